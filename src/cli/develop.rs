//! How pictures are exposed and written.

use clap::{Args, ValueEnum};
use glam::Vec3;

use mesolux::bake::solution::Bake;
use mesolux::error::{Error, Result};
use mesolux::render::{Codes, Development, Tone};
use mesolux::scene::Scene;

#[derive(Args)]
pub struct DevelopOptions {
    /// Multiplies the light by 2^EV; found from the picture if not given
    #[arg(long, value_name = "EV", allow_hyphen_values = true, help_heading = PNG)]
    exposure: Option<f32>,
    /// Light in which a white surface is shown white: linear RGB, or `lamps`, the mean direct light
    /// on the surfaces [default: that of sRGB, so that yellow lamps make white walls yellow]
    #[arg(long, value_name = "lamps|R,G,B", value_parser = white, help_heading = PNG)]
    white: Option<White>,
    /// What becomes of light that is too bright
    #[arg(long, value_enum, default_value_t = ToneName::Neutral, help_heading = PNG)]
    tone: ToneName,
    /// Bits and coding
    #[arg(long, value_enum, default_value_t = CodesName::Srgb8, help_heading = PNG)]
    png: CodesName,
}

/// A heading for each option: one for all would stand above those of later structs, too.
const PNG: &str = "PNG";

#[derive(Debug, Clone, Copy)]
enum White {
    Lamps,
    Colour([f32; 3]),
}

fn white(text: &str) -> std::result::Result<White, String> {
    let wrong = || "must be `lamps`, or three numbers like 1,0.8,0.6".to_owned();
    if text == "lamps" {
        return Ok(White::Lamps);
    }
    let numbers: Vec<f32> = (text.split(','))
        .map(|n| n.trim().parse().map_err(|_| wrong()))
        .collect::<std::result::Result<_, _>>()?;
    match <[f32; 3]>::try_from(numbers) {
        Ok(rgb) if is_colour(rgb) => Ok(White::Colour(rgb)),
        Ok(_) => Err("must be at least 0, at most 1e6, and not all 0".into()),
        Err(_) => Err(wrong()),
    }
}

fn is_colour(rgb: [f32; 3]) -> bool {
    rgb.iter().all(|c| (0.0..=1e6).contains(c)) && rgb.iter().any(|&c| c > 1e-6)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ToneName {
    /// Compressed, its hue kept: Khronos PBR Neutral
    Neutral,
    /// Cut off, and all else as it is
    Cut,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CodesName {
    /// 8 bits, sRGB, dithered
    Srgb8,
    /// 16 bits, sRGB
    Srgb16,
    /// 16 bits, linear (gamma 1 in the file)
    Linear16,
}

impl DevelopOptions {
    /// # Errors
    /// An exposure out of range; `--white lamps` without a bake.
    pub fn check(&self, has_bake: bool) -> Result<()> {
        check_exposure(self.exposure)?;
        if !has_bake && matches!(self.white, Some(White::Lamps)) {
            let what = "--white lamps needs the light of a bake: give --white R,G,B";
            return Err(Error::Usage(what.into()));
        }
        Ok(())
    }

    /// What is asked for, of a scene with its bake.
    pub fn of(&self, baked: Option<(&Scene, &Bake)>) -> Development {
        Development {
            exposure: self.exposure,
            white: match self.white {
                None => None,
                Some(White::Colour(rgb)) => Some(rgb),
                Some(White::Lamps) => baked.and_then(|(scene, bake)| lamps(scene, bake)),
            },
            tone: match self.tone {
                ToneName::Neutral => Tone::Neutral,
                ToneName::Cut => Tone::Cut,
            },
            codes: match self.png {
                CodesName::Srgb8 => Codes::Srgb8,
                CodesName::Srgb16 => Codes::Srgb16,
                CodesName::Linear16 => Codes::Linear16,
            },
        }
    }
}

/// # Errors
/// An exposure out of range.
pub fn check_exposure(exposure: Option<f32>) -> Result<()> {
    match exposure.filter(|ev| !(-64.0..=64.0).contains(ev)) {
        None => Ok(()),
        Some(ev) => Err(Error::Usage(format!(
            "--exposure {ev}: must be in -64 to 64"
        ))),
    }
}

/// Mean direct light over the surfaces; of a scene that only a sky lights, all light.
fn lamps(scene: &Scene, bake: &Bake) -> Option<[f32; 3]> {
    let mean = |irradiance: &[Vec3]| {
        let sum: glam::DVec3 = (scene.triangles.iter().zip(irradiance))
            .map(|(triangle, light)| {
                let [a, b, c] = scene.corners(triangle);
                (b - a).cross(c - a).length() * light.as_dvec3()
            })
            .sum();
        (sum / sum.max_element()).as_vec3().to_array()
    };
    let found = [&bake.irradiance_direct, &bake.irradiance].map(|light| mean(light));
    let lamps = found.into_iter().find(|&rgb| is_colour(rgb));
    if lamps.is_none() {
        tracing::warn!("--white lamps: the scene is dark, and its white stays as it is");
    }
    lamps
}
