//! Relief turned into geometry: the high-poly baseline for comparisons of light on relief.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::assemble::is_degenerate;
use super::{HeightMap, Material, Scene, Triangle};
use crate::error::{Error, Result};

/// Most rounds of halving: they reduce an edge of 2³² texels to one.
const MOST_ROUNDS: u32 = 32;

/// Most triangles: the path tracer takes about 10 GiB for them.
const MOST_TRIANGLES: usize = 1 << 25;

/// Coordinates that differ by whole repeats, each rounded to f32, are the same place.
const SAME_PLACE: f64 = 1e-6;

/// A scene in which every triangle with relief is refined to the texels of its height map and
/// displaced, without its relief maps.
///
/// An edge is halved until it spans at most one texel, in that of its two triangles where it spans
/// more; the triangles are cut to match, without T-junctions. A vertex moves along the smooth
/// normal of the original triangles with relief (weighted by area) by the height above the map's
/// mean; where texture coordinates meet in a seam, by the mean of their heights. Vertices shared
/// with triangles without relief stay where they are: these triangles keep their shape and are cut
/// only along such edges. Triangles left without area are dropped and counted.
///
/// # Errors
/// [`Error::Usage`]: more than 2²⁵ triangles.
pub fn displace(scene: &Scene) -> Result<Scene> {
    let mut work = Refined::new(scene);
    work.check_count(work.least_count())?;
    for _ in 0..MOST_ROUNDS {
        if !work.refine()? {
            break;
        }
    }
    Ok(work.into_scene(scene))
}

/// A triangle under refinement, with coordinates not yet rounded.
#[derive(Clone, Copy)]
struct Piece {
    vertices: [u32; 3],
    uv: [DVec2; 3],
    emission_uv: Option<[DVec2; 3]>,
    material: u32,
}

/// A corner of a new triangle: its vertex, and its texture coordinates as in [`Piece`].
type Corner = (u32, DVec2, Option<DVec2>);

fn doubles(uv: [[f32; 2]; 3]) -> [DVec2; 3] {
    uv.map(|uv| DVec2::from(uv.map(f64::from)))
}

fn floats(uv: [DVec2; 3]) -> [[f32; 2]; 3] {
    uv.map(|uv| uv.as_vec2().to_array())
}

struct Relief {
    map: Arc<HeightMap>,
    mean: f64,
    /// Scene units for a value of 1.
    scale: f64,
}

impl Relief {
    fn of(material: &Material) -> Option<Self> {
        let map = material
            .map_height
            .clone()
            .filter(|_| material.has_relief())?;
        Some(Self {
            mean: map.mean(),
            scale: f64::from(material.height_scale),
            map,
        })
    }

    /// Length in texels of an edge in texture space.
    fn texels(&self, from: DVec2, to: DVec2) -> f64 {
        ((to - from) * DVec2::new(f64::from(self.map.width), f64::from(self.map.height))).length()
    }

    /// Height above the mesh's own surface, scene units.
    fn height(&self, uv: DVec2) -> f64 {
        self.scale * (self.map.sample(uv.x, uv.y) - self.mean)
    }
}

struct Refined {
    /// `[material]`.
    reliefs: Vec<Option<Relief>>,
    vertices: Vec<DVec3>,
    /// Smooth unit normals; zero where there is no relief or where the normals cancel.
    normals: Vec<DVec3>,
    pieces: Vec<Piece>,
    /// Edges between triangles with and without relief, the lower vertex first.
    fixed_edges: HashSet<[u32; 2]>,
    /// Vertices of triangles without relief and of such edges.
    fixed: HashSet<u32>,
}

impl Refined {
    fn new(scene: &Scene) -> Self {
        let reliefs: Vec<Option<Relief>> = scene.materials.iter().map(Relief::of).collect();
        let (mut beside_relief, mut beside_flat) = (HashSet::new(), HashSet::new());
        let mut fixed = HashSet::new();
        for triangle in &scene.triangles {
            let raised = reliefs[triangle.material as usize].is_some();
            let edges = match raised {
                true => &mut beside_relief,
                false => {
                    fixed.extend(triangle.vertices);
                    &mut beside_flat
                }
            };
            edges.extend(edges_of(triangle.vertices).map(|[a, b]| sorted(a, b)));
        }
        Self {
            fixed_edges: beside_relief.intersection(&beside_flat).copied().collect(),
            fixed,
            reliefs,
            vertices: scene.vertices.clone(),
            normals: relief_normals(scene),
            pieces: scene
                .triangles
                .iter()
                .map(|t| Piece {
                    vertices: t.vertices,
                    uv: doubles(t.uv),
                    emission_uv: t.emission_uv.map(doubles),
                    material: t.material,
                })
                .collect(),
        }
    }

    /// No triangle whose edges are at most a texel long is larger than the equilateral one.
    fn least_count(&self) -> f64 {
        let largest = 0.75_f64.sqrt() / 2.0;
        let texels = |piece: &Piece| {
            let map = &self.reliefs[piece.material as usize].as_ref()?.map;
            let [a, b, c] = piece.uv;
            let area = (b - a).perp_dot(c - a).abs() / 2.0;
            Some(area * f64::from(map.width) * f64::from(map.height))
        };
        self.pieces.iter().filter_map(texels).sum::<f64>() / largest
    }

    fn check_count(&self, count: f64) -> Result<()> {
        if count <= MOST_TRIANGLES as f64 {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "the relief as geometry takes more than {MOST_TRIANGLES} triangles, two or more for \
             each texel on the surfaces: use smaller height maps"
        )))
    }

    /// Halves every edge that is longer than a texel once. Returns false if there was none.
    fn refine(&mut self) -> Result<bool> {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        for piece in &self.pieces {
            let Some(relief) = &self.reliefs[piece.material as usize] else {
                continue;
            };
            for (k, [a, b]) in edges_of(piece.vertices).into_iter().enumerate() {
                let key = sorted(a, b);
                if relief.texels(piece.uv[k], piece.uv[(k + 1) % 3]) <= 1.0
                    || middles.contains_key(&key)
                {
                    continue;
                }
                let middle = self.vertices.len() as u32;
                middles.insert(key, middle);
                let halfway = |of: &[DVec3]| of[a as usize] + of[b as usize];
                let place = halfway(&self.vertices) / 2.0;
                let normal = halfway(&self.normals).normalize_or_zero();
                self.vertices.push(place);
                self.normals.push(normal);
                if self.fixed_edges.contains(&key) {
                    self.fixed.insert(middle);
                    self.fixed_edges.insert(sorted(a, middle));
                    self.fixed_edges.insert(sorted(middle, b));
                }
            }
        }
        if middles.is_empty() {
            return Ok(false);
        }
        // An edge within a surface lies in two triangles, each of which becomes one more.
        self.check_count((self.pieces.len() + 2 * middles.len()) as f64)?;
        let pieces = std::mem::take(&mut self.pieces);
        for piece in pieces {
            self.split(piece, &middles);
        }
        Ok(true)
    }

    /// Cuts a triangle at the middles of its halved edges, into two, three or four.
    fn split(&mut self, piece: Piece, middles: &HashMap<[u32; 2], u32>) {
        let middle = edges_of(piece.vertices).map(|[a, b]| middles.get(&sorted(a, b)).copied());
        let corner = |k: usize| -> Corner {
            let k = k % 3;
            (
                piece.vertices[k],
                piece.uv[k],
                piece.emission_uv.map(|uv| uv[k]),
            )
        };
        let half = |k: usize, vertex| -> Corner {
            let middle = |uv: [DVec2; 3]| (uv[k % 3] + uv[(k + 1) % 3]) / 2.0;
            (vertex, middle(piece.uv), piece.emission_uv.map(middle))
        };
        let mut push = |corners: [Corner; 3]| {
            self.pieces.push(Piece {
                vertices: corners.map(|c| c.0),
                uv: corners.map(|c| c.1),
                // All corners have one, or none has.
                emission_uv: (piece.emission_uv).map(|_| corners.map(|c| c.2.unwrap_or(c.1))),
                material: piece.material,
            });
        };
        // Rotated so that the pattern begins with the middle of edge k.
        let turned = |k: usize| [0, 1, 2].map(|i| middle[(k + i) % 3]);
        for k in 0..3 {
            match turned(k) {
                [Some(m), None, None] => {
                    let m = half(k, m);
                    push([corner(k), m, corner(k + 2)]);
                    push([m, corner(k + 1), corner(k + 2)]);
                    return;
                }
                [Some(m), Some(n), None] => {
                    let (m, n) = (half(k, m), half(k + 1, n));
                    push([m, corner(k + 1), n]);
                    // The remaining quad is cut along its shorter diagonal; ties are broken by
                    // index, the same on every run.
                    let place = |c: Corner| self.vertices[c.0 as usize];
                    let (a, c) = (corner(k), corner(k + 2));
                    if place(a).distance_squared(place(n)) <= place(m).distance_squared(place(c)) {
                        push([a, m, n]);
                        push([a, n, c]);
                    } else {
                        push([a, m, c]);
                        push([m, n, c]);
                    }
                    return;
                }
                [Some(m), Some(n), Some(o)] => {
                    let (m, n, o) = (half(k, m), half(k + 1, n), half(k + 2, o));
                    push([corner(k), m, o]);
                    push([m, corner(k + 1), n]);
                    push([o, n, corner(k + 2)]);
                    push([m, n, o]);
                    return;
                }
                _ => {}
            }
        }
        self.pieces.push(piece);
    }

    fn into_scene(self, scene: &Scene) -> Scene {
        let vertices = self.displaced();
        let mut result = Scene {
            materials: scene.materials.iter().map(without_relief).collect(),
            triangles: Vec::with_capacity(self.pieces.len()),
            vertices,
            meshes: Vec::new(),
            ..scene.clone()
        };
        for piece in &self.pieces {
            let corners = piece.vertices.map(|v| result.vertices[v as usize]);
            if is_degenerate(corners) {
                result.dropped_degenerate += 1;
                continue;
            }
            result.triangles.push(Triangle {
                vertices: piece.vertices,
                uv: floats(piece.uv),
                emission_uv: piece.emission_uv.map(floats),
                light_uv: None,
                material: piece.material,
            });
        }
        result
    }

    fn displaced(&self) -> Vec<DVec3> {
        // Each height counts once for a place in texture space, for any number of triangles that
        // meet there.
        let mut heights: Vec<Vec<(u32, DVec2, f64)>> = vec![Vec::new(); self.vertices.len()];
        for piece in &self.pieces {
            let Some(relief) = &self.reliefs[piece.material as usize] else {
                continue;
            };
            for (vertex, uv) in piece.vertices.into_iter().zip(piece.uv) {
                let known = &mut heights[vertex as usize];
                let same = |&(material, at, _): &(u32, DVec2, f64)| {
                    let apart = uv - at;
                    material == piece.material
                        && (apart - apart.round()).abs().max_element() < SAME_PLACE
                };
                if !known.iter().any(same) {
                    known.push((piece.material, uv, relief.height(uv)));
                }
            }
        }
        let moved = |(index, place): (usize, &DVec3)| {
            let heights = &heights[index];
            if heights.is_empty() || self.fixed.contains(&(index as u32)) {
                return *place;
            }
            let mean = heights.iter().map(|h| h.2).sum::<f64>() / heights.len() as f64;
            *place + self.normals[index] * mean
        };
        self.vertices.iter().enumerate().map(moved).collect()
    }
}

/// Direction in which each vertex is displaced, `[vertex]`: the smooth unit normal of the triangles
/// with relief about it, weighted by area; zero where there are none or where they cancel.
pub fn relief_normals(scene: &Scene) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; scene.vertices.len()];
    for triangle in &scene.triangles {
        if scene.materials[triangle.material as usize].has_relief() {
            let [a, b, c] = scene.corners(triangle);
            for vertex in triangle.vertices {
                normals[vertex as usize] += (b - a).cross(c - a);
            }
        }
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}

fn without_relief(material: &Material) -> Material {
    Material {
        map_height: None,
        height_scale: Material::default().height_scale,
        map_normal: None,
        ..material.clone()
    }
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
