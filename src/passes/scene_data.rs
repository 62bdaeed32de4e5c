//! The scene as lists for the buffers of devices: what any device that works on it holds.

use bytemuck::Pod;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::fresh_rows::{RowShape, Span};
use super::receiver_blocks::receiver_blocks;
use super::types::{
    Component, Meshlet, NearFactor, NearVector, ReceiverBlock, Source, Triangle, contour_corners,
};
use super::words::Words;
use crate::constants::GROUP;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::meshlets;
use crate::mesh::near::{NearPairs, Rows};
use crate::mesh::occluders::Occluders;
use crate::mesh::sources::{self, PART_MEMBERS, SourcePlace, Sources};

/// What [`super::buffers::SceneBuffers`] holds, list by list.
#[derive(Clone, Serialize, Deserialize)]
pub struct SceneData {
    /// Of all elements, of which the last have a relief.
    pub shape: RowShape,
    pub element_count: u32,
    pub occluder_count: u32,
    pub source_count: u32,
    pub meshlet_count: u32,
    pub enclosed: bool,
    pub vertices: Words,
    pub corners: Words,
    pub occluder_corners: Words,
    pub occluder_items: Words,
    pub triangles: Words,
    pub planes: Words,
    pub balls: Words,
    pub receiver_blocks: Words,
    pub areas: Words,
    pub weights: Words,
    pub reflectance: Words,
    pub meshlets: Words,
    pub components: Words,
    pub lit: LitSources,
    pub near_rows: NearRows,
    pub near_relief_rows: NearRows,
}

/// The sources and what they refer to: what changes when a scene is lit otherwise.
#[derive(Clone, Serialize, Deserialize)]
pub struct LitSources {
    pub sources: Words,
    pub contours: Words,
    pub parts: Words,
    pub webs: Words,
    pub eyes: Words,
    pub eye_starts: Words,
    /// Whether some lie at an infinite distance.
    pub any_far: bool,
}

/// Form factors from near elements, one source after another.
#[derive(Clone, Serialize, Deserialize)]
pub struct NearRows {
    pub factors: Words,
    /// Where those of each source begin; one more than the sources.
    pub starts: Words,
}

impl NearRows {
    fn new<T: Pod>(rows: &Rows<T>) -> Self {
        Self {
            factors: Words::of(&rows.factors),
            starts: Words::of(&rows.starts),
        }
    }

    /// Of one source, at most.
    pub fn longest(&self) -> u32 {
        let starts: &[u32] = self.starts.values();
        let lengths = starts.windows(2).map(|pair| pair[1] - pair[0]);
        lengths.max().unwrap_or(0)
    }

    /// Those of the elements that are found of a span, counted from its first. `kind`: the first
    /// element of all of its kind.
    fn within<T: Pod>(&self, span: Span, kind: u32, element: impl Fn(&mut T) -> &mut u32) -> Self {
        let starts: &[u32] = self.starts.values();
        let all: &[T] = self.factors.values();
        let before = span.first - kind;
        let own = before + span.own[0]..before + span.own[1];
        let (mut factors, mut ends) = (Vec::new(), vec![0]);
        for of in starts.windows(2) {
            for factor in &all[of[0] as usize..of[1] as usize] {
                let mut factor = *factor;
                let at = element(&mut factor);
                if own.contains(at) {
                    *at -= before;
                    factors.push(factor);
                }
            }
            ends.push(factors.len() as u32);
        }
        Self {
            factors: Words::of(&factors),
            starts: ends.into(),
        }
    }
}

impl SceneData {
    pub fn new(
        elements: &Elements,
        sources: &Sources,
        connections: &Connections,
        occluders: &Occluders,
        near: &NearPairs,
    ) -> Self {
        let vertices: Vec<Vec3> = elements.vertices.iter().map(|v| v.as_vec3()).collect();
        let planes = planes(elements);
        let narrow = |values: &[f64]| -> Vec<f32> { values.iter().map(|&v| v as f32).collect() };
        let meshlets: Vec<Meshlet> =
            meshlets::build(elements, connections, occluders, &sources.chart)
                .iter()
                .map(Meshlet::from)
                .collect();
        let element_count = elements.len() as u32;
        let meso_count = element_count - elements.plain_count() as u32;
        Self {
            shape: RowShape::whole(element_count, meso_count),
            element_count,
            occluder_count: occluders.len() as u32,
            source_count: sources.list.len() as u32,
            meshlet_count: meshlets.len() as u32,
            enclosed: connections.enclosed,
            vertices: Words::of(&vertices),
            corners: Words::of(&elements.corners),
            occluder_corners: Words::of(&occluders.corners),
            occluder_items: Words::of(&occluders.items),
            triangles: Words::of(&triangles(elements, &planes)),
            planes: Words::of(&planes),
            balls: Words::of(&balls(elements)),
            receiver_blocks: Words::of(&receiver_blocks(elements)),
            areas: Words::of(&narrow(&elements.area)),
            weights: Words::of(&narrow(&near.weights)),
            reflectance: Words::of(&elements.even_reflectance()),
            meshlets: Words::of(&meshlets),
            components: Words::of(&components(elements, connections)),
            lit: LitSources::new(&sources.list),
            near_rows: NearRows::new(&near.rows),
            near_relief_rows: NearRows::new(&near.relief_rows),
        }
    }

    /// Blocks of the elements of a row.
    pub fn blocks_of(&self, shape: RowShape) -> Vec<ReceiverBlock> {
        let blocks: &[ReceiverBlock] = self.receiver_blocks.values();
        let of = |span: Span, kind: u32, before: u32| {
            let first = (before + (span.first - kind) / GROUP) as usize;
            &blocks[first..first + span.count.div_ceil(GROUP) as usize]
        };
        let whole = self.shape;
        let plain = of(shape.plain, 0, 0);
        let meso = of(shape.meso, whole.meso.first, whole.plain_blocks());
        [plain, meso].concat()
    }

    /// Near elements of a row, without and with a relief.
    pub fn near_of(&self, shape: RowShape) -> [NearRows; 2] {
        let plain = self
            .near_rows
            .within(shape.plain, 0, |f: &mut NearFactor| &mut f.element);
        let kind = self.shape.meso.first;
        let rows = &self.near_relief_rows;
        [
            plain,
            rows.within(shape.meso, kind, |f: &mut NearVector| &mut f.element),
        ]
    }
}

impl LitSources {
    pub fn new(list: &[sources::Source]) -> Self {
        let outlined = Outlined::new(list);
        Self {
            sources: Words::of(&outlined.list),
            contours: Words::of(&outlined.contours),
            parts: Words::of(&outlined.parts),
            webs: Words::of(&outlined.webs),
            eyes: Words::of(&eyes(list)),
            eye_starts: Words::of(&eye_starts(list)),
            any_far: list.iter().any(sources::Source::is_far),
        }
    }
}

/// Places on each source, with the packed normals of curved ones, one source after another. Only
/// the `receiver` estimator gives sources places, and reads them.
fn eyes(sources: &[sources::Source]) -> Vec<[f32; 4]> {
    let texels = |source: &sources::Source| {
        let is_curved = source.cone > 0.0;
        let texel = move |place: &SourcePlace| {
            let normal = if is_curved { place.normal } else { DVec3::ZERO };
            place.at.as_vec3().extend(packed(normal)).to_array()
        };
        source.places.iter().map(texel).collect::<Vec<_>>()
    };
    sources.iter().flat_map(texels).collect()
}

/// Where the places of each source begin among those of all; one more than the sources.
fn eye_starts(sources: &[sources::Source]) -> Vec<u32> {
    let mut starts = vec![0];
    let mut end = 0;
    starts.extend(sources.iter().map(|source| {
        end += source.places.len() as u32;
        end
    }));
    starts
}

/// The bits of a vector with components from -1 to 1, as `unpackSnorm4x8` reads them.
fn packed(vector: DVec3) -> f32 {
    let bytes = vector.to_array().map(|c| (c * 127.0).round() as i8 as u8);
    let [x, y, z] = bytes;
    f32::from_bits(u32::from_le_bytes([x, y, z, 0]))
}

/// Normal n and n · x, `[element]`.
fn planes(elements: &Elements) -> Vec<[f32; 4]> {
    (0..elements.len())
        .map(|e| {
            let n = elements.normal[e];
            let height = n.dot(elements.centroid[e]) as f32;
            n.as_vec3().extend(height).to_array()
        })
        .collect()
}

/// Centroid and radius, `[element]`.
fn balls(elements: &Elements) -> Vec<[f32; 4]> {
    (0..elements.len())
        .map(|e| {
            let centroid = elements.centroid[e].as_vec3();
            centroid.extend(elements.radius(e) as f32).to_array()
        })
        .collect()
}

fn triangles(elements: &Elements, planes: &[[f32; 4]]) -> Vec<Triangle> {
    (0..elements.len())
        .map(|e| {
            let [a, b, c] = elements.triangle(e).map(|v| v.as_vec3());
            Triangle {
                a,
                area: elements.area[e] as f32,
                b,
                height: planes[e][3],
                c,
                unused_c: 0.0,
                normal: elements.normal[e].as_vec3(),
                unused: 0.0,
            }
        })
        .collect()
}

/// Words of a part in [`SceneBuffers::parts`], whole texels.
const PART_WORDS: usize = (8 + PART_MEMBERS).next_multiple_of(4);

/// Sources with what they refer to in the buffers of all.
struct Outlined {
    list: Vec<Source>,
    contours: Vec<[f32; 4]>,
    /// See [`SceneBuffers::parts`].
    parts: Vec<[f32; PART_WORDS]>,
    /// Of beams, `[row][column]` of each, to whole texels.
    webs: Vec<f32>,
}

impl Outlined {
    fn new(sources: &[sources::Source]) -> Self {
        let mut outlined = Self {
            list: Vec::with_capacity(sources.len()),
            contours: Vec::new(),
            parts: Vec::new(),
            webs: Vec::new(),
        };
        // Lights have no elements; of a far one the first eye stands there.
        let with_eyes = |mut row: Source, source: &sources::Source, first_eye: u32| {
            if source.is_far() {
                row.first_element = first_eye;
            }
            row
        };
        for (source, first_eye) in sources.iter().zip(eye_starts(sources)) {
            if let Some(web) = &source.web {
                let (first, rows) = (outlined.webs.len() as u32, web.rows);
                let beam = Source::beam(source, (first, web.columns), rows);
                outlined.list.push(with_eyes(beam, source, first_eye));
                outlined.webs.extend(&web.shares);
                continue;
            }
            let corners = contour_corners(source);
            let outline = (outlined.contours.len() as u32, corners.len() as u32);
            let first_part = outlined.parts.len() as u32;
            let row = Source::new(source, outline, first_part);
            outlined.list.push(with_eyes(row, source, first_eye));
            outlined.contours.extend(corners);
            outlined.parts.extend(source.parts.iter().map(|part| {
                let mut words = [0.0; PART_WORDS];
                words[..3].copy_from_slice(&part.centroid.as_vec3().to_array());
                words[3..6].copy_from_slice(&part.vector_area.as_vec3().to_array());
                words[6] = part.radius as f32;
                words[7] = f32::from_bits(part.members.len() as u32);
                for (word, &member) in words[8..].iter_mut().zip(&part.members) {
                    *word = f32::from_bits(member);
                }
                words
            }));
        }
        let texels = outlined.webs.len().div_ceil(4);
        outlined.webs.resize(4 * texels, 0.0);
        outlined
    }
}

fn components(elements: &Elements, connections: &Connections) -> Vec<Component> {
    let mut components: Vec<_> = connections
        .closed
        .iter()
        .map(|&closed| Component {
            low: Vec3::INFINITY,
            closed: closed.into(),
            high: Vec3::NEG_INFINITY,
        })
        .collect();
    for (e, &c) in connections.component.iter().enumerate() {
        for v in elements.triangle(e) {
            let component = &mut components[c as usize];
            component.low = component.low.min(v.as_vec3());
            component.high = component.high.max(v.as_vec3());
        }
    }
    components
}
