//! Sources: groups of neighbouring, nearly coplanar elements that shoot together from one hemicube.
//!
//! Charts are cut in two until each part is small enough in elements, area and emitted power. The
//! order of the parts becomes the order of the elements, so that a source is a range of elements.
//! An element that is itself too large or too bright is cut into several sources. A point light is
//! two sources, one for each half of its sphere.

mod cut;
mod eyes;
mod far;
mod group;
mod lit;
mod scatter;
mod single;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::constants::{KIND_POINT, KIND_SURFACE};
use crate::error::{Error, Result};
use crate::mesh::charts::Connections;
use crate::mesh::contour::Loop;
use crate::mesh::elements::Elements;
use crate::scene::even_light::far_lights;
use crate::scene::{Lights, PointLight, Web};
use cut::{Limits, cut};
pub(crate) use eyes::least_strong;
use eyes::{move_eyes, turn_frames};
use far::far;
pub(crate) use far::{FAR, far_power};
use group::group;
use lit::Lit;
use scatter::scatter;
use single::{halves, part, point};

/// Where groups are cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grouping {
    /// Most elements of a source that has a relief; a curved one may have twice as many, and more
    /// where more than [`Self::MANY`] elements are curved: as the square root of their number. The
    /// outline of a plane source stands for any number.
    pub max_elements: usize,
    /// Most area of a source, as a share of the scene's.
    pub max_area: f64,
    /// Most emitted power of a source, as a share of the scene's.
    pub max_power: f64,
    /// Most unevenness of the light on a source of the most area, as far as it can be foreseen: the
    /// root mean square of what it reflects more or less than its mean, as a share of what the
    /// scene reflects. Smaller ones may be as much less even. Cornell box of 17,708 elements, rms
    /// and bias at random points: 1.20 and −0.56 % with 502 sources uncut; 0.94 and −0.31 % with
    /// 577 at 0.05; 0.83 and −0.22 % with 724 at 0.025; 0.77 and −0.13 % with 1,032 at 0.0125.
    pub max_unevenness: f64,
    /// Whether every element is a source of its own, whatever it is.
    pub alone: bool,
    /// Bands of a sky's parts from the nadir to the zenith, an even number.
    pub sky_bands: u32,
}

impl Grouping {
    /// Every element shoots alone, and none is cut.
    pub const ELEMENTS: Self = Self {
        max_elements: 1,
        max_area: f64::INFINITY,
        max_power: f64::INFINITY,
        max_unevenness: f64::INFINITY,
        alone: true,
        sky_bands: Self::SKY_BANDS,
    };

    /// Of [`Self::sky_bands`] by default: parts of 6° each way.
    pub const SKY_BANDS: u32 = 30;

    /// The work of drawing grows as sources times elements, and the work near a source as elements
    /// times members of a source. With members as the square root of the elements both grow alike,
    /// and sources still become smaller.
    pub const MANY: usize = 1 << 15;

    /// Most elements of a curved source without relief, where `curved` elements are curved in all.
    fn most_curved(&self, curved: usize) -> usize {
        let times = (curved as f64 / Self::MANY as f64).sqrt().max(1.0);
        (2.0 * self.max_elements as f64 * times) as usize
    }
}

impl Default for Grouping {
    fn default() -> Self {
        Self {
            max_elements: 48,
            max_area: 1.0 / 256.0,
            max_power: 1.0 / 32.0,
            max_unevenness: 0.025,
            alone: false,
            sky_bands: Self::SKY_BANDS,
        }
    }
}

/// One source, in internal units.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Source {
    pub kind: u32,
    /// The hemicube's centre: on the surface, or at the point light.
    pub eye: DVec3,
    /// Places on it, evenly by area, from which silhouettes cut it; more of a strong emitter. None
    /// before [`crate::mesh::open_eyes`]. Of a far light its directions.
    pub places: Vec<SourcePlace>,
    /// Centroid of the area.
    pub centroid: DVec3,
    /// Mean normal, and the hemicube's other two axes.
    pub normal: DVec3,
    pub tangent: DVec3,
    pub bitangent: DVec3,
    pub area: f64,
    /// Projected area seen from far away along `normal`.
    pub facing: f64,
    /// Radius of the ball about `centroid` that holds the source.
    pub radius: f64,
    /// Groups of neighbouring members of a curved source; from afar each counts as a point.
    pub parts: Vec<Part>,
    /// Largest angle between `normal` and a member's normal; exactly 0 where all lie in one plane.
    pub cone: f64,
    /// Radiosity from emission; a point light's radiant intensity over the square of the internal
    /// unit.
    pub emitted: Vec3,
    /// Of a beam: shares of its intensity about the frame of `normal`, `tangent`, `bitangent`.
    #[serde(skip)]
    pub web: Option<Arc<Web>>,
    /// Members: a range of elements.
    pub first_element: u32,
    pub element_count: u32,
    /// Outline, counter-clockwise seen from the front.
    pub contour: Vec<Loop>,
    pub component: u32,
}

/// A place on a source.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SourcePlace {
    pub at: DVec3,
    /// Of the member that it lies on.
    pub normal: DVec3,
}

/// Most members of a part.
pub const PART_MEMBERS: usize = 6;

/// A few members of a curved source.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Part {
    pub centroid: DVec3,
    /// Sum of area times normal.
    pub vector_area: DVec3,
    /// Radius of the ball about `centroid` that holds the part.
    pub radius: f64,
    /// Elements, [`PART_MEMBERS`] at most.
    pub members: Vec<u32>,
}

impl Source {
    /// Whether it has elements.
    pub fn is_surface(&self) -> bool {
        self.kind == KIND_SURFACE
    }

    /// Whether it is a light without a surface that is asked for by rays alone: a sun, a part of
    /// the sky, a beam.
    pub fn is_far(&self) -> bool {
        !self.is_surface() && self.kind != KIND_POINT
    }

    /// Its elements; of a light without a surface none.
    pub fn members(&self) -> std::ops::Range<usize> {
        let first = self.first_element as usize;
        first..first + self.element_count as usize
    }

    /// Emitted power, internal units, summed over the colours.
    pub fn emitted_power(&self) -> f64 {
        let sum = f64::from(self.emitted.element_sum());
        match self.kind {
            KIND_POINT => 2.0 * std::f64::consts::PI * sum,
            // Of a far light and of a beam: what arrives, see [`far_power`].
            _ => self.area * sum,
        }
    }
}

/// Sources that can shoot; groups that are black are left out.
#[derive(Clone)]
pub struct Sources {
    pub list: Vec<Source>,
    /// Number of groups left out.
    pub black: usize,
    /// Chart of each element, for the meshlets.
    pub chart: Vec<u32>,
    /// Range of the list whose elements have a relief.
    pub relief: std::ops::Range<usize>,
    /// See [`Grouping::sky_bands`].
    sky_bands: u32,
}

impl Sources {
    /// Updates the sources to the emission that their elements have now and to other point lights.
    /// The grouping by the old emission stays.
    ///
    /// # Errors
    /// An element emits that belongs to no source because it was black.
    pub fn relight(&mut self, elements: &Elements, lights: &Lights, seed: u64) -> Result<()> {
        self.list.retain(Source::is_surface);
        let mut covered = vec![false; elements.len()];
        for source in &mut self.list {
            let members = source.members();
            let area: f64 = members.clone().map(|e| elements.area[e]).sum();
            let emitted = members
                .clone()
                .map(|e| elements.emitted[e].as_dvec3() * elements.area[e]);
            source.emitted = (emitted.sum::<DVec3>() / area).as_vec3();
            covered[members].fill(true);
        }
        if let Some(e) =
            (0..elements.len()).find(|&e| !covered[e] && elements.emitted[e] != Vec3::ZERO)
        {
            return Err(Error::Usage(format!(
                "triangle {} emits now, and neither emitted nor reflected when visibility was kept: bake again",
                elements.input_index[e]
            )));
        }
        self.add_lights(lights, elements, seed);
        Ok(())
    }

    /// Adds the lights that have no elements, and turns the frames of all sources.
    fn add_lights(&mut self, lights: &Lights, elements: &Elements, seed: u64) {
        for light in lights.points.iter().filter(|light| light.beam.is_none()) {
            self.list.extend(point(light, elements));
        }
        self.list.extend(far(lights, elements, self.sky_bands));
        turn_frames(&mut self.list, seed);
    }
}

/// The light by which groups are made even, beside what the elements emit.
#[derive(Clone, Copy)]
pub struct LitBy<'a> {
    pub points: &'a [PointLight],
    /// Of suns and the sky: the direction to each, and its irradiance on a plane that faces it.
    pub far: &'a [(DVec3, f64)],
}

/// Orders the elements and groups them, for these lights. `seed` turns each hemicube about its axis
/// by an angle of its own, so that the pixel grids of different hemicubes do not align.
pub fn build(
    elements: &mut Elements,
    lights: &Lights,
    grouping: &Grouping,
    seed: u64,
) -> (Sources, Connections) {
    let lit_by = LitBy {
        points: &lights.points,
        far: &far_lights(lights),
    };
    let (mut sources, connections) = group_by(elements, lit_by, grouping, seed);
    sources.add_lights(lights, elements, seed);
    (sources, connections)
}

/// Orders the elements and groups them, without sources of lights.
pub fn group_by(
    elements: &mut Elements,
    lit_by: LitBy,
    grouping: &Grouping,
    seed: u64,
) -> (Sources, Connections) {
    let connections = Connections::new(elements);
    let limits = Limits::new(elements, grouping);
    let asked = grouping.max_unevenness.is_finite();
    let lit = asked
        .then(|| Lit::new(elements, &connections, lit_by))
        .flatten();
    let mut groups = cut(elements, &connections, &limits, lit.as_ref());
    let order = groups.order.clone();
    scatter(&mut groups, |place| elements.is_meso(order[place] as usize));
    elements.permute(&groups.order);
    let connections = connections.permute(&groups.order);
    let mut sources = Sources {
        list: Vec::with_capacity(groups.ranges.len()),
        black: 0,
        chart: groups.chart,
        relief: 0..0,
        sky_bands: grouping.sky_bands,
    };
    let can_shoot = |e: usize| (elements.reflectance[e] + elements.emitted[e]).max_element() > 0.0;
    let mut plain = None;
    for range in groups.ranges {
        if elements.is_meso(range.start) {
            plain.get_or_insert(sources.list.len());
        }
        if !range.clone().any(can_shoot) {
            sources.black += 1;
            continue;
        }
        if range.len() > 1 {
            sources.list.push(group(elements, &connections, range));
            continue;
        }
        let e = range.start;
        let mut stack = vec![elements.triangle(e)];
        while let Some(triangle) = stack.pop() {
            let area = triangle_area(triangle);
            let emitted = area * f64::from(elements.emitted[e].element_sum());
            if limits.too_much(area, emitted) {
                stack.extend(halves(triangle));
            } else {
                sources.list.push(part(elements, &connections, e, triangle));
            }
        }
    }
    sources.relief = plain.unwrap_or(sources.list.len())..sources.list.len();
    move_eyes(&mut sources.list, elements, &limits, seed);
    (sources, connections)
}

pub(crate) fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Shapes;

    /// For a fine grid at an oblique angle to all axes, whose coordinates are rounded.
    #[test]
    fn finer_planes_make_no_more_sources() {
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
        let mut shapes = Shapes::new();
        let (x, y) = (turn * DVec3::X, turn * DVec3::Y);
        shapes.quad(DVec3::ZERO, x, y, (200, 200), 0);
        shapes.weld();
        let count = |max_elements| {
            let grouping = Grouping {
                max_elements,
                ..Grouping::default()
            };
            let mut elements = Elements::new(&shapes.scene);
            build(&mut elements, &Lights::NONE, &grouping, 0)
                .0
                .list
                .len()
        };
        assert_eq!(count(48), count(usize::MAX));
    }

    /// The number of sources of a fine ball grows as the square root of its elements.
    #[test]
    fn sources_of_finer_balls_grow_as_the_square_root() {
        let count = |levels| {
            let mut shapes = Shapes::new();
            shapes.sphere(DVec3::ZERO, 1.0, levels, true, 0);
            let mut elements = Elements::new(&shapes.scene);
            let grouping = Grouping {
                max_area: 1.0,
                ..Grouping::default()
            };
            build(&mut elements, &Lights::NONE, &grouping, 0)
                .0
                .list
                .len() as f64
        };
        // 20,480 elements, 81,920 and 327,680.
        let [coarse, fine, finer] = [5, 6, 7].map(count);
        assert!((1.2..3.0).contains(&(fine / coarse)), "{coarse} {fine}");
        assert!((1.6..2.5).contains(&(finer / fine)), "{fine} {finer}");
    }
}
