//! The solution's directional part.

use std::ops::Range;
use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::meso::{RANK, Relief};
use crate::passes::buffers::download_parts;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::types::Reflected;
use crate::vk::Device;

/// Light of the elements with a relief, in internal order, in their tangent frames; `slot` is an
/// index of [`Relief::kept`], `direction` of [`Relief::directions`].
pub struct ReliefLight {
    /// The elements, `[meso element]`.
    pub elements: Vec<u32>,
    /// ∫ L ω dω over a slot, `[meso element][slot][colour]`, W·m⁻².
    pub moments: Vec<[Vec3; 3]>,
    /// Of this what comes straight from emitters and point lights.
    pub moments_direct: Vec<[Vec3; 3]>,
    /// Of the functions by which each element responds, Σ E u_r(ω), `[meso element][rank]`, RGB,
    /// W·m⁻²: see [`crate::meso::Basis`]. None by the paper's method.
    pub coefficients: Vec<Vec3>,
    /// What is sent as radiosity πL, bilinear between the directions, emission included, `[meso
    /// element][direction]`, RGB, W·m⁻².
    pub exitant: Vec<Vec3>,
}

impl ReliefLight {
    /// What meso element m sends, `[direction]`.
    pub fn sent(&self, relief: &Relief, m: usize) -> &[Vec3] {
        let k = relief.directions.count();
        &self.exitant[m * k..(m + 1) * k]
    }

    /// Of the elements with a relief, which are the last, from what they hold.
    pub(super) fn new(elements: &Elements, relief: &Relief, sums: ReliefSums) -> Self {
        let ReliefSums {
            direct,
            mut moments,
            coefficients,
            ..
        } = sums;
        for (sum, direct) in moments.iter_mut().zip(&direct) {
            (0..3).for_each(|c| sum[c] += direct[c]);
        }
        let first = (elements.len() - relief.count()) as u32;
        let exitant = coefficients
            .par_chunks(RANK)
            .enumerate()
            .flat_map_iter(|(m, coefficients)| {
                let e = first as usize + m;
                let response = relief.response(e);
                let scale = relief.scale[e];
                let emitted = elements.emitted[e] / response.mean_emission;
                let sent = response.send(coefficients).into_iter();
                sent.zip(&response.emission)
                    .map(move |(sent, emission)| sent * scale + emitted * *emission)
                    .collect::<Vec<_>>()
            })
            .collect();
        Self {
            elements: (first..elements.len() as u32).collect(),
            moments,
            moments_direct: direct,
            coefficients,
            exitant,
        }
    }
}

/// What the elements with a relief of a member hold on its device.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ReliefSums {
    /// Moments of direct and of indirect light, `[meso element][slot][colour]`.
    direct: Vec<[Vec3; 3]>,
    moments: Vec<[Vec3; 3]>,
    /// `[meso element][rank]`
    coefficients: Vec<Vec3>,
    /// What they reflect in all, `[meso element]`.
    pub reflected: Vec<Vec3>,
}

impl ReliefSums {
    /// Of these elements, counted from the first of all.
    pub fn download(
        device: &Arc<Device>,
        buffers: &ReliefBuffers,
        elements: Range<usize>,
    ) -> Result<Self> {
        let first = elements.start - buffers.shape.first_element as usize;
        let own = |each: usize| first * each..(first + elements.len()) * each;
        let slots = own(buffers.shape.kept.count());
        let moments = [
            (&buffers.moments_direct, slots.clone()),
            (&buffers.moments_indirect, slots),
        ];
        let [direct, moments] = download_parts(device, moments)?;
        let held = [(&buffers.coefficients, own(RANK))];
        let [coefficients] = download_parts::<Vec4, 1>(device, held)?;
        let [reflected] = download_parts::<Reflected, 1>(device, [(&buffers.reflected, own(1))])?;
        Ok(Self {
            direct,
            moments,
            coefficients: coefficients.into_iter().map(Vec4::truncate).collect(),
            reflected: reflected.into_iter().map(|of| of.sum).collect(),
        })
    }

    /// Takes those of further elements behind.
    pub fn append(&mut self, mut others: Self) {
        self.direct.append(&mut others.direct);
        self.moments.append(&mut others.moments);
        self.coefficients.append(&mut others.coefficients);
        self.reflected.append(&mut others.reflected);
    }
}
