//! Difference of two pictures of the same view.

use super::Picture;
use crate::error::{Error, Result};
use crate::picture::tone::luminance;

/// Of linear radiance, all pixels and colours together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Mean of (a − b)² / (b² + ε²), ε a hundredth of the mean of the reference b.
    pub rel_mse: f64,
    /// Mean of a over that of b, less 1.
    pub bias: f64,
    /// Root of the mean square of a − b over the mean of b.
    pub rms: f64,
}

/// Below this share of the mean a pixel counts as dark, and its relative error is not reported.
const DARK: f64 = 0.01;
/// Share of the reference's mean at which a difference is shown in full colour.
const FULL_COLOUR: f32 = 0.25;

impl Comparison {
    /// # Errors
    /// Pictures of different sizes.
    pub fn new(ours: &Picture, reference: &Picture) -> Result<Self> {
        same_size(ours, reference)?;
        let values = |picture: &Picture| picture.radiance.as_flattened().to_vec();
        let (a, b) = (values(ours), values(reference));
        let count = a.len() as f64;
        let sum = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>();
        let (total, mean) = (sum(&a), sum(&b) / count);
        let (mut squares, mut relative) = (0.0, 0.0);
        for (&a, &b) in a.iter().zip(&b) {
            let (apart, b) = (f64::from(a) - f64::from(b), f64::from(b));
            squares += apart * apart;
            relative += apart * apart / (b * b + (DARK * mean).powi(2));
        }
        Ok(Self {
            rel_mse: relative / count,
            bias: total / count / mean - 1.0,
            rms: (squares / count).sqrt() / mean,
        })
    }
}

/// Ours, the reference and their difference side by side: red where ours is brighter, blue where it
/// is darker, white where they are alike.
///
/// # Errors
/// Pictures of different sizes.
pub fn side_by_side(ours: &Picture, reference: &Picture) -> Result<Picture> {
    same_size(ours, reference)?;
    let (width, height) = (ours.width as usize, ours.height as usize);
    let mean = reference
        .radiance
        .iter()
        .map(|&r| luminance(r))
        .sum::<f32>()
        / (width * height) as f32;
    // Radiance that the tone curve maps to nearly white.
    let white = 1.0 / reference.automatic_exposure.exp2();
    let difference = |a: [f32; 3], b: [f32; 3]| {
        let apart = ((luminance(a) - luminance(b)) / (FULL_COLOUR * mean)).clamp(-1.0, 1.0);
        let pale = white * (1.0 - apart.abs());
        if apart > 0.0 {
            [white, pale, pale]
        } else {
            [pale, pale, white]
        }
    };
    let mut radiance = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        let pixels = row * width..(row + 1) * width;
        let (a, b) = (&ours.radiance[pixels.clone()], &reference.radiance[pixels]);
        radiance.extend_from_slice(a);
        radiance.extend_from_slice(b);
        radiance.extend(a.iter().zip(b).map(|(&a, &b)| difference(a, b)));
    }
    Ok(Picture {
        width: 3 * ours.width,
        height: ours.height,
        radiance,
        automatic_exposure: reference.automatic_exposure,
        contrasts: Vec::new(),
    })
}

pub(super) fn same_size(a: &Picture, b: &Picture) -> Result<()> {
    match (a.width, a.height) == (b.width, b.height) {
        true => Ok(()),
        false => Err(Error::Usage(format!(
            "pictures of {}x{} and {}x{} cannot be compared",
            a.width, a.height, b.width, b.height
        ))),
    }
}
