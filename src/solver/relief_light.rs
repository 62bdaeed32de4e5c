//! The solution's directional part.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::meso::{RANK, Relief};
use crate::passes::buffers::download;
use crate::passes::relief_buffers::ReliefBuffers;
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

    pub(super) fn download(
        device: &Arc<Device>,
        elements: &Elements,
        relief: &Relief,
        buffers: &ReliefBuffers,
    ) -> Result<Self> {
        let count = relief.kept().count() * buffers.element_count as usize;
        let direct: Vec<[Vec3; 3]> = download(device, &buffers.moments_direct, count)?;
        let mut moments: Vec<[Vec3; 3]> = download(device, &buffers.moments_indirect, count)?;
        for (sum, direct) in moments.iter_mut().zip(&direct) {
            (0..3).for_each(|c| sum[c] += direct[c]);
        }
        let held = RANK * buffers.element_count as usize;
        let coefficients: Vec<Vec4> = download(device, &buffers.coefficients, held)?;
        let coefficients: Vec<Vec3> = coefficients.into_iter().map(Vec4::truncate).collect();
        let first = buffers.first_element;
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
        Ok(Self {
            elements: (first..first + buffers.element_count).collect(),
            moments,
            moments_direct: direct,
            coefficients,
            exitant,
        })
    }
}
