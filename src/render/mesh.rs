//! The triangles of the shade pass: fronts by material, and backs.

use std::f32::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::blocks::Blocks;
use super::flat_relief::FlatRelief;
use super::mesh_scene::MeshScene;
use super::seen_scene::SeenScene;
use super::shafts::Shafts;
use super::textures::Bound;
use super::{Cuts, Light, Lighting, parts};
use crate::constants::{LIT_IN_PARTS, LIT_NOT, LIT_OPEN, PART_HIDDEN, PART_OPEN, PART_UNSURE};
use crate::error::Result;
use crate::passes::buffers::upload;
use crate::passes::shade::{Draw, LitBuffers, Parameters, Vertex};
use crate::passes::shadow_rays::LightCounts;
use crate::passes::types::LitTriangle;
use crate::picture::{NEAR, Projection, Tile};
use crate::scene::Material;
use crate::vk::{Buffer, BufferUse, Device};

/// The scene's fronts by material, then its backs.
pub struct Mesh {
    pub vertices: Buffer,
    pub indices: Buffer,
    /// Input of the lighting by light points.
    pub lit: LitBuffers,
    /// Number of lit triangles with nothing between them and the lights, and of all lit triangles.
    pub open: [usize; 2],
    /// Number of parts of lit triangles, `[PART_…]`.
    pub parts: [usize; 3],
    ranges: Vec<KindRange>,
    blocks: Blocks,
}

/// Drawn triangles of one kind.
struct KindRange {
    kind: Kind,
    /// LIT_…
    lit: u32,
    /// Drawn triangles.
    triangles: Range<u32>,
}

/// A drawn triangle; ordered by kind, then by index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Drawn {
    kind: Kind,
    /// Index in the scene.
    triangle: usize,
}

/// Triangles that are drawn by one draw, with their material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Front(u32),
    /// Fronts whose relief is too far to be resolved: the vertices hold the light that it sends.
    Far(u32),
    Back,
    /// What fronts emit by a texture, added to what they reflect.
    Glow(u32),
}

impl Kind {
    /// Whether light points light it.
    fn is_lit(self) -> bool {
        matches!(self, Self::Front(_))
    }
}

impl Mesh {
    /// All triangles but those that are drawn as prisms; lit where there are `shafts`.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        seen: &SeenScene<'_>,
        kept: &MeshScene,
        rest: Option<&FlatRelief>,
        shafts: Option<&Shafts>,
    ) -> Result<Self> {
        let SeenScene {
            scene,
            lighting,
            projection,
            ..
        } = *seen;
        let far = |e: usize| rest.and_then(|rest| rest.far.get(&e));
        // The visible side is decided here in f64: a rasteriser decides it from rounded corners,
        // wrongly for slivers.
        let mut order: Vec<_> = scene
            .triangles
            .par_iter()
            .enumerate()
            .filter(|(e, _)| rest.is_none_or(|rest| !rest.prism[*e]))
            .map(|(e, t)| {
                let [a, b, c] = scene.corners(t);
                let front = (b - a).cross(c - a).dot(projection.eye - a) > 0.0;
                let kind = match front {
                    true if far(e).is_some() => Kind::Far(t.material),
                    true => Kind::Front(t.material),
                    false => Kind::Back,
                };
                Drawn { kind, triangle: e }
            })
            .filter(|drawn| !(lighting.hide_backs && drawn.kind == Kind::Back))
            .collect();
        // Nothing is added where no texture emits.
        if shows_emission(lighting) {
            let glows = order.iter().filter_map(|drawn| match drawn.kind {
                Kind::Front(m) => scene.materials[m as usize].map_ke.as_ref().map(|_| Drawn {
                    kind: Kind::Glow(m),
                    ..*drawn
                }),
                _ => None,
            });
            let glows: Vec<Drawn> = glows.collect();
            order.extend(glows);
        }
        order.par_sort_unstable();
        let vertices: Vec<_> = order
            .par_iter()
            .flat_map_iter(|&Drawn { kind, triangle: e }| {
                let light = match kind {
                    // L = ρ · E / π with the emission for ρ.
                    Kind::Glow(_) => [Vec3::splat(PI); 3],
                    _ => far(e).copied().unwrap_or(kept.light[e]),
                };
                let triangle = &scene.triangles[e];
                let away = rest.and_then(|rest| rest.away.get(&e));
                let places = away.copied().unwrap_or(scene.corners(triangle));
                let uv = match kind {
                    Kind::Glow(_) => triangle.uv_of_emission(),
                    _ => triangle.uv,
                };
                corners(uv, places, light, projection)
            })
            .collect();
        let mut lit = shafts.map_or_else(Lit::default, |shafts| {
            let lit = lit_triangles(kept, &order, &vertices);
            let pixel = projection.sample_angle(1);
            Lit::new(lit, &order, shafts, pixel.into())
        });
        // Those that need the same shading come together.
        let kind = |i: usize| (order[i].kind, lit.how(i, order[i].kind));
        let mut places: Vec<usize> = (0..order.len()).collect();
        places.sort_by_key(|&i| kind(i));
        let mut ranges = Vec::new();
        let mut first = 0;
        for same in places.chunk_by(|&a, &b| kind(a) == kind(b)) {
            let end = first + same.len() as u32;
            let (kind, lit) = kind(same[0]);
            let triangles = first..end;
            ranges.push(KindRange {
                kind,
                lit,
                triangles,
            });
            first = end;
        }
        let vertices: Vec<Vertex> = places
            .iter()
            .flat_map(|&i| &vertices[3 * i..][..3])
            .copied()
            .collect();
        if !lit.triangles.is_empty() {
            lit.triangles = places.iter().map(|&i| lit.triangles[i]).collect();
        }
        let fronts = order.iter().filter(|drawn| drawn.kind.is_lit()).count();
        let indices: Vec<u32> = (0..vertices.len() as u32).collect();
        let corners: Vec<Vec3> = vertices.iter().map(|vertex| vertex.position).collect();
        Ok(Self {
            vertices: upload(device, "shade vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "shade indices", &indices, BufferUse::Geometry)?,
            open: [lit.open, if lit.triangles.is_empty() { 0 } else { fronts }],
            parts: lit.parts,
            lit: LitBuffers::new(device, &lit.triangles, &lit.states)?,
            ranges,
            blocks: Blocks::new(projection, &corners, 3),
        })
    }

    /// Triangles that a tile draws, and all.
    pub fn drawn(&self, tile: Tile, cuts: Cuts) -> [usize; 2] {
        let ranges = self.ranges.iter().map(|range| &range.triangles);
        self.blocks.drawn(ranges, tile, cuts)
    }

    /// Draws of what one tile may show, lit straight by so many lights.
    pub fn draws<'a>(
        &'a self,
        seen: &SeenScene<'a>,
        tile: Tile,
        textures: &'a Bound,
        lights: LightCounts,
    ) -> impl Iterator<Item = Draw<'a>> {
        let rows = seen.projection.rows(tile);
        let corner = tile.corner(seen.samples);
        let (scene, lighting, cuts) = (seen.scene, seen.lighting, seen.cuts);
        let parameters = move |material| parameters(rows, material, lighting);
        self.ranges.iter().map(move |range| Draw {
            triangles: self.blocks.shown(range.triangles.clone(), tile, cuts),
            lit: range.lit,
            texture: match range.kind {
                Kind::Front(m) if lighting.show.is_coloured() => textures.of_material(m),
                Kind::Glow(m) => textures.of_emission(m),
                Kind::Front(_) | Kind::Far(_) | Kind::Back => textures.white(),
            },
            adds: matches!(range.kind, Kind::Glow(_)),
            parameters: match range.kind {
                Kind::Front(m) => {
                    let material = &scene.materials[m as usize];
                    let mut own = parameters(Some(material)).lit_by(lights, corner);
                    if material.map_ke.is_some() {
                        own.emitted = Vec3::ZERO;
                    }
                    if !lighting.show.is_coloured() {
                        own.reflectance = Vec3::ONE;
                    }
                    own
                }
                Kind::Glow(m) => Parameters {
                    reflectance: scene.materials[m as usize].ke.into(),
                    ..parameters(None)
                },
                Kind::Far(m) => Parameters {
                    reflectance: Vec3::ONE,
                    ..parameters(Some(&scene.materials[m as usize]))
                },
                Kind::Back => parameters(None),
            },
        })
    }
}

/// What is lit straight, and the parts of it that see all of each light, or none.
#[derive(Default)]
struct Lit {
    triangles: Vec<LitTriangle>,
    /// Two bits a part.
    states: Vec<u32>,
    /// Triangles that are open as a whole.
    open: usize,
    /// `[PART_…]`
    parts: [usize; 3],
}

impl Lit {
    /// `pixel` is the angle of a pixel.
    fn new(mut triangles: Vec<LitTriangle>, order: &[Drawn], shafts: &Shafts, pixel: f64) -> Self {
        let levels = parts::levels(&triangles, pixel);
        let drawn = triangles.par_iter().zip(order).zip(&levels);
        let states: Vec<Vec<u8>> = drawn
            .map(|((triangle, drawn), &level)| match drawn.kind.is_lit() {
                true => parts::states(shafts, triangle, level),
                false => vec![PART_UNSURE as u8],
            })
            .collect();
        let mut words = Vec::new();
        let (mut open, mut all) = (0, [0; 3]);
        for (((triangle, states), level), drawn) in
            triangles.iter_mut().zip(states).zip(levels).zip(order)
        {
            let level = if states.len() == 1 { 0 } else { level };
            if drawn.kind.is_lit() {
                let counts = parts::count(&states, level);
                (0..3).for_each(|k| all[k] += counts[k]);
            }
            if let [state] = states[..] {
                triangle.first_part = state.into();
                open += usize::from(u32::from(state) == PART_OPEN);
                continue;
            }
            triangle.level = level;
            triangle.first_part = STATES_IN_WORD as u32 * words.len() as u32;
            let word = |states: &[u8]| {
                let bits = states
                    .iter()
                    .zip(0..)
                    .map(|(&s, i)| u32::from(s) << (2 * i));
                bits.sum::<u32>()
            };
            words.extend(states.chunks(STATES_IN_WORD).map(word));
        }
        Self {
            triangles,
            states: words,
            open,
            parts: all,
        }
    }

    /// LIT_… of a triangle of that kind.
    fn how(&self, i: usize, kind: Kind) -> u32 {
        let Some(triangle) = self.triangles.get(i).filter(|_| kind.is_lit()) else {
            return LIT_NOT;
        };
        match (triangle.level, triangle.first_part) {
            (0, PART_OPEN) => LIT_OPEN,
            // Nothing arrives from lights.
            (0, PART_HIDDEN) => LIT_NOT,
            _ => LIT_IN_PARTS,
        }
    }
}

const STATES_IN_WORD: usize = 16;

/// Height of the start of shadow rays above a triangle, as a share of its corners' greatest
/// coordinate relative to the eye: 2⁻¹⁸. Places on it are interpolated with weights that sum to 1
/// within about 2⁻²², so that they deviate from its plane by that share.
const ABOVE: f32 = 1.0 / (1 << 18) as f32;

/// `vertices` are those of the triangles in `order`, three each.
fn lit_triangles(kept: &MeshScene, order: &[Drawn], vertices: &[Vertex]) -> Vec<LitTriangle> {
    order
        .par_iter()
        .zip(vertices.par_chunks(3))
        .map(|(&Drawn { triangle: e, .. }, drawn)| {
            let normals = &kept.lit[e];
            let [a, b, c] = [0, 1, 2].map(|k| drawn[k].position);
            let furthest = a.abs().max(b.abs()).max(c.abs()).max_element();
            let [normal_a, normal_b, normal_c] = normals.corners;
            LitTriangle {
                a,
                b,
                c,
                normal_a,
                normal_b,
                normal_c,
                plane: normals.plane,
                above: ABOVE * furthest,
                ..LitTriangle::zeroed()
            }
        })
        .collect()
}

fn shows_emission(lighting: &Lighting<'_>) -> bool {
    lighting.part != Light::Indirect && lighting.show.is_light() && lighting.show.is_coloured()
}

/// Push constants of a material's fronts, or of backs (None).
pub fn parameters(
    [x, y, w]: [Vec3; 3],
    material: Option<&Material>,
    lighting: &Lighting<'_>,
) -> Parameters {
    let (reflectance, emitted, metered) = match material {
        Some(m) => (m.kd, m.mean_emission(), if m.emits() { 0.0 } else { 1.0 }),
        None => ([0.0; 3], [0.0; 3], 0.0),
    };
    let shines = if shows_emission(lighting) { 1.0 } else { 0.0 };
    Parameters {
        x,
        y,
        w,
        near: NEAR,
        reflectance: reflectance.into(),
        emitted: Vec3::from(emitted) * shines,
        metered,
        light_count: 0,
        emitter_points: 0,
        polygon_count: 0,
        corner: [0; 2],
    }
}

fn corners(
    uv: [[f32; 2]; 3],
    positions: [DVec3; 3],
    irradiance: [Vec3; 3],
    projection: &Projection,
) -> [Vertex; 3] {
    let images = uv.map(|[u, v]| Vec2::new(u, 1.0 - v));
    // The texture repeats: coordinates shifted to near 0 are more precise.
    let whole = images[0].floor();
    std::array::from_fn(|k| Vertex {
        position: ((positions[k] - projection.eye) / projection.unit).as_vec3(),
        irradiance: irradiance[k],
        uv: images[k] - whole,
    })
}
