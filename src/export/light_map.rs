//! Light at the texels of a light map.
//!
//! Direct light is found at each texel. Indirect light is found on a coarse lattice of each chart,
//! and on finer ones where it was not what the coarser ones let expect. Texels beneath what stands
//! on the surface are dark, but for those beside others: these take their light, so that no
//! darkness runs out from under.

use glam::Vec3;

use super::borders;
use super::lattice::{BESIDE, Lattice, neighbour, too_early};
use super::surface::{Pages, Surface};
use super::texels::{Texel, TexelMap, quarters};
use crate::error::Result;
use crate::solver::{LightAt, Lit, Place};

/// Light at the texels of all pages.
pub struct LightMap {
    pub pages: Pages,
    pub map: TexelMap,
    /// `[texel]` of `map`.
    pub light: Vec<LightAt>,
    /// Places at which direct light or all light was found.
    pub looked_at: usize,
    /// Whether it was stopped: finer lattices are then interpolated.
    pub stopped: bool,
    /// Texels that lie beneath what stands on their surface, `[texel]`.
    pub(super) covered: Vec<bool>,
}

/// A difference from what was expected counts from this share of the light at a texel, and this
/// share of the mean light, on.
const UNEXPECTED: [f32; 2] = [0.004, 0.001];

/// Texels whose direct light differs from a neighbour's by more than this share of the larger are
/// looked at in four places.
const EDGE: f32 = 0.02;

/// Places that are looked at between two calls of `go_on`.
const AT_ONCE: usize = 2048;

/// Looks at places, and is stopped between.
pub(super) struct Looking<'a> {
    pub lit: &'a Lit<'a>,
    /// Called with what was looked at so far; false stops.
    pub go_on: &'a dyn Fn(usize) -> bool,
    pub looked_at: usize,
    pub stopped: bool,
}

impl Looking<'_> {
    /// Of as many places as there is time for.
    pub fn at(&mut self, places: &[Place]) -> Result<Vec<LightAt>> {
        let lit = self.lit;
        self.each(places, |some| lit.at(some))
    }

    pub fn direct(&mut self, places: &[Place]) -> Result<Vec<Vec3>> {
        let lit = self.lit;
        self.each(places, |some| lit.direct_at(some))
    }

    fn each<T>(
        &mut self,
        places: &[Place],
        find: impl Fn(&[Place]) -> Result<Vec<T>>,
    ) -> Result<Vec<T>> {
        let mut found = Vec::with_capacity(places.len());
        for some in places.chunks(AT_ONCE) {
            if self.stopped {
                break;
            }
            found.extend(find(some)?);
            self.looked_at += some.len();
            self.stopped = !(self.go_on)(self.looked_at);
        }
        Ok(found)
    }
}

impl LightMap {
    /// `go_on` is called with how many places have been looked at; false stops, and the finer
    /// lattices of indirect light are then interpolated.
    ///
    /// # Errors
    /// Stopped before the lattices that are looked at as a whole.
    pub fn new(surface: &Surface, lit: &Lit<'_>, go_on: &dyn Fn(usize) -> bool) -> Result<Self> {
        let mut map = TexelMap::new(surface);
        let mut looking = Looking {
            lit,
            go_on,
            looked_at: 0,
            stopped: false,
        };
        let covered = covered(surface, &mut map, lit)?;
        let direct = direct(surface, &map, &covered, &mut looking)?;
        let indirect = indirect(surface, &map, &covered, &mut looking)?;
        let mut light: Vec<LightAt> = (direct.into_iter().zip(indirect))
            .map(|(direct, indirect)| LightAt { direct, indirect })
            .collect();
        uncover(surface, &map, &covered, &mut light);
        borders::fit(surface, &map, &mut looking, &mut light)?;
        Ok(Self {
            pages: surface.pages,
            map,
            light,
            looked_at: looking.looked_at,
            stopped: looking.stopped,
            covered,
        })
    }
}

fn place(surface: &Surface, texel: &Texel) -> Place {
    surface.place(texel.triangle as usize, texel.weights)
}

/// Whether all of a texel is covered, `[texel]`. One whose middle is covered is looked at in
/// another place.
fn covered(surface: &Surface, map: &mut TexelMap, lit: &Lit<'_>) -> Result<Vec<bool>> {
    let places: Vec<Place> = map.texels.iter().map(|t| place(surface, t)).collect();
    let mut covered = lit.covered(&places)?;
    let doubtful: Vec<usize> = (0..places.len()).filter(|&t| covered[t]).collect();
    let weights: Vec<_> = (doubtful.iter())
        .map(|&t| quarters(surface, &map.texels[t]))
        .collect();
    let others: Vec<Place> = (doubtful.iter().zip(&weights))
        .flat_map(|(&t, four)| {
            let triangle = map.texels[t].triangle as usize;
            four.map(|weights| surface.place(triangle, weights))
        })
        .collect();
    let found = lit.covered(&others)?;
    for ((&t, four), found) in doubtful.iter().zip(&weights).zip(found.chunks_exact(4)) {
        if let Some(open) = found.iter().position(|is_covered| !is_covered) {
            map.texels[t].weights = four[open];
            covered[t] = false;
        }
    }
    Ok(covered)
}

/// Direct light, `[texel]`.
fn direct(
    surface: &Surface,
    map: &TexelMap,
    covered: &[bool],
    looking: &mut Looking<'_>,
) -> Result<Vec<Vec3>> {
    let places: Vec<Place> = map.texels.iter().map(|t| place(surface, t)).collect();
    let mut light = looking.direct(&places)?;
    if light.len() < places.len() {
        return Err(too_early());
    }
    let is_edge = |&t: &usize| {
        let beside = BESIDE
            .into_iter()
            .filter_map(|step| neighbour(surface, map, t, step));
        !covered[t]
            && beside.into_iter().any(|other| {
                let (one, other) = (light[t].max_element(), light[other].max_element());
                (one - other).abs() > EDGE * one.max(other)
            })
    };
    let edges: Vec<usize> = (0..places.len()).filter(is_edge).collect();
    let finer: Vec<Place> = (edges.iter())
        .flat_map(|&t| {
            let texel = &map.texels[t];
            quarters(surface, texel).map(|weights| surface.place(texel.triangle as usize, weights))
        })
        .collect();
    let found = looking.direct(&finer)?;
    let hidden = looking.lit.covered(&finer)?;
    let of_edges = edges
        .iter()
        .zip(found.chunks_exact(4))
        .zip(hidden.chunks_exact(4));
    for ((&t, four), hidden) in of_edges {
        let open = || {
            four.iter()
                .zip(hidden)
                .filter(|(_, is_hidden)| !**is_hidden)
        };
        let count = open().count();
        if count > 0 {
            light[t] = open().map(|(light, _)| *light).sum::<Vec3>() / count as f32;
        }
    }
    Ok(light)
}

/// Indirect light, `[texel]`.
fn indirect(
    surface: &Surface,
    map: &TexelMap,
    covered: &[bool],
    looking: &mut Looking<'_>,
) -> Result<Vec<Vec3>> {
    let lattice = Lattice {
        surface,
        map,
        covered,
        unexpected: UNEXPECTED,
    };
    let light = lattice.values(|texels| {
        let places: Vec<Place> = texels
            .iter()
            .map(|&t| place(surface, &map.texels[t]))
            .collect();
        let found = looking.at(&places)?;
        Ok(found.iter().map(|light| light.indirect).collect())
    })?;
    Ok(light.into_iter().map(Option::unwrap_or_default).collect())
}

/// Gives covered texels beside others the light of these.
fn uncover(surface: &Surface, map: &TexelMap, covered: &[bool], light: &mut [LightAt]) {
    let all = (-1..=1).flat_map(|y| (-1..=1).map(move |x| [x, y]));
    let around: Vec<[i64; 2]> = all.filter(|step| *step != [0, 0]).collect();
    for t in (0..light.len()).filter(|&t| covered[t]) {
        let beside = around
            .iter()
            .filter_map(|&step| neighbour(surface, map, t, step));
        let open: Vec<LightAt> = beside.filter(|&o| !covered[o]).map(|o| light[o]).collect();
        if !open.is_empty() {
            let count = open.len() as f32;
            light[t] = LightAt {
                direct: open.iter().map(|light| light.direct).sum::<Vec3>() / count,
                indirect: open.iter().map(|light| light.indirect).sum::<Vec3>() / count,
            };
        }
    }
}
