//! The texels of a light map, and where they lie on the surface.

use std::collections::HashMap;

use glam::DVec2;

use super::surface::Surface;

/// A texel that a chart covers, or that interpolation over a chart reads.
#[derive(Debug, Clone, Copy)]
pub struct Texel {
    /// Column and row in its page.
    pub at: [u32; 2],
    pub page: u32,
    pub triangle: u32,
    /// Barycentric coordinates of the place nearest to the texel's middle; of one outside the
    /// chart, 0.05 texels within.
    pub weights: [f64; 3],
    /// From the middle to that place, texels; 0 within the chart.
    pub distance: f64,
}

/// No texel is there.
pub const NOTHING: u32 = u32::MAX;

/// Texels of all pages.
pub struct TexelMap {
    pub texels: Vec<Texel>,
    /// Index of a texel, `[page][row][column]`, or [`NOTHING`].
    pub index: Vec<u32>,
    pub width: u32,
    pub height: u32,
}

/// Places at the edge of a chart are this far within it, texels: at the edge itself they would lie
/// in the plane of the surface that begins there, and see nothing of it.
const INSET: f64 = 0.05;

/// Interpolation at a place reads texels whose middles are less than one texel off each way.
pub(super) const REACH: f64 = std::f64::consts::SQRT_2;

impl TexelMap {
    pub fn new(surface: &Surface) -> Self {
        let pages = surface.pages;
        let (width, height) = (pages.width, pages.height);
        let mut map = Self {
            texels: Vec::new(),
            index: vec![NOTHING; width as usize * height as usize * pages.count as usize],
            width,
            height,
        };
        for (t, page) in surface.page.iter().enumerate() {
            if let Some(page) = *page {
                map.cover(surface, t, page);
            }
        }
        map
    }

    /// Adds what a triangle covers; a texel between two belongs to the one that is nearer.
    fn cover(&mut self, surface: &Surface, t: usize, page: u32) {
        let corners = [0, 1, 2].map(|k| surface.texel(t, k));
        for [x, y] in texels_about(corners, self.width, self.height) {
            let middle = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (weights, distance) = nearest(corners, middle);
            if distance >= REACH {
                continue;
            }
            let weights = match distance > 0.0 {
                true => inset(corners, weights),
                false => weights,
            };
            let texel = Texel {
                at: [x, y],
                page,
                triangle: t as u32,
                weights,
                distance,
            };
            let slot = self.slot(page, x, y);
            match self.index[slot] {
                NOTHING => {
                    self.index[slot] = self.texels.len() as u32;
                    self.texels.push(texel);
                }
                known => {
                    let known = &mut self.texels[known as usize];
                    if distance < known.distance {
                        *known = texel;
                    }
                }
            }
        }
    }

    fn slot(&self, page: u32, x: u32, y: u32) -> usize {
        (page as usize * self.height as usize + y as usize) * self.width as usize + x as usize
    }

    /// Index of the texel at a column and a row, which may lie outside of the page.
    pub fn find(&self, page: u32, x: i64, y: i64) -> Option<usize> {
        let inside = |at: i64, most: u32| (0..i64::from(most)).contains(&at);
        if !inside(x, self.width) || !inside(y, self.height) {
            return None;
        }
        let found = self.index[self.slot(page, x as u32, y as u32)];
        (found != NOTHING).then_some(found as usize)
    }

    /// The four texels between which a place of a page lies, and their weights.
    pub fn between(&self, page: u32, at: DVec2) -> [(Option<usize>, f64); 4] {
        let corner = (at - 0.5).floor();
        let part = at - 0.5 - corner;
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let along = |step: i32, part: f64| if step == 0 { 1.0 - part } else { part };
            let found = self.find(
                page,
                corner.x as i64 + i64::from(i),
                corner.y as i64 + i64::from(j),
            );
            (found, along(i, part.x) * along(j, part.y))
        })
    }
}

/// Columns and rows of the texels that interpolation over a triangle may read, and more.
pub(super) fn texels_about(
    corners: [DVec2; 3],
    width: u32,
    height: u32,
) -> impl Iterator<Item = [u32; 2]> {
    let [a, b, c] = corners;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let range = |low: f64, high: f64, most: u32| {
        let first = (low - REACH - 0.5).ceil().max(0.0) as u32;
        let last = (high + REACH - 0.5).floor().min(f64::from(most) - 1.0);
        first..=last.max(0.0) as u32
    };
    let columns = range(low.x, high.x, width);
    range(low.y, high.y, height).flat_map(move |y| columns.clone().map(move |x| [x, y]))
}

/// The place of a triangle nearest to a point, as barycentric coordinates, and its distance.
pub(super) fn nearest([a, b, c]: [DVec2; 3], p: DVec2) -> ([f64; 3], f64) {
    let cross = |u: DVec2, v: DVec2| u.perp_dot(v);
    let area = cross(b - a, c - a);
    if area.abs() > 0.0 {
        let weights = [
            cross(b - p, c - p),
            cross(c - p, a - p),
            cross(a - p, b - p),
        ];
        let weights = weights.map(|w| w / area);
        if weights.iter().all(|&w| w >= 0.0) {
            return (weights, 0.0);
        }
    }
    let corners = [a, b, c];
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    for k in 0..3 {
        let next = (k + 1) % 3;
        let side = corners[next] - corners[k];
        let square = side.length_squared();
        let along = match square > 0.0 {
            true => ((p - corners[k]).dot(side) / square).clamp(0.0, 1.0),
            false => 0.0,
        };
        let distance = p.distance(corners[k] + along * side);
        if distance < best.1 {
            let mut weights = [0.0; 3];
            weights[k] = 1.0 - along;
            weights[next] = along;
            best = (weights, distance);
        }
    }
    best
}

/// Moved towards the middle of the triangle, by [`INSET`] away from its sides.
fn inset([a, b, c]: [DVec2; 3], weights: [f64; 3]) -> [f64; 3] {
    let area = 0.5 * (b - a).perp_dot(c - a).abs();
    let radius = 2.0 * area / (a.distance(b) + b.distance(c) + c.distance(a)).max(1e-30);
    let share = (INSET / radius.max(1e-30)).min(0.5);
    weights.map(|w| w + share * (1.0 / 3.0 - w))
}

/// Triangles of a surface whose edges end a chart: `(triangle, edge)`, from each corner to the
/// next.
pub fn borders(surface: &Surface) -> Vec<(usize, usize)> {
    let key = |t: usize, k: usize| {
        let uv = surface.uv[t][k];
        (surface.page[t], uv.x.to_bits(), uv.y.to_bits())
    };
    let mut count: HashMap<_, u32> = HashMap::new();
    let edge = |t: usize, k: usize| {
        let (one, other) = (key(t, k), key(t, (k + 1) % 3));
        if one < other {
            (one, other)
        } else {
            (other, one)
        }
    };
    let with_page = || (0..surface.page.len()).filter(|&t| surface.page[t].is_some());
    let edges = || with_page().flat_map(|t| (0..3).map(move |k| (t, k)));
    for (t, k) in edges() {
        *count.entry(edge(t, k)).or_default() += 1;
    }
    edges().filter(|&(t, k)| count[&edge(t, k)] == 1).collect()
}

/// Barycentric coordinates of the place beside a point of an edge, from corner `k` on.
pub fn beside_edge(surface: &Surface, t: usize, k: usize, along: f64) -> [f64; 3] {
    let mut weights = [0.0; 3];
    weights[k] = 1.0 - along;
    weights[(k + 1) % 3] = along;
    let corners = [0, 1, 2].map(|k| surface.texel(t, k));
    inset(corners, weights)
}

/// The middle of a texel's part of the surface in the four quarters of the texel.
pub fn quarters(surface: &Surface, texel: &Texel) -> [[f64; 3]; 4] {
    let t = texel.triangle as usize;
    let corners = [0, 1, 2].map(|k| surface.texel(t, k));
    let [x, y] = texel.at.map(f64::from);
    [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)].map(|(i, j)| {
        let (weights, distance) = nearest(corners, DVec2::new(x + i, y + j));
        match distance > 0.0 {
            true => inset(corners, weights),
            false => weights,
        }
    })
}
