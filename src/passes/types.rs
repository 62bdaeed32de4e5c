//! The structs that Rust and GLSL share, scalar layout. `shaders/shared/types.glsl` has the same fields in the same order;
//! `tests/shader_layout.rs` compares every offset.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use crate::constants::{KIND_SURFACE, LEAF_TRIANGLES};
use crate::mesh::meshlets;
use crate::mesh::sources;
use crate::meso::HeightPyramid;

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Source {
    pub eye: Vec3,
    pub area: f32,
    pub normal: Vec3,
    pub radius: f32,
    pub tangent: Vec3,
    pub cone_sin: f32,
    pub bitangent: Vec3,
    pub cone_cos: f32,
    pub emitted: Vec3,
    pub kind: u32,
    pub first_element: u32,
    pub element_count: u32,
    pub first_contour: u32,
    pub contour_count: u32,
    pub component: u32,
    /// Centroid of the area.
    pub middle: Vec3,
    /// Area that a far place in the direction of `normal` sees.
    pub facing: f32,
    /// Of the largest part's ball; parts are counted in the buffer of all.
    pub part_radius: f32,
    pub first_part: u32,
    pub part_count: u32,
}

impl Source {
    /// `first_contour` and `contour_count` count the corners of [`contour_corners`].
    pub fn new(
        source: &sources::Source,
        (first_contour, contour_count): (u32, u32),
        first_part: u32,
    ) -> Self {
        let part_radius = source.parts.iter().map(|p| p.radius).fold(0.0, f64::max);
        Self {
            eye: source.eye.as_vec3(),
            area: source.area as f32,
            normal: source.normal.as_vec3(),
            // A little more than it is, for the rounding to f32.
            radius: (source.radius * (1.0 + 1e-6)) as f32,
            tangent: source.tangent.as_vec3(),
            cone_sin: source.cone.sin() as f32,
            bitangent: source.bitangent.as_vec3(),
            cone_cos: source.cone.cos() as f32,
            emitted: source.emitted,
            kind: source.kind,
            first_element: source.first_element,
            element_count: source.element_count,
            first_contour,
            contour_count,
            component: source.component,
            middle: source.centroid.as_vec3(),
            facing: source.facing as f32,
            part_radius: (part_radius * (1.0 + 1e-6)) as f32,
            first_part,
            part_count: source.parts.len() as u32,
        }
    }
}

/// A source's outline as the shader walks it: each loop's corners and its first once more; w is 1 where a loop starts.
pub fn contour_corners(source: &sources::Source) -> Vec<[f32; 4]> {
    let mut corners = Vec::new();
    if source.kind != KIND_SURFACE {
        return corners;
    }
    for closed in &source.contour {
        for (i, corner) in closed.iter().chain(closed.first()).enumerate() {
            let c = corner.as_vec3();
            corners.push([c.x, c.y, c.z, if i == 0 { 1.0 } else { 0.0 }]);
        }
    }
    corners
}

/// An element as it is gathered from, for loading by fours.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Triangle {
    pub a: Vec3,
    pub area: f32,
    pub b: Vec3,
    /// normal · x on its plane.
    pub height: f32,
    pub c: Vec3,
    pub unused_c: f32,
    pub normal: Vec3,
    pub unused: f32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Meshlet {
    pub centre: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    pub cutoff: f32,
    pub first: u32,
    pub count: u32,
    pub component: u32,
}

impl From<&meshlets::Meshlet> for Meshlet {
    fn from(m: &meshlets::Meshlet) -> Self {
        Self {
            centre: m.centre.as_vec3(),
            radius: m.radius as f32,
            axis: m.axis.as_vec3(),
            cutoff: m.cutoff as f32,
            first: m.first,
            count: m.count,
            component: m.component,
        }
    }
}

/// Consecutive elements as receivers: bounds of their centroids and normals.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReceiverBlock {
    pub centre: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    /// Of the cylinder about the axis.
    pub half_height: f32,
    pub cone_sin: f32,
    pub cone_cos: f32,
    /// Radius of an element.
    pub largest: f32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Component {
    pub low: Vec3,
    pub closed: u32,
    pub high: Vec3,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Slot {
    pub emitted: Vec3,
    pub source: u32,
    pub reflected: Vec3,
    /// Of all its form factors.
    pub scale: f32,
}

/// The command for a list of receivers, and how many they are.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReceiverList {
    pub groups_x: u32,
    pub groups_y: u32,
    pub groups_z: u32,
    pub count: u32,
}

/// Where the form factors of a source lie: word `first` of a chunk.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct KeptRow {
    pub chunk: u32,
    pub first: u32,
    /// Of all of them.
    pub scale: f32,
}

/// How far the memory for kept form factors is filled.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct KeptState {
    pub chunk: u32,
    pub used: u32,
    pub rows: u32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct View {
    pub eye: Vec3,
    pub x: Vec3,
    pub y: Vec3,
    pub w: Vec3,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Draw {
    pub index_count: u32,
    pub instance_count: u32,
    pub first_index: u32,
    pub vertex_offset: i32,
    pub first_instance: u32,
}

/// A source as it receives: the words of a coupling row that belong to it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct CouplingTarget {
    pub first_element: u32,
    pub element_count: u32,
    pub first_word: u32,
    /// 1 where all members have one reflectance, 3 otherwise.
    pub word_count: u32,
    pub inverse_area: f32,
}

/// An element with a relief.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct MesoElement {
    pub tangent: Vec3,
    pub response: u32,
    pub bitangent: Vec3,
    pub scale: Vec3,
}

/// Where an element with a relief lies in its texture.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct MesoTexel {
    pub uv_a: Vec2,
    pub uv_b: Vec2,
    pub uv_c: Vec2,
    /// Facet of the texture among those of all textures: two a cell, as in [`crate::meso::HeightField`].
    pub first: u32,
    pub columns: u32,
    pub rows: u32,
}

/// A facet of a texture, as the pixel estimator looks it up.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct TextureFacet {
    pub reflectance: Vec3,
    /// A bit for each of the first 32 directions less than 90° from its normal, and for each of the others.
    pub above_low: u32,
    pub above_high: u32,
}

/// Reflected radiosity of an element with a relief, with the rounding error of its last sum.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Reflected {
    pub sum: Vec3,
    pub error: Vec3,
}

/// One height map's part of the buffer of pyramids.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct HeightTile {
    pub first: u32,
    pub width: u32,
    pub height: u32,
    pub top: u32,
    pub highest: f32,
}

impl HeightTile {
    /// `first` counts the values before this pyramid's in the buffer.
    pub fn new(pyramid: &HeightPyramid, first: u32) -> Self {
        Self {
            first,
            width: pyramid.width,
            height: pyramid.height,
            top: pyramid.top(),
            highest: pyramid.highest(),
        }
    }
}

/// A straight segment over a height map: (u, v, height) at its ends.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct HeightRay {
    pub from: Vec3,
    pub tile: u32,
    pub to: Vec3,
}

/// Where a segment first passes below the surface.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct HeightHit {
    /// 0 at the segment's start, 1 at its end.
    pub t: f32,
    /// `row * width + column` of the texel at the low corner of the cell that holds the hit; `NONE` where there is none.
    pub cell: u32,
    /// Place in the cell, 0..=1 to the next column and to the next row.
    pub local: Vec2,
    /// Height of the surface there.
    pub height: f32,
    /// ∂h/∂u and ∂h/∂v of the cell's bilinear patch.
    pub gradient: Vec2,
    /// Steps of the march, hit or not.
    pub steps: u32,
}

/// A triangle with relief, extruded; see `shaders/shared/types.glsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Prism {
    pub low_a: Vec3,
    pub low_b: Vec3,
    pub low_c: Vec3,
    pub high_a: Vec3,
    pub high_b: Vec3,
    pub high_c: Vec3,
    pub uv_a: Vec2,
    pub uv_b: Vec2,
    pub uv_c: Vec2,
    pub light_a: u32,
    pub light_b: u32,
    pub light_c: u32,
    pub surface: u32,
    pub tangent: Vec3,
    pub texel: f32,
    pub bitangent: Vec3,
    pub normal: Vec3,
    pub first_cluster: u32,
    pub cluster_count: u32,
    pub slots: Vec3,
}

/// A parallel light on a face; see `shaders/shared/types.glsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ParallelLight {
    pub towards: Vec3,
    pub fluence_a: Vec3,
    pub fluence_b: Vec3,
    pub fluence_c: Vec3,
}

/// A place that light comes straight from: a part of an emitter, or a point light.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct LightPoint {
    /// From the eye, internal units.
    pub position: Vec3,
    pub kind: u32,
    pub normal: Vec3,
    /// Of the part of an emitter, internal units.
    pub area: f32,
    /// Le times its area, or radiant intensity, in internal units.
    pub strength: Vec3,
}

/// A box of the tree of what casts shadows, in depth-first order.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowNode {
    pub low: Vec3,
    /// The node that follows all that is in this one.
    pub skip: u32,
    pub high: Vec3,
    /// [`LEAF_TRIANGLES`] times its first triangle, plus how many a leaf has; others have none.
    pub leaf: u32,
}

impl ShadowNode {
    /// Of a leaf.
    pub fn triangles(&self) -> std::ops::Range<usize> {
        let first = self.leaf / LEAF_TRIANGLES;
        first as usize..(first + self.leaf % LEAF_TRIANGLES) as usize
    }
}

/// What casts a shadow.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowTriangle {
    pub a: Vec3,
    pub b: Vec3,
    pub c: Vec3,
    /// 1: it stands for a relief about it.
    pub relief: u32,
}

/// What hides places from a source, and where it does.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowOccluder {
    pub a: Vec3,
    /// The connected part that it is of.
    pub component: u32,
    pub b: Vec3,
    /// 1: that part is closed, with all normals outward.
    pub closed: u32,
    pub c: Vec3,
    /// normal · x on its plane.
    pub height: f32,
    pub normal: Vec3,
    pub unused: u32,
}

/// A straight way from `from` to `to`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ShadowRay {
    pub from: Vec3,
    /// Share of the way before which triangles with a relief are passed over.
    pub clear: f32,
    pub to: Vec3,
}

/// A plain triangle that is lit straight, from the eye, internal units.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct LitTriangle {
    pub a: Vec3,
    pub b: Vec3,
    pub c: Vec3,
    /// Of the smooth surface at the corners.
    pub normal_a: Vec3,
    pub normal_b: Vec3,
    pub normal_c: Vec3,
    /// Its own normal.
    pub plane: Vec3,
    /// What rays start above it.
    pub above: f32,
    /// 1: nothing stands between it and the lights.
    pub open: u32,
}

/// A relief as it is drawn.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReliefSurface {
    /// Of the prisms, in the map's heights.
    pub lowest: f32,
    pub top: f32,
    pub mean: f32,
    /// Of the height field that the factors belong to.
    pub columns: u32,
    pub rows: u32,
    pub rank: u32,
    pub first_factor: u32,
    /// Scene heights a texture repeat in u and in v for a unit of height.
    pub slope: Vec2,
}
