//! Closed scenes in which every surface emits 1 − ρ: the radiosity is 1 everywhere.

use glam::{DVec3, Vec3};

use super::{Case, Check, Context, Size, furnace_material, settings};
use crate::bake::quality::Quality;
use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::mesh::sources::Grouping;
use crate::scene::Lights;
use crate::scene::shapes::Shapes;
use crate::solver::Settings;

pub(super) const NEARLY_WHITE: Case = Case {
    name: "nearly_white",
    asked: "reflectance 0.999 in a closed room: radiosity 1, and no more missing than the bound says",
    run: nearly_white,
};
pub(super) const OCCLUDERS: Case = Case {
    name: "occluders",
    asked: "two balls in a closed room, reflectance at random up to 0.95: radiosity 1 at high quality",
    run: occluders,
};

/// At ρ = 0.999; measured: 6.4e-5.
const NEARLY_WHITE_MEAN: f64 = 1.5e-4;
/// With occluders, at high quality; measured: 5.6e-4, 4.3e-3.
const OCCLUDERS_RMS: f64 = 1e-3;
const OCCLUDERS_MOST: f64 = 5e-3;
/// At the small size, with larger sources; measured: 1.9e-3, 1.5e-2.
const SMALL_RMS: f64 = 3e-3;
const SMALL_MOST: f64 = 2e-2;

fn nearly_white(context: &Context) -> Result<Vec<Check>> {
    let rho = 0.999f32;
    let mut shapes = Shapes::new();
    let material = furnace_material(&mut shapes, rho);
    let n = match context.size {
        Size::Small => 2,
        Size::Full => 8,
    };
    shapes.room(DVec3::ZERO, DVec3::new(1.0, 0.9, 1.1), n, material);
    let bake = Settings {
        residual: 0.5,
        // One shot for each square: the light is reflected about a thousand times.
        grouping: Grouping {
            max_area: 1.0 / 24.0,
            max_power: 1.0 / 24.0,
            ..Grouping::default()
        },
        ..settings()
    };
    let solved = context.solve(&shapes.scene, &bake)?;
    let mean = solved.mean(&solved.radiosity, 0..solved.area.len());
    // Of all that was emitted, (1 − ρ) of each area.
    let missing = (1.0 - mean) / (1.0 - f64::from(rho));
    let bound = solved.report.error_bound.unwrap_or(0.0);
    Ok(vec![
        Check::at_most("mean off 1", (mean - 1.0).abs(), NEARLY_WHITE_MEAN),
        Check::at_most(
            format!("missing light over the bound of {bound:.2}"),
            missing / bound,
            1.0,
        ),
    ])
}

/// A box of n × n squares a side with two balls of 20 · 4^levels triangles, ρ at random in 0..most
/// for each element and colour, emission 1 − ρ.
pub fn occluded_elements(n: u32, levels: u32, most: f32) -> Elements {
    let mut shapes = Shapes::new();
    shapes.room(DVec3::ZERO, DVec3::ONE, n, 0);
    shapes.sphere(DVec3::new(0.32, 0.3, 0.35), 0.2, levels, true, 0);
    shapes.sphere(DVec3::new(0.68, 0.62, 0.6), 0.17, levels, true, 0);
    let mut elements = Elements::new(&shapes.scene);
    let mut state = 1u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    for e in 0..elements.len() {
        let rho = Vec3::new(random(), random(), random()) * most;
        elements.reflectance[e] = rho;
        elements.emitted[e] = Vec3::ONE - rho;
    }
    elements
}

fn occluders(context: &Context) -> Result<Vec<Check>> {
    let (elements, bake, rms_limit, most_limit) = match context.size {
        Size::Small => {
            let bake = Settings::default();
            (occluded_elements(10, 2, 0.95), bake, SMALL_RMS, SMALL_MOST)
        }
        Size::Full => {
            let bake = Quality::High.settings();
            let elements = occluded_elements(25, 3, 0.95);
            (elements, bake, OCCLUDERS_RMS, OCCLUDERS_MOST)
        }
    };
    let solved = context.solve_elements(elements, &Lights::NONE, &bake)?;
    let (rms, most) = solved.off_one(0..solved.area.len());
    Ok(vec![
        Check::at_most("rms off 1", rms, rms_limit),
        Check::at_most("largest", most, most_limit),
    ])
}
