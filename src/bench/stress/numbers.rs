//! Lengths, emission and reflectance at the ends of their ranges.

use std::f32::consts::PI;

use glam::DVec3;

use super::{Case, Check, Context, Size, settings, through_files};
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::shapes::Shapes;
use crate::solver::{Settings, StopReason};

pub(super) const SCALE: Case = Case {
    name: "scale",
    asked: "a scene 2^20 times as large and as small: the same radiosity to the bit",
    run: scale,
};
pub(super) const OFFSET: Case = Case {
    name: "offset",
    asked: "a scene moved by 10^6: the same radiosity",
    run: offset,
};
pub(super) const NO_EMISSION: Case = Case {
    name: "no_emission",
    asked: "nothing emits: a file is refused with a sentence, and the solver's light is 0",
    run: no_emission,
};
pub(super) const EMISSION: Case = Case {
    name: "emission",
    asked: "emission times 2^±30: light scales to the bit; times 1e-9 and 1e9: to rounding",
    run: emission,
};
pub(super) const BLACK: Case = Case {
    name: "black",
    asked: "reflectance 0 in a sphere half of which emits 1: irradiance 1/2 everywhere (closed form)",
    run: black,
};
pub(super) const WHITE: Case = Case {
    name: "white",
    asked: "reflectance 1 with a black lid: the lid takes all that is emitted (closed form); without a lid the bound is none",
    run: white,
};
pub(super) const MANY_SHOTS: Case = Case {
    name: "many_shots",
    asked: "10^5 shots of equal lights at one place: the light of one, times their number",
    run: many_shots,
};

/// Light of two solutions with another order of their last shots differs by their unshot light.
const REORDERED: f64 = 1e-5;
/// All that is sent arrives: 9.7e-8.
const SPHERE: f64 = 1e-6;
/// Energy on the lid: 1.9e-7.
const ENERGY: f64 = 1e-6;
/// Limit set for this case.
const DRIFT: f64 = 1e-6;

/// Not exact, since the last bit of a power may change the order of two equal sources.
fn fine() -> Settings {
    Settings {
        residual: 3e-6,
        ..settings()
    }
}

/// A room with a ball, a lamp and a point light, whose emission is `power` times that of the plain
/// one.
fn room(power: f32) -> Shapes {
    let mut shapes = Shapes::new();
    let light = shapes.material(0.3, 1.5 * power);
    shapes.room(DVec3::ZERO, DVec3::new(1.0, 0.9, 1.1), 6, 0);
    shapes.sphere(DVec3::new(0.6, 0.35, 0.5), 0.22, 2, true, 0);
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| 0.3 * axis);
    shapes.quad(DVec3::new(0.3, 0.85, 0.3), x, z, (2, 2), light);
    shapes.point_light(DVec3::new(0.3, 0.5, 0.8), 0.4 * power);
    shapes
}

fn scale(context: &Context) -> Result<Vec<Check>> {
    let here = context.solve(&room(1.0).scene, &fine())?;
    let check = |power: f64| {
        let factor = power.exp2();
        let mut scene = room(1.0).scene;
        for v in &mut scene.vertices {
            *v *= factor;
        }
        for light in &mut scene.lights.points {
            light.position *= factor;
            light.intensity = light.intensity.map(|i| i * (factor * factor) as f32);
        }
        let there = context.solve(&scene, &fine())?;
        let same = here.radiosity == there.radiosity;
        Ok(Check::holds(format!("the same bits at 2^{power}"), same))
    };
    [-20.0, 20.0].into_iter().map(check).collect()
}

fn offset(context: &Context) -> Result<Vec<Check>> {
    // Multiples of 2^-20 are exact at 10^6 as at 0.
    let held = |offset: f64| {
        let mut scene = room(1.0).scene;
        for v in &mut scene.vertices {
            *v = (*v * 20f64.exp2()).round() / 20f64.exp2() + offset;
        }
        for light in &mut scene.lights.points {
            light.position += offset;
        }
        context.solve(&scene, &fine())
    };
    let off = held(0.0)?.largest_difference(&held(1e6)?);
    Ok(vec![Check::at_most("largest difference", off, REORDERED)])
}

fn no_emission(context: &Context) -> Result<Vec<Check>> {
    let mut scene = room(0.0).scene;
    scene.lights.points.clear();
    let said = match through_files(&scene) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    };
    let solved = context.solve(&scene, &settings())?;
    let dark = solved.radiosity.iter().all(|b| b.max_element() == 0.0);
    Ok(vec![
        Check::holds(
            "the file is refused by name of the cause",
            said.contains("there is no light"),
        ),
        Check::holds("the solver's light is 0", dark),
    ])
}

fn emission(context: &Context) -> Result<Vec<Check>> {
    let plain = context.solve(&room(1.0).scene, &fine())?;
    let mut checks = Vec::new();
    for power in [30f32, -30.0] {
        let factor = power.exp2();
        let other = context.solve(&room(factor).scene, &fine())?;
        let same = plain
            .radiosity
            .iter()
            .zip(&other.radiosity)
            .all(|(a, b)| *a * factor == *b);
        checks.push(Check::holds(format!("the same bits at 2^{power}"), same));
    }
    for factor in [1e9f32, 1e-9] {
        let mut other = context.solve(&room(factor).scene, &fine())?;
        for b in &mut other.radiosity {
            *b /= factor;
        }
        let off = plain.largest_difference(&other);
        checks.push(Check::at_most(
            format!("largest difference at {factor:e}"),
            off,
            REORDERED,
        ));
    }
    Ok(checks)
}

fn black(context: &Context) -> Result<Vec<Check>> {
    let mut shapes = Shapes::new();
    let dark = shapes.material(0.0, 0.0);
    let lit = shapes.material(0.0, 1.0 / PI);
    let all = shapes.sphere(DVec3::ZERO, 1.0, 3, false, dark);
    // Cuts the sphere into halves of equal area; no triangle has its centroid in the plane.
    let axis = DVec3::new(0.31, 0.87, 0.23);
    for e in all.clone() {
        let t = shapes.scene.triangles[e];
        if shapes.scene.corners(&t).iter().sum::<DVec3>().dot(axis) > 0.0 {
            shapes.scene.triangles[e].material = lit;
        }
    }
    let solved = context.solve(&shapes.scene, &settings())?;
    let off = (solved.mean(&solved.irradiance, all) / 0.5 - 1.0).abs();
    Ok(vec![Check::at_most("mean irradiance off 1/2", off, SPHERE)])
}

fn white(context: &Context) -> Result<Vec<Check>> {
    let mut shapes = Shapes::new();
    let white = shapes.material(1.0, 0.0);
    let black = shapes.material(0.0, 0.0);
    let lamp = shapes.material(1.0, 1.0 / PI);
    let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 6, white);
    for (side, material) in [(0, lamp), (1, black)] {
        for t in &mut shapes.scene.triangles[sides[side].clone()] {
            t.material = material;
        }
    }
    let solved = context.solve(&shapes.scene, &settings())?;
    // The floor emits 1 over the area that the lid has.
    let off = (solved.mean(&solved.irradiance, sides[1].clone()) - 1.0).abs();
    let unbounded = solved.report.error_bound.is_none();
    for t in &mut shapes.scene.triangles[sides[1].clone()] {
        t.material = white;
    }
    // Nothing absorbs light here: there is no solution.
    let closed = context.solve(&shapes.scene, &settings())?.report;
    let stopped = closed.stop == StopReason::Unsolved;
    Ok(vec![
        Check::at_most("energy on the lid off that emitted", off, ENERGY),
        Check::holds("no error bound with a lid", unbounded),
        Check::holds(
            "no error bound, and no solution, without",
            closed.error_bound.is_none() && stopped,
        ),
    ])
}

fn many_shots(context: &Context) -> Result<Vec<Check>> {
    // Each light shoots once for each half of its sphere. A power of two, so that their shares are
    // exact.
    let count = match context.size {
        Size::Full => 1 << 16,
        Size::Small => 1 << 11,
    };
    let lit = |count: u32, intensity: f32| -> Scene {
        let mut shapes = Shapes::new();
        let black = shapes.material(0.0, 0.0);
        shapes.room(DVec3::ZERO, DVec3::new(1.0, 0.9, 1.1), 2, black);
        for _ in 0..count {
            shapes.point_light(DVec3::new(0.41, 0.37, 0.52), intensity);
        }
        shapes.scene
    };
    let coarse = Settings {
        hemicube: 8,
        ..settings()
    };
    let one = context.solve(&lit(1, 1.0), &coarse)?;
    let many = context.solve(&lit(count, 1.0 / count as f32), &coarse)?;
    let pairs = one.irradiance.iter().zip(&many.irradiance);
    let drift = pairs.map(|(a, b)| f64::from(((*b - *a) / *a).abs().max_element()));
    Ok(vec![
        Check::holds(
            format!("{} shots", 2 * count),
            many.report.shots == 2 * count,
        ),
        Check::at_most("largest drift", drift.fold(0.0, f64::max), DRIFT),
    ])
}
