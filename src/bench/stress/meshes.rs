//! Badly shaped triangles.

use glam::DVec3;

use super::{Case, Check, Context, Size, furnace_limit, furnace_material, settings, through_files};
use crate::bench::irradiance;
use crate::bench::places::Sample;
use crate::bench::truth::Wanted;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::shapes::Shapes;
use crate::solver::Settings;

pub(super) const SLIVERS: Case = Case {
    name: "slivers",
    asked: "a wall that ends in slivers of 10^6:1 and 10^9:1 in a closed furnace: radiosity 1",
    run: slivers,
};
pub(super) const SPECKS: Case = Case {
    name: "specks",
    asked: "balls of a millionth and a thousand millionth of the room in a closed furnace: radiosity 1",
    run: specks,
};
pub(super) const DEGENERATE: Case = Case {
    name: "degenerate",
    asked: "triangles without area in a file: counted, and the light to the bit as without them",
    run: degenerate,
};
pub(super) const DUPLICATES: Case = Case {
    name: "duplicates",
    asked: "each triangle of a file twice, corners turned: counted, and the light to the bit as of one",
    run: duplicates,
};
pub(super) const SHUFFLED: Case = Case {
    name: "shuffled",
    asked: "triangles in another order, a poster in the plane of a wall among them: the same light for each",
    run: shuffled,
};
pub(super) const NON_MANIFOLD: Case = Case {
    name: "non_manifold",
    asked: "four sheets that share one edge in a lit room: irradiance of the path tracer",
    run: non_manifold,
};

/// Two solutions with another order of their last shots differ by their unshot light, and sources
/// cut at other triangles have other hemicubes, of 64² pixels here.
const REORDERED: f64 = 1e-5;
/// Bias and rms against paths, squares of an eighth of the room having penumbrae within them.
/// Measured: 1.2e-3, 1.04e-2.
const BIAS: f64 = 2.5e-3;
const RMS: f64 = 0.02;

/// A closed furnace whose floor ends in two slivers of the given width, over a length of 1.
fn sliver_room(width: f64) -> Scene {
    let mut shapes = Shapes::new();
    let material = furnace_material(&mut shapes, 0.7);
    let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 6, material);
    // The floor comes first.
    let rest = shapes.scene.triangles.split_off(sides[0].end);
    shapes.scene.triangles.clear();
    let plain = DVec3::X * (1.0 - width);
    shapes.quad(DVec3::ZERO, DVec3::Z, plain, (6, 6), material);
    shapes.quad(plain, DVec3::Z, DVec3::X * width, (1, 1), material);
    shapes.scene.triangles.extend(rest);
    shapes.weld();
    shapes.scene
}

fn slivers(context: &Context) -> Result<Vec<Check>> {
    let mut checks = Vec::new();
    for width in [1e-6, 1e-9] {
        let solved = context.solve(&sliver_room(width), &settings())?;
        // The floor's 72 plain triangles come first.
        let slivers = 72..74;
        let rest = (0..solved.area.len()).filter(|e| !slivers.contains(e));
        let (limit, most) = (furnace_limit(0.7), solved.off_one(rest).1);
        checks.push(Check::at_most(
            format!("largest error beside them at {width:e}"),
            most,
            limit,
        ));
        let most = solved.off_one(slivers).1;
        checks.push(Check::at_most(format!("on them at {width:e}"), most, limit));
    }
    Ok(checks)
}

fn specks(context: &Context) -> Result<Vec<Check>> {
    let check = |radius: f64| {
        let mut shapes = Shapes::new();
        let material = furnace_material(&mut shapes, 0.7);
        shapes.room(DVec3::ZERO, DVec3::ONE, 6, material);
        shapes.sphere(DVec3::new(0.4, 0.6, 0.45), radius, 1, true, material);
        let solved = context.solve(&shapes.scene, &settings())?;
        let most = solved.off_one(0..solved.area.len()).1;
        Ok(Check::at_most(
            format!("largest error at {radius:e}"),
            most,
            furnace_limit(0.7),
        ))
    };
    [1e-6, 1e-9].into_iter().map(check).collect()
}

/// A room with a ball and a lamp.
fn lit_room() -> Shapes {
    let mut shapes = Shapes::new();
    let lamp = shapes.material(0.2, 2.0);
    shapes.room(DVec3::ZERO, DVec3::ONE, 6, 0);
    shapes.sphere(DVec3::new(0.6, 0.35, 0.5), 0.2, 2, true, 0);
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| 0.4 * axis);
    shapes.quad(DVec3::new(0.3, 0.95, 0.3), x, z, (2, 2), lamp);
    shapes.weld();
    shapes
}

fn degenerate(context: &Context) -> Result<Vec<Check>> {
    let clean = through_files(&lit_room().scene)?;
    let mut bad = lit_room();
    let [a, b, c] = bad.scene.triangles[0].vertices;
    let middle = 0.5 * (bad.scene.vertices[a as usize] + bad.scene.vertices[b as usize]);
    let middle = bad.vertex(middle);
    for corners in [[a, a, b], [c, c, c], [a, middle, b]] {
        bad.triangle(corners, 0);
    }
    let read = through_files(&bad.scene)?;
    let (clean, other) = (
        context.solve(&clean, &settings())?,
        context.solve(&read, &settings())?,
    );
    Ok(vec![
        Check::holds("all three are counted", read.dropped_degenerate == 3),
        Check::holds("the same bits", clean.radiosity == other.radiosity),
    ])
}

fn duplicates(context: &Context) -> Result<Vec<Check>> {
    let clean = through_files(&lit_room().scene)?;
    let mut bad = lit_room();
    let count = bad.scene.triangles.len();
    for e in 0..count {
        let mut again = bad.scene.triangles[e];
        again.vertices.rotate_left(e % 3);
        bad.scene.triangles.push(again);
    }
    let read = through_files(&bad.scene)?;
    let (clean, other) = (
        context.solve(&clean, &settings())?,
        context.solve(&read, &settings())?,
    );
    Ok(vec![
        Check::holds("all are counted", read.dropped_duplicates == count),
        Check::holds("the same bits", clean.radiosity == other.radiosity),
    ])
}

fn shuffled(context: &Context) -> Result<Vec<Check>> {
    let check = |poster: bool, limit: f64| {
        let mut shapes = lit_room();
        if poster {
            // Faces the room from the plane z = 0, over parts of its triangles.
            let [x, y] = [DVec3::X, DVec3::Y].map(|axis| 0.41 * axis);
            let paint = shapes.material(0.8, 0.0);
            shapes.quad(DVec3::new(0.27, 0.23, 0.0), x, y, (3, 3), paint);
        }
        let fine = Settings {
            residual: 3e-6,
            ..settings()
        };
        let plain = context.solve(&shapes.scene, &fine)?;
        let count = shapes.scene.triangles.len();
        let mut order: Vec<usize> = (0..count).collect();
        let mut state = 7u64;
        for i in (1..count).rev() {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            order.swap(i, (state >> 33) as usize % (i + 1));
        }
        let mut scene = shapes.scene.clone();
        scene.triangles = order.iter().map(|&e| shapes.scene.triangles[e]).collect();
        let mut other = context.solve(&scene, &fine)?;
        let found = other.radiosity.clone();
        for (at, &e) in order.iter().enumerate() {
            other.radiosity[e] = found[at];
        }
        let off = plain.largest_difference(&other);
        let name = if poster { "with the poster" } else { "without" };
        Ok(Check::at_most(
            format!("largest difference {name}"),
            off,
            limit,
        ))
    };
    [check(false, REORDERED), check(true, REORDERED)]
        .into_iter()
        .collect()
}

fn non_manifold(context: &Context) -> Result<Vec<Check>> {
    let mut shapes = Shapes::new();
    let lamp = shapes.material(0.2, 2.0);
    shapes.room(DVec3::ZERO, DVec3::ONE, 8, 0);
    let foot = DVec3::new(0.5, 0.2, 0.3);
    let (up, along) = (0.4 * DVec3::Y, 0.4 * DVec3::Z);
    for arm in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y] {
        // Both sides of each sheet.
        let arm = if arm.y == 0.0 {
            0.3 * arm
        } else {
            0.4 * arm * up.y
        };
        shapes.quad(foot, arm, along, (4, 4), 0);
        shapes.quad(foot, along, arm, (4, 4), 0);
    }
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| 0.4 * axis);
    shapes.quad(DVec3::new(0.3, 0.95, 0.3), x, z, (2, 2), lamp);
    shapes.weld();
    let solved = context.solve(&shapes.scene, &settings())?;
    let paths = match context.size {
        Size::Small => 500,
        Size::Full => 4000,
    };
    let wanted = Wanted {
        sample: Sample::Some(200),
        paths,
        seed: 0,
        direct: false,
    };
    let measured = irradiance::of_elements(&shapes.scene, &solved.irradiance, &wanted, &|| true)?;
    let checks = measured.into_iter().flat_map(|measure| {
        let found = measure.centroids;
        [
            Check::at_most("bias", found.bias.abs(), BIAS),
            Check::at_most("rms", found.rms, RMS),
        ]
    });
    Ok(checks.collect())
}
