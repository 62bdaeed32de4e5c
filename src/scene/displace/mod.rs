//! Relief turned into geometry: the high-poly baseline for comparisons of light on relief.

mod cells;

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DVec2, DVec3};

use self::cells::{ON_LINE, Point, cells};
use super::assemble::is_degenerate;
use super::{HeightMap, Material, Scene, Triangle};
use crate::error::{Error, Result};

/// Most triangles: the path tracer takes about 10 GiB for them.
const MOST_TRIANGLES: usize = 1 << 25;

/// Coordinates that differ by whole repeats, each rounded to f32, are the same place.
const SAME_PLACE: f64 = 1e-6;

/// A scene in which every triangle with relief is cut along the cells of its height map and
/// displaced, without its relief maps.
///
/// A cell lies between the centres of four texels; the map is bilinear over it. Its middle is a
/// vertex too, so that a whole cell becomes four triangles. Triangles that meet in an edge are cut
/// at the same places of it, without T-junctions. A vertex moves along the smooth normal of the
/// original triangles with relief (weighted by area) by the height above the map's mean; where
/// texture coordinates meet in a seam, by the mean of their heights. Vertices shared with triangles
/// without relief stay where they are: these triangles keep their shape and are cut only along such
/// edges. Triangles left without area are dropped and counted.
///
/// # Errors
/// [`Error::Usage`]: more than 2²⁵ triangles.
pub fn displace(scene: &Scene) -> Result<Scene> {
    let reliefs: Vec<Option<Relief>> = scene.materials.iter().map(Relief::of).collect();
    check_count(least_count(scene, &reliefs))?;
    let mut fine = Fine::new(scene, &reliefs)?;
    for triangle in &scene.triangles {
        fine.cut(triangle)?;
    }
    Ok(fine.into_scene())
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

fn check_count(count: f64) -> Result<()> {
    if count <= MOST_TRIANGLES as f64 {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "the relief as geometry takes more than {MOST_TRIANGLES} triangles, four for each texel on \
         the surfaces: use smaller height maps"
    )))
}

/// Of the triangles that a part of a cell becomes, none is larger than half a cell.
fn least_count(scene: &Scene, reliefs: &[Option<Relief>]) -> f64 {
    let cells = |triangle: &Triangle| {
        let relief = reliefs[triangle.material as usize].as_ref()?;
        let [a, b, c] = triangle.uv.map(|uv| relief.cells(doubles(uv)));
        Some((b - a).perp_dot(c - a).abs() / 2.0)
    };
    2.0 * scene.triangles.iter().filter_map(cells).sum::<f64>()
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

    /// A place in texture space in cells of the map: centres of texels have whole coordinates.
    fn cells(&self, uv: DVec2) -> DVec2 {
        uv * DVec2::new(f64::from(self.map.width), f64::from(self.map.height)) - 0.5
    }

    /// Height above the mesh's own surface, scene units.
    fn height(&self, uv: DVec2) -> f64 {
        self.scale * (self.map.sample(uv.x, uv.y) - self.mean)
    }
}

/// A place on an edge: its share of the way from the lower vertex to the higher, and its vertex.
type Knot = (f64, u32);

/// What is known of a vertex on an original edge.
#[derive(Default, Clone)]
struct OnEdge {
    normal: DVec3,
    /// Touches triangles without relief.
    fixed: bool,
    /// Each height counts once for a place in texture space, for any number of triangles that meet
    /// there: material, texture coordinates, height.
    heights: Vec<(u32, DVec2, f64)>,
}

/// The scene under construction.
struct Fine<'a> {
    scene: &'a Scene,
    reliefs: &'a [Option<Relief>],
    /// Of the original vertices, `[vertex]`.
    normals: Vec<DVec3>,
    /// `[edge]`, the lower vertex first; in ascending order.
    knots: HashMap<[u32; 2], Vec<Knot>>,
    /// Original vertices, knots, and vertices within triangles, which are displaced already.
    vertices: Vec<DVec3>,
    /// `[vertex]` of the original vertices and knots.
    on_edges: Vec<OnEdge>,
    triangles: Vec<Triangle>,
}

impl<'a> Fine<'a> {
    fn new(scene: &'a Scene, reliefs: &'a [Option<Relief>]) -> Result<Self> {
        let normals = relief_normals(scene);
        let mut fixed = HashSet::new();
        let mut flat_edges = HashSet::new();
        for triangle in &scene.triangles {
            if reliefs[triangle.material as usize].is_none() {
                fixed.extend(triangle.vertices);
                flat_edges.extend(edges_of(triangle.vertices).map(|[a, b]| sorted(a, b)));
            }
        }
        let on_edge = |(vertex, &normal): (usize, &DVec3)| OnEdge {
            normal,
            fixed: fixed.contains(&(vertex as u32)),
            heights: Vec::new(),
        };
        let mut fine = Self {
            scene,
            reliefs,
            on_edges: normals.iter().enumerate().map(on_edge).collect(),
            normals,
            knots: HashMap::new(),
            vertices: scene.vertices.clone(),
            triangles: Vec::new(),
        };
        for of in fine.crossings()? {
            let edge = of.edge;
            let knots = fine.knots_of(of, flat_edges.contains(&edge));
            fine.knots.insert(edge, knots);
        }
        Ok(fine)
    }

    /// Where the edges of triangles with relief cross the lines between cells; in the order of the
    /// input, so that vertices have the same numbers in every run.
    fn crossings(&self) -> Result<Vec<Crossings>> {
        let mut places = HashMap::new();
        let mut crossings: Vec<Crossings> = Vec::new();
        let mut count = 0.0;
        for triangle in &self.scene.triangles {
            let Some(relief) = &self.reliefs[triangle.material as usize] else {
                continue;
            };
            let at = triangle.uv.map(|uv| relief.cells(doubles(uv)));
            for (k, [a, b]) in edges_of(triangle.vertices).into_iter().enumerate() {
                let ends = [at[k], at[(k + 1) % 3]];
                let [from, to] = if a < b { ends } else { [ends[1], ends[0]] };
                let along = to - from;
                count += along.abs().element_sum();
                check_count(count)?;
                let place = *places.entry(sorted(a, b)).or_insert_with(|| {
                    crossings.push(Crossings {
                        edge: sorted(a, b),
                        ..Crossings::default()
                    });
                    crossings.len() - 1
                });
                let edge = &mut crossings[place];
                edge.length = edge.length.max(along.length());
                for axis in 0..2 {
                    let [low, high] = [from[axis].min(to[axis]), from[axis].max(to[axis])];
                    let lines = low.ceil() as i64..=high.floor() as i64;
                    let share = |line: i64| (line as f64 - from[axis]) / along[axis];
                    edge.shares
                        .extend(lines.map(share).filter(|share| share.is_finite()));
                }
            }
        }
        Ok(crossings)
    }

    /// Makes a vertex for the crossings of an edge that are not too near to one another.
    fn knots_of(&mut self, of: Crossings, fixed: bool) -> Vec<Knot> {
        let [a, b] = of.edge;
        let near = ON_LINE / 2.0 / of.length;
        let mut shares = of.shares;
        shares.sort_by(f64::total_cmp);
        let mut last = 0.0;
        shares.retain(|&share| {
            let apart = share - last > near && 1.0 - share > near;
            if apart {
                last = share;
            }
            apart
        });
        let knot = |share: f64| {
            let between = |of: &[DVec3]| of[a as usize].lerp(of[b as usize], share);
            let vertex = self.vertices.len() as u32;
            self.vertices.push(between(&self.scene.vertices));
            self.on_edges.push(OnEdge {
                normal: between(&self.normals).normalize_or_zero(),
                fixed,
                heights: Vec::new(),
            });
            (share, vertex)
        };
        shares.into_iter().map(knot).collect()
    }

    /// The corners of a triangle and the knots of its edges, in turn.
    fn outline(&self, triangle: &Triangle) -> Vec<(u32, DVec3)> {
        let mut outline = Vec::new();
        for (k, [a, b]) in edges_of(triangle.vertices).into_iter().enumerate() {
            let [from, to] = [k, (k + 1) % 3].map(|k| DVec3::AXES[k]);
            outline.push((a, from));
            let knots = self.knots.get(&sorted(a, b)).map_or(&[][..], Vec::as_slice);
            if a < b {
                outline.extend(knots.iter().map(|&(s, v)| (v, from.lerp(to, s))));
            } else {
                outline.extend(knots.iter().rev().map(|&(s, v)| (v, to.lerp(from, s))));
            }
        }
        outline
    }

    fn cut(&mut self, triangle: &Triangle) -> Result<()> {
        let outline = self.outline(triangle);
        if outline.len() == 3 && self.reliefs[triangle.material as usize].is_none() {
            self.triangles.push(Triangle {
                light_uv: None,
                ..*triangle
            });
            return Ok(());
        }
        let uv = triangle.uv.map(doubles);
        let emission_uv = triangle.emission_uv.map(|uv| uv.map(doubles));
        let relief = self.reliefs[triangle.material as usize].as_ref();
        let point = |(vertex, weights): (u32, DVec3)| Point {
            vertex,
            at: relief.map_or(DVec2::ZERO, |r| r.cells(weighted(uv, weights))),
            weights,
        };
        let outline: Vec<Point> = outline.into_iter().map(point).collect();
        if let Some(relief) = relief {
            for point in &outline {
                let at = weighted(uv, point.weights);
                self.on_edges[point.vertex as usize].add(triangle.material, at, relief);
            }
        }
        let corners = self.scene.corners(triangle);
        let normals = triangle.vertices.map(|v| self.normals[v as usize]);
        let vertices = &mut self.vertices;
        let mut within = |weights: DVec3| {
            let normal = (0..3)
                .map(|k| normals[k] * weights[k])
                .sum::<DVec3>()
                .normalize_or_zero();
            let place: DVec3 = (0..3).map(|k| corners[k] * weights[k]).sum();
            let height = relief.map_or(0.0, |r| r.height(weighted(uv, weights)));
            vertices.push(place + normal * height);
            vertices.len() as u32 - 1
        };
        let parts = match relief {
            Some(_) => cells(outline, &mut within),
            None => vec![outline],
        };
        let triangles = &mut self.triangles;
        let mut push = |points: [Point; 3]| {
            let at = |of| points.map(|p| weighted(of, p.weights).as_vec2().to_array());
            triangles.push(Triangle {
                vertices: points.map(|p| p.vertex),
                uv: at(uv),
                emission_uv: emission_uv.map(at),
                light_uv: None,
                material: triangle.material,
            });
        };
        for part in parts {
            if let Ok(whole) = <[Point; 3]>::try_from(part.as_slice()) {
                push(whole);
                continue;
            }
            let weights = part.iter().map(|p| p.weights).sum::<DVec3>() / part.len() as f64;
            let middle = Point {
                vertex: within(weights),
                at: DVec2::ZERO,
                weights,
            };
            for k in 0..part.len() {
                push([part[k], part[(k + 1) % part.len()], middle]);
            }
        }
        check_count(self.triangles.len() as f64)
    }

    fn into_scene(mut self) -> Scene {
        for (place, on_edge) in self.vertices.iter_mut().zip(&self.on_edges) {
            *place += on_edge.offset();
        }
        let mut dropped = self.scene.dropped_degenerate;
        let vertices = &self.vertices;
        self.triangles.retain(|triangle| {
            let degenerate = is_degenerate(triangle.vertices.map(|v| vertices[v as usize]));
            dropped += usize::from(degenerate);
            !degenerate
        });
        Scene {
            materials: self.scene.materials.iter().map(without_relief).collect(),
            triangles: self.triangles,
            vertices: self.vertices,
            meshes: Vec::new(),
            dropped_degenerate: dropped,
            ..self.scene.clone()
        }
    }
}

/// Where an edge crosses the lines between cells.
#[derive(Default)]
struct Crossings {
    /// The lower vertex first.
    edge: [u32; 2],
    /// Of the way from its lower vertex to its higher.
    shares: Vec<f64>,
    /// In cells, the greatest of its triangles.
    length: f64,
}

impl OnEdge {
    fn add(&mut self, material: u32, uv: DVec2, relief: &Relief) {
        let same = |&(of, at, _): &(u32, DVec2, f64)| {
            let apart = uv - at;
            of == material && (apart - apart.round()).abs().max_element() < SAME_PLACE
        };
        if !self.heights.iter().any(same) {
            self.heights.push((material, uv, relief.height(uv)));
        }
    }

    fn offset(&self) -> DVec3 {
        if self.heights.is_empty() || self.fixed {
            return DVec3::ZERO;
        }
        let sum: f64 = self.heights.iter().map(|h| h.2).sum();
        self.normal * (sum / self.heights.len() as f64)
    }
}

fn doubles(uv: [f32; 2]) -> DVec2 {
    DVec2::from(uv.map(f64::from))
}

/// The value at a place of a triangle.
fn weighted(of: [DVec2; 3], weights: DVec3) -> DVec2 {
    (0..3).map(|k| of[k] * weights[k]).sum()
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
