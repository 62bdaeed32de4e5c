//! Draws the surfaces of a scene by the light at their corners, from an eye that moves freely.
//! Shaders: `view_mesh`, `view_mesh_relief` and `view_overlay`, each `.vert` and `.frag`.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::camera::Rows;
use super::corner_light::{CornerLight, Slant};
use super::slopes::{Slopes, mean_tile, slope_axes};
use super::surface_mesh::{About, MeshRange, NOTHING, SurfaceMesh, Vertex};
use crate::error::Result;
use crate::passes::pass_parts::PartedPass;
use crate::passes::shaders::{view_mesh, view_mesh_relief, view_overlay};
use crate::render::upload_texture;
use crate::scene::Scene;
use crate::vk::{
    Blending, Buffer, BufferUse, DescriptorSet, Device, Format, GraphicsPipeline, GraphicsShaders,
    GraphicsState, Image, RenderPass, Sampled, Sampler, Sides, VertexAttribute,
};

/// What a frame shows of the surfaces.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    /// Factor of radiance.
    pub exposure: f32,
    /// Irradiance of light not shot yet, W·m⁻².
    pub ambient: Vec3,
    /// Factors of all light, of direct light and of emission.
    pub parts: [f32; 3],
    /// Whether relief is shown on its own normals.
    pub relief: bool,
    /// Outlines of elements, colours of sources.
    pub elements: bool,
    pub sources: bool,
    /// The marked element.
    pub chosen: Option<u32>,
}

impl Shown {
    pub fn has_overlays(&self) -> bool {
        self.elements || self.sources || self.chosen.is_some()
    }
}

/// What is bound of one material.
struct Sets {
    plain: DescriptorSet,
    /// Of a material with relief.
    relief: Option<DescriptorSet>,
}

/// Light at the corners, W·m⁻².
struct Corners {
    /// `[drawn triangle][corner]`.
    light: Buffer,
    /// `[drawn triangle with relief][corner][along u, along v, lift]`.
    slanted: Buffer,
}

/// A scene ready to be drawn.
pub struct SurfacePass {
    plain: GraphicsPipeline,
    relief: GraphicsPipeline,
    overlay: GraphicsPipeline,
    /// `[material]`.
    sets: Vec<Sets>,
    overlays: DescriptorSet,
    mesh: SurfaceMesh,
    all: Corners,
    direct: Corners,
    /// `[drawn triangle]`.
    about: Buffer,
    /// `[triangle]` of the input; empty while there are none.
    sources: Vec<u32>,
    /// `[material]`.
    reflectance: Vec<Vec3>,
    emitted: Vec<Vec3>,
}

impl Corners {
    /// No light yet.
    fn new(device: &Arc<Device>, name: &str, mesh: &SurfaceMesh) -> Result<Self> {
        let dark = |count: usize| -> Result<Buffer> {
            let values = vec![Vec3::ZERO; count.max(1)];
            let bytes = size_of_val(&values[..]) as u64;
            let mut buffer = Buffer::new(device, name, bytes, BufferUse::Stream)?;
            buffer.write(0, &values);
            Ok(buffer)
        };
        let triangles = mesh.order.len();
        Ok(Self {
            light: dark(3 * triangles)?,
            slanted: dark(9 * (triangles - mesh.first_relief))?,
        })
    }

    /// Takes light `[triangle][corner]` in the order of the input, and how it depends on slopes.
    fn write(
        &mut self,
        mesh: &SurfaceMesh,
        scene: &Scene,
        light: &[[Vec3; 3]],
        slants: Option<&[[Slant; 3]]>,
    ) {
        let order = mesh.order.iter();
        let light: Vec<[Vec3; 3]> = order.map(|&e| light[e as usize]).collect();
        self.light.write(0, &light);
        let with_relief = &mesh.order[mesh.first_relief..];
        let slanted: Vec<[[Vec3; 3]; 3]> = match slants {
            None => vec![[[Vec3::ZERO; 3]; 3]; with_relief.len()],
            Some(slants) => with_relief
                .iter()
                .map(|&e| {
                    let axes = slope_axes(scene, &scene.triangles[e as usize]);
                    let axes = axes.map(|axis| axis.as_vec3());
                    slants[e as usize].map(|[r, g, b, lift]| {
                        let [u, v] =
                            axes.map(|axis| Vec3::new(axis.dot(r), axis.dot(g), axis.dot(b)));
                        [u, v, lift]
                    })
                })
                .collect(),
        };
        if !slanted.is_empty() {
            self.slanted.write(0, &slanted);
        }
    }
}

impl SurfacePass {
    /// # Errors
    /// A scene that does not fit the device.
    pub fn new(device: &Arc<Device>, pass: &RenderPass, scene: &Scene) -> Result<Self> {
        let pipeline = |name, shaders, blending, attributes| {
            pipeline(device, pass, name, shaders, blending, attributes)
        };
        let plain = pipeline("surfaces", &view_mesh::SHADER, Blending::Nearest, 2)?;
        let relief = pipeline("relief", &view_mesh_relief::SHADER, Blending::Nearest, 2)?;
        let overlay = pipeline("overlays", &view_overlay::SHADER, Blending::Glaze, 1)?;
        let mesh = SurfaceMesh::new(device, scene)?;
        let all = Corners::new(device, "all light", &mesh)?;
        let direct = Corners::new(device, "direct light", &mesh)?;
        let bytes = (size_of::<About>() * mesh.order.len()) as u64;
        let about = Buffer::new(device, "about triangles", bytes, BufferUse::Stream)?;
        let sampler = Sampler::new(device, "surfaces", true)?;
        let (textures, texture_of) = textures(device, scene)?;
        let slopes = scene.materials.iter().enumerate().map(|(i, material)| {
            let slopes = Slopes::new(material, mean_tile(scene, i));
            let image = slopes.map(|s| upload_texture(device, "slopes", s.size, &s.texels));
            image.transpose()
        });
        let slopes: Vec<Option<Image>> = slopes.collect::<Result<_>>()?;
        let sets = slopes.iter().zip(&texture_of).map(|(slopes, &texture)| {
            let sampled = |image| Sampled {
                image,
                sampler: &sampler,
            };
            let albedo = sampled(&textures[texture]);
            let bindings = view_mesh::Bindings {
                albedo,
                all_light: &all.light,
                direct_light: &direct.light,
                about: &about,
            };
            let of_relief = slopes.as_ref().map(|slopes| {
                let bindings = view_mesh_relief::Bindings {
                    albedo,
                    all_light: &all.light,
                    direct_light: &direct.light,
                    about: &about,
                    all_slanted: &all.slanted,
                    direct_slanted: &direct.slanted,
                    slopes: sampled(slopes),
                };
                relief.bind("relief", &bindings)
            });
            Ok(Sets {
                plain: plain.bind("surfaces", &bindings)?,
                relief: of_relief.transpose()?,
            })
        });
        let mut surfaces = Self {
            sets: sets.collect::<Result<_>>()?,
            overlays: overlay.bind("overlays", &view_overlay::Bindings { about: &about })?,
            plain,
            relief,
            overlay,
            all,
            direct,
            about,
            sources: Vec::new(),
            mesh,
            reflectance: scene.materials.iter().map(|m| m.kd.into()).collect(),
            emitted: Vec::new(),
        };
        surfaces.set_emission(scene);
        surfaces.set_about(scene);
        Ok(surfaces)
    }

    /// Sets the emission to that of `scene`, which is otherwise the same scene; of textured
    /// emission the mean.
    pub fn set_emission(&mut self, scene: &Scene) {
        self.emitted = (scene.materials.iter())
            .map(|m| m.mean_emission().into())
            .collect();
    }

    /// Shows this light on `scene`, which is otherwise the same scene.
    pub fn set_light(&mut self, scene: &Scene, light: &CornerLight) {
        let slanted = light.slanted.as_ref();
        let all = slanted.map(|slants| &slants.all[..]);
        let direct = slanted.map(|slants| &slants.direct[..]);
        self.all.write(&self.mesh, scene, &light.all, all);
        self.direct.write(&self.mesh, scene, &light.direct, direct);
    }

    /// Sets the source of each triangle, `[triangle]` in the order of the input.
    pub fn set_sources(&mut self, scene: &Scene, sources: Vec<u32>) {
        self.sources = sources;
        self.set_about(scene);
    }

    /// Origin and unit of the places that it draws, scene units.
    pub fn frame(&self) -> (DVec3, f64) {
        self.mesh.frame
    }

    /// Sets the places of surfaces to those of `scene`, which is otherwise the same scene.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn set_places(&mut self, device: &Arc<Device>, scene: &Scene) -> Result<()> {
        self.mesh.move_to(device, scene)
    }

    /// Sets the heights to those of `scene`, which is otherwise the same scene.
    pub fn set_about(&mut self, scene: &Scene) {
        let about = self.mesh.about(scene, &self.sources);
        self.about.write(0, &about);
    }

    /// Records the draws within a render pass that has begun.
    pub fn record(&self, pass: &mut PartedPass<'_>, seen: &Rows, shown: &Shown) {
        for range in &self.mesh.ranges {
            let sets = &self.sets[range.material as usize];
            let relief = sets.relief.as_ref();
            let (pipeline, set) = match relief.filter(|_| shown.relief && range.relief) {
                Some(set) => (&self.relief, set),
                None => (&self.plain, &sets.plain),
            };
            self.draw(
                pass,
                pipeline,
                set,
                range,
                &self.parameters(seen, shown, range),
            );
        }
    }

    /// Records what lies over the surfaces, which have been drawn.
    pub fn record_overlays(&self, pass: &mut PartedPass<'_>, seen: &Rows, shown: &Shown) {
        for range in &self.mesh.ranges {
            let parameters = self.parameters(seen, shown, range);
            self.draw(pass, &self.overlay, &self.overlays, range, &parameters);
        }
    }

    fn parameters(&self, seen: &Rows, shown: &Shown, range: &MeshRange) -> view_mesh::Parameters {
        let material = range.material as usize;
        let [all, direct, emission] = shown.parts;
        // The same of all three.
        view_mesh::Parameters {
            x: seen.x,
            y: seen.y,
            w: seen.w,
            reflectance: self.reflectance[material],
            exposure: shown.exposure,
            emitted: self.emitted[material] * emission,
            ambient: shown.ambient,
            parts: Vec2::new(all, direct),
            elements: f32::from(u8::from(shown.elements)),
            sources: f32::from(u8::from(shown.sources)),
            first_relief: 3 * self.mesh.first_relief as u32,
            chosen: shown.chosen.unwrap_or(NOTHING),
        }
    }

    fn draw(
        &self,
        pass: &mut PartedPass<'_>,
        pipeline: &GraphicsPipeline,
        set: &DescriptorSet,
        range: &MeshRange,
        parameters: &view_mesh::Parameters,
    ) {
        pass.draw(std::iter::once(range.triangles.clone()), |cmd| {
            cmd.bind_indices(&self.mesh.indices);
            cmd.bind_graphics(pipeline, set, Some(&self.mesh.vertices));
            cmd.push_graphics(pipeline, parameters);
        });
    }
}

/// A pipeline that reads the first `attributes` of a vertex.
fn pipeline(
    device: &Arc<Device>,
    pass: &RenderPass,
    name: &'static str,
    shaders: &GraphicsShaders<'_>,
    blending: Blending,
    attributes: usize,
) -> Result<GraphicsPipeline> {
    let attribute = |format, offset: usize| VertexAttribute {
        format,
        offset: offset as u32,
    };
    let three = Format::R32G32B32_SFLOAT;
    let all = [
        attribute(three, std::mem::offset_of!(Vertex, position)),
        attribute(Format::R32G32_SFLOAT, std::mem::offset_of!(Vertex, uv)),
    ];
    GraphicsPipeline::new(
        device,
        pass,
        &GraphicsState {
            name,
            shaders,
            constants: &[],
            vertex_stride: size_of::<Vertex>() as u32,
            attributes: &all[..attributes],
            blending,
            sides: Sides::Fronts,
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
