//! Each GPU pass against its CPU twin, on tiny input.

mod common;

use std::cell::Cell;
use std::collections::BTreeSet;

use common::{Build, assert_silent, device};
use glam::DVec3;
use mesolux::constants::NONE;
use mesolux::mesh::elements::Elements;
use mesolux::mesh::near::Nearness;
use mesolux::mesh::sources::Source;
use mesolux::passes::cull::Culling;
use mesolux::reference;
use mesolux::reference::form_factors::Verdict;
use mesolux::solver::{Estimator, Problem, Report, Settings, Solver};

const FACE: u32 = 32;

/// An open room with a sphere, a sheet seen from behind, an emitter and a point light.
fn scene() -> Build {
    let mut build = Build::new();
    let light = build.material(0.2, 2.0);
    build.room(DVec3::ZERO, DVec3::new(1.0, 0.9, 1.1), 5, 0);
    build.sphere(DVec3::new(0.6, 0.35, 0.5), 0.22, 2, true, 0);
    build.quad(
        DVec3::new(0.2, 0.2, 0.2),
        DVec3::new(0.2, 0.1, 0.0),
        DVec3::Y * 0.3,
        (2, 2),
        0,
    );
    build.quad(
        DVec3::new(0.3, 0.85, 0.3),
        DVec3::X * 0.3,
        DVec3::Z * 0.3,
        (2, 2),
        light,
    );
    build.point_light(DVec3::new(0.3, 0.5, 0.8), 0.4);
    build
}

/// A closed room with a ball that emits.
fn enclosed() -> Build {
    let mut build = Build::new();
    let light = build.material(0.2, 2.0);
    build.room(DVec3::ZERO, DVec3::new(1.0, 0.9, 1.1), 5, 0);
    build.sphere(DVec3::new(0.6, 0.35, 0.5), 0.22, 2, true, light);
    build
}

fn solver(build: &Build, estimator: Estimator, culling: Culling, shots: u32) -> Solver {
    solve_so(
        build,
        &Settings {
            estimator,
            culling,
            shots: Some(shots),
            ..settings()
        },
    )
}

fn settings() -> Settings {
    Settings {
        hemicube: FACE,
        // The twins look at one batch after another, all of one size.
        emitter_hemicube: Some(FACE),
        batch: 6,
        // The twins know one visibility a source: that of its eye.
        nearness: Nearness::NONE,
        silhouettes: false,
        ..Settings::default()
    }
}

fn solve_so(build: &Build, settings: &Settings) -> Solver {
    Solver::new(
        &device(),
        Elements::new(&build.scene),
        &build.scene.lights,
        settings,
    )
    .expect("the scene fits the device")
}

/// The slots' item buffers one by one.
fn columns(items: &[u32], slots: usize) -> Vec<Vec<u32>> {
    let n = FACE as usize;
    (0..slots)
        .map(|slot| {
            (0..3 * n * n)
                .map(|i| items[(i / n * slots + slot) * n + i % n])
                .collect()
        })
        .collect()
}

#[test]
fn item_buffers_equal_rays_and_culling_changes_nothing() {
    let mut first: Option<Vec<u32>> = None;
    for culling in [Culling::Off, Culling::Meshlets, Culling::Triangles] {
        let mut solver = solver(&scene(), Estimator::Receiver, culling, 200);
        let mut buffers = Vec::new();
        let count = solver.problem.sources.list.len() as u32;
        for first in (0..count.min(48)).step_by(6) {
            let sources: Vec<u32> = (first..count.min(first + 6)).collect();
            let drawn = solver.draw(&sources).expect("a batch is drawn");
            for (slot, column) in (columns(&drawn.items, drawn.slots as usize).iter()).enumerate() {
                let Some(&source) = sources.get(slot) else {
                    assert!(
                        column.iter().all(|&i| i == NONE),
                        "an empty slot draws nothing"
                    );
                    continue;
                };
                let source = &solver.problem.sources.list[source as usize];
                let wrong = reference::item_buffer::disagreements(
                    &solver.problem.elements,
                    &solver.problem.connections,
                    &solver.problem.occluders,
                    source,
                    FACE,
                    column,
                );
                assert!(
                    wrong.is_empty(),
                    "{culling:?}: pixels differ from what rays meet (pixel, expected, drawn): {wrong:?}"
                );
                if culling == Culling::Off {
                    let all = drawn_without_culling(&solver, source);
                    let of_slot = &drawn.counts[slot];
                    assert!(
                        of_slot.iter().all(|&[_, _, d]| d as usize == all),
                        "{all} are to be drawn: {of_slot:?}"
                    );
                }
            }
            buffers.extend(drawn.items);
        }
        assert!(buffers.iter().any(|&i| i != NONE));
        match &first {
            None => first = Some(buffers),
            Some(first) => {
                // Where two surfaces meet to rounding, either may win; nowhere else.
                let differing = first.iter().zip(&buffers).filter(|(a, b)| a != b).count();
                assert_eq!(differing, 0, "{culling:?} changes {differing} pixels");
            }
        }
    }
    assert_silent();
}

/// Occluders that each face of a source's hemicube draws where none is culled.
fn drawn_without_culling(solver: &Solver, source: &Source) -> usize {
    let is_left_out = |&i: &usize| {
        reference::item_buffer::is_left_out(
            &solver.problem.elements,
            &solver.problem.connections,
            &solver.problem.occluders,
            source,
            i,
        )
    };
    (0..solver.problem.occluders.len())
        .filter(|i| !is_left_out(i))
        .count()
}

/// Whether lists hold all triangles of a face or are filled again and again, and whether blocks of
/// receivers are passed over as a whole or one by one: the same light, and the same counts.
#[test]
fn light_does_not_depend_on_lists_nor_on_blocks() {
    let build = enclosed();
    let solve = |culling, list_room| {
        let settings = Settings {
            culling,
            list_room,
            merging: false,
            shots: Some(400),
            // No rays: all is drawn.
            ..settings()
        };
        let solved = build.solve(&settings);
        (solved.irradiance, solved.report)
    };
    let (light, report) = solve(Culling::Triangles, None);
    // Of 620 triangles: a meshlet or two at a time.
    let (in_parts, of_parts) = solve(Culling::Triangles, Some(100));
    assert!(light == in_parts, "lists in parts change the light");
    assert_eq!(report.triangles_drawn, of_parts.triangles_drawn);
    assert_eq!(
        report.skipped.meshlets_culled,
        of_parts.skipped.meshlets_culled
    );
    assert_eq!(
        report.skipped.triangles_culled,
        of_parts.skipped.triangles_culled
    );
    let (one_by_one, of_all) = solve(Culling::Off, None);
    assert!(light == one_by_one, "passing over blocks changes the light");
    let away = |report: &Report| report.skipped.receivers_facing_away;
    assert!(away(&report) > 0);
    assert_eq!(away(&report), away(&of_all));
    // More slots than a dispatch sorts for: sources are shot in another order.
    let [narrow, wide] = [6, 50].map(|batch| {
        let solved = build.solve(&Settings {
            batch,
            residual: 1e-6,
            ..settings()
        });
        assert_eq!(solved.report.batch, batch);
        solved.irradiance
    });
    let mean = narrow.iter().map(|e| e.element_sum()).sum::<f32>() / narrow.len() as f32;
    let apart = narrow
        .iter()
        .zip(&wide)
        .map(|(a, b)| (*a - *b).element_sum().abs());
    let most = apart.fold(0.0, f32::max) / mean;
    assert!(most < 1e-3, "light is {most} apart");
    assert_silent();
}

#[test]
fn culling_keeps_every_element_that_owns_a_pixel() {
    let mut solver = solver(&scene(), Estimator::Receiver, Culling::Triangles, 6);
    let sources = strongest(&solver, 6);
    let counts = solver.draw(&sources).expect("a batch is drawn").counts;
    for (slot, &source) in sources.iter().enumerate() {
        let source = &solver.problem.sources.list[source as usize];
        for face in 0..5 {
            let shown: BTreeSet<u32> = reference::cull::shown(
                &solver.problem.elements,
                &solver.problem.connections,
                &solver.problem.occluders,
                source,
                face,
                FACE,
            );
            let [_, _, drawn] = counts[slot][face as usize];
            assert!(
                drawn as usize >= shown.len(),
                "slot {slot}, face {face}: {drawn} drawn, {} shown",
                shown.len()
            );
            assert!(
                (drawn as usize) < solver.problem.occluders.len(),
                "something is culled"
            );
        }
    }
    assert_silent();
}

/// How surely a ray must find what it finds, see [`reference::occluder_rays::hidden`].
const DOUBT: f64 = 1e-4;

/// The sources with the most emitted power, ties to the lower index.
fn strongest(solver: &Solver, count: usize) -> Vec<u32> {
    let power = |s: &u32| solver.problem.sources.list[*s as usize].emitted_power() as f32;
    let mut order: Vec<u32> = (0..solver.problem.sources.list.len() as u32).collect();
    order.retain(|s| power(s) > 0.0);
    order.sort_by(|a, b| power(b).total_cmp(&power(a)).then(a.cmp(b)));
    order.truncate(count);
    order
}

/// The coupling of a source to all others, by the GPU and by the twin from the source's own row.
#[test]
fn coupling_equals_its_twin() {
    // Sums of some tens of terms in f32.
    const ROUNDING: f64 = 2e-6;
    let mut coloured = 0;
    for build in [scene(), textured()] {
        let mut solver = solve_so(
            &build,
            &Settings {
                shots: Some(1),
                ..settings()
            },
        );
        solver.run(|_| true).expect("one source is drawn");
        let light = solver.light().expect("the light comes back");
        let source = strongest(&solver, 1)[0];
        let emitted = solver.problem.sources.list[source as usize].emitted.x;
        let row: Vec<f32> = (light.irradiance_direct.iter())
            .map(|e| e.x / emitted)
            .collect();
        let found = &solver.draw(&[source]).expect("it is drawn").coupling[0];
        let even = solver.problem.elements.even_reflectance();
        let targets = solver.coupling_targets();
        coloured += targets.iter().filter(|t| t.word_count == 3).count();
        let expected =
            reference::couple::couple(&solver.problem.near.weights, &even, targets, &row);
        assert_eq!(found.len(), expected.len());
        let largest = expected.iter().copied().fold(0.0, f64::max);
        let apart = (found.iter().zip(&expected))
            .map(|(&f, &e)| (f64::from(f) - e).abs())
            .fold(0.0, f64::max);
        println!(
            "{} words: {:.1e} of the largest apart",
            found.len(),
            apart / largest
        );
        assert!(largest > 0.0 && apart <= ROUNDING * largest);
    }
    assert!(coloured > 0, "some targets have several reflectances");
    assert_silent();
}

/// A room whose elements are white and red in turns, so that sources have members of both.
fn textured() -> Build {
    let mut build = scene();
    let red = build.material(0.5, 0.0);
    build.scene.materials[red as usize].kd = [0.8, 0.1, 0.2];
    for (i, triangle) in build.scene.triangles.iter_mut().enumerate() {
        if i % 2 == 1 && triangle.material == 0 {
            triangle.material = red;
        }
    }
    build
}

/// One batch of emission: irradiance by the GPU and by the twin from the GPU's own item buffers.
#[test]
fn estimators_equal_their_twins() {
    let mut enclosed_scenes = 0;
    for (estimator, strong, build, places) in [
        (Estimator::Receiver, 0, scene(), 4),
        // The pixels decide.
        (Estimator::Receiver, 0, scene(), 0),
        (Estimator::Receiver, 0, enclosed(), 0),
        (Estimator::Receiver, 0, enclosed(), 4),
        (Estimator::Receiver, 2, scene(), 4),
        (Estimator::Receiver, 6, enclosed(), 4),
        (Estimator::Pixel, 0, scene(), 4),
    ] {
        let by_rays = strong > 0;
        // By rays, all emitters that are strong.
        let (emitter_hemicube, shots) = match by_rays {
            false => (settings().emitter_hemicube, 6),
            true => (None, strong),
        };
        let settings = Settings {
            estimator,
            emitter_hemicube,
            shots: Some(shots),
            places,
            ..settings()
        };
        let mut solver = solve_so(&build, &settings);
        solver.run(|_| true).expect("the batch runs");
        let light = solver.light().expect("the light comes back");
        let elements = &solver.problem.elements;
        let chosen = strongest(&solver, shots as usize);
        let mut expected = vec![0.0; elements.len()];
        let Problem {
            connections,
            occluders,
            ..
        } = &solver.problem;
        let occluders = occluders.casters(elements, connections);
        // Where a ray passes so close to an edge that rounding decides.
        let doubtful: Vec<Cell<bool>> = vec![Cell::new(false); elements.len()];
        let by_ray = |e: usize, source: &Source, p| {
            let depth = reference::occluder_rays::hidden(&occluders, source, p);
            doubtful[e].set(doubtful[e].get() || depth.abs() < DOUBT);
            depth < 0.0
        };
        for &s in &chosen {
            let source = &solver.problem.sources.list[s as usize];
            let items = reference::item_buffer::item_buffer(
                elements,
                &solver.problem.connections,
                &solver.problem.occluders,
                source,
                FACE,
            );
            let emitted = f64::from(source.emitted.x);
            let sums = reference::bin_pixels::form_factors(elements, source, &items, FACE);
            let factors: Vec<f64> = (0..elements.len())
                .map(|e| match estimator {
                    Estimator::Receiver if by_rays => {
                        let sees = |p| by_ray(e, source, p);
                        reference::form_factors::gather(elements, source, e, sees)
                    }
                    Estimator::Receiver => {
                        let drawn = reference::form_factors::Drawn {
                            elements,
                            source,
                            items: &items,
                            n: FACE,
                        };
                        let pixels_decide =
                            places == 0 && !reference::form_factors::is_near(elements, source, e);
                        if pixels_decide {
                            let share = drawn.share(elements.centroid[e], e);
                            let whole =
                                reference::form_factors::gather(elements, source, e, |_| true);
                            return share * whole;
                        }
                        let sees = |p| match drawn.sight(p, e) {
                            Verdict::Doubtful => by_ray(e, source, p),
                            verdict => verdict == Verdict::Seen,
                        };
                        reference::form_factors::gather(elements, source, e, sees)
                    }
                    Estimator::Pixel | Estimator::Paper => {
                        reference::bin_pixels::irradiance(source, sums[e], elements.area[e])
                    }
                })
                .collect();
            let scale = match solver.problem.connections.enclosed {
                true => {
                    let elements = elements.area.iter().copied().zip(factors.iter().copied());
                    reference::normalise::scale(elements, source.area)
                }
                false => 1.0,
            };
            for (sum, factor) in expected.iter_mut().zip(factors) {
                *sum += emitted * scale * factor;
            }
        }
        let scale = expected.iter().copied().fold(0.0, f64::max);
        assert!(scale > 0.0);
        // A pixel on the edge of two triangles may go to either: the light that one of them lacks
        // the other has. All else agrees to rounding (far sources: 0.07 %).
        let lacks =
            |e: usize| elements.area[e] * (expected[e] - f64::from(light.irradiance_direct[e].x));
        let rounding = |e: usize| elements.area[e] * (1.5e-3 * expected[e] + 1e-5 * scale);
        let different: Vec<usize> = (0..elements.len())
            .filter(|&e| !doubtful[e].get() && lacks(e).abs() > rounding(e))
            .collect();
        let exchanged = |&&e: &&usize| {
            (different.iter())
                .any(|&o| o != e && (lacks(e) + lacks(o)).abs() <= rounding(e).min(rounding(o)))
        };
        let exchange = different.iter().filter(exchanged).count();
        let wrong = different.len() - exchange;
        let doubtful = doubtful.iter().filter(|d| d.get()).count();
        println!(
            "{estimator:?}, by rays {by_rays}, {places} places: {wrong} of {} elements differ, {exchange} exchange \
             pixels, {doubtful} are doubtful",
            elements.len()
        );
        let by_rays_in_all = solver.report().emitters_by_rays;
        assert_eq!(by_rays_in_all, u64::from(strong));
        assert!(doubtful * 50 <= elements.len());
        assert_eq!(wrong, 0, "{estimator:?}: elements differ");
        let most = match estimator {
            Estimator::Receiver => 0,
            // 16 measured.
            Estimator::Pixel | Estimator::Paper => elements.len() / 20,
        };
        assert!(exchange <= most, "{exchange} exchange, {most} may");
        let power = |value: &dyn Fn(usize) -> f64| {
            (0..elements.len())
                .map(|e| elements.area[e] * value(e))
                .sum::<f64>()
        };
        let (got, want) = (
            power(&|e| f64::from(light.irradiance_direct[e].x)),
            power(&|e| expected[e]),
        );
        assert!(
            (got / want - 1.0).abs() < 2e-3,
            "{estimator:?}: power {got} for {want}"
        );
        if solver.problem.connections.enclosed {
            let list = &solver.problem.sources.list;
            let sent = |&s: &u32| list[s as usize].area * f64::from(list[s as usize].emitted.x);
            let sent: f64 = chosen.iter().map(sent).sum();
            assert!(
                (got / sent - 1.0).abs() < 1e-6,
                "{got} of {sent} arrives in an enclosed scene"
            );
            enclosed_scenes += 1;
        }
    }
    assert_eq!(enclosed_scenes, 3);
    assert_silent();
}
