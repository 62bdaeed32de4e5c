//! A simple shaded picture of a bake: irradiance smoothed over each surface, reflectance textures per sample, 4 × 4 samples a
//! pixel.
//!
//! ```text
//! irradiance ─► smooth ─┐
//! textures ─────────────┼─► passes::shade ──┬─ tile by tile ─► Picture ─► tone ─► .png
//! projection ───────────┤                   │                     └──────────────► .exr
//! light by direction ───┴─► passes::relief ─┘
//! ```

mod compare;
mod lighting;
mod lights;
mod picture;
mod projection;
mod relief;
mod smooth;
mod textures;
pub mod tone;

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

pub use compare::{Comparison, side_by_side};
pub use lighting::{Direct, Light, Lighting, ReliefShading, Show};
pub use picture::{FileKind, Picture, SAMPLES};
pub(crate) use projection::Projection;
pub use smooth::corner_irradiance;

use crate::error::{Error, Result};
use crate::passes;
use crate::passes::buffers::upload;
use crate::passes::shade::{Draw, Parameters, Shade, Target, Vertex};
use crate::scene::{Camera, Material, Scene, Triangle};
use crate::vk::{Buffer, BufferUse, Commands, DescriptorSet, Device, Sampler};
use picture::Samples;
use projection::Tile;
use relief::ReliefMesh;
use textures::Textures;

/// What is to be seen.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub camera: &'a Camera,
    /// Pixels.
    pub width: u32,
    pub height: u32,
}

impl View<'_> {
    /// # Errors
    /// A size of 0 or above [`MOST_PIXELS`].
    pub(crate) fn check(&self) -> Result<()> {
        for (name, side) in [("width", self.width), ("height", self.height)] {
            if !(1..=MOST_PIXELS).contains(&side) {
                return Err(Error::Usage(format!(
                    "picture {name} {side} must be in 1..={MOST_PIXELS}"
                )));
            }
        }
        Ok(())
    }
}

/// Most pixels along a side of a picture.
pub const MOST_PIXELS: u32 = 16_384;

/// Pixels along a side of a tile: 2048² samples take 64 MiB of colour, as much again to read them, and 16 MiB of depth.
const TILE: u32 = 2048 / SAMPLES;

/// A pixel keeps its samples where a channel's lowest is below this share of its highest: nearer together, the tone curve is
/// straight enough that the mean alone gives the same code.
const CONTRAST: f32 = 0.8;

/// Renders `scene` under its irradiance E: L = ρ(u, v) · E / π + Le on fronts, black on backs, which block all the same.
/// Triangles with relief are drawn by relief mapping where their light by direction is given.
///
/// # Errors
/// A size of 0 or above [`MOST_PIXELS`]; a camera that looks nowhere; a device that lacks the memory or fails.
pub fn render<'a>(
    device: &Arc<Device>,
    scene: &Scene,
    lighting: impl Into<Lighting<'a>>,
    view: &View<'_>,
) -> Result<Picture> {
    let lighting = lighting.into();
    assert_eq!(
        lighting.irradiance.len(),
        scene.triangles.len(),
        "one irradiance a triangle"
    );
    view.check()?;
    let projection = Projection::new(scene, view)?;
    let shade = Shade::new(device)?;
    let textures = Textures::new(device, &shade, scene)?;
    let mesh = Mesh::new(device, scene, &lighting, &projection)?;
    let relief = Relief::new(device, &shade, scene, &lighting, &textures, &projection)?;
    let (width, height) = (view.width.min(TILE), view.height.min(TILE));
    let target = Target::new(device, &shade, (width * SAMPLES, height * SAMPLES))?;

    let mut gathered = Gathered {
        width: view.width,
        radiance: vec![[0.0; 3]; view.width as usize * view.height as usize],
        contrasts: Vec::new(),
        metered: Vec::new(),
    };
    for row in (0..view.height).step_by(TILE as usize) {
        for column in (0..view.width).step_by(TILE as usize) {
            let tile = Tile {
                column,
                row,
                width: TILE.min(view.width - column),
                height: TILE.min(view.height - row),
            };
            Commands::run(device, "shade", |cmd| {
                shade.record(
                    cmd,
                    &target,
                    (tile.width * SAMPLES, tile.height * SAMPLES),
                    (&mesh.vertices, &mesh.indices),
                    mesh.draws(scene, &textures, &projection, tile, lighting.part),
                    || {
                        if let Some(relief) = &relief {
                            relief.record(cmd, scene, &lighting, &projection, tile);
                        }
                    },
                );
                Ok(())
            })?;
            gathered.add(
                tile,
                &target.rows(tile.height * SAMPLES),
                target.width as usize,
            );
        }
    }
    Ok(gathered.into_picture(view))
}

/// The scene's fronts by material, then its backs.
struct Mesh {
    vertices: Buffer,
    indices: Buffer,
    /// Material (none for backs), first vertex, count.
    ranges: Vec<(Option<u32>, u32, u32)>,
}

impl Mesh {
    fn new(
        device: &Arc<Device>,
        scene: &Scene,
        lighting: &Lighting<'_>,
        projection: &Projection,
    ) -> Result<Self> {
        let smooth = corner_irradiance(scene, &lighting.irradiance());
        let mut elsewhere = vec![false; scene.triangles.len()];
        for &e in lighting
            .relief()
            .iter()
            .flat_map(|(light, _)| &light.elements)
        {
            elsewhere[e as usize] = true;
        }
        // Which side is seen is found here in f64: a rasteriser finds it from rounded corners, wrongly for slivers.
        let mut order: Vec<_> = scene
            .triangles
            .par_iter()
            .enumerate()
            .filter(|(e, _)| !elsewhere[*e])
            .map(|(e, t)| {
                let [a, b, c] = scene.corners(t);
                let front = (b - a).cross(c - a).dot(projection.eye - a) > 0.0;
                (if front { t.material } else { u32::MAX }, e)
            })
            .collect();
        order.par_sort_unstable();
        let vertices: Vec<_> = order
            .par_iter()
            .flat_map_iter(|&(_, e)| corners(scene, &scene.triangles[e], smooth[e], projection))
            .collect();
        let mut ranges = Vec::new();
        let mut first = 0;
        for same in order.chunk_by(|a, b| a.0 == b.0) {
            let count = 3 * same.len() as u32;
            let material = (same[0].0 != u32::MAX).then_some(same[0].0);
            ranges.push((material, first, count));
            first += count;
        }
        let indices: Vec<u32> = (0..vertices.len() as u32).collect();
        Ok(Self {
            vertices: upload(device, "shade vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "shade indices", &indices, BufferUse::Geometry)?,
            ranges,
        })
    }

    fn draws<'a>(
        &'a self,
        scene: &'a Scene,
        textures: &'a Textures,
        projection: &Projection,
        tile: Tile,
        part: Light,
    ) -> impl Iterator<Item = Draw<'a>> {
        let rows = projection.rows(tile);
        self.ranges
            .iter()
            .map(move |&(material, first, count)| Draw {
                first_vertex: first,
                vertex_count: count,
                texture: match material {
                    Some(m) => textures.of_material(m),
                    None => textures.white(),
                },
                parameters: parameters(rows, material.map(|m| &scene.materials[m as usize]), part),
            })
    }
}

/// Of a material's fronts, or of backs.
fn parameters([x, y, w]: [Vec3; 3], material: Option<&Material>, part: Light) -> Parameters {
    let (reflectance, emitted, metered) = match material {
        Some(m) => (m.kd, m.ke, if m.emits() { 0.0 } else { 1.0 }),
        None => ([0.0; 3], [0.0; 3], 0.0),
    };
    let shines = if part == Light::Indirect { 0.0 } else { 1.0 };
    Parameters {
        x,
        y,
        w,
        near: projection::NEAR,
        reflectance: reflectance.into(),
        emitted: Vec3::from(emitted) * shines,
        metered,
    }
}

/// The relief of a picture, ready to be drawn.
struct Relief {
    pass: passes::relief::Relief,
    mesh: ReliefMesh,
    /// One for each range of the mesh.
    sets: Vec<DescriptorSet>,
    shading: u32,
    _sampler: Sampler,
}

impl Relief {
    /// None where nothing with relief is drawn as such.
    fn new(
        device: &Arc<Device>,
        shade: &Shade,
        scene: &Scene,
        lighting: &Lighting<'_>,
        textures: &Textures,
        projection: &Projection,
    ) -> Result<Option<Self>> {
        let Some((light, shading)) = lighting.relief() else {
            return Ok(None);
        };
        let pass = passes::relief::Relief::new(device, shade)?;
        let mesh = ReliefMesh::new(device, scene, lighting, light, projection, lighting.cache)?;
        let sampler = Sampler::new(device, "relief albedo", true)?;
        let sets = mesh
            .ranges
            .iter()
            .map(|&(material, ..)| pass.bind(textures.image(material), &sampler, &mesh.buffers))
            .collect::<Result<_>>()?;
        Ok(Some(Self {
            pass,
            mesh,
            sets,
            shading,
            _sampler: sampler,
        }))
    }

    fn record(
        &self,
        cmd: &Commands,
        scene: &Scene,
        lighting: &Lighting<'_>,
        projection: &Projection,
        tile: Tile,
    ) {
        let rows = projection.rows(tile);
        let directions = self.mesh.directions;
        let [light_count, emitter_points] = self.mesh.buffers.light_counts();
        let draws = self.mesh.ranges.iter().zip(&self.sets);
        let draws = draws.map(|(&(material, first, count), set)| {
            let material = &scene.materials[material as usize];
            passes::relief::Draw {
                first_prism: first,
                prism_count: count,
                set,
                parameters: passes::relief::Parameters {
                    shade: parameters(rows, Some(material), lighting.part),
                    shading: self.shading,
                    view: lighting.show.code(),
                    pixel: projection.sample_angle(),
                    cells: [directions.columns, directions.rows],
                    light_count,
                    emitter_points,
                },
            }
        });
        self.pass.record(cmd, &self.mesh.buffers, draws);
    }
}

fn corners(
    scene: &Scene,
    triangle: &Triangle,
    irradiance: [Vec3; 3],
    projection: &Projection,
) -> [Vertex; 3] {
    let positions: [DVec3; 3] = scene.corners(triangle);
    let images = triangle.uv.map(|[u, v]| Vec2::new(u, 1.0 - v));
    // A texture repeats: near 0, its coordinates have more digits left for the place within it.
    let whole = images[0].floor();
    std::array::from_fn(|k| Vertex {
        position: ((positions[k] - projection.eye) / projection.unit).as_vec3(),
        irradiance: irradiance[k],
        uv: images[k] - whole,
    })
}

/// What has been drawn so far.
struct Gathered {
    width: u32,
    radiance: Vec<[f32; 3]>,
    contrasts: Vec<(u32, Samples)>,
    /// Luminance of the pixels that an exposure meter looks at.
    metered: Vec<f32>,
}

impl Gathered {
    /// Takes a tile's samples, rows of `stride`.
    fn add(&mut self, tile: Tile, samples: &[[f32; 4]], stride: usize) {
        let side = SAMPLES as usize;
        let rows: Vec<Vec<(Samples, bool)>> = (0..tile.height as usize)
            .into_par_iter()
            .map(|row| {
                (0..tile.width as usize)
                    .map(|column| {
                        let sample = |i: usize| {
                            samples[(row * side + i / side) * stride + column * side + i % side]
                        };
                        let colours = std::array::from_fn(|i| {
                            let [r, g, b, _] = sample(i);
                            [r, g, b]
                        });
                        (colours, (0..side * side).all(|i| sample(i)[3] > 0.5))
                    })
                    .collect()
            })
            .collect();
        for (row, pixels) in rows.into_iter().enumerate() {
            let start = (tile.row + row as u32) * self.width + tile.column;
            for (place, (samples, metered)) in (start..).zip(pixels) {
                let mean = picture::mean(&samples);
                self.radiance[place as usize] = mean;
                if metered {
                    self.metered.push(tone::luminance(mean));
                }
                if contrasts(&samples) {
                    self.contrasts.push((place, samples));
                }
            }
        }
    }

    fn into_picture(mut self, view: &View<'_>) -> Picture {
        self.contrasts.par_sort_unstable_by_key(|c| c.0);
        Picture {
            width: view.width,
            height: view.height,
            radiance: self.radiance,
            automatic_exposure: picture::automatic_exposure(&mut self.metered),
            contrasts: self.contrasts,
        }
    }
}

fn contrasts(samples: &Samples) -> bool {
    (0..3).any(|c| {
        let values = samples.iter().map(|s| s[c]);
        let (low, high) = values.fold((f32::INFINITY, 0.0_f32), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        low < CONTRAST * high
    })
}
