//! Draws the surfaces of a scene by the light of their corners, from an eye that moves freely. Shaders: `view_mesh`,
//! `view_mesh_laid` and `view_mesh_overlaid`, `.vert` and `.frag` of each.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use egui::Color32;
use glam::{DVec3, Vec2, Vec3, Vec4};

use super::camera::Rows;
use super::detailer::Drawn;
use super::panel_pass;
use crate::error::Result;
use crate::passes::buffers::upload;
use crate::passes::shaders;
use crate::render::upload_texture;
use crate::scene::{Material, Scene};
use crate::vk::{
    Bind, Binding, Buffer, BufferUse, Commands, DescriptorSet, Device, Format, GraphicsPipeline,
    GraphicsState, Image, ImageUse, RenderPass, Sampler, VertexAttribute,
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

/// A view that a picture was drawn of, as the shader has it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct PictureView {
    x: [f32; 4],
    y: [f32; 4],
    w: [f32; 4],
    eye: Vec3,
    /// Half a pixel's angle, as a tangent; 0 of a picture that is not to be shown.
    pixel: f32,
    /// Of the image that is the picture.
    share: Vec2,
}

/// How surfaces show detailed pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Laid {
    No,
    /// As it is: the last picture is of this view.
    Exactly,
    /// Those of other views, where they show the place.
    FromElsewhere,
}

/// A detailed picture on the device.
struct Kept {
    image: Image,
    distances: Image,
    view: PictureView,
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
    /// What is shown in place of the light of the corners.
    pub picture: Laid,
    /// The element that is marked.
    pub chosen: Option<u32>,
}

impl Shown {
    fn has_overlays(&self) -> bool {
        self.elements || self.sources || self.chosen.is_some()
    }
}

/// A scene ready to be drawn.
pub struct SurfacePass {
    plain: GraphicsPipeline,
    /// With pictures laid over.
    laid: GraphicsPipeline,
    /// With outlines, colours and a mark over both.
    overlaid: GraphicsPipeline,
    sampler: Sampler,
    /// A picture ends at its edges.
    held: Sampler,
    nearest: Sampler,
    /// The first is white.
    textures: Vec<Image>,
    /// `[material]`, its place in `textures`.
    texture_of: Vec<usize>,
    /// The last whole picture, and a later coarse one.
    pictures: [Kept; 2],
    /// Which of them came last.
    last: usize,
    /// Their views.
    views: Buffer,
    /// `[texture]`.
    sets: Vec<DescriptorSet>,
    vertices: Buffer,
    indices: Buffer,
    /// `[drawn triangle][corner]`.
    all: Buffer,
    direct: Buffer,
    /// `[drawn triangle]`.
    about: Buffer,
    /// `[triangle]` of the input; none yet where empty.
    sources: Vec<u32>,
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
        let pipeline = |name, vertex, fragment| {
            GraphicsPipeline::new(
                device,
                pass,
                &GraphicsState {
                    name,
                    vertex,
                    fragment,
                    bindings: &[
                        Binding::Sampled,
                        storage,
                        storage,
                        storage,
                        Binding::Sampled,
                        Binding::Sampled,
                        Binding::Sampled,
                        Binding::Sampled,
                        storage,
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
            )
        };
        let plain = pipeline("surfaces", shaders::VIEW_MESH_VERT, shaders::VIEW_MESH_FRAG)?;
        let laid = pipeline(
            "surfaces under pictures",
            shaders::VIEW_MESH_LAID_VERT,
            shaders::VIEW_MESH_LAID_FRAG,
        )?;
        let overlaid = pipeline(
            "surfaces under overlays",
            shaders::VIEW_MESH_OVERLAID_VERT,
            shaders::VIEW_MESH_OVERLAID_FRAG,
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
        let light = 12 * vertices.len() as u64;
        let stream = |name, bytes| Buffer::new(device, name, bytes, BufferUse::Stream);
        let mut dark = [stream("all light", light)?, stream("direct light", light)?];
        for buffer in &mut dark {
            buffer.write(0, &vec![Vec3::ZERO; vertices.len()]);
        }
        let [all, direct] = dark;
        let about = (size_of::<About>() * order.len()) as u64;
        let no_picture = || -> Result<Kept> {
            let size = padded_size((1, 1));
            let count = (size.0 * size.1) as usize;
            Ok(Kept {
                image: panel_pass::upload(
                    device,
                    "no picture",
                    size,
                    &vec![Color32::BLACK; count],
                )?,
                distances: upload_distances(device, size, &vec![0.0; count])?,
                view: PictureView::zeroed(),
            })
        };
        let (textures, texture_of) = textures(device, scene)?;
        let mut views = stream("pictures' views", size_of::<[PictureView; 2]>() as u64)?;
        views.write(0, &[PictureView::zeroed(); 2]);
        let mut surfaces = Self {
            plain,
            laid,
            overlaid,
            sampler: Sampler::new(device, "surfaces", true)?,
            held: Sampler::held(device, "detailed picture")?,
            textures,
            texture_of,
            nearest: Sampler::new(device, "distances", false)?,
            pictures: [no_picture()?, no_picture()?],
            last: 0,
            views,
            sets: Vec::new(),
            vertices: upload(device, "surface vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "surface indices", &indices, BufferUse::Geometry)?,
            all,
            direct,
            about: stream("about triangles", about)?,
            sources: Vec::new(),
            order,
            ranges,
            reflectance: scene.materials.iter().map(|m| m.kd.into()).collect(),
            emitted: Vec::new(),
            device: Arc::clone(device),
        };
        surfaces.set_emission(scene);
        surfaces.set_about(scene);
        surfaces.bind()?;
        Ok(surfaces)
    }

    fn bind(&mut self) -> Result<()> {
        let [whole, coarse] = &self.pictures;
        let set = |image| {
            self.plain.bind(
                "surfaces",
                &[
                    Bind::Image(image, &self.sampler),
                    Bind::Buffer(&self.all),
                    Bind::Buffer(&self.direct),
                    Bind::Buffer(&self.about),
                    Bind::Image(&whole.image, &self.held),
                    Bind::Image(&coarse.image, &self.held),
                    Bind::Image(&whole.distances, &self.nearest),
                    Bind::Image(&coarse.distances, &self.nearest),
                    Bind::Buffer(&self.views),
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
    pub fn set_sources(&mut self, scene: &Scene, sources: Vec<u32>) {
        self.sources = sources;
        self.set_about(scene);
    }

    /// Takes the heights of a scene that differs in nothing else.
    pub fn set_about(&mut self, scene: &Scene) {
        let unit = scene.local_frame().1;
        let rises: Vec<f32> = scene.materials.iter().map(|m| rise(m, unit)).collect();
        let about = self.order.iter().map(|&e| About {
            triangle: e,
            source: self.sources.get(e as usize).copied().unwrap_or(NOTHING),
            rise: rises[scene.triangles[e as usize].material as usize],
        });
        let about: Vec<_> = about.collect();
        self.about.write(0, &about);
    }

    /// Takes a picture of a view, and shows it in place of what it replaces: a coarse one is shown where the last whole one shows nothing.
    ///
    /// # Errors
    /// A device without the memory.
    /// Returns the image, and the share of it that is the picture.
    pub fn set_picture(&mut self, drawn: &Drawn, rows: &Rows) -> Result<(&Image, Vec2)> {
        let (device, size) = (&self.device, drawn.size);
        let half = (drawn.of.camera.fov_y / 2.0).to_radians().tan();
        let place = usize::from(!drawn.is_whole());
        if drawn.is_whole() {
            // What came before it is of an older view.
            self.pictures[1].view.pixel = 0.0;
        }
        let padded = padded_size(size);
        let share =
            Vec2::new(size.0 as f32, size.1 as f32) / Vec2::new(padded.0 as f32, padded.1 as f32);
        let codes = fill(size, &drawn.codes);
        self.pictures[place] = Kept {
            image: panel_pass::upload(device, "detailed picture", padded, &codes)?,
            distances: upload_distances(device, padded, &fill(size, &drawn.distances))?,
            view: PictureView {
                x: rows.x.to_array(),
                y: rows.y.to_array(),
                w: rows.w.to_array(),
                eye: rows.eye,
                pixel: (half / f64::from(size.1)) as f32,
                share,
            },
        };
        self.last = place;
        self.bind()?;
        Ok((&self.pictures[place].image, share))
    }

    /// Says which pictures may be laid over the surfaces: the whole one, the coarse one.
    pub fn lay(&mut self, shown: [bool; 2]) {
        let mut views = [self.pictures[0].view, self.pictures[1].view];
        for (view, shown) in views.iter_mut().zip(shown) {
            view.pixel *= f32::from(u8::from(shown));
        }
        self.views.write(0, &views);
    }

    /// Draws within the render pass that is under way.
    pub fn record(&self, cmd: &Commands, seen: &Rows, shown: &Shown) {
        cmd.bind_indices(&self.indices);
        let pipeline = match shown.picture {
            _ if shown.has_overlays() => &self.overlaid,
            Laid::No => &self.plain,
            Laid::FromElsewhere => &self.laid,
            // What lies exactly over all of a frame is drawn without the surfaces.
            Laid::Exactly => return,
        };
        for &(material, first, count) in &self.ranges {
            let material = material as usize;
            let set = &self.sets[self.texture_of[material]];
            cmd.bind_graphics(pipeline, set, &self.vertices);
            let [all, direct, emission] = shown.parts;
            cmd.push_graphics(
                pipeline,
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
                    from_picture: match shown.picture {
                        Laid::No => 0,
                        Laid::Exactly => 1 + self.last as u32,
                        Laid::FromElsewhere => 3,
                    },
                    chosen: shown.chosen.unwrap_or(NOTHING),
                },
            );
            cmd.draw_indexed(first, count);
        }
    }
}

/// What the shader knows of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct About {
    /// Its place in the input.
    triangle: u32,
    source: u32,
    /// How far its relief reaches above or below it, internal units.
    rise: f32,
}

fn rise(material: &Material, unit: f64) -> f32 {
    let Some(map) = &material.map_height else {
        return 0.0;
    };
    let mean = map.mean();
    let most = map.values.iter().map(|&v| (f64::from(v) - mean).abs());
    let scale = f64::from(material.height_scale.abs());
    (most.fold(0.0, f64::max) * scale / unit) as f32
}

/// Sides of the image of a picture. A software driver compiles a shader anew for images whose sides become powers of two or cease to
/// be: no odd number from 3 on is one.
fn padded_size((width, height): (u32, u32)) -> (u32, u32) {
    ((width | 1).max(3), (height | 1).max(3))
}

/// A picture in such an image, its edges going on.
fn fill<T: Copy>((width, height): (u32, u32), picture: &[T]) -> Vec<T> {
    let (wide, high) = padded_size((width, height));
    let row = |y: u32| (y.min(height - 1) * width) as usize;
    let rows =
        (0..high).flat_map(|y| (0..wide).map(move |x| picture[row(y) + x.min(width - 1) as usize]));
    rows.collect()
}

/// An image of distances that shaders read texel by texel.
fn upload_distances(device: &Arc<Device>, size: (u32, u32), distances: &[f32]) -> Result<Image> {
    let name = "detailed picture's distances";
    let image = Image::new(device, name, size, Format::R32_SFLOAT, ImageUse::Texture)?;
    let bytes = size_of_val(distances) as u64;
    let mut staging = Buffer::new(device, "distances staging", bytes, BufferUse::Upload)?;
    staging.write(0, distances);
    Commands::run(device, name, |cmd| {
        cmd.upload_texture(&staging, &image, 4);
        Ok(())
    })?;
    Ok(image)
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
