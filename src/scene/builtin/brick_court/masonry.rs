//! The geometry of the court: pavement, walls, doorway, steps, bench.

use glam::{DVec2, DVec3};

use super::super::masonry_maps::{BRICKWORK, PAVING};
use super::super::slabs::{Panel, Slabs, TUCK, lines};
use super::entrance::{FRAME, LOWER_STEP_DEPTH, STEP, doorway, frame_x, lower_step_x, steps};
use super::{BRICK, LIMESTONE, PAVEMENT, PLASTER};
use crate::scene::assemble::Mesh;

/// The ends of the court, metres; the brick wall stands at z = 0 and the plaster at `EAST`.
const WEST: f64 = -8.0;
pub(super) const EAST: f64 = 3.0;
const SOUTH: f64 = 9.0;
/// How far the plaster goes.
const PLASTER_END: f64 = 3.6;
/// Thickness of the walls.
const THICKNESS: f64 = 0.4;
/// The plinth: its height, three courses, and how far it stands out.
pub(super) const PLINTH: f64 = 0.225;
pub(super) const STANDS_OUT: f64 = 0.03;
/// Top of the wall: three tiles of brickwork above the plinth.
pub(super) const TOP: f64 = PLINTH + 3.0 * BRICKWORK.y;
const COPING: f64 = 0.08;
const OVERHANG: f64 = 0.06;

/// The bench: its seat, and its two legs.
const SEAT: [DVec3; 2] = [DVec3::new(-2.15, 0.38, 0.10), DVec3::new(-0.65, 0.46, 0.54)];
const LEGS: [[f64; 2]; 2] = [[-1.98, -1.82], [-0.98, -0.82]];
const LEG_Z: [f64; 2] = [0.15, 0.49];
/// Bases of the jars: the middle, half the side and the height.
pub(super) const BASES: [(DVec2, f64, f64); 2] = [
    (DVec2::new(2.32, 0.62), 0.24, 0.06),
    (DVec2::new(-0.32, 1.05), 0.15, 0.05),
];

/// A buttress beyond the left edge of the picture, whose shadow lies over the bench.
const BUTTRESS: [DVec3; 2] = [
    DVec3::new(-5.2, 0.0, STANDS_OUT),
    DVec3::new(-4.6, 2.5, 1.3),
];

/// All that is plane, in as few triangles as there can be.
pub(super) fn mesh() -> Mesh {
    let mut slabs = Slabs::default();
    pavement(&mut slabs);
    slabs.part();
    brick_wall(&mut slabs);
    slabs.part();
    plaster_wall(&mut slabs);
    slabs.part();
    doorway(&mut slabs);
    slabs.part();
    steps(&mut slabs);
    slabs.part();
    bench(&mut slabs);
    slabs.part();
    slabs.block(BUTTRESS[0], BUTTRESS[1], PLASTER);
    for (at, half, height) in BASES {
        slabs.part();
        let low = DVec3::new(at.x - half, 0.0, at.y - half);
        let high = DVec3::new(at.x + half, height, at.y + half);
        slabs.block(low, high, LIMESTONE);
    }
    slabs.mesh
}

pub(super) fn is_within([low, high]: [f64; 2], x: f64) -> bool {
    (low..high).contains(&x)
}

/// The ground, without what stands on it.
fn pavement(slabs: &mut Slabs) {
    let bases =
        BASES.map(|(at, half, _)| [at.x, at.y].map(|middle| [middle - half, middle + half]));
    let mut stands = vec![[lower_step_x(), [STANDS_OUT, LOWER_STEP_DEPTH]]];
    stands.extend(bases);
    stands.push([0, 2].map(|axis| BUTTRESS.map(|corner| corner[axis])));
    stands.extend(LEGS.map(|x| [x, LEG_Z]));
    let tiles = |size: f64| (-20..20).map(move |k| f64::from(k) * size);
    let of = |axis: usize| stands.iter().flat_map(move |s| s[axis]);
    let columns: Vec<f64> = of(0).collect();
    // z points to the south, and rows go to the north.
    let rows: Vec<f64> = of(1).chain(tiles(PAVING.y)).map(|z| -z).collect();
    let panel = Panel {
        origin: DVec3::ZERO,
        along: DVec3::X,
        up: DVec3::NEG_Z,
        columns: &lines(WEST, EAST - STANDS_OUT, &columns),
        rows: &lines(-SOUTH, -STANDS_OUT, &rows),
        material: PAVEMENT,
    };
    slabs.panel(&panel, |x, north| {
        !stands
            .iter()
            .any(|[of_x, of_z]| is_within(*of_x, x) && is_within(*of_z, -north))
    });
}

/// The brick wall with its plinth, its coping, its end and its back.
fn brick_wall(slabs: &mut Slabs) {
    let [left, right] = frame_x();
    let lower = lower_step_x();
    let bands: Vec<f64> = (0..=3)
        .map(|k| PLINTH + f64::from(k) * BRICKWORK.y)
        .collect();
    let spring = FRAME.centre.y;
    let mut rows = bands.clone();
    rows.push(spring);
    let rows = lines(PLINTH, TOP, &rows);
    let front = |rows, material, z: f64| Panel {
        origin: DVec3::Z * z,
        along: DVec3::X,
        up: DVec3::Y,
        columns: &[],
        rows,
        material,
    };
    let columns = lines(WEST, EAST, &[left, right]);
    let wall = Panel {
        columns: &columns,
        ..front(&rows, BRICK, 0.0)
    };
    slabs.panel(&wall, |x, _| !is_within([left, right], x));
    let above: Vec<f64> = rows
        .iter()
        .copied()
        .filter(|&y| y > spring + FRAME.radius)
        .collect();
    slabs.above_arch(FRAME, &above, 0.0, BRICK);

    slabs.part();
    let foot_lines = lines(
        WEST,
        EAST,
        &[left, right, lower[0], lower[1], EAST - STANDS_OUT],
    );
    let foot = Panel {
        columns: &foot_lines,
        ..front(&[-TUCK, 0.0, STEP / 2.0, PLINTH], LIMESTONE, STANDS_OUT)
    };
    slabs.panel(&foot, |x, y| {
        let behind_step = is_within(lower, x) && y < STEP / 2.0;
        !is_within([left, right], x) && !behind_step && x < EAST - STANDS_OUT
    });
    let level = |y: f64, rows, columns| Panel {
        origin: DVec3::Y * y,
        along: DVec3::X,
        up: DVec3::NEG_Z,
        columns,
        rows,
        material: LIMESTONE,
    };
    slabs.panel(
        &level(PLINTH, &[-STANDS_OUT, 0.0, TUCK], &foot_lines),
        |x, _| !is_within([left, right], x),
    );

    slabs.part();
    let coping = [
        DVec3::new(WEST, TOP, -THICKNESS - OVERHANG),
        DVec3::new(EAST + THICKNESS, TOP + COPING, OVERHANG),
    ];
    slabs.solid(coping[0], coping[1], LIMESTONE);
    slabs.part();
    // Closed behind, so that no light gets between.
    slabs.quad(
        [
            DVec3::new(EAST + THICKNESS, -TUCK, -THICKNESS),
            DVec3::new(WEST, -TUCK, -THICKNESS),
            DVec3::new(WEST, TOP, -THICKNESS),
            DVec3::new(EAST + THICKNESS, TOP, -THICKNESS),
        ],
        LIMESTONE,
    );
    slabs.quad(
        [
            DVec3::new(WEST, -TUCK, -THICKNESS),
            DVec3::new(WEST, -TUCK, STANDS_OUT),
            DVec3::new(WEST, TOP, STANDS_OUT),
            DVec3::new(WEST, TOP, -THICKNESS),
        ],
        LIMESTONE,
    );
}

/// The plaster to the east, with plinth, coping, end and back.
fn plaster_wall(slabs: &mut Slabs) {
    let panel = |x: f64, columns, rows, material| Panel {
        origin: DVec3::X * x,
        along: DVec3::Z,
        up: DVec3::Y,
        columns,
        rows,
        material,
    };
    let ends = [-TUCK, 0.0, PLASTER_END];
    slabs.panel(&panel(EAST, &ends, &[PLINTH, TOP], PLASTER), |_, _| true);
    let ends = [STANDS_OUT, PLASTER_END];
    let foot = EAST - STANDS_OUT;
    slabs.panel(
        &panel(foot, &ends, &[-TUCK, 0.0, PLINTH], LIMESTONE),
        |_, _| true,
    );
    let (near, far) = (STANDS_OUT, PLASTER_END);
    slabs.quad(
        [
            DVec3::new(foot, PLINTH, far),
            DVec3::new(EAST, PLINTH, far),
            DVec3::new(EAST, PLINTH, near),
            DVec3::new(foot, PLINTH, near),
        ],
        LIMESTONE,
    );
    slabs.part();
    slabs.solid(
        DVec3::new(EAST - OVERHANG, TOP, OVERHANG),
        DVec3::new(EAST + THICKNESS, TOP + COPING, PLASTER_END + OVERHANG),
        LIMESTONE,
    );
    slabs.part();
    let beyond = EAST + THICKNESS;
    for (corners, material) in [
        (
            [
                DVec3::new(foot, -TUCK, far),
                DVec3::new(beyond, -TUCK, far),
                DVec3::new(beyond, PLINTH, far),
                DVec3::new(foot, PLINTH, far),
            ],
            LIMESTONE,
        ),
        (
            [
                DVec3::new(EAST, PLINTH, far),
                DVec3::new(beyond, PLINTH, far),
                DVec3::new(beyond, TOP, far),
                DVec3::new(EAST, TOP, far),
            ],
            PLASTER,
        ),
        (
            [
                DVec3::new(beyond, -TUCK, far),
                DVec3::new(beyond, -TUCK, -THICKNESS),
                DVec3::new(beyond, TOP, -THICKNESS),
                DVec3::new(beyond, TOP, far),
            ],
            PLASTER,
        ),
    ] {
        slabs.quad(corners, material);
    }
}

fn bench(slabs: &mut Slabs) {
    let [low, high] = SEAT;
    slabs.solid(low, high, LIMESTONE);
    for [left, right] in LEGS {
        slabs.part();
        slabs.sides(
            DVec3::new(left, 0.0, LEG_Z[0]),
            DVec3::new(right, low.y, LEG_Z[1]),
            LIMESTONE,
        );
    }
}
