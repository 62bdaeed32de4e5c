//! The passes for relief against their CPU twins, on tiny input.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3, Vec4};
use mesolux::constants::{KIND_POINT, NONE};
use mesolux::math::directions::Directions;
use mesolux::mesh::sources::Grouping;
use mesolux::meso::{Options, RANK, Transport};
use mesolux::passes::buffers::{SceneBuffers, State, download};
use mesolux::passes::gather::Part;
use mesolux::passes::near_to_relief::{NearParts, NearToRelief};
use mesolux::passes::relief_buffers::{ReliefBuffers, ReliefData};
use mesolux::passes::scene_data::SceneData;
use mesolux::passes::types::Reflected;
use mesolux::reference;
use mesolux::reference::near_to_relief::receive;
use mesolux::reference::send_relief::send_relief;
use mesolux::solver::{Settings, Solver};
use mesolux::vk::Commands;

const BATCH: u32 = 6;
const FACE: u32 = 32;

/// A room with an area light and a point light; four of its sides and a ball have a coloured
/// relief, and the ball glows.
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
        hemicube: FACE,
        // The twins look at one batch after another, all of one size.
        emitter_hemicube: Some(FACE),
        batch: BATCH,
        shots,
        // Sources that few batches see twice.
        grouping: Grouping {
            max_area: 1.0 / 512.0,
            max_power: 1.0 / 8.0,
            max_unevenness: f64::INFINITY,
            ..Grouping::default()
        },
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
    Solver::new(&device, elements, &build.scene.lights, &settings)
        .expect("the scene fits the device")
}

/// Sources that send at once, at most: what more send is found after the moments have changed.
const SENDING: u64 = 100;

/// What sources send, from the moments before: emission and first light as well as what follows.
#[test]
fn sources_send_as_their_twin() {
    for (transport, k) in [
        (Transport::Physical, 64),
        (Transport::Physical, 32),
        (Transport::Paper, 16),
    ] {
        let (mut seen, mut again, mut glowing, mut worst) = (0, 0, 0, 0.0_f64);
        let mut now = solver(transport, k, None);
        for steps in 1..=12 {
            // What is sent follows from the moments that lay there before.
            let light = now.light().expect("it comes back").relief;
            let light = light.expect("it has relief");
            let exits = |solver: &Solver, count: u64| {
                let exits = solver.relief_exits(count as usize).expect("they come back");
                exits.expect("it has relief")
            };
            let kept = exits(&now, 1).kept;
            let before = now.report().gathered_rows;
            now.run(|_| false).expect("a batch or two are gathered");
            let rows = now.report().gathered_rows - before;
            if rows == 0 || rows > SENDING {
                continue;
            }
            let sent = exits(&now, rows);
            let before = &now;
            let relief = before
                .problem
                .elements
                .relief
                .as_ref()
                .expect("it has relief");
            let directions = k as usize;
            for (i, slot) in sent.slots.iter().enumerate() {
                let of_relief = &before.problem.sources.relief;
                if slot.source == NONE || !of_relief.contains(&(slot.source as usize)) {
                    continue;
                }
                let source = &before.problem.sources.list[slot.source as usize];
                let first = (source.first_element - light.elements[0]) as usize;
                let members = first * RANK..(first + source.element_count as usize) * RANK;
                let own = (slot.source as usize - of_relief.start) * directions;
                let earlier: Vec<DVec3> = kept[own..own + directions]
                    .iter()
                    .map(|v| v.as_dvec3())
                    .collect();
                let twin = send_relief(
                    &before.problem.elements,
                    relief,
                    source,
                    &light.coefficients[members],
                    &earlier,
                    slot.emitted.as_dvec3(),
                    slot.reflected.as_dvec3(),
                );
                let row = |part: usize| &sent.exits[(2 * i + part) * directions..][..directions];
                // Sums of some 64 · 3 products in f32 and their differences from what was sent
                // before.
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

/// The light of one source: whatever its form factors, it lies in the slots as its twin spreads it.
#[test]
fn wide_sources_fill_slots_as_their_twin() {
    for k in [16, 64] {
        let mut solver = solver(Transport::Physical, k, Some(1));
        solver.run(|_| true).expect("the shot runs");
        let light = solver.light().expect("it comes back").relief;
        let light = light.expect("it has relief");
        let directions = Directions::new(k).expect("a number of the paper");
        // The strongest of all, by the twin of what chose it.
        let powers = solver.problem.sources.list.iter().map(|s| match s.kind {
            KIND_POINT => std::f64::consts::TAU * f64::from(s.emitted.x),
            _ => s.area * f64::from(s.emitted.x),
        });
        let strongest = powers
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let emitted = f64::from(
            solver.problem.sources.list[strongest.expect("some shine").0]
                .emitted
                .x,
        );
        let (mut wide, mut worst) = (0, 0.0f64);
        for moments in light.moments.chunks_exact(k as usize) {
            let red = || moments.iter().map(|m| m[0].as_dvec3());
            let whole: DVec3 = red().sum();
            let mut expected = vec![DVec3::ZERO; k as usize];
            let points = reference::disc::points(whole / emitted);
            // Rounding decides for points on the border of two slots.
            let slot = |v: DVec3| directions.slot_of(v.normalize());
            let nudge = 1e-5 * DVec3::new(0.6, 0.7, 0.4);
            if points
                .iter()
                .any(|&p| slot(p + nudge * p.length()) != slot(p - nudge * p.length()))
            {
                continue;
            }
            wide += usize::from(points.len() > 1);
            for point in points {
                expected[slot(point)] += emitted * point;
            }
            let off: f64 = red().zip(&expected).map(|(a, b)| a.distance(*b)).sum();
            worst = worst.max(off / whole.length().max(1e-9));
        }
        println!("K = {k}: {wide} elements see the light wide, {worst:.1e} lies elsewhere");
        assert!(wide > 20 && worst < 1e-4);
    }
    assert_silent();
}

/// Measured: 2.0e-7 and 2.3e-7. A device may round a point at the border of two slots to the other.
const APART: f64 = 1e-6;
/// Measured: 6.3e-6. The functions of a response are steep between some directions, and f32 knows
/// a place in their square to 1e-6 of a cell.
const HELD_APART: f64 = 1.3e-5;
const ELSEWHERE: f64 = 1e-3;

/// Light of near parts, of some size and of either sign.
#[test]
fn near_parts_bring_light_as_their_twin() {
    let k = 32;
    let mut build = Build::new();
    let floor = build.material(0.8, 0.0);
    build.relief(floor, 8, |x, y| {
        0.03 * (std::f64::consts::TAU * (x + y)).sin()
    });
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 8, 0);
    for t in &mut build.scene.triangles[sides[0].clone()] {
        t.material = floor;
    }
    build.uv(sides[0].clone(), DVec3::X, DVec3::Z);
    let settings = Settings {
        relief: Options {
            directions: Directions::new(k).expect("a number of the paper"),
            ..Options::default()
        },
        ..Settings::default()
    };
    let device = device();
    let elements = mesolux::bake::elements(&device, &build.scene, &settings).expect("it fits");
    let solver =
        Solver::new(&device, elements, &mesolux::scene::Lights::NONE, &settings).expect("it fits");
    let on = &solver.problem;
    let relief = on.elements.relief.as_ref().expect("it has relief");
    let (connections, occluders) = (&on.connections, &on.occluders);
    let scene = SceneData::new(&on.elements, &on.sources, connections, occluders, &on.near);
    let scene = SceneBuffers::new(&device, &scene, scene.shape).expect("it fits");
    let state = State::new(&device, &scene).expect("it fits");
    let buffers = ReliefData::new(&on.elements, relief, &on.sources);
    let buffers = ReliefBuffers::new(&device, &buffers).expect("it fits");
    let pass = NearToRelief::new(&device, &NearParts::new(&on.near), &state, &buffers);
    let pass = pass.expect("it is made");
    let pass = pass.expect("relief sees near sources");
    let light = |i: u32| Vec3::new((i % 7) as f32 - 2.0, (i % 5) as f32, 0.5 * (i % 3) as f32);
    let beyond: Vec<Vec3> = (0..on.near.parts).map(light).collect();
    pass.write(Part::Reflected, &beyond).expect("it is written");
    Commands::run(&device, "near to relief", |cmd| {
        pass.record(cmd, Part::Reflected);
        Ok(())
    })
    .expect("it runs");
    let count = buffers.shape.element_count as usize;
    let moments: Vec<[Vec3; 3]> =
        download(&device, &buffers.moments_indirect, count * k as usize).expect("it comes");
    let coefficients: Vec<Vec4> =
        download(&device, &buffers.coefficients, count * RANK).expect("it comes");
    let reflected: Vec<Reflected> = download(&device, &buffers.reflected, count).expect("it comes");
    let irradiance: Vec<Vec3> =
        download(&device, &state.indirect, on.elements.len()).expect("it comes");
    let (mut lit, mut worst, mut held_apart, mut elsewhere) = (0, 0.0_f64, 0.0_f64, 0.0_f64);
    for m in 0..count {
        let e = on.elements.plain_count() + m;
        let parts = on.near.relief_entries.of(m);
        let twin = receive(relief, e, parts, &beyond);
        lit += usize::from(!parts.is_empty());
        let found = [irradiance[e], reflected[m].sum].map(|v| v.as_dvec3());
        worst = worst.max(apart(
            found.into_iter(),
            [twin.irradiance, twin.reflected].iter(),
        ));
        let held = coefficients[m * RANK..][..RANK].iter();
        held_apart = held_apart.max(apart(
            held.map(|c| c.truncate().as_dvec3()),
            twin.coefficients.iter(),
        ));
        // Rounding decides for points on the border of two slots.
        let of = moments[m * k as usize..][..k as usize].iter();
        let off = of
            .zip(&twin.moments)
            .flat_map(|(found, twin)| (0..3).map(|c| found[c].as_dvec3().distance(twin[c])));
        let whole: f64 = twin.moments.iter().flatten().map(|v| v.length()).sum();
        elsewhere = elsewhere.max(off.sum::<f64>() / whole.max(1e-9));
    }
    println!(
        "{lit} elements: {worst:.1e} apart, coefficients {held_apart:.1e}, {elsewhere:.1e} of the moments in other slots"
    );
    assert!(lit > 100 && worst < APART && held_apart < HELD_APART && elsewhere < ELSEWHERE);
    assert_silent();
}

/// Largest difference of what is in f32 and what is in f64, as a share of the largest.
fn apart<'a>(
    found: impl Iterator<Item = DVec3>,
    expected: impl Iterator<Item = &'a DVec3> + Clone,
) -> f64 {
    let largest = expected.clone().map(|v| v.abs().max_element());
    let largest = largest.fold(f64::MIN_POSITIVE, f64::max);
    let apart = found
        .zip(expected)
        .map(|(a, b)| (a - *b).abs().max_element());
    apart.fold(0.0, f64::max) / largest
}
