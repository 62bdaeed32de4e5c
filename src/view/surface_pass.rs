//! Draws the surfaces of a scene by the light at their corners, from an eye that moves freely.
//! Shaders: `view_mesh`, `view_mesh_laid` and `view_mesh_overlaid`, each `.vert` and `.frag`.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::camera::Rows;
use super::detailer::Drawn;
use super::laid_pictures::LaidPictures;
use super::surface_mesh::{About, NOTHING, SurfaceMesh, Vertex};
use crate::error::Result;
use crate::passes::shaders::{view_mesh, view_mesh_laid, view_mesh_overlaid};
use crate::render::upload_texture;
use crate::scene::Scene;
use crate::vk::{
    Blending, Buffer, BufferUse, Commands, DescriptorSet, Device, Format, GraphicsPipeline,
    GraphicsShaders, GraphicsState, Image, RenderPass, Sampled, Sampler, VertexAttribute,
};

/// How surfaces show detailed pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Laid {
    No,
    /// The last picture is of this view and is shown unchanged.
    Exactly,
    /// Pictures of other views, where they show the place.
    FromElsewhere,
}

/// What a frame shows of the surfaces.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    /// Factor of radiance.
    pub exposure: f32,
    /// Irradiance of light not shot yet, W·m⁻².
    pub ambient: Vec3,
    /// Factors of all light, of direct light and of emission.
    pub parts: [f32; 3],
    /// Outlines of elements, colours of sources.
    pub elements: bool,
    pub sources: bool,
    /// What is shown in place of the light of the corners.
    pub picture: Laid,
    /// The marked element.
    pub chosen: Option<u32>,
}

impl Shown {
    fn has_overlays(&self) -> bool {
        self.elements || self.sources || self.chosen.is_some()
    }
}

/// What is bound of one texture.
struct Sets {
    plain: DescriptorSet,
    /// With pictures, for two pipelines.
    laid: DescriptorSet,
}

/// A scene ready to be drawn.
pub struct SurfacePass {
    plain: GraphicsPipeline,
    /// With detailed pictures laid over the surfaces.
    laid: GraphicsPipeline,
    /// With outlines, colours and a mark over the surfaces and the pictures.
    overlaid: GraphicsPipeline,
    sampler: Sampler,
    /// For pictures: clamped at their edges.
    held: Sampler,
    nearest: Sampler,
    /// The first is white.
    textures: Vec<Image>,
    /// Index into `textures`, `[material]`.
    texture_of: Vec<usize>,
    pictures: LaidPictures,
    /// `[texture]`.
    sets: Vec<Sets>,
    mesh: SurfaceMesh,
    /// `[drawn triangle][corner]`.
    all: Buffer,
    direct: Buffer,
    /// `[drawn triangle]`.
    about: Buffer,
    /// `[triangle]` of the input; empty while there are none.
    sources: Vec<u32>,
    /// `[material]`.
    reflectance: Vec<Vec3>,
    emitted: Vec<Vec3>,
    device: Arc<Device>,
}

/// Distance of the near plane, internal units.
const NEAR: f32 = 1e-4;

impl SurfacePass {
    /// # Errors
    /// A scene that does not fit the device.
    pub fn new(device: &Arc<Device>, pass: &RenderPass, scene: &Scene) -> Result<Self> {
        let pipeline = |name, shaders| pipeline(device, pass, name, shaders);
        let mesh = SurfaceMesh::new(device, scene)?;
        let corners = 3 * mesh.order.len();
        let light = |name| -> Result<Buffer> {
            let mut buffer = Buffer::new(device, name, 12 * corners as u64, BufferUse::Stream)?;
            buffer.write(0, &vec![Vec3::ZERO; corners]);
            Ok(buffer)
        };
        let about = (size_of::<About>() * mesh.order.len()) as u64;
        let (textures, texture_of) = textures(device, scene)?;
        let mut surfaces = Self {
            plain: pipeline("surfaces", &view_mesh::SHADER)?,
            laid: pipeline("surfaces under pictures", &view_mesh_laid::SHADER)?,
            overlaid: pipeline("surfaces under overlays", &view_mesh_overlaid::SHADER)?,
            sampler: Sampler::new(device, "surfaces", true)?,
            held: Sampler::held(device, "detailed picture")?,
            nearest: Sampler::new(device, "distances", false)?,
            textures,
            texture_of,
            pictures: LaidPictures::new(device)?,
            sets: Vec::new(),
            all: light("all light")?,
            direct: light("direct light")?,
            about: Buffer::new(device, "about triangles", about, BufferUse::Stream)?,
            sources: Vec::new(),
            mesh,
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
        let [whole, coarse] = &self.pictures.kept;
        let held = |image| Sampled {
            image,
            sampler: &self.held,
        };
        let nearest = |image| Sampled {
            image,
            sampler: &self.nearest,
        };
        let sets = |image| {
            let plain = view_mesh::Bindings {
                albedo: Sampled {
                    image,
                    sampler: &self.sampler,
                },
                all_light: &self.all,
                direct_light: &self.direct,
                about: &self.about,
            };
            let laid = view_mesh_laid::Bindings {
                albedo: plain.albedo,
                all_light: plain.all_light,
                direct_light: plain.direct_light,
                about: plain.about,
                whole: held(&whole.image),
                coarse: held(&coarse.image),
                whole_distances: nearest(&whole.distances),
                coarse_distances: nearest(&coarse.distances),
                views: &self.pictures.views,
            };
            Ok(Sets {
                plain: self.plain.bind("surfaces", &plain)?,
                laid: self.laid.bind("surfaces under pictures", &laid)?,
            })
        };
        self.sets = self.textures.iter().map(sets).collect::<Result<_>>()?;
        Ok(())
    }

    /// Sets the emission to that of `scene`, which is otherwise the same scene; of textured
    /// emission the mean.
    pub fn set_emission(&mut self, scene: &Scene) {
        self.emitted = (scene.materials.iter())
            .map(|m| m.mean_emission().into())
            .collect();
    }

    /// Sets the light, irradiance `[triangle][corner]` in the order of the input, W·m⁻².
    pub fn set_light(&mut self, all: &[[Vec3; 3]], direct: &[[Vec3; 3]]) {
        let by_order = |light: &[[Vec3; 3]]| -> Vec<[Vec3; 3]> {
            let order = self.mesh.order.iter();
            order.map(|&e| light[e as usize]).collect()
        };
        let (all, direct) = (by_order(all), by_order(direct));
        self.all.write(0, &all);
        self.direct.write(0, &direct);
    }

    /// Sets the source of each triangle, `[triangle]` in the order of the input.
    pub fn set_sources(&mut self, scene: &Scene, sources: Vec<u32>) {
        self.sources = sources;
        self.set_about(scene);
    }

    /// Sets the heights to those of `scene`, which is otherwise the same scene.
    pub fn set_about(&mut self, scene: &Scene) {
        let about = self.mesh.about(scene, &self.sources);
        self.about.write(0, &about);
    }

    /// Takes a detailed picture and shows it in place of the one that it replaces. A coarse one is
    /// shown only where the last whole one shows nothing. Returns the image, and the share of it
    /// that is the picture.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn set_picture(&mut self, drawn: &Drawn, rows: &Rows) -> Result<(&Image, Vec2)> {
        let share = self.pictures.set(&self.device, drawn, rows)?;
        self.bind()?;
        Ok((&self.pictures.kept[self.pictures.last].image, share))
    }

    /// Sets which pictures may be laid over the surfaces: the whole one, the coarse one.
    pub fn lay(&mut self, shown: [bool; 2]) {
        self.pictures.lay(shown);
    }

    /// Records the draws within a render pass that has begun.
    pub fn record(&self, cmd: &Commands, seen: &Rows, shown: &Shown) {
        cmd.bind_indices(&self.mesh.indices);
        let plain = shown.picture == Laid::No && !shown.has_overlays();
        let pipeline = match shown.picture {
            _ if shown.has_overlays() => &self.overlaid,
            Laid::No => &self.plain,
            Laid::FromElsewhere => &self.laid,
            // A picture that covers all of the frame is drawn without the surfaces.
            Laid::Exactly => return,
        };
        for range in &self.mesh.ranges {
            let material = range.material as usize;
            let sets = &self.sets[self.texture_of[material]];
            let set = match plain {
                true => &sets.plain,
                false => &sets.laid,
            };
            cmd.bind_graphics(pipeline, set, Some(&self.mesh.vertices));
            let [all, direct, emission] = shown.parts;
            cmd.push_graphics(
                pipeline,
                // The same in all three.
                &view_mesh::Parameters {
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
                        Laid::Exactly => 1 + self.pictures.last as u32,
                        Laid::FromElsewhere => 3,
                    },
                    chosen: shown.chosen.unwrap_or(NOTHING),
                },
            );
            cmd.draw_indexed(range.first, range.count);
        }
    }
}

fn pipeline(
    device: &Arc<Device>,
    pass: &RenderPass,
    name: &'static str,
    shaders: &GraphicsShaders<'_>,
) -> Result<GraphicsPipeline> {
    let attribute = |format, offset: usize| VertexAttribute {
        format,
        offset: offset as u32,
    };
    let three = Format::R32G32B32_SFLOAT;
    GraphicsPipeline::new(
        device,
        pass,
        &GraphicsState {
            name,
            shaders,
            constants: &[],
            vertex_stride: size_of::<Vertex>() as u32,
            attributes: &[
                attribute(three, std::mem::offset_of!(Vertex, position)),
                attribute(three, std::mem::offset_of!(Vertex, normal)),
                attribute(Format::R32G32_SFLOAT, std::mem::offset_of!(Vertex, uv)),
            ],
            blending: Blending::Nearest,
            backs_alone: false,
        },
    )
}

/// Every texture of a scene once, white first, and the index of each material's.
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
