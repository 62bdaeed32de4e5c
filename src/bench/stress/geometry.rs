//! Surfaces that touch, cross, lie very close together, or are tiny.

use std::f32::consts::PI;

use glam::DVec3;

use super::{Case, Check, Context, Size, furnace_limit, furnace_material, settings};
use crate::error::Result;
use crate::path_tracer::{NORMAL_95, PathTracer};
use crate::render::Light;
use crate::scene::shapes::Shapes;
use crate::solver::Settings;

pub(super) const TOUCHING: Case = Case {
    name: "touching",
    asked: "a box that stands on the floor of a closed furnace, edges on edges: radiosity 1 on all that is not covered",
    run: touching,
};
pub(super) const INTERPENETRATING: Case = Case {
    name: "interpenetrating",
    asked: "two balls that cross in a closed furnace: radiosity 1 on all that lies outside both",
    run: interpenetrating,
};
pub(super) const THIN_GAP: Case = Case {
    name: "thin_gap",
    asked: "a lamp 1e-3 of an element below a ceiling: no light behind it when it faces down, all of it when up",
    run: thin_gap,
};
pub(super) const OPEN_SHEET: Case = Case {
    name: "open_sheet",
    asked: "an open black sheet below a lamp: the same shadow either way round, as path traced; a lamp's back is dark",
    run: open_sheet,
};
pub(super) const ONE_PIXEL: Case = Case {
    name: "one_pixel",
    asked: "a ball of many elements that a hemicube sees as one pixel, in a closed furnace: radiosity 1",
    run: one_pixel,
};

// Limits are near twice what the larger of both sizes measured, which stands beside them.

/// Contacts: 1.6e-3, 6.0e-3.
const CONTACT_RMS: f64 = 3e-3;
const CONTACT_MOST: f64 = 1.2e-2;
/// Elements crossed by the other ball's surface send the mean of a lit and a dark part, which
/// affects their neighbours: 3.3e-3.
const CROSSING_MEAN: f64 = 6e-3;
/// Light through a gap of 1e-3 of an element: 1.8e-5.
const LEAK: f64 = 4e-5;
/// At this gap the lamp fills all but little of the hemisphere: 5.5e-5.
const FULL: f64 = 1.2e-4;
/// Elements of an eighth have penumbrae within them: 3.5e-3.
const SHADOW_BIAS: f64 = 7e-3;
/// The two sheets differ only in their winding.
const EITHER_WAY: f64 = 1e-6;
/// The whole ball covers one or two pixels; its rms is that of plain and far elements: 1.7e-3.
const TINY_RMS: f64 = 3.5e-3;

fn touching(context: &Context) -> Result<Vec<Check>> {
    let mut shapes = Shapes::new();
    let material = furnace_material(&mut shapes, 0.6);
    let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 8, material);
    let low = DVec3::new(0.25, 0.0, 0.25);
    let solid = shapes.solid(low, DVec3::splat(0.5), 4, material);
    let scene = &shapes.scene;
    let solved = context.solve(scene, &Settings::default())?;
    let covered = |e: usize| {
        let inside = |v: &DVec3| (v.x - 0.5).abs() <= 0.25 && (v.z - 0.5).abs() <= 0.25;
        let floor = sides[0].contains(&e) && scene.corners(&scene.triangles[e]).iter().all(inside);
        floor || solid[0].contains(&e)
    };
    let (rms, most) = solved.off_one((0..solved.area.len()).filter(|&e| !covered(e)));
    Ok(vec![
        Check::at_most("rms off 1", rms, CONTACT_RMS),
        Check::at_most("largest", most, CONTACT_MOST),
    ])
}

fn interpenetrating(context: &Context) -> Result<Vec<Check>> {
    let mut shapes = Shapes::new();
    let material = furnace_material(&mut shapes, 0.6);
    shapes.room(DVec3::ZERO, DVec3::ONE, 8, material);
    let balls = [0.4, 0.6].map(|x| DVec3::new(x, 0.5, 0.5));
    let levels = match context.size {
        Size::Small => 2,
        Size::Full => 3,
    };
    for centre in balls {
        shapes.sphere(centre, 0.2, levels, true, material);
    }
    let scene = &shapes.scene;
    let solved = context.solve(scene, &settings())?;
    // Corners of one ball lie on it to rounding.
    let clear = |v: &DVec3| balls.iter().all(|c| v.distance(*c) > 0.2 - 1e-9);
    let outside =
        (0..solved.area.len()).filter(|&e| scene.corners(&scene.triangles[e]).iter().all(clear));
    let off = (solved.mean(&solved.radiosity, outside) - 1.0).abs();
    Ok(vec![Check::at_most("mean off 1", off, CROSSING_MEAN)])
}

fn thin_gap(context: &Context) -> Result<Vec<Check>> {
    // Squares of an eighth.
    const GAP: f64 = 1e-3 / 8.0;
    let lit = |up: bool| {
        let mut shapes = Shapes::new();
        let lamp = shapes.material(0.0, 1.0 / PI);
        let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 8, 0);
        let (x, z) = (0.5 * DVec3::X, 0.5 * DVec3::Z);
        let corner = DVec3::new(0.25, 1.0 - GAP, 0.25);
        let (u, v) = if up { (z, x) } else { (x, z) };
        shapes.quad(corner, u, v, (4, 4), lamp);
        let scene = shapes.scene;
        let inside = |v: &DVec3| (v.x - 0.5).abs() <= 0.25 && (v.z - 0.5).abs() <= 0.25;
        let covered: Vec<usize> = sides[1]
            .clone()
            .filter(|&e| scene.corners(&scene.triangles[e]).iter().all(inside))
            .collect();
        let solved = context.solve(&scene, &settings())?;
        let behind = solved.mean(&solved.irradiance, covered.iter().copied());
        let open = sides[1].clone().filter(|e| !covered.contains(e));
        Ok((behind, solved.mean(&solved.irradiance, open)))
    };
    let (behind, open) = lit(false)?;
    let (facing, _) = lit(true)?;
    // The lamp is black: light that the ceiling reflects to it is not reflected again.
    Ok(vec![
        Check::at_most("behind the lamp over beside it", behind / open, LEAK),
        Check::at_most(
            "facing the lamp, off its radiosity",
            (facing - 1.0).abs(),
            FULL,
        ),
    ])
}

fn open_sheet(context: &Context) -> Result<Vec<Check>> {
    let lit = |sheet_up: bool, lamp_up: bool| {
        let mut shapes = Shapes::new();
        let black = shapes.material(0.0, 0.0);
        let lamp = shapes.material(0.0, 1.0 / PI);
        let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 8, black);
        let mut plate = |corner: DVec3, side: f64, up: bool, material: u32| {
            let (x, z) = (side * DVec3::X, side * DVec3::Z);
            let (u, v) = if up { (z, x) } else { (x, z) };
            shapes.quad(corner, u, v, (4, 4), material);
        };
        plate(DVec3::new(0.3, 0.5, 0.3), 0.4, sheet_up, black);
        plate(DVec3::new(0.3, 0.9, 0.3), 0.4, lamp_up, lamp);
        let solved = context.solve(&shapes.scene, &settings())?;
        Ok((solved, sides[0].clone(), shapes.scene))
    };
    let (up, floor, scene) = lit(true, false)?;
    let (down, _, _) = lit(false, false)?;
    let (backward, _, _) = lit(true, true)?;
    let mean = up.mean(&up.irradiance, floor.clone());
    let apart = floor
        .clone()
        .map(|e| f64::from((up.irradiance[e] - down.irradiance[e]).abs().x));
    let tracer = PathTracer::new(&scene)?;
    let (mut truth, mut noise, mut found) = (0.0, 0.0, 0.0);
    for e in floor.clone() {
        let centroid = scene.corners(&scene.triangles[e]).iter().sum::<DVec3>() / 3.0;
        let (value, error) = tracer.irradiance(centroid, DVec3::Y, 2000, e as u64, Light::Global);
        truth += f64::from(value.x);
        noise += f64::from(error.x).powi(2);
        found += f64::from(up.irradiance[e].x);
    }
    let bias = (found / truth - 1.0).abs();
    let interval = NORMAL_95 * noise.sqrt() / truth;
    let dark = floor.map(|e| backward.irradiance[e].x).all(|e| e == 0.0);
    Ok(vec![
        Check::at_most(
            "largest difference by winding",
            apart.fold(0.0, f64::max) / mean,
            EITHER_WAY,
        ),
        Check::at_most("bias against paths", bias, SHADOW_BIAS + interval),
        Check::holds("a lamp's back is dark", dark),
    ])
}

fn one_pixel(context: &Context) -> Result<Vec<Check>> {
    // 5,120 or 1,310,720 triangles.
    let levels = match context.size {
        Size::Small => 4,
        Size::Full => 8,
    };
    let mut shapes = Shapes::new();
    let material = furnace_material(&mut shapes, 0.6);
    let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 6, material);
    // A pixel in the middle of a face is 2/16 of its distance wide. The walls' emission is drawn as
    // well: shadow rays would aim at each of the ball's elements.
    let coarse = Settings {
        hemicube: 16,
        emitter_hemicube: Some(16),
        ..settings()
    };
    let ball = shapes.sphere(DVec3::splat(0.52), 0.01, levels, true, material);
    let solved = context.solve(&shapes.scene, &coarse)?;
    let (rms, _) = solved.off_one(ball.clone());
    let (_, most) = solved.off_one(0..sides[5].end);
    Ok(vec![
        Check::at_most(
            format!("rms of {} elements off 1", ball.len()),
            rms,
            TINY_RMS,
        ),
        Check::at_most("largest in the room", most, furnace_limit(0.6)),
    ])
}
