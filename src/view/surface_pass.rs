//! Draws the surfaces of a scene by the light of their corners, from an eye that moves freely. Shaders: `view_mesh.vert`,
//! `view_mesh.frag`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use egui::Color32;
use glam::{DVec3, Vec2, Vec3, Vec4};

use super::camera::Rows;
use super::panel_pass;
use crate::error::Result;
use crate::passes::buffers::upload;
use crate::passes::shaders;
use crate::render::upload_texture;
use crate::scene::Scene;
use crate::vk::{
    Bind, Binding, Buffer, BufferUse, Commands, DescriptorSet, Device, Format, GraphicsPipeline,
    GraphicsState, Image, RenderPass, Sampler, VertexAttribute,
};

/// One corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Vertex {
    /// From the scene's middle, internal units.
    position: Vec3,
    normal: Vec3,
    /// v down, as images are stored.
    uv: Vec2,
}

/// Push constants of one draw.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    x: Vec4,
    y: Vec4,
    w: Vec4,
    eye: Vec3,
    near: f32,
    reflectance: Vec3,
    exposure: f32,
    emitted: Vec3,
    ambient: Vec3,
    parts: Vec2,
    elements: f32,
    sources: f32,
    from_picture: u32,
    chosen: u32,
}

/// What a frame shows of the surfaces.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    /// What radiance is multiplied by.
    pub exposure: f32,
    /// Irradiance of light not shot yet, W·m⁻².
    pub ambient: Vec3,
    /// How often all light and direct light count, and emission.
    pub parts: [f32; 3],
    /// Outlines of elements, colours of sources.
    pub elements: bool,
    pub sources: bool,
    /// Whether the picture is shown in place of the light of the corners.
    pub picture: bool,
    /// The element that is marked.
    pub chosen: Option<u32>,
}

/// A scene ready to be drawn.
pub struct SurfacePass {
    pipeline: GraphicsPipeline,
    sampler: Sampler,
    /// A picture ends at its edges.
    held: Sampler,
    /// The first is white.
    textures: Vec<Image>,
    /// `[material]`, its place in `textures`.
    texture_of: Vec<usize>,
    picture: Image,
    /// `[texture]`.
    sets: Vec<DescriptorSet>,
    vertices: Buffer,
    indices: Buffer,
    /// `[drawn triangle][corner]`.
    all: Buffer,
    direct: Buffer,
    /// `[drawn triangle]`: its place in the input, its source.
    about: Buffer,
    /// `[drawn triangle]`, its place in the input.
    order: Vec<u32>,
    /// Material, first vertex, count.
    ranges: Vec<(u32, u32, u32)>,
    /// Of the materials.
    reflectance: Vec<Vec3>,
    emitted: Vec<Vec3>,
    device: Arc<Device>,
}

/// Distance of the near plane, internal units.
const NEAR: f32 = 1e-4;

/// No element is marked, or none belongs to a source.
const NOTHING: u32 = u32::MAX;

impl SurfacePass {
    /// # Errors
    /// A scene that does not fit the device.
    pub fn new(device: &Arc<Device>, pass: &RenderPass, scene: &Scene) -> Result<Self> {
        let attribute = |format, offset: usize| VertexAttribute {
            format,
            offset: offset as u32,
        };
        let storage = Binding::Storage;
        let pipeline = GraphicsPipeline::new(
            device,
            pass,
            &GraphicsState {
                name: "surfaces",
                vertex: shaders::VIEW_MESH_VERT,
                fragment: shaders::VIEW_MESH_FRAG,
                bindings: &[
                    Binding::Sampled,
                    storage,
                    storage,
                    storage,
                    Binding::Sampled,
                ],
                push_bytes: size_of::<Parameters>(),
                vertex_stride: size_of::<Vertex>() as u32,
                attributes: &[
                    attribute(
                        Format::R32G32B32_SFLOAT,
                        std::mem::offset_of!(Vertex, position),
                    ),
                    attribute(
                        Format::R32G32B32_SFLOAT,
                        std::mem::offset_of!(Vertex, normal),
                    ),
                    attribute(Format::R32G32_SFLOAT, std::mem::offset_of!(Vertex, uv)),
                ],
                sums: false,
            },
        )?;
        let mut order: Vec<u32> = (0..scene.triangles.len() as u32).collect();
        let material = |e: u32| scene.triangles[e as usize].material;
        order.sort_by_key(|&e| material(e));
        let mut ranges = Vec::new();
        let mut first = 0;
        for same in order.chunk_by(|&a, &b| material(a) == material(b)) {
            let count = 3 * same.len() as u32;
            ranges.push((material(same[0]), first, count));
            first += count;
        }
        let vertices = vertices(scene, &order);
        let indices: Vec<u32> = (0..vertices.len() as u32).collect();
        let about: Vec<[u32; 2]> = order.iter().map(|&e| [e, NOTHING]).collect();
        let light = 12 * vertices.len() as u64;
        let stream = |name, bytes| Buffer::new(device, name, bytes, BufferUse::Stream);
        let mut dark = [stream("all light", light)?, stream("direct light", light)?];
        for buffer in &mut dark {
            buffer.write(0, &vec![Vec3::ZERO; vertices.len()]);
        }
        let [all, direct] = dark;
        let mut about_buffer = stream("about triangles", size_of_val(&about[..]) as u64)?;
        about_buffer.write(0, &about);
        let (textures, texture_of) = textures(device, scene)?;
        let mut surfaces = Self {
            pipeline,
            sampler: Sampler::new(device, "surfaces", true)?,
            held: Sampler::held(device, "detailed picture")?,
            textures,
            texture_of,
            picture: panel_pass::upload(device, "no picture", (1, 1), &[Color32::BLACK])?,
            sets: Vec::new(),
            vertices: upload(device, "surface vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "surface indices", &indices, BufferUse::Geometry)?,
            all,
            direct,
            about: about_buffer,
            order,
            ranges,
            reflectance: scene.materials.iter().map(|m| m.kd.into()).collect(),
            emitted: Vec::new(),
            device: Arc::clone(device),
        };
        surfaces.set_emission(scene);
        surfaces.bind()?;
        Ok(surfaces)
    }

    fn bind(&mut self) -> Result<()> {
        let set = |image| {
            self.pipeline.bind(
                "surfaces",
                &[
                    Bind::Image(image, &self.sampler),
                    Bind::Buffer(&self.all),
                    Bind::Buffer(&self.direct),
                    Bind::Buffer(&self.about),
                    Bind::Image(&self.picture, &self.held),
                ],
            )
        };
        self.sets = self.textures.iter().map(set).collect::<Result<_>>()?;
        Ok(())
    }

    /// Takes the emission of a scene that differs in nothing else.
    pub fn set_emission(&mut self, scene: &Scene) {
        self.emitted = scene.materials.iter().map(|m| m.ke.into()).collect();
    }

    /// Takes other light, `[triangle][corner]` in the order of the input.
    pub fn set_light(&mut self, all: &[[Vec3; 3]], direct: &[[Vec3; 3]]) {
        let by_order = |light: &[[Vec3; 3]]| -> Vec<[Vec3; 3]> {
            self.order.iter().map(|&e| light[e as usize]).collect()
        };
        let (all, direct) = (by_order(all), by_order(direct));
        self.all.write(0, &all);
        self.direct.write(0, &direct);
    }

    /// Takes the source of each triangle, in the order of the input.
    pub fn set_sources(&mut self, sources: &[u32]) {
        let about: Vec<[u32; 2]> = self
            .order
            .iter()
            .map(|&e| [e, sources.get(e as usize).copied().unwrap_or(NOTHING)])
            .collect();
        self.about.write(0, &about);
    }

    /// Takes a picture of the whole view, sRGB codes.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn set_picture(&mut self, size: (u32, u32), codes: &[Color32]) -> Result<&Image> {
        self.picture = panel_pass::upload(&self.device, "detailed picture", size, codes)?;
        self.bind()?;
        Ok(&self.picture)
    }

    /// Draws within the render pass that is under way.
    pub fn record(&self, cmd: &Commands, seen: &Rows, shown: &Shown) {
        cmd.bind_indices(&self.indices);
        for &(material, first, count) in &self.ranges {
            let material = material as usize;
            let set = &self.sets[self.texture_of[material]];
            cmd.bind_graphics(&self.pipeline, set, &self.vertices);
            let [all, direct, emission] = shown.parts;
            cmd.push_graphics(
                &self.pipeline,
                &Parameters {
                    x: seen.x,
                    y: seen.y,
                    w: seen.w,
                    eye: seen.eye,
                    near: NEAR,
                    reflectance: self.reflectance[material],
                    exposure: shown.exposure,
                    emitted: self.emitted[material] * emission,
                    ambient: shown.ambient,
                    parts: Vec2::new(all, direct),
                    elements: f32::from(u8::from(shown.elements)),
                    sources: f32::from(u8::from(shown.sources)),
                    from_picture: shown.picture.into(),
                    chosen: shown.chosen.unwrap_or(NOTHING),
                },
            );
            cmd.draw_indexed(first, count);
        }
    }
}

/// Three a triangle, `[drawn triangle][corner]`.
fn vertices(scene: &Scene, order: &[u32]) -> Vec<Vertex> {
    let (origin, unit) = scene.local_frame();
    order
        .iter()
        .flat_map(|&e| {
            let triangle = &scene.triangles[e as usize];
            let corners = scene.corners(triangle).map(|p: DVec3| (p - origin) / unit);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            let images = triangle.uv.map(|[u, v]| Vec2::new(u, 1.0 - v));
            // A texture repeats: near 0, its coordinates have more digits left for the place within it.
            let whole = images[0].floor();
            [0, 1, 2].map(|k| Vertex {
                position: corners[k].as_vec3(),
                normal,
                uv: images[k] - whole,
            })
        })
        .collect()
}

/// Every texture of a scene once, white first, and the place of each material's.
fn textures(device: &Arc<Device>, scene: &Scene) -> Result<(Vec<Image>, Vec<usize>)> {
    let mut images = vec![upload_texture(device, "white", (1, 1), &[[1.0; 3]])?];
    let mut known = Vec::new();
    let mut places = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let Some(map) = &material.map_kd else {
            places.push(0);
            continue;
        };
        let found = known.iter().position(|k| Arc::ptr_eq(k, map));
        places.push(match found {
            Some(place) => place + 1,
            None => {
                let name = map.path.display().to_string();
                let size = (map.width, map.height);
                images.push(upload_texture(device, &name, size, &map.texels)?);
                known.push(Arc::clone(map));
                known.len()
            }
        });
    }
    Ok((images, places))
}
