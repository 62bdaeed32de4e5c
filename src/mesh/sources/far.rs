//! Sources at an infinite distance: suns, and parts of the sky; and beams, whose intensity depends
//! on the direction.
//!
//! A far source sends radiosity πL from a solid angle Ω: a surface that faces it receives L Ω, as
//! by a form factor Ω/π. It holds directions that stand for even shares of its light.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::{Source, SourcePlace};
use crate::constants::{KIND_BEAM, KIND_SKY, KIND_SUN, NONE, SOURCE_EYES};
use crate::math::form_factor::spread_in_triangle;
use crate::mesh::elements::Elements;
use crate::mesh::near::blocked;
use crate::mesh::shadow_tree::ShadowTree;
use crate::scene::even_light::luminance;
use crate::scene::sky::{Sky, SkyPart};
use crate::scene::{Beam, Lights, PointLight, Sun};
use crate::structs::ShadowOccluder;

/// Samples of a part's light, each way.
const GRID: usize = 16;

/// Of a sky's light: a part with more is cut in four, so many times at most.
const MOST_LIGHT: f64 = 1.0 / 64.0;
const MOST_CUTS: u32 = 4;

/// Solid angle over π of a sun without a size: what it sends is as sharp as rays find it.
const SHARP: f64 = 1e-6;

/// All sources of the lights that are no surfaces and no even points.
pub(super) fn far(lights: &Lights, elements: &Elements, sky_bands: u32) -> Vec<Source> {
    let mut list: Vec<Source> = lights.suns.iter().filter_map(sun).collect();
    list.extend(lights.sky.iter().flat_map(|of| sky(of, sky_bands)));
    let beams = lights.points.iter().filter_map(|light| {
        let beam = light.beam.as_ref()?;
        Some(self::beam(light, beam, elements))
    });
    list.extend(beams);
    list
}

/// None of a sun that does not shine.
fn sun(sun: &Sun) -> Option<Source> {
    let irradiance = Vec3::from(sun.irradiance).as_dvec3();
    if irradiance == DVec3::ZERO {
        return None;
    }
    let sine = (sun.angle.to_radians() / 2.0).sin();
    // The projection of a cap of half angle θ has the area π sin² θ.
    let size = (sine * sine).max(SHARP);
    let (x, y) = sun.towards.any_orthonormal_pair();
    let direction = |i: usize| {
        let [u, v] = net(i);
        // Even shares of the cap's projection: the irradiance of a surface that faces its middle.
        let (radius, angle) = (sine * u.sqrt(), TAU * v);
        let flat_part = radius * (angle.cos() * x + angle.sin() * y);
        flat_part + (1.0 - radius * radius).sqrt() * sun.towards
    };
    let directions: Vec<DVec3> = (0..SOURCE_EYES as usize).map(direction).collect();
    // The mean of the cosines to the middle is a little less than 1.
    let facing: f64 = directions.iter().map(|d| d.dot(sun.towards)).sum();
    let radiosity = irradiance * f64::from(SOURCE_EYES) / (size * facing);
    Some(source(KIND_SUN, directions, size, radiosity))
}

/// Parts of a sky that shine, in so many bands from the nadir to the zenith.
fn sky(sky: &Sky, bands: u32) -> Vec<Source> {
    let mut parts: Vec<(SkyPart, Lit)> = Vec::new();
    let mut add = |part: SkyPart| parts.push((part, Lit::of(&part, sky)));
    for band in 0..bands {
        let angle = |band: u32| PI * (f64::from(band) / f64::from(bands) - 0.5);
        let flat = angle(band).midpoint(angle(band + 1)).cos();
        let columns = (f64::from(2 * bands) * flat).round().max(3.0) as u32;
        for column in 0..columns {
            let turns = |column: u32| f64::from(column) / f64::from(columns);
            add(SkyPart {
                low: DVec2::new(angle(band).sin(), turns(column)),
                high: DVec2::new(angle(band + 1).sin(), turns(column + 1)),
            });
        }
    }
    let whole: f64 = parts.iter().map(|(_, lit)| lit.light).sum();
    for _ in 0..MOST_CUTS {
        let uncut = std::mem::take(&mut parts);
        for (part, lit) in uncut {
            match lit.light > MOST_LIGHT * whole {
                true => parts.extend(part.quarters().map(|part| (part, Lit::of(&part, sky)))),
                false => parts.push((part, lit)),
            }
        }
    }
    let shining = parts.iter().filter(|(_, lit)| lit.light > 0.0);
    shining
        .map(|(part, lit)| {
            let size = part.solid_angle() / PI;
            source(KIND_SKY, lit.directions(part, sky), size, PI * lit.radiance)
        })
        .collect()
}

/// Places by which the power of far lights is estimated.
const PLACES: usize = 512;

/// Longer than any way through a scene, internal units.
pub(crate) const FAR: f64 = 4.0;

/// Gives far lights and beams the area by which their radiosity, or intensity, is the power that
/// arrives at the elements: an estimate by a ray from each of some places, evenly by area.
pub(crate) fn far_power(
    elements: &Elements,
    sources: &mut [Source],
    occluders: &ShadowTree<ShadowOccluder>,
) {
    if !sources.iter().any(Source::is_far) {
        return;
    }
    let whole: f64 = elements.area.iter().sum();
    let mut places = Vec::with_capacity(PLACES);
    let mut before = 0.0;
    for e in 0..elements.len() {
        before += elements.area[e];
        while (places.len() as f64 + 0.5) * whole < before * PLACES as f64 {
            let [v, w] = spread_in_triangle(places.len());
            let [a, b, c] = elements.triangle(e);
            places.push((a + v * (b - a) + w * (c - a), elements.normal[e]));
        }
    }
    sources
        .par_iter_mut()
        .filter(|s| s.is_far())
        .for_each(|source| {
            let arrives = |(i, &(place, normal)): (usize, &(DVec3, DVec3))| {
                let way = source.way_from(place, i % SOURCE_EYES as usize);
                let factor = source.factor_along(way, normal);
                match factor > 0.0 && !blocked(occluders, place, place + way) {
                    true => factor,
                    false => 0.0,
                }
            };
            let share = places.iter().enumerate().map(arrives).sum::<f64>() / PLACES as f64;
            let all = match source.kind {
                KIND_BEAM => 4.0 * PI / whole,
                _ => source.facing,
            };
            source.area = whole * share.max(LEAST_SHARE * all);
        });
}

/// Of all that a light may give: what passes for arriving where no ray finds it.
const LEAST_SHARE: f64 = 1e-3;

impl Source {
    /// The way from a place to place i of a far light or beam; of a far light to beyond the scene.
    pub(crate) fn way_from(&self, place: DVec3, i: usize) -> DVec3 {
        match self.kind {
            KIND_BEAM => self.eye - place,
            _ => FAR * self.places[i].at,
        }
    }

    /// Form factor of a far light along a way that nothing blocks, as if all its light came along
    /// it; of a beam irradiance for a unit of intensity.
    pub(crate) fn factor_along(&self, way: DVec3, normal: DVec3) -> f64 {
        let cosine = way.dot(normal).max(0.0) / way.length();
        match &self.web {
            Some(web) => {
                let beam = Beam {
                    axis: self.normal,
                    zero: self.tangent,
                    web: Arc::clone(web),
                };
                beam.share(-way) * cosine / way.length_squared()
            }
            None => self.facing * cosine,
        }
    }
}

/// Light of a part.
struct Lit {
    /// Mean radiance.
    radiance: DVec3,
    /// Luminance times solid angle.
    light: f64,
    /// Shares of the luminance up to each cell of GRID rows of GRID cells.
    cumulated: Vec<f64>,
}

impl Lit {
    fn of(part: &SkyPart, sky: &Sky) -> Self {
        let mut radiance = DVec3::ZERO;
        let mut cumulated = Vec::with_capacity(GRID * GRID);
        let mut sum = 0.0;
        for cell in 0..GRID * GRID {
            let at = DVec2::new((cell / GRID) as f64 + 0.5, (cell % GRID) as f64 + 0.5);
            let found = sky.radiance(sky.towards(part.at(at / GRID as f64)));
            radiance += found / (GRID * GRID) as f64;
            sum += luminance(found.as_vec3().to_array());
            cumulated.push(sum);
        }
        Self {
            radiance,
            light: sum / (GRID * GRID) as f64 * part.solid_angle(),
            cumulated,
        }
    }

    /// Directions of even shares of the luminance.
    fn directions(&self, part: &SkyPart, sky: &Sky) -> Vec<DVec3> {
        let whole = self.cumulated[GRID * GRID - 1];
        let row_end = |row: usize| self.cumulated[(row + 1) * GRID - 1];
        let before = |cell: usize| {
            if cell == 0 {
                0.0
            } else {
                self.cumulated[cell - 1]
            }
        };
        let direction = |i: usize| {
            let [u, v] = net(i);
            // By rows, and then within the row.
            let wanted = u * whole;
            let row = (0..GRID - 1)
                .find(|&row| row_end(row) > wanted)
                .unwrap_or(GRID - 1);
            let (first, end) = (before(row * GRID), row_end(row));
            let down = (wanted - first) / (end - first);
            let wanted = first + v * (end - first);
            let cells = row * GRID..(row + 1) * GRID - 1;
            let cell = cells.clone().find(|&cell| self.cumulated[cell] > wanted);
            let cell = cell.unwrap_or(cells.end);
            let across = (wanted - before(cell)) / (self.cumulated[cell] - before(cell));
            let at = DVec2::new(row as f64 + down, (cell % GRID) as f64 + across);
            sky.towards(part.at(at / GRID as f64))
        };
        (0..SOURCE_EYES as usize).map(direction).collect()
    }
}

/// Point i of a (0, 7, 2)-net: Sobol's first two dimensions, moved to the middle of their cells.
/// Each aligned group of a power of two of them is spread evenly.
fn net(i: usize) -> [f64; 2] {
    let first = (i as u32).reverse_bits();
    let mut second = 0_u32;
    let mut column = 1_u32 << 31;
    let mut left = i;
    while left != 0 {
        if left & 1 == 1 {
            second ^= column;
        }
        column ^= column >> 1;
        left >>= 1;
    }
    let cell = 0.5 / f64::from(SOURCE_EYES);
    [first, second].map(|bits| f64::from(bits) / 2.0_f64.powi(32) + cell)
}

fn source(kind: u32, directions: Vec<DVec3>, size: f64, radiosity: DVec3) -> Source {
    let middle = directions.iter().sum::<DVec3>() / directions.len() as f64;
    let place = |at| SourcePlace {
        at,
        normal: DVec3::ZERO,
    };
    Source {
        kind,
        eye: middle,
        places: directions.into_iter().map(place).collect(),
        centroid: middle,
        normal: -middle.normalize(),
        facing: size,
        emitted: radiosity.as_vec3(),
        ..none()
    }
}

fn beam(light: &PointLight, beam: &Beam, elements: &Elements) -> Source {
    let eye = (light.position - elements.origin) / elements.unit;
    let intensity = Vec3::from(light.intensity).as_dvec3() / (elements.unit * elements.unit);
    Source {
        kind: KIND_BEAM,
        eye,
        centroid: eye,
        normal: beam.axis,
        tangent: beam.zero,
        bitangent: beam.axis.cross(beam.zero),
        emitted: intensity.as_vec3(),
        web: Some(beam.web.clone()),
        ..none()
    }
}

fn none() -> Source {
    Source {
        kind: KIND_SKY,
        eye: DVec3::ZERO,
        places: Vec::new(),
        centroid: DVec3::ZERO,
        normal: DVec3::Y,
        tangent: DVec3::ZERO,
        bitangent: DVec3::ZERO,
        area: 0.0,
        facing: 0.0,
        radius: 0.0,
        parts: Vec::new(),
        cone: 0.0,
        emitted: Vec3::ZERO,
        web: None,
        first_element: 0,
        element_count: 0,
        contour: Vec::new(),
        component: NONE,
    }
}
