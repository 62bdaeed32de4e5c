//! The passes for relief against their CPU twins, on tiny input.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::constants::NONE;
use mesolux::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::reference::send_relief::send_relief;
use mesolux::solver::{Settings, Solver};

const BATCH: u32 = 6;

/// A room with an area light and a point light; four of its sides and a ball have a coloured relief, and the ball glows.
fn scene() -> Build {
    let mut build = Build::new();
    let floor = build.material(0.8, 0.0);
    let ball = build.material(0.6, 0.3);
    let lamp = build.material(0.2, 3.0);
    build.scene.materials[floor as usize].kd = [0.9, 0.5, 0.3];
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    build.relief(floor, 8, |x, y| 0.03 * wave(x) * wave(y));
    build.relief(ball, 6, |x, y| 0.02 * wave(x + y));
    let sides = build.room(DVec3::ZERO, DVec3::new(1.0, 1.0, 1.0), 4, 0);
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 0.25 * axis);
    for (side, [u, v]) in sides.iter().zip([[2, 0], [2, 0], [1, 2], [1, 2]]) {
        for t in &mut build.scene.triangles[side.clone()] {
            t.material = floor;
        }
        build.uv(side.clone(), axes[u], axes[v]);
    }
    let sphere = build.sphere(DVec3::new(0.5, 0.4, 0.5), 0.2, 1, true, ball);
    build.uv(
        sphere,
        DVec3::new(0.2, 0.05, 0.0),
        DVec3::new(0.0, 0.1, 0.2),
    );
    let lamp = build.quad(
        DVec3::new(0.3, 0.95, 0.3),
        DVec3::X * 0.4,
        DVec3::Z * 0.4,
        (2, 2),
        lamp,
    );
    assert!(!lamp.is_empty());
    build.point_light(DVec3::new(0.2, 0.7, 0.8), 0.3);
    build
}

fn solver(transport: Transport, k: u32, shots: Option<u32>) -> Solver {
    let build = scene();
    let settings = Settings {
        hemicube: 32,
        batch: BATCH,
        shots,
        // Every shot is drawn, so that a batch is BATCH of them.
        visibility_memory: Some(0),
        relief: Options {
            transport,
            directions: Directions::new(k).expect("a number of the paper"),
            cache: None,
        },
        ..Settings::default()
    };
    let device = device();
    let elements = mesolux::bake::elements(&device, &build.scene, &settings)
        .expect("the relief fits the device");
    Solver::new(&device, elements, &build.scene.point_lights, &settings)
        .expect("the scene fits the device")
}

/// What the sources of one batch send, from the moments before it: emission and first light as well as second shots.
#[test]
fn sources_send_as_their_twin() {
    for (transport, k) in [
        (Transport::Physical, 64),
        (Transport::Physical, 32),
        (Transport::Paper, 16),
    ] {
        let (mut seen, mut again, mut glowing, mut worst) = (0, 0, 0, 0.0_f64);
        let mut now = solver(transport, k, None);
        for steps in 1..=125 {
            // Two submissions a step. What the last one sent is told by what lay there before it.
            now.run_batches(1, |_| ()).expect("a batch runs");
            if steps > 4 && (steps < 100 || steps % 25 != 0) {
                continue;
            }
            let sent = now
                .relief_exits()
                .expect("they come back")
                .expect("it has relief");
            let mut before = solver(transport, k, Some((2 * steps - 1) * BATCH));
            before.run(|_| true).expect("it runs");
            let kept = before
                .relief_exits()
                .expect("they come back")
                .expect("it has relief")
                .kept;
            let light = before
                .light()
                .expect("it comes back")
                .relief
                .expect("it has relief");
            let relief = before.elements.relief.as_ref().expect("it has relief");
            let directions = k as usize;
            for (i, slot) in sent.slots.iter().enumerate() {
                let of_relief = &before.sources.relief;
                if slot.source == NONE || !of_relief.contains(&(slot.source as usize)) {
                    continue;
                }
                let source = &before.sources.list[slot.source as usize];
                let first = (source.first_element - light.elements[0]) as usize;
                let members =
                    first * directions..(first + source.element_count as usize) * directions;
                let own = (slot.source as usize - of_relief.start) * directions;
                let earlier: Vec<DVec3> = kept[own..own + directions]
                    .iter()
                    .map(|v| v.as_dvec3())
                    .collect();
                let twin = send_relief(
                    (&before.elements, relief),
                    source,
                    &light.moments[members],
                    &earlier,
                    (slot.emitted.as_dvec3(), slot.reflected.as_dvec3()),
                );
                let row = |part: usize| &sent.exits[(2 * i + part) * directions..][..directions];
                // Sums of some 64 · 3 products in f32 and their differences from what was sent before.
                let scale = twin
                    .kept
                    .iter()
                    .chain(&twin.emitted)
                    .map(|v| v.max_element())
                    .fold(0.0, f64::max);
                let compare = |found: &[Vec3], expected: &[DVec3]| {
                    found
                        .iter()
                        .zip(expected)
                        .map(|(a, b)| (a.as_dvec3() - *b).abs().max_element())
                        .fold(0.0, f64::max)
                };
                let error = compare(row(0), &twin.emitted)
                    .max(compare(row(1), &twin.reflected))
                    .max(compare(&sent.kept[own..own + directions], &twin.kept));
                worst = worst.max(error / scale);
                assert!(
                    error <= 2e-5 * scale,
                    "steps {steps}, source {}: {error:.1e} of {scale:.1e}",
                    slot.source
                );
                seen += 1;
                again += u32::from(earlier.iter().any(|v| *v != DVec3::ZERO));
                glowing += u32::from(slot.emitted != Vec3::ZERO);
            }
        }
        println!(
            "{transport:?}, K = {k}: {seen} sources, {again} not for the first time, {glowing} glowing: largest difference {worst:.1e}"
        );
        assert!(seen > 10 && again > 3 && glowing > 0);
    }
    assert_silent();
}

/// Slots that no light has reached are left out and counted.
#[test]
fn dark_slots_are_counted() {
    let mut solver = solver(Transport::Physical, 64, Some(40));
    solver.run(|_| true).expect("it runs");
    assert!(solver.report().skipped.dark_slots > 0);
    let shots_of_relief = solver
        .relief_exits()
        .expect("they come back")
        .expect("it has relief")
        .kept;
    assert!(shots_of_relief.iter().any(|v| *v != Vec3::ZERO));
    assert_silent();
}
