//! Sources: groups of neighbouring, nearly coplanar elements that shoot together from one hemicube.
//!
//! Charts are cut in two until each part is small enough in elements, area and emitted power; the parts' order becomes the
//! elements' order, so that a source is a range of elements. An element that is itself too large or too bright is cut into
//! several sources. A point light is two sources, one for each half of its sphere.

mod group;
mod near;
mod single;

use glam::{DVec3, Vec3};

use crate::charts::{Connections, charts, morton_order};
use crate::constants::{KIND_POINT, KIND_SURFACE};
use crate::contour::Loop;
use crate::elements::Elements;
use crate::error::{Error, Result};
use crate::scene::PointLight;
use group::{Shape, bisect, group, holds};
use near::Surroundings;
use single::{halves, part, point};

/// Where groups are cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grouping {
    /// Most elements of a source that is curved or has a relief: a plane one's outline stands for any number. Where more than
    /// [`Self::MANY`] elements are curved, curved sources have more, as the square root of their number.
    pub max_elements: usize,
    /// Most area of a source, as a share of the scene's.
    pub max_area: f64,
    /// The same of a plane source that has another surface closer before it than its side: there its light is uneven, and so is
    /// what the other surface takes of it.
    pub max_area_near: f64,
    /// Most emitted power of a source, as a share of the scene's.
    pub max_power: f64,
}

impl Grouping {
    /// The work of drawing is that of sources times elements, and that of what lies near a source that of elements times the members of a
    /// source. With members as the square root of the elements both grow alike, and sources still become smaller.
    pub const MANY: usize = 1 << 15;

    /// Most elements of a curved source without relief, where so many are curved in all.
    fn most_curved(&self, curved: usize) -> usize {
        let times = (curved as f64 / Self::MANY as f64).sqrt().max(1.0);
        (self.max_elements as f64 * times) as usize
    }
}

impl Default for Grouping {
    fn default() -> Self {
        Self {
            max_elements: 48,
            max_area: 1.0 / 256.0,
            max_area_near: 1.0 / 1024.0,
            max_power: 1.0 / 128.0,
        }
    }
}

/// One source, in internal units. See [`crate::passes::types::Source`] for the form the GPU reads.
#[derive(Debug, Clone)]
pub struct Source {
    pub kind: u32,
    /// Place that it sees from: on the surface, or the point light.
    pub eye: DVec3,
    /// Of the area.
    pub centroid: DVec3,
    /// Mean normal, and the hemicube's other two axes.
    pub normal: DVec3,
    pub tangent: DVec3,
    pub bitangent: DVec3,
    pub area: f64,
    /// Area that a far place in the direction of `normal` sees.
    pub facing: f64,
    /// Of the ball about `centroid` that holds the source.
    pub radius: f64,
    /// Of a curved source: neighbouring members put together, each of which is a point from afar.
    pub parts: Vec<Part>,
    /// Largest angle between `normal` and a member's normal; exactly 0 where all lie in one plane.
    pub cone: f64,
    /// Radiosity from emission; a point light's radiant intensity over the square of the internal unit.
    pub emitted: Vec3,
    /// Members: a range of elements.
    pub first_element: u32,
    pub element_count: u32,
    /// Outline, counter-clockwise seen from the front.
    pub contour: Vec<Loop>,
    pub component: u32,
}

/// A few members of a curved source.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    pub centroid: DVec3,
    /// Sum of area times normal.
    pub vector_area: DVec3,
    /// Of the ball about `centroid` that holds the part.
    pub radius: f64,
}

impl Source {
    /// Emitted power, internal units, summed over the colours.
    pub fn emitted_power(&self) -> f64 {
        let sum = f64::from(self.emitted.element_sum());
        match self.kind {
            KIND_POINT => 2.0 * std::f64::consts::PI * sum,
            _ => self.area * sum,
        }
    }
}

/// Sources that can ever shoot, and how many were left out because they are black.
pub struct Sources {
    pub list: Vec<Source>,
    pub black: usize,
    /// Chart of each element, for the meshlets.
    pub chart: Vec<u32>,
    /// Those whose elements have a relief: a range of the list.
    pub relief: std::ops::Range<usize>,
}

impl Sources {
    /// Lights the groups anew: by the emission that their elements have now, and by other point lights. What was cut by the old
    /// emission stays as it is.
    ///
    /// # Errors
    /// An element emits that belongs to no source, since it was black.
    pub fn relight(&mut self, elements: &Elements, lights: &[PointLight], seed: u64) -> Result<()> {
        self.list.retain(|s| s.kind != KIND_POINT);
        let mut covered = vec![false; elements.len()];
        for source in &mut self.list {
            let first = source.first_element as usize;
            let members = first..first + source.element_count as usize;
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
                "triangle {} emits now, and neither emitted nor reflected when visibility was kept: bake anew",
                elements.input_index[e]
            )));
        }
        for light in lights {
            self.list.extend(point(light, elements));
        }
        for (i, source) in self.list.iter_mut().enumerate() {
            (source.tangent, source.bitangent) = turned_frame(source.normal, seed, i as u64);
        }
        Ok(())
    }
}

/// Orders the elements and groups them. `seed` turns each hemicube about its axis by an angle of its own, which keeps the
/// pixels' grids from agreeing with one another.
pub fn build(
    elements: &mut Elements,
    lights: &[PointLight],
    grouping: &Grouping,
    seed: u64,
) -> (Sources, Connections) {
    let connections = Connections::new(elements);
    let total_area: f64 = elements.area.iter().sum();
    let power = |e: usize| elements.area[e] * f64::from(elements.emitted[e].element_sum());
    let total_power: f64 = (0..elements.len()).map(power).sum();
    let too_much = |area: f64, emitted: f64| {
        area > grouping.max_area * total_area
            || (emitted > 0.0 && emitted > grouping.max_power * total_power)
    };
    let is_flat = |members: &[u32]| {
        let members = members.iter().map(|&e| e as usize);
        Shape::new(elements, members).flat
    };
    let mut order = Vec::with_capacity(elements.len());
    let mut groups = Vec::new();
    let mut chart_of = Vec::with_capacity(elements.len());
    let mut charts = charts(elements, &connections, &morton_order(elements));
    let reach = (grouping.max_area * total_area).sqrt();
    // Elements with a relief come last, and so do their sources.
    charts.sort_by_key(|chart| elements.is_meso(chart[0] as usize));
    let is_curved = |chart: &&Vec<u32>| !elements.is_meso(chart[0] as usize) && !is_flat(chart);
    let curved: usize = charts.iter().filter(is_curved).map(Vec::len).sum();
    let most_curved = grouping.most_curved(curved);
    let surroundings = Surroundings::new(elements, &charts, reach);
    for (c, chart) in (0_u32..).zip(charts) {
        let mut stack = vec![chart];
        while let Some(mut members) = stack.pop() {
            let area = members.iter().map(|&e| elements.area[e as usize]).sum();
            let emitted = members.iter().map(|&e| power(e as usize)).sum();
            // A plane group's outline stands for all its members, however many.
            let relief = elements.is_meso(members[0] as usize);
            let plane = !relief && is_flat(&members);
            let most = if relief {
                grouping.max_elements
            } else {
                most_curved
            };
            let many = members.len() > most && !plane;
            let uneven = plane
                && area > grouping.max_area_near * total_area
                && members.iter().any(|&e| surroundings.any_before(e, c));
            let large = many || uneven || too_much(area, emitted);
            if large && members.len() > 1 {
                let at = bisect(elements, &mut members);
                stack.push(members.split_off(at));
                stack.push(members);
            } else {
                groups.push((order.len() as u32, members.len() as u32));
                chart_of.extend(std::iter::repeat_n(c, members.len()));
                order.extend(members);
            }
        }
    }
    elements.permute(&order);
    let connections = connections.permute(&order);
    let mut sources = Sources {
        list: Vec::with_capacity(groups.len()),
        black: 0,
        chart: chart_of,
        relief: 0..0,
    };
    let can_shoot = |e: usize| (elements.reflectance[e] + elements.emitted[e]).max_element() > 0.0;
    let mut plain = None;
    for (first, count) in groups {
        if elements.is_meso(first as usize) {
            plain.get_or_insert(sources.list.len());
        }
        let range = first as usize..(first + count) as usize;
        if !range.clone().any(can_shoot) {
            sources.black += 1;
            continue;
        }
        if count > 1 {
            sources.list.push(group(elements, &connections, range));
            continue;
        }
        let e = first as usize;
        let mut stack = vec![elements.triangle(e)];
        while let Some(triangle) = stack.pop() {
            let area = triangle_area(triangle);
            let emitted = area * f64::from(elements.emitted[e].element_sum());
            if too_much(area, emitted) {
                stack.extend(halves(triangle));
            } else {
                sources.list.push(part(elements, &connections, e, triangle));
            }
        }
    }
    sources.relief = plain.unwrap_or(sources.list.len())..sources.list.len();
    for light in lights {
        sources.list.extend(point(light, elements));
    }
    // Point lights do not count: other ones must not move the eyes of what is lit anew.
    let least = LEAST * grouping.max_power * total_power;
    for (i, source) in sources.list.iter_mut().enumerate() {
        (source.tangent, source.bitangent) = turned_frame(source.normal, seed, i as u64);
        let emitted = source.emitted_power();
        let strong = emitted > 0.0 && emitted >= least;
        if strong && source.kind == KIND_SURFACE && source.cone == 0.0 {
            let bright = emitted * total_area > BRIGHT * total_power * source.area;
            source.eye = off_the_grid(elements, source, spread(seed, i as u64), bright);
        }
    }
    (sources, connections)
}

pub(crate) fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Tangent and bitangent about `normal` (Duff et al. 2017), turned by an angle drawn from the seed and the index.
fn turned_frame(normal: DVec3, seed: u64, index: u64) -> (DVec3, DVec3) {
    let (t, b) = normal.any_orthonormal_pair();
    let angle = std::f64::consts::TAU * unit_random(seed, index);
    let (sin, cos) = angle.sin_cos();
    (t * cos + b * sin, b * cos - t * sin)
}

/// The weakest emitters that are taken for strong, as a share of [`Grouping::max_power`]. Groups that are cut for their power are
/// stronger. It bounds their number, 512 by default, also where everything glows; each of many weak lamps has errors of its own, which
/// even out.
const LEAST: f64 = 0.25;

/// Power of the weakest emitters of a scene that are taken for strong.
pub(crate) fn least_strong(sources: &[Source], grouping: &Grouping) -> f64 {
    let power: f64 = sources.iter().map(Source::emitted_power).sum();
    LEAST * grouping.max_power * power
}

/// Light per area, over that of the whole scene, of what is a lamp: it is cut for its power, into many sources that share each shadow's edge.
const BRIGHT: f64 = 4.0;

/// An eye at the place `[u, v]` of a plane source, where the unit square goes to equal areas, if it is bright, and half-way there from its own
/// if not. Emitters and receivers often lie on grids that agree; from their centroids all would see past an edge, or none. A
/// silhouette through a single source is told best by its middle.
fn off_the_grid(elements: &Elements, source: &Source, [u, v]: [f64; 2], bright: bool) -> DVec3 {
    let members = source.first_element..source.first_element + source.element_count;
    let triangles: Vec<[DVec3; 3]> = match (source.element_count, &source.contour[..]) {
        // Perhaps a piece of its element.
        (1, [corners]) if corners.len() == 3 => vec![[corners[0], corners[1], corners[2]]],
        _ => members.map(|e| elements.triangle(e as usize)).collect(),
    };
    let mut left = u * triangles.iter().copied().map(triangle_area).sum::<f64>();
    let within = triangles.iter().find(|&&triangle| {
        left -= triangle_area(triangle);
        left < 0.0
    });
    let &[a, b, c] = within.unwrap_or(&triangles[0]);
    let share = 1.0 + (left / triangle_area([a, b, c])).clamp(-1.0, 0.0);
    let place = a + share.sqrt() * ((1.0 - v) * (b - a) + v * (c - a));
    let half = source.eye.midpoint(place);
    match !bright && triangles.iter().any(|&t| holds(t, half, source.normal)) {
        true => half,
        false => place,
    }
}

/// Places in the unit square, of which those of neighbouring indices lie far apart: the sequence R₂ (Roberts 2018).
fn spread(seed: u64, index: u64) -> [f64; 2] {
    // 1/g and 1/g² with g³ = g + 1.
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    let axis = |i: usize| (unit_random(seed, !(i as u64)) + STEP[i] * index as f64).fract();
    [axis(0), axis(1)]
}

/// A number in 0..1 from a seed and an index (SplitMix64).
fn unit_random(seed: u64, index: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0xa076_1d64_78bd_642f)
        .wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

// The shapes are those of the benchmarks.
#[cfg(all(test, feature = "cli"))]
mod tests {
    use super::*;
    use crate::bench::stress::shapes::Shapes;

    /// However fine, and at right angles to no axis: coordinates are rounded.
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
            build(&mut elements, &[], &grouping, 0).0.list.len()
        };
        assert_eq!(count(48), count(usize::MAX));
    }

    /// Sources of a fine ball are as many as the square root of its elements.
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
            build(&mut elements, &[], &grouping, 0).0.list.len() as f64
        };
        // 20,480 elements, 81,920 and 327,680.
        let [coarse, fine, finer] = [5, 6, 7].map(count);
        assert!((1.2..3.0).contains(&(fine / coarse)), "{coarse} {fine}");
        assert!((1.6..2.5).contains(&(finer / fine)), "{fine} {finer}");
    }
}
