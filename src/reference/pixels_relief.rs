//! Twin of the pixel estimator where light has directions: the paper's equations (2) to (4), pixel
//! by pixel.

use glam::{DVec2, DVec3};

use crate::constants::{KIND_POINT, NONE};
use crate::math::hemicube::{Pixel, delta_form_factor, direction_of, solid_angle_share};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;
use crate::meso::{Relief, slot_shares};

/// Least cosine that the light of a grazing pixel is taken to come from.
const LEAST_HEIGHT: f64 = 1e-3;

/// What one source sends: the same in all directions, or by direction of the hemicube's frame,
/// `[direction]`; W·m⁻².
pub enum Light<'a> {
    Even(DVec3, DVec3),
    ByDirection(&'a [DVec3], &'a [DVec3]),
}

/// What one pixel brings to the element that it shows.
struct Beam {
    /// Of the source, internal units.
    eye: DVec3,
    /// From the eye through the pixel, unit, along the world's axes.
    ray: DVec3,
    /// Irradiance, W·m⁻², RGB.
    brought: DVec3,
}

/// What the elements receive, W·m⁻², RGB; meso elements are the last ones.
pub struct Received {
    /// `[element]`.
    pub direct: Vec<DVec3>,
    pub indirect: Vec<DVec3>,
    /// Both together, `[meso element][slot][colour]`.
    pub moments: Vec<[DVec3; 3]>,
    /// Radiosity, `[meso element]`.
    pub reflected: Vec<DVec3>,
    /// Light sent by direction, `[meso element][slot]`; only for `paper` transport.
    pub outgoing: Vec<DVec3>,
}

impl Received {
    /// Nothing yet.
    pub fn new(elements: &Elements, relief: &Relief) -> Self {
        let slots = relief.count() * relief.directions.count();
        let kept = relief.count() * relief.kept().count();
        Self {
            direct: vec![DVec3::ZERO; elements.len()],
            indirect: vec![DVec3::ZERO; elements.len()],
            moments: vec![[DVec3::ZERO; 3]; kept],
            reflected: vec![DVec3::ZERO; relief.count()],
            outgoing: vec![DVec3::ZERO; slots],
        }
    }

    /// Adds what `source` brings to the elements in its item buffer, `[row][column]` of a hemicube
    /// of `n` pixels a side.
    pub fn add(
        &mut self,
        elements: &Elements,
        relief: &Relief,
        source: &Source,
        items: &[u32],
        n: u32,
        light: &Light<'_>,
    ) {
        let first_meso = elements.len() - relief.count();
        let axes = [source.tangent, source.bitangent, source.normal];
        for (i, &item) in items.iter().enumerate() {
            let e = item as usize;
            // A back blocks light and receives none.
            if item == NONE || (source.eye - elements.centroid[e]).dot(elements.normal[e]) <= 0.0 {
                continue;
            }
            let pixel = Pixel {
                column: i as u32 % n,
                row: i as u32 / n,
            };
            let ray = direction_of(pixel, n).normalize();
            let (emitted, reflected) = match light {
                Light::Even(emitted, reflected) => (*emitted, *reflected),
                Light::ByDirection(emitted, reflected) => {
                    let look = |of: &[DVec3]| -> DVec3 {
                        let four = relief.directions.bilinear(ray).into_iter();
                        four.map(|(k, weight)| of[k] * weight).sum()
                    };
                    (look(emitted), look(reflected))
                }
            };
            let weight = match source.kind {
                KIND_POINT => std::f64::consts::TAU * solid_angle_share(pixel, n),
                _ => source.area * delta_form_factor(pixel, n),
            } / elements.area[e];
            self.direct[e] += weight * emitted;
            self.indirect[e] += weight * reflected;
            if relief.is_meso(e) {
                let beam = Beam {
                    eye: source.eye,
                    ray: axes[0] * ray.x + axes[1] * ray.y + axes[2] * ray.z,
                    brought: weight * (emitted + reflected),
                };
                self.reflect(elements, relief, e, e - first_meso, &beam);
            }
        }
    }

    /// Adds a beam's light on element `e`, which is meso element `m`.
    fn reflect(&mut self, elements: &Elements, relief: &Relief, e: usize, m: usize, beam: &Beam) {
        let Beam { eye, ray, brought } = *beam;
        let k = relief.directions.count();
        let frame = [
            relief.tangent[e].as_dvec3(),
            relief.bitangent[e].as_dvec3(),
            elements.normal[e],
        ];
        let from = -DVec3::from_array(frame.map(|axis| axis.dot(ray)));
        let slots = relief.kept();
        let slot = slots.slot_of(from);
        let moment = (from / from.z.max(LEAST_HEIGHT)).with_z(1.0);
        for c in 0..3 {
            self.moments[m * slots.count() + slot][c] += moment * brought[c];
        }
        let Some(texels) = &relief.texels else {
            let response = relief.response(e);
            let terms = response.basis.at(from).into_iter().zip(&response.albedo);
            let albedo: DVec3 = terms.map(|(u, albedo)| u * albedo.as_dvec3()).sum();
            self.reflected[m] += albedo * relief.scale[e].as_dvec3() * brought;
            return;
        };
        // The place in the texture that the pixel shows, by barycentric areas.
        let [a, b, c] = elements.triangle(e);
        let n = elements.normal[e];
        let p = eye + ray * (n.dot(a - eye) / n.dot(ray));
        let part = |q: DVec3, r: DVec3| n.dot((q - p).cross(r - p));
        let whole = n.dot((b - a).cross(c - a));
        let on = &texels.elements[e];
        let uv = (on.uv_a.as_dvec2() * part(b, c)
            + on.uv_b.as_dvec2() * part(c, a)
            + on.uv_c.as_dvec2() * part(a, b))
            / whole;
        let at = uv * DVec2::new(f64::from(on.columns), f64::from(on.rows)) - 0.5;
        let within = at - at.floor();
        let column = (at.x.floor() as i64).rem_euclid(i64::from(on.columns)) as u32;
        let row = (at.y.floor() as i64).rem_euclid(i64::from(on.rows)) as u32;
        let facet = 2 * (row * on.columns + column) + u32::from(within.x + within.y > 1.0);
        let facet = texels.facets[(on.first + facet) as usize];
        let sent = facet.reflectance.as_dvec3() * brought;
        for (j, share) in slot_shares(&relief.directions).into_iter().enumerate() {
            if facet.normal.as_dvec3().dot(relief.directions.centre(j)) > 0.0 {
                self.outgoing[m * k + j] += sent;
                self.reflected[m] += sent * share;
            }
        }
    }
}
