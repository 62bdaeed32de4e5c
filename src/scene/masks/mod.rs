//! Alpha masks as geometry: triangles are cut where alpha equals the cutoff, and what is
//! transparent goes. Item buffers, rays, pictures and the path tracer so see the same holes, and a
//! scene without masks costs nothing.
//!
//! The lines of a mask are found and simplified once, in texture space; each triangle is cut along
//! them. Places on an edge depend on that edge alone, and all triangles that share it get them.
//!
//! ```text
//! alpha ─► contours ─► simplify ─► lines ─► clip ─► pieces
//! ```

mod alpha;
mod clip;
mod contours;
mod lines;
mod pieces;
mod simplify;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::assemble::is_degenerate;
use super::{Scene, Triangle, meshes};
use crate::error::{Error, Result};
pub(super) use alpha::DEFAULT_CUTOFF;
pub use alpha::{AlphaMap, AlphaMask};
use clip::{Clip, Clipped, EDGES, Node, STEPS, Shape, at_edge};
use lines::Plane;
use pieces::{Nodes, Outline, is_mostly};

/// Texels by which a line may move when it is simplified.
const TOLERANCE: f64 = 0.5;

/// The same at most, for masks that make too many triangles.
const COARSEST: f64 = 8.0;

/// Segments of lines in all triangles, at most: about as many triangles result.
const MOST: usize = 2_000_000;

/// What cutting leaves.
pub(super) struct Cut {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<Triangle>,
    /// `[triangle]`, the triangle that it was cut from.
    pub from: Vec<u32>,
}

impl Scene {
    /// Cuts out the alpha masks of all materials, which have none afterwards. Reading a scene does
    /// this. A note for each mask says how many triangles there are and what share of the area
    /// went.
    ///
    /// # Errors
    /// Masks that would make more than some two million triangles.
    pub fn cut_masks(&mut self) -> Result<()> {
        if let Some(cut) = cut(self)? {
            self.meshes = meshes::of_cut(&self.meshes, &cut.from);
            (self.vertices, self.triangles) = (cut.vertices, cut.triangles);
        }
        Ok(())
    }
}

/// Cuts the triangles of materials with masks, and takes the masks away; None where there are none.
///
/// # Errors
/// See [`Scene::cut_masks`].
pub(super) fn cut(scene: &mut Scene) -> Result<Option<Cut>> {
    if scene.materials.iter().all(|m| m.alpha_mask.is_none()) {
        return Ok(None);
    }
    let mut tolerance = TOLERANCE;
    let lines = loop {
        if let Some(found) = Clips::new(scene, tolerance) {
            break found;
        }
        tolerance *= 2.0;
        if tolerance > COARSEST {
            return Err(Error::Scene {
                scene: match &scene.path {
                    Some(path) => path.display().to_string(),
                    None => scene.name.clone(),
                },
                what: format!(
                    "alpha masks would cut its triangles to more than {MOST}: use masks with \
                     fewer holes, or that repeat less often"
                ),
            });
        }
    };
    if tolerance > TOLERANCE {
        scene.warnings.push(format!(
            "alpha masks are cut out to {tolerance} texels, not {TOLERANCE}: there would be too \
             many triangles"
        ));
    }
    let cut = Cutting::new(scene, &lines).finish();
    let notes = notes(scene, &cut);
    scene.notes.extend(notes);
    scene.materials.iter_mut().for_each(|m| m.alpha_mask = None);
    Ok(Some(cut))
}

/// The lines in all triangles.
struct Clips {
    /// `[material]`
    planes: Vec<Option<Plane>>,
    /// `[triangle]`; None where no line can be.
    clipped: Vec<Option<Clipped>>,
}

impl Clips {
    /// None where there are too many.
    fn new(scene: &Scene, tolerance: f64) -> Option<Self> {
        let plane = |mask: &AlphaMask| {
            let loops = contours::loops(mask);
            let lines = simplify::simplified(&loops, mask.size(), tolerance);
            Plane::new(mask.size(), lines)
        };
        let masks = scene.materials.par_iter().map(|m| m.alpha_mask.as_ref());
        let planes: Vec<Option<Plane>> = masks.map(|mask| mask.map(plane)).collect();
        let mut count = 0;
        let mut clipped = Vec::with_capacity(scene.triangles.len());
        // In parts, so that what is too much ends soon.
        for part in scene.triangles.chunks(1024) {
            let lines = |t: &Triangle| -> Option<Option<Clipped>> {
                let mask = scene.materials[t.material as usize].alpha_mask.as_ref();
                let plane = planes[t.material as usize].as_ref();
                let (Some(mask), Some(plane)) = (mask, plane) else {
                    return Some(None);
                };
                let clip = Clip::new(mask, plane, &Shape::new(t));
                match plane.is_empty() || clip.is_flat() {
                    true => Some(None),
                    false => clip.lines().map(Some),
                }
            };
            let of_part: Option<Vec<_>> = part.par_iter().map(lines).collect();
            clipped.extend(of_part?);
            let new = clipped[clipped.len() - part.len()..].iter().flatten();
            count += new.map(|of| of.lines.len()).sum::<usize>();
            if count > MOST {
                return None;
            }
        }
        Some(Self { planes, clipped })
    }
}

/// Places on the edges that lines lead through, by their vertices: steps from the lower one.
struct OnEdges(HashMap<[u32; 2], Vec<u32>>);

impl OnEdges {
    fn new(scene: &Scene, clips: &Clips) -> Self {
        // With the steps within which two are one.
        let mut all: HashMap<[u32; 2], Vec<(u32, u32)>> = HashMap::new();
        for (t, clipped) in scene.triangles.iter().zip(&clips.clipped) {
            let mask = scene.materials[t.material as usize].alpha_mask.as_ref();
            let plane = clips.planes[t.material as usize].as_ref();
            let (Some(clipped), Some(mask), Some(plane)) = (clipped, mask, plane) else {
                continue;
            };
            let shape = Shape::new(t);
            let clip = Clip::new(mask, plane, &shape);
            for &(edge, step) in &clipped.on_edges {
                let close = clip.close(edge) / clip.length(edge) * STEPS;
                let key = EDGES[edge].map(|k| shape.vertices[k]);
                all.entry(key).or_default().push((step, close as u32));
            }
        }
        let merged = |mut steps: Vec<(u32, u32)>| {
            steps.sort_unstable();
            let mut kept: Vec<u32> = Vec::new();
            for (step, close) in steps {
                if kept.last().is_none_or(|last| step - last > close) {
                    kept.push(step);
                }
            }
            kept
        };
        Self(
            all.into_iter()
                .map(|(edge, steps)| (edge, merged(steps)))
                .collect(),
        )
    }

    fn of(&self, shape: &Shape, edge: usize) -> &[u32] {
        let key = EDGES[edge].map(|k| shape.vertices[k]);
        self.0.get(&key).map_or(&[], Vec::as_slice)
    }

    /// The node that stands for one: the next of its edge below.
    fn merged(&self, shape: &Shape, node: Node) -> Node {
        let Node::OnEdge(edge, step) = node else {
            return node;
        };
        let known = self.of(shape, edge);
        let at = known.partition_point(|&other| other <= step);
        Node::OnEdge(edge, known[at.saturating_sub(1)])
    }
}

/// What becomes of a triangle.
enum Pieces {
    Whole,
    None,
    /// Corners of pieces that stay: nodes, and their barycentric coordinates.
    Some(Vec<[(Node, DVec2); 3]>),
}

struct Cutting<'a> {
    scene: &'a Scene,
    clips: &'a Clips,
    on_edges: OnEdges,
    cut: Cut,
    /// New vertices by the vertices of their triangle or edge, and the bits of their weights.
    known: HashMap<([u32; 3], [u64; 2]), u32>,
}

impl<'a> Cutting<'a> {
    fn new(scene: &'a Scene, clips: &'a Clips) -> Self {
        Self {
            scene,
            clips,
            on_edges: OnEdges::new(scene, clips),
            cut: Cut {
                vertices: scene.vertices.clone(),
                triangles: Vec::with_capacity(scene.triangles.len()),
                from: Vec::with_capacity(scene.triangles.len()),
            },
            known: HashMap::new(),
        }
    }

    fn finish(mut self) -> Cut {
        let all: Vec<Pieces> = (0..self.scene.triangles.len())
            .into_par_iter()
            .map(|t| self.pieces(t))
            .collect();
        for (t, pieces) in all.into_iter().enumerate() {
            let triangle = self.scene.triangles[t];
            match pieces {
                Pieces::None => {}
                Pieces::Whole => self.push(t, triangle),
                Pieces::Some(pieces) => {
                    let shape = Shape::new(&triangle);
                    for piece in pieces {
                        self.add(t, &shape, piece);
                    }
                }
            }
        }
        self.cut
    }

    fn pieces(&self, t: usize) -> Pieces {
        let triangle = &self.scene.triangles[t];
        let shape = Shape::new(triangle);
        let material = triangle.material as usize;
        let mut nodes = Nodes::default();
        for k in 0..3 {
            nodes.add(Node::Corner(k), at_edge);
        }
        for edge in 0..3 {
            for &step in self.on_edges.of(&shape, edge) {
                nodes.add(Node::OnEdge(edge, step), at_edge);
            }
        }
        let mask = self.scene.materials[material].alpha_mask.as_ref();
        let (Some(mask), Some(plane)) = (mask, &self.clips.planes[material]) else {
            return self.split(nodes, Vec::new(), false, |_| true);
        };
        let clip = Clip::new(mask, plane, &shape);
        let mut lines = Vec::new();
        for line in self.clips.clipped[t].iter().flat_map(|of| &of.lines) {
            let [from, to] = line.map(|node| self.on_edges.merged(&shape, node));
            if !on_one_edge(from, to) {
                lines.push([from, to].map(|node| nodes.add(node, |node| clip.weights(node))));
            }
        }
        let [a, b, c] = clip.corners;
        let opaque = |at: DVec2| mask.is_opaque_at(a + at.x * (b - a) + at.y * (c - a));
        self.split(nodes, lines, clip.turn < 0.0, opaque)
    }

    fn split(
        &self,
        nodes: Nodes,
        lines: Vec<[usize; 2]>,
        is_turned: bool,
        opaque: impl Fn(DVec2) -> bool,
    ) -> Pieces {
        let whole = || match is_mostly([DVec2::ZERO, DVec2::X, DVec2::Y], &opaque) {
            true => Pieces::Whole,
            false => Pieces::None,
        };
        if nodes.list.len() == 3 && lines.is_empty() {
            return whole();
        }
        let outline = Outline {
            nodes: nodes.list,
            lines,
            is_turned,
        };
        let Some(pieces) = outline.opaque_pieces(&opaque) else {
            return whole();
        };
        let pieces = pieces.into_iter();
        Pieces::Some(pieces.map(|of| of.map(|n| outline.nodes[n])).collect())
    }

    /// Adds a piece of a triangle, its corners counter-clockwise in their weights.
    fn add(&mut self, t: usize, shape: &Shape, piece: [(Node, DVec2); 3]) {
        let piece = match shape.is_turned {
            true => [piece[0], piece[2], piece[1]],
            false => piece,
        };
        let triangle = Triangle {
            vertices: piece.map(|(node, at)| self.vertex(shape, node, at)),
            uv: piece.map(|(node, at)| uv_at(&shape.uv, node, at)),
            emission_uv: (shape.emission_uv.as_ref())
                .map(|uv| piece.map(|(node, at)| uv_at(uv, node, at))),
            light_uv: (shape.light_uv.as_ref())
                .map(|uv| piece.map(|(node, at)| uv_at(uv, node, at))),
            material: self.scene.triangles[t].material,
        };
        let corners = triangle.vertices.map(|v| self.cut.vertices[v as usize]);
        if !is_degenerate(corners) {
            self.push(t, triangle);
        }
    }

    fn push(&mut self, t: usize, triangle: Triangle) {
        self.cut.triangles.push(triangle);
        self.cut.from.push(t as u32);
    }

    fn vertex(&mut self, shape: &Shape, node: Node, at: DVec2) -> u32 {
        let place = |k: usize| self.scene.vertices[shape.vertices[k] as usize];
        let (key, found) = match node {
            Node::Corner(k) => return shape.vertices[k],
            Node::OnEdge(edge, step) => {
                let [from, to] = EDGES[edge];
                let ends = [shape.vertices[from], shape.vertices[to]];
                let share = f64::from(step) / STEPS;
                let key = ([ends[0], ends[1], ends[1]], [u64::from(step), 0]);
                (key, place(from).lerp(place(to), share))
            }
            Node::Within(_) => {
                let [a, b, c] = [0, 1, 2].map(place);
                let key = (shape.vertices, at.to_array().map(f64::to_bits));
                (key, a + at.x * (b - a) + at.y * (c - a))
            }
        };
        let vertices = &mut self.cut.vertices;
        *self.known.entry(key).or_insert_with(|| {
            vertices.push(found);
            vertices.len() as u32 - 1
        })
    }
}

/// Whether a line between two nodes lies in an edge, or is none.
fn on_one_edge(from: Node, to: Node) -> bool {
    let edges = |node: Node| match node {
        Node::Corner(k) => [0, 1, 2].map(|e: usize| EDGES[e].contains(&k)),
        Node::OnEdge(edge, _) => [0, 1, 2].map(|e| e == edge),
        Node::Within(_) => [false; 3],
    };
    let (one, other) = (edges(from), edges(to));
    from == to || (0..3).any(|e| one[e] && other[e])
}

fn uv_at(corners: &[[f32; 2]; 3], node: Node, at: DVec2) -> [f32; 2] {
    let uv = |k: usize, i: usize| f64::from(corners[k][i]);
    [0, 1].map(|i| match node {
        Node::Corner(k) => corners[k][i],
        Node::OnEdge(edge, step) => {
            let ([from, to], share) = (EDGES[edge], f64::from(step) / STEPS);
            (uv(from, i) + share * (uv(to, i) - uv(from, i))) as f32
        }
        Node::Within(_) => {
            let own = uv(0, i);
            (own + at.x * (uv(1, i) - own) + at.y * (uv(2, i) - own)) as f32
        }
    })
}

/// What became of the triangles of each material with a mask.
fn notes(scene: &Scene, cut: &Cut) -> Vec<String> {
    #[derive(Clone, Copy, Default)]
    struct Sum {
        count: usize,
        area: f64,
    }
    let sums = |vertices: &[DVec3], triangles: &[Triangle]| {
        let mut sums = vec![Sum::default(); scene.materials.len()];
        for t in triangles {
            let [a, b, c] = t.vertices.map(|v| vertices[v as usize]);
            let sum = &mut sums[t.material as usize];
            sum.count += 1;
            sum.area += 0.5 * (b - a).cross(c - a).length();
        }
        sums
    };
    let before = sums(&scene.vertices, &scene.triangles);
    let after = sums(&cut.vertices, &cut.triangles);
    let materials = scene.materials.iter().zip(before.iter().zip(&after));
    materials
        .filter(|(material, (before, _))| material.alpha_mask.is_some() && before.count > 0)
        .map(|(material, (before, after))| {
            format!(
                "material \"{}\": its alpha mask makes {} triangles of {} and takes away {:.1} % of \
                 their area",
                material.name,
                after.count,
                before.count,
                100.0 * (1.0 - after.area / before.area)
            )
        })
        .collect()
}
