//! Elements of one plane are drawn as few triangles: no gap, no bend passed over, the same light.

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use common::{Build, Solved, assert_silent, device, solve};
use glam::{DQuat, DVec3};
use mesolux::constants::NONE;
use mesolux::mesh::charts::Connections;
use mesolux::mesh::elements::Elements;
use mesolux::mesh::occluders::Occluders;
use mesolux::solver::{Estimator, Settings, Solver};

struct Merged {
    elements: Elements,
    occluders: Occluders,
}

impl Merged {
    /// Merges a scene's elements and checks what holds for every scene.
    fn new(build: &Build) -> Self {
        let elements = Elements::new(&build.scene);
        let connections = Connections::new(&elements);
        let merged = Self {
            occluders: Occluders::merged(&elements, &connections),
            elements,
        };
        merged.check(&connections);
        merged
    }

    fn check(&self, connections: &Connections) {
        // Twice the farthest that a corner may lie from the plane of its item.
        const PLANE: f64 = 4e-7;
        let Self {
            elements,
            occluders,
        } = self;
        let (mut area, mut vector_area) = (0.0, DVec3::ZERO);
        for (i, &item) in occluders.items.iter().enumerate() {
            let triangle = occluders.triangle(elements, i);
            let [a, b, c] = triangle;
            let normal = elements.normal[item as usize];
            let cross = 0.5 * (b - a).cross(c - a);
            assert!(cross.dot(normal) >= 0.0, "occluder {i} shows its back");
            let height = |v: DVec3| (v - elements.centroid[item as usize]).dot(normal).abs();
            assert!(triangle.into_iter().all(|v| height(v) <= PLANE));
            area += cross.length();
            vector_area += cross;
            assert!(
                i >= occluders.own || occluders.corners[i] == elements.corners[item as usize],
                "occluder {i} is no element as it is"
            );
        }
        assert!(
            occluders.items[..occluders.own]
                .windows(2)
                .all(|w| w[0] < w[1])
        );
        let components = |items: &[u32]| -> Vec<u32> {
            let of = |&e: &u32| connections.component[e as usize];
            items.iter().map(of).collect()
        };
        assert!(components(&occluders.items[occluders.own..]).is_sorted());
        let wanted: f64 = elements.area.iter().sum();
        assert!(
            (area / wanted - 1.0).abs() <= 1e-6,
            "area {area} for {wanted}"
        );
        let wanted_vector: DVec3 = (0..elements.len())
            .map(|e| elements.normal[e] * elements.area[e])
            .sum();
        assert!(vector_area.distance(wanted_vector) <= 1e-6 * wanted);
        self.no_gaps();
    }

    /// No corner lies within an edge of another triangle, unless elements themselves meet like
    /// that.
    fn no_gaps(&self) {
        let gaps = |corners: &[[u32; 3]]| {
            let vertices: BTreeSet<u32> = corners.iter().flatten().copied().collect();
            let edges: BTreeSet<(u32, u32)> = corners
                .iter()
                .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
                .map(|(a, b)| (a.min(b), a.max(b)))
                .collect();
            let place = |v: u32| self.elements.vertices[v as usize];
            let mut gaps = 0;
            for &(a, b) in &edges {
                let along = place(b) - place(a);
                for &v in &vertices {
                    let d = place(v) - place(a);
                    let share = d.dot(along) / along.length_squared();
                    let aside = d.distance(share * along);
                    let end = v == a || v == b;
                    gaps += u32::from(!end && share > 0.0 && share < 1.0 && aside < 1e-6);
                }
            }
            gaps
        };
        assert_eq!(gaps(&self.occluders.corners), gaps(&self.elements.corners));
    }
}

/// Keeps the cells of a quad's grid for which `wanted` holds.
fn cut(build: &mut Build, n: usize, wanted: impl Fn(usize, usize) -> bool) {
    let mut i = 0;
    build.scene.triangles.retain(|_| {
        let cell = i / 2;
        i += 1;
        wanted(cell % n, cell / n)
    });
}

#[test]
fn a_wall_with_corners_and_a_hole_needs_its_outline_alone() {
    let tilted = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    for (turn, n) in [(DQuat::IDENTITY, 8), (tilted, 8), (tilted, 80)] {
        let mut build = Build::new();
        let (u, v) = (turn * DVec3::X * 3.0, turn * DVec3::Y * 2.0);
        build.quad(DVec3::new(5.0, 1.0, -2.0), u, v, (n as u32, n as u32), 0);
        let hole = |i: usize| (n / 8..n / 4).contains(&i);
        let notch = |i: usize| i >= n / 2;
        cut(&mut build, n, |i, j| {
            !(notch(i) && notch(j) || hole(i) && hole(j))
        });
        let merged = Merged::new(&build);
        // An L as long about as the whole, 4 n corners, its hole n / 2: V + 2 holes − 2.
        assert_eq!(merged.occluders.len(), 4 * n + n / 2, "{n} cells");
        assert_eq!(merged.occluders.own, 0);
        let items: BTreeSet<u32> = merged.occluders.items.iter().copied().collect();
        assert_eq!(items.len(), 1);
    }
}

#[test]
fn a_cube_is_its_edges_and_a_sphere_all_of_its_own() {
    let mut build = Build::new();
    build.solid(DVec3::ZERO, DVec3::new(1.0, 1.2, 0.7), 6, 0);
    build.weld();
    let merged = Merged::new(&build);
    // Four edges of six squares a side: V − 2.
    assert_eq!(merged.occluders.len(), 6 * (4 * 6 - 2));
    let mut build = Build::new();
    build.sphere(DVec3::ZERO, 1.0, 4, true, 0);
    let merged = Merged::new(&build);
    assert_eq!(merged.occluders, Occluders::elements(&merged.elements));
}

#[test]
fn the_gentlest_bend_ends_a_region() {
    // A floor bent once; one bent a little at every line of its grid, 2·10⁻⁶ a cell.
    let once = |x: f64| 1e-4 * x.max(0.0);
    let everywhere = |x: f64| 0.5 * 5e-5 * x * x;
    let bent = |height: &dyn Fn(f64) -> f64| {
        let mut build = Build::new();
        build.quad(
            DVec3::new(-1.0, -1.0, 0.0),
            DVec3::X * 2.0,
            DVec3::Y * 2.0,
            (50, 50),
            0,
        );
        for v in &mut build.scene.vertices {
            v.z = height(v.x);
        }
        Merged::new(&build)
    };
    let merged = bent(&once);
    // Halves of 25 by 50 cells.
    assert_eq!(merged.occluders.len(), 2 * (150 - 2));
    for i in 0..merged.occluders.len() {
        let triangle = merged.occluders.triangle(&merged.elements, i);
        let sides = triangle.map(|v| v.x > 1e-6 || v.x < -1e-6).map(u32::from);
        assert!(sides.iter().sum::<u32>() >= 1);
        let low = triangle.iter().any(|v| v.x < -1e-6);
        let high = triangle.iter().any(|v| v.x > 1e-6);
        assert!(low != high, "{triangle:?} passes the bend");
    }
    let merged = bent(&everywhere);
    for i in 0..merged.occluders.len() {
        let triangle = merged.occluders.triangle(&merged.elements, i);
        let wide = |a: DVec3, b: DVec3| (a.x - b.x).abs();
        let [a, b, c] = triangle;
        assert!(wide(a, b).max(wide(b, c)).max(wide(c, a)) < 0.25);
    }
}

#[test]
fn what_a_curved_neighbour_needs_is_kept() {
    const N: u32 = 12;
    for welded in [true, false] {
        let mut build = Build::new();
        // A plate, and beyond one edge of it cloth that waves.
        let (x, y) = (DVec3::X, DVec3::Y);
        build.quad(DVec3::ZERO, x, y, (N, N), 0);
        let first = build.scene.vertices.len() as u32;
        for j in 0..=N {
            for i in 0..=N {
                let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(N));
                let z = 0.1 * v * (5.0 * PI * u + 3.0 * v).sin();
                build.vertex(DVec3::new(u, 1.0 + v, z));
            }
        }
        for j in 0..N {
            for i in 0..N {
                let at = |i, j| first + j * (N + 1) + i;
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                build.triangle([a, b, c], 0);
                build.triangle([a, c, d], 0);
            }
        }
        if welded {
            build.weld();
        }
        let merged = Merged::new(&build);
        assert_eq!(merged.occluders.own as u32, 2 * N * N);
        let plate = merged.occluders.len() - merged.occluders.own;
        assert_eq!(plate as u32, 4 * N - 2, "welded: {welded}");
    }
}

/// A small Cornell box: boxes, a ball, a lamp below the ceiling and one in it; parts of it welded.
fn cornell(n: u32) -> Build {
    let mut build = Build::new();
    let lamp = build.material(0.0, 5.0);
    build.room(DVec3::ZERO, DVec3::ONE, n, 0);
    build.weld();
    build.solid(
        DVec3::new(0.15, 0.0, 0.2),
        DVec3::new(0.3, 0.5, 0.25),
        n / 4,
        0,
    );
    build.sphere(DVec3::new(0.65, 0.25, 0.6), 0.2, 3, true, 0);
    build.quad(
        DVec3::new(0.35, 0.99, 0.35),
        DVec3::X * 0.3,
        DVec3::Z * 0.3,
        (3, 3),
        lamp,
    );
    build
}

const FACE: u32 = 64;

fn settings(merging: bool) -> Settings {
    Settings {
        merging,
        hemicube: FACE,
        residual: 1e-2,
        ..Settings::default()
    }
}

/// Area-weighted rms of the difference of two bakes' irradiance over its mean.
fn difference(a: &Solved, b: &Solved) -> f64 {
    let (mut squares, mut sum, mut area) = (0.0, 0.0, 0.0);
    for (e, &weight) in a.area.iter().enumerate() {
        let (a, b) = (f64::from(a.irradiance[e].x), f64::from(b.irradiance[e].x));
        squares += weight * (a - b).powi(2);
        sum += weight * a;
        area += weight;
    }
    (squares / area).sqrt() / (sum / area)
}

/// How many pixels may show another plane: a long edge that the near plane cuts is rounded
/// elsewhere than a short one.
const FLIPPED: f64 = 1e-6;
/// Largest rms of the difference over the mean.
const DIFFERENCE: f64 = 1e-6;

#[test]
fn merged_elements_leave_the_light_as_it_is() {
    let build = cornell(16);
    let bake = |merging| {
        let elements = Elements::new(&build.scene);
        solve(elements, &mesolux::scene::Lights::NONE, &settings(merging))
    };
    let (merged, apart) = (bake(true), bake(false));
    assert_eq!(apart.report.skipped.triangles_merged, 0);
    // The outlines of walls, of the box's sides, and of the lamp; the ball as it is.
    let left = merged.report.elements - merged.report.skipped.triangles_merged;
    println!(
        "{} elements, {left} drawn from; hemicubes {} and {}",
        merged.report.elements, merged.report.hemicubes, apart.report.hemicubes
    );
    assert_eq!(
        left,
        6 * (4 * 16 - 2) + 6 * (4 * 4 - 2) + 1280 + (4 * 3 - 2)
    );
    let apart_by = difference(&merged, &apart);
    println!("rms of the difference over the mean: {apart_by:e}");
    assert!(apart_by <= DIFFERENCE, "{apart_by:e}");
}

#[test]
fn merged_elements_show_the_same_planes() {
    let build = cornell(16);
    let draw = |merging| {
        let mut solver = Solver::new(
            &device(),
            Elements::new(&build.scene),
            &mesolux::scene::Lights::NONE,
            &settings(merging),
        )
        .expect("the scene fits the device");
        let n = FACE as usize;
        let mut columns = BTreeMap::new();
        let count = solver.problem.sources.list.len() as u32;
        let slots = solver.report().batch;
        for first in (0..count.min(24 * slots)).step_by(slots as usize) {
            let sources: Vec<u32> = (first..count.min(first + slots)).collect();
            let drawn = solver.draw(&sources).expect("a batch is drawn");
            for (slot, &source) in sources.iter().enumerate() {
                let rows = drawn.items.chunks_exact(n * drawn.slots as usize);
                let column: Vec<u32> = rows
                    .flat_map(|row| &row[slot * n..][..n])
                    .copied()
                    .collect();
                columns.insert(source, column);
            }
        }
        (solver, columns)
    };
    let ((solver, merged), (_, apart)) = (draw(true), draw(false));
    let elements = &solver.problem.elements;
    let plane = |item: u32| {
        let normal = elements.normal[item as usize];
        normal.extend(normal.dot(elements.centroid[item as usize]))
    };
    let (mut pixels, mut other) = (0, 0);
    for (source, items) in &merged {
        let Some(items_apart) = apart.get(source) else {
            continue;
        };
        for (&a, &b) in items.iter().zip(items_apart) {
            pixels += u32::from(b != NONE);
            let differ = match (a, b) {
                (NONE, NONE) => false,
                (NONE, _) | (_, NONE) => true,
                (a, b) => a != b && plane(a).distance(plane(b)) > 1e-5,
            };
            other += u32::from(differ);
        }
    }
    println!("{other} of {pixels} pixels show another plane");
    assert!(pixels > 0);
    let share = f64::from(other) / f64::from(pixels);
    assert!(share <= FLIPPED, "{other} of {pixels} differ");
    assert_silent();
}

#[test]
fn the_pixel_estimator_draws_every_element() {
    let build = cornell(8);
    let settings = Settings {
        estimator: Estimator::Pixel,
        ..settings(true)
    };
    let elements = Elements::new(&build.scene);
    let solver = Solver::new(
        &device(),
        elements,
        &mesolux::scene::Lights::NONE,
        &settings,
    )
    .expect("it fits the device");
    assert_eq!(
        solver.problem.occluders,
        Occluders::elements(&solver.problem.elements)
    );
    assert_eq!(solver.report().skipped.triangles_merged, 0);
    assert_silent();
}
