//! The paper's equations (1) to (4) as a plain program, in f64: progressive radiosity, one shot
//! after another.

use glam::DVec3;

use crate::constants::{KIND_POINT, NONE};
use crate::math::directions::{Directions, nearest_of};
use crate::math::hemicube::{Pixel, delta_form_factor, direction_of, solid_angle_share};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;
use crate::meso::{MesoTexel, Relief, TextureFacet, slot_shares};

/// A scene whose elements are patches, those with relief the last ones.
pub struct Program<'a> {
    elements: &'a Elements,
    relief: Option<&'a Relief>,
    sources: &'a [Source],
    directions: Directions,
    /// Of the directions, `[direction]`.
    centres: Vec<DVec3>,
    first_relief: usize,
    /// W·m⁻², RGB, `[element]`; a patch with relief has the sum of its directions.
    pub direct: Vec<DVec3>,
    pub indirect: Vec<DVec3>,
    /// (4), all light, `[patch with relief][direction]`.
    pub incoming: Vec<DVec3>,
    /// (3), `[patch with relief][direction]`, W·m⁻².
    pub outgoing: Vec<DVec3>,
    /// Reflected radiosity that was sent, `[source][direction]`; of a flat patch, one.
    sent: Vec<Vec<DVec3>>,
    emission_sent: Vec<bool>,
}

impl<'a> Program<'a> {
    pub fn new(elements: &'a Elements, sources: &'a [Source], directions: Directions) -> Self {
        let relief = elements.relief.as_ref();
        let patches = relief.map_or(0, Relief::count);
        let k = directions.count();
        let first_relief = elements.len() - patches;
        let ways = |source: &Source| match source.is_surface()
            && source.first_element as usize >= first_relief
        {
            true => vec![DVec3::ZERO; k],
            false => vec![DVec3::ZERO],
        };
        Self {
            elements,
            relief,
            sources,
            centres: directions.centres(),
            directions,
            first_relief,
            direct: vec![DVec3::ZERO; elements.len()],
            indirect: vec![DVec3::ZERO; elements.len()],
            incoming: vec![DVec3::ZERO; k * patches],
            outgoing: vec![DVec3::ZERO; k * patches],
            sent: sources.iter().map(ways).collect(),
            emission_sent: vec![false; sources.len()],
        }
    }

    /// Shoots until the unshot power is no more than this share of what is emitted. `look` gives
    /// the item buffer of a source, `[row][column]` of a hemicube of `n` pixels a side. Returns how
    /// many shots it took.
    pub fn solve<'b>(&mut self, share: f64, n: u32, look: impl Fn(usize) -> &'b [u32]) -> u32 {
        let emitted: f64 = self.sources.iter().map(Source::emitted_power).sum();
        for shots in 0.. {
            let powers: Vec<f64> = (0..self.sources.len()).map(|s| self.unshot(s)).collect();
            if powers.iter().sum::<f64>() <= share * emitted {
                return shots;
            }
            let strongest =
                (0..powers.len()).fold(0, |a, b| if powers[b] > powers[a] { b } else { a });
            self.shoot(strongest, n, look(strongest));
        }
        unreachable!("shots are counted without end")
    }

    /// What a source reflects, by direction where it has relief.
    fn reflected(&self, s: usize) -> Vec<DVec3> {
        let source = &self.sources[s];
        let e = source.first_element as usize;
        if !source.is_surface() {
            vec![DVec3::ZERO]
        } else if e < self.first_relief {
            vec![self.elements.reflectance[e].as_dvec3() * (self.direct[e] + self.indirect[e])]
        } else {
            let k = self.directions.count();
            self.outgoing[(e - self.first_relief) * k..][..k].to_vec()
        }
    }

    /// Unshot power, summed over the colours.
    fn unshot(&self, s: usize) -> f64 {
        let source = &self.sources[s];
        let emitted = match self.emission_sent[s] {
            true => 0.0,
            false => source.emitted_power(),
        };
        let left = self
            .reflected(s)
            .into_iter()
            .zip(&self.sent[s])
            .map(|(now, sent)| now - *sent);
        let mean: DVec3 = match self.sent[s].len() {
            1 => left.sum(),
            _ => left
                .zip(slot_shares(&self.directions))
                .map(|(left, share)| left * share)
                .sum(),
        };
        emitted + mean.element_sum() * source.area
    }

    fn shoot(&mut self, s: usize, n: u32, items: &[u32]) {
        let source = &self.sources[s];
        let now = self.reflected(s);
        let unsent: Vec<DVec3> = now
            .iter()
            .zip(&self.sent[s])
            .map(|(now, sent)| *now - *sent)
            .collect();
        self.sent[s] = now;
        let emitted = match std::mem::replace(&mut self.emission_sent[s], true) {
            true => DVec3::ZERO,
            false => source.emitted.as_dvec3(),
        };
        for (i, &item) in items.iter().enumerate() {
            let j = item as usize;
            // A back blocks light and takes none.
            if item == NONE
                || (source.eye - self.elements.centroid[j]).dot(self.elements.normal[j]) <= 0.0
            {
                continue;
            }
            let pixel = Pixel {
                column: i as u32 % n,
                row: i as u32 / n,
            };
            let local = direction_of(pixel, n).normalize();
            let ray =
                source.tangent * local.x + source.bitangent * local.y + source.normal * local.z;
            let power = match source.kind {
                KIND_POINT => std::f64::consts::TAU * solid_angle_share(pixel, n),
                _ => source.area * delta_form_factor(pixel, n),
            };
            // (1) and (2)
            let brought = power / self.elements.area[j];
            let (direct, indirect) = (
                emitted * brought,
                self.towards(source, &unsent, ray) * brought,
            );
            self.direct[j] += direct;
            self.indirect[j] += indirect;
            if let Some(relief) = self.relief.filter(|_| j >= self.first_relief) {
                self.reflect(relief, j, source.eye, ray, direct + indirect);
            }
        }
    }

    /// ΔB_iq: what a source sends along a ray, bilinear between its directions.
    fn towards(&self, source: &Source, unsent: &[DVec3], ray: DVec3) -> DVec3 {
        let (Some(relief), [_, _, ..]) = (self.relief, unsent) else {
            return unsent[0];
        };
        let local =
            frame(self.elements, relief, source.first_element as usize).map(|axis| axis.dot(ray));
        let four = self
            .directions
            .bilinear(DVec3::from_array(local))
            .into_iter();
        four.map(|(k, weight)| unsent[k] * weight).sum()
    }

    /// (3) and (4): light along a ray from `eye` on patch `j`.
    fn reflect(&mut self, relief: &Relief, j: usize, eye: DVec3, ray: DVec3, brought: DVec3) {
        let k = self.directions.count();
        let m = j - self.first_relief;
        let from = -DVec3::from_array(frame(self.elements, relief, j).map(|axis| axis.dot(ray)));
        self.incoming[m * k + nearest_of(&self.centres, from)] += brought;
        let facet = self.texel(relief, j, eye, ray);
        for out in 0..k {
            if facet.normal.dot(self.centres[out]) > 0.0 {
                self.outgoing[m * k + out] += facet.reflectance.as_dvec3() * brought;
            }
        }
    }

    /// The half texel that a ray from `eye` meets on the flat patch `j`, by barycentric areas.
    fn texel(&self, relief: &Relief, j: usize, eye: DVec3, ray: DVec3) -> TextureFacet {
        let [a, b, c] = self.elements.triangle(j);
        let n = self.elements.normal[j];
        let p = eye + ray * (n.dot(a - eye) / n.dot(ray));
        let part = |q: DVec3, r: DVec3| n.dot((q - p).cross(r - p));
        let whole = n.dot((b - a).cross(c - a));
        let Some(texels) = &relief.texels else {
            unreachable!("the paper's transport keeps its texels");
        };
        let MesoTexel {
            uv,
            first,
            columns,
            rows,
        } = texels.elements[j];
        let uv = (uv[0] * part(b, c) + uv[1] * part(c, a) + uv[2] * part(a, b)) / whole;
        let (x, y) = (
            uv.x * f64::from(columns) - 0.5,
            uv.y * f64::from(rows) - 0.5,
        );
        let wrap = |at: f64, size: u32| (at.floor() as i64).rem_euclid(i64::from(size)) as u32;
        let half = u32::from(x - x.floor() + (y - y.floor()) > 1.0);
        texels.facets[(first + 2 * (wrap(y, rows) * columns + wrap(x, columns)) + half) as usize]
    }
}

/// Tangent, bitangent and normal of a patch with relief.
fn frame(elements: &Elements, relief: &Relief, e: usize) -> [DVec3; 3] {
    [
        relief.tangent[e].as_dvec3(),
        relief.bitangent[e].as_dvec3(),
        elements.normal[e],
    ]
}
