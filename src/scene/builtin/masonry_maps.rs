//! Maps of walls, paving and doors made by code: heights and colours that belong together.
//!
//! Each repeats without a seam and is the same on every call.

use std::path::Path;

use glam::{DVec2, DVec3};
use image::{DynamicImage, ImageBuffer, Rgb};
use rayon::prelude::*;

use super::noise::{of_cell, rough, smooth};
use super::relief_maps::stretched;
use crate::error::Result;
use crate::scene::{HeightMap, Texture};

/// Height and colour of a place.
struct Texel {
    /// Metres.
    height: f64,
    /// Reflectance, linear RGB.
    colour: DVec3,
}

/// The maps of a material.
pub(super) struct Maps {
    pub heights: HeightMap,
    /// Metres between the lowest and the highest place.
    pub height_scale: f32,
    pub colours: Texture,
}

/// Metres that a tile of brickwork is wide and high: 8 bricks by 12 courses.
pub(super) const BRICKWORK: DVec2 = DVec2::new(1.8, 0.9);
/// Length of a brick and height of a course with their joints, metres.
const BRICK: DVec2 = DVec2::new(0.225, 0.075);
/// Metres that a tile of paving is wide and deep: three courses of four slabs.
pub(super) const PAVING: DVec2 = DVec2::new(2.4, 1.2);
const SLAB: DVec2 = DVec2::new(0.6, 0.4);
/// Metres that a tile of planks is wide and high: 8 planks.
pub(super) const PLANKS: DVec2 = DVec2::new(1.0, 1.0);
/// Metres that a tile of stone is wide and high.
pub(super) const STONE: DVec2 = DVec2::new(1.2, 1.2);

/// Metres that a tile of plaster is wide and high.
pub(super) const PLASTERING: DVec2 = DVec2::new(2.4, 2.4);

/// Old brickwork in running bond, its joints set back by some 9 mm, in so many texels.
pub(super) fn brickwork(size: [u32; 2]) -> Result<Maps> {
    make("brickwork", size, |at| {
        let [x, y] = at;
        // Courses are not quite straight.
        let wave = 0.0015 * smooth(at, [6, 5], 11);
        let y_metres = y * BRICKWORK.y + wave;
        let course = (y_metres / BRICK.y).floor();
        let along = x * BRICKWORK.x / BRICK.x + 0.5 * course.rem_euclid(2.0);
        let brick = [
            (along.floor() as i64).rem_euclid(8),
            (course as i64).rem_euclid(12),
        ];
        let of_brick = |seed: u64| of_cell(brick[0], brick[1], seed);
        let within = DVec2::new(
            (along.rem_euclid(1.0) - 0.5) * BRICK.x,
            (y_metres / BRICK.y)
                .rem_euclid(1.0)
                .mul_add(BRICK.y, -0.5 * BRICK.y),
        );
        let half = DVec2::new(0.1080 - 0.0025 * of_brick(1), 0.0330 - 0.0020 * of_brick(2));
        let moved = within - DVec2::new(0.002 * (of_brick(3) - 0.5), 0.0015 * (of_brick(4) - 0.5));
        let worn = 0.0011 * rough(at, [90, 45], 3, 21);
        let inward = worn - rounded_box(moved, half, 0.004 + 0.004 * of_brick(5));
        let rise = round_edge(inward, 0.0065);

        let tilt = DVec2::new(0.030 * (of_brick(6) - 0.5), 0.070 * (of_brick(7) - 0.5));
        let skin = 0.0005 * rough(at, [56, 28], 3, 31) + 0.00016 * rough(at, [256, 128], 2, 41);
        let pit = (rough(at, [70, 35], 2, 51) - 0.72).clamp(0.0, 0.25) / 0.25;
        let face = 0.0045 * (of_brick(8) - 0.5) + tilt.dot(moved) + skin - 0.0016 * pit;
        let mortar =
            -0.0085 + 0.0013 * rough(at, [40, 20], 2, 61) + 0.0004 * rough(at, [220, 110], 2, 71);

        let burnt = of_brick(9).powi(2);
        let clay = DVec3::new(0.37, 0.165, 0.108).lerp(DVec3::new(0.20, 0.088, 0.070), burnt);
        let sandy = (of_brick(10) - 0.55).max(0.0) * 0.9;
        let clay = clay.lerp(DVec3::new(0.47, 0.30, 0.20), sandy);
        let mottled = 1.0 + 0.13 * rough(at, [24, 12], 4, 81) + 0.10 * smooth(at, [200, 100], 91);
        let bloom = 0.16 * (rough(at, [16, 8], 3, 95) - 0.2).clamp(0.0, 1.0);
        let clay = (clay * mottled * (1.0 - 0.3 * pit)).lerp(DVec3::new(0.55, 0.50, 0.45), bloom);
        let lime = DVec3::new(0.54, 0.49, 0.42)
            * (1.0 + 0.12 * rough(at, [30, 15], 3, 97) + 0.08 * smooth(at, [300, 150], 99));
        Texel {
            height: mortar + (face - mortar) * rise,
            colour: lime.lerp(clay, smoothstep((inward + 0.0008) / 0.0022)),
        }
    })
}

/// Slabs of limestone in courses, no two joints in line.
pub(super) fn paving() -> Result<Maps> {
    make("paving", [1024, 512], |at| {
        let [x, y] = at;
        let course = (3.0 * y).floor();
        let row = (course as i64).rem_euclid(3);
        let along = x * PAVING.x / SLAB.x + [0.0, 0.37, 0.71][row as usize];
        let slab = (along.floor() as i64).rem_euclid(4);
        let of_slab = |seed: u64| of_cell(slab, row, seed);
        let within = DVec2::new(
            (along.rem_euclid(1.0) - 0.5) * SLAB.x,
            ((3.0 * y).rem_euclid(1.0) - 0.5) * SLAB.y,
        );
        let half = SLAB / 2.0 - DVec2::splat(0.0045 + 0.001 * of_slab(1));
        let worn = 0.0016 * rough(at, [60, 30], 3, 121);
        let inward = worn - rounded_box(within, half, 0.010);
        let rise = round_edge(inward, 0.010);

        let tilt = DVec2::new(0.010 * (of_slab(2) - 0.5), 0.014 * (of_slab(3) - 0.5));
        let skin = 0.0011 * rough(at, [16, 8], 3, 131) + 0.0002 * rough(at, [200, 100], 2, 141);
        let face = 0.0030 * (of_slab(4) - 0.5) + tilt.dot(within) + skin;
        let joint = -0.007 + 0.0012 * rough(at, [80, 40], 3, 151);

        let tone = 0.86 + 0.22 * of_slab(5);
        let warmth = 0.06 * (of_slab(6) - 0.5);
        let stone = DVec3::new(0.50 + warmth, 0.455, 0.385 - warmth)
            * (tone
                * (1.0 + 0.09 * rough(at, [14, 7], 4, 161) + 0.04 * smooth(at, [300, 150], 171)));
        let earth = DVec3::new(0.20, 0.17, 0.13) * (1.0 + 0.25 * rough(at, [90, 45], 2, 181));
        Texel {
            height: joint + (face - joint) * rise,
            colour: earth.lerp(stone, smoothstep((inward + 0.002) / 0.006)),
        }
    })
}

/// Upright planks with painted grain.
pub(super) fn planks() -> Result<Maps> {
    make("planks", [512, 512], |at| {
        let [x, y] = at;
        let along = 8.0 * x;
        let plank = (along.floor() as i64).rem_euclid(8);
        let across = (along.rem_euclid(1.0) - 0.5) * 0.125;
        let inward = 0.0615 - across.abs();
        let rise = round_edge(inward, 0.006);
        // The grain is long and shifts from plank to plank.
        let grain = rough([x, y + of_cell(plank, 0, 1)], [96, 3], 3, 201);
        let face = 0.0015 * (of_cell(plank, 0, 2) - 0.5)
            + 0.012 * (of_cell(plank, 0, 3) - 0.5) * across
            + 0.0004 * grain;
        let tone = (0.9 + 0.2 * of_cell(plank, 0, 4)) * (1.0 + 0.18 * grain);
        Texel {
            height: -0.006 + (face + 0.006) * rise,
            colour: DVec3::new(0.075, 0.155, 0.165) * tone,
        }
    })
}

/// Colours of limestone; a factor of a reflectance.
pub(super) fn stone() -> Result<Texture> {
    let maps = make("stone", [512, 512], |at| Texel {
        height: 0.0,
        colour: (DVec3::new(0.90, 0.90, 0.90)
            + DVec3::new(0.050, 0.055, 0.065) * rough(at, [5, 5], 5, 221)
            + 0.03 * smooth(at, [160, 160], 231))
        .min(DVec3::ONE),
    })?;
    Ok(maps.colours)
}

/// Colours of weathered plaster; a factor of a reflectance.
pub(super) fn plaster() -> Result<Texture> {
    let maps = make("plaster", [512, 512], |at| {
        let streak = rough(at, [26, 3], 4, 241) + 0.8 * rough(at, [4, 4], 5, 251);
        let grain = 0.025 * smooth(at, [220, 220], 261);
        Texel {
            height: 0.0,
            colour: (DVec3::splat(0.87 + grain) + DVec3::new(0.055, 0.065, 0.080) * streak)
                .min(DVec3::ONE),
        }
    })?;
    Ok(maps.colours)
}

/// Distance to the outline of a rectangle about the origin with rounded corners, negative within.
fn rounded_box(at: DVec2, half: DVec2, radius: f64) -> f64 {
    let q = at.abs() - half + DVec2::splat(radius);
    q.max(DVec2::ZERO).length() + q.max_element().min(0.0) - radius
}

/// The quarter of an ellipse from 0 at the outline to 1 at `width` within it.
fn round_edge(inward: f64, width: f64) -> f64 {
    let t = 1.0 - (inward / width).clamp(0.0, 1.0);
    (1.0 - t * t * t).max(0.0).sqrt()
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The maps of a function of the place on the tile, u and v in 0..1.
fn make(
    name: &str,
    [width, height]: [u32; 2],
    texel: impl Fn([f64; 2]) -> Texel + Sync,
) -> Result<Maps> {
    let place = |i: u32, of: u32| (f64::from(i) + 0.5) / f64::from(of);
    let (heights, codes): (Vec<f64>, Vec<[u8; 3]>) = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let at = [place(i % width, width), 1.0 - place(i / width, height)];
            let Texel { height, colour } = texel(at);
            (height, colour.to_array().map(srgb_code))
        })
        .unzip();
    let (heights, height_scale) = stretched(&format!("{name}-height"), width, height, &heights);
    let codes = codes.into_flattened();
    // The file that the colours would be read from: a scene that is written reads back the same.
    let Some(image) = ImageBuffer::<Rgb<u8>, Vec<u8>>::from_raw(width, height, codes) else {
        unreachable!("three codes a texel");
    };
    let path = format!("{name}-colour.png");
    Ok(Maps {
        heights,
        height_scale,
        colours: Texture::from_image(Path::new(&path), DynamicImage::from(image))?,
    })
}

/// The 8-bit sRGB code of linear light, IEC 61966-2-1.
fn srgb_code(linear: f64) -> u8 {
    let c = linear.clamp(0.0, 1.0);
    let coded = match c <= 0.003_130_8 {
        true => 12.92 * c,
        false => 1.055 * c.powf(1.0 / 2.4) - 0.055,
    };
    (255.0 * coded).round() as u8
}
