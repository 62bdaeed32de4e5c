//! The doorway: its stone frame, the door and two steps.

use glam::{DVec2, DVec3};

use super::super::slabs::{Arch, Panel, Slabs, TUCK, lines};
use super::masonry::{PLINTH, STANDS_OUT, is_within};
use super::{DOOR, LIMESTONE};

/// The door's opening, and the stone about it.
pub(super) const OPENING: Arch = Arch {
    centre: DVec2::new(0.75, 1.60),
    radius: 0.50,
};
pub(super) const FRAME: Arch = Arch {
    centre: OPENING.centre,
    radius: 0.66,
};
const FRAME_STANDS_OUT: f64 = 0.045;
const DOOR_Z: f64 = -0.24;
/// Height and depth of the upper step, which is as wide as the frame; the lower one is half as
/// high.
pub(super) const STEP: f64 = 0.30;
const STEP_DEPTH: f64 = 0.36;
pub(super) const LOWER_STEP_DEPTH: f64 = 0.70;
const LOWER_STEP_WIDER: f64 = 0.22;

/// Left and right end of the door's frame, which the upper step has too, and of the lower step.
pub(super) fn frame_x() -> [f64; 2] {
    [-1.0, 1.0].map(|side| FRAME.centre.x + side * FRAME.radius)
}

pub(super) fn lower_step_x() -> [f64; 2] {
    let [left, right] = frame_x();
    [left - LOWER_STEP_WIDER, right + LOWER_STEP_WIDER]
}

/// The frame, its reveal and the door.
pub(super) fn doorway(slabs: &mut Slabs) {
    let depths = [-TUCK, 0.0, FRAME_STANDS_OUT];
    let reveal = [DOOR_Z - TUCK, DOOR_Z, FRAME_STANDS_OUT];
    let front = FRAME_STANDS_OUT;
    slabs.vault(FRAME, &depths, true, LIMESTONE);
    slabs.vault(OPENING, &reveal, false, LIMESTONE);
    slabs.ring(OPENING, FRAME, front, LIMESTONE);
    let feet = [STEP, FRAME.centre.y];
    for side in [-1.0, 1.0] {
        let [inner, outer] = [OPENING, FRAME].map(|arch| arch.centre.x + side * arch.radius);
        let ends = if side < 0.0 {
            [outer, inner]
        } else {
            [inner, outer]
        };
        let jamb = Panel {
            origin: DVec3::Z * front,
            along: DVec3::X,
            up: DVec3::Y,
            columns: &ends,
            rows: &feet,
            material: LIMESTONE,
        };
        slabs.panel(&jamb, |_, _| true);
        let mut flank = |x: f64, depths: &[f64], faces: f64| {
            // Fronts to −x with `along` = z, to +x with −z.
            let columns: Vec<f64> = match faces < 0.0 {
                true => depths.to_vec(),
                false => depths.iter().rev().map(|z| -z).collect(),
            };
            let panel = Panel {
                origin: DVec3::X * x,
                along: -DVec3::Z * faces,
                up: DVec3::Y,
                columns: &columns,
                rows: &feet,
                material: LIMESTONE,
            };
            slabs.panel(&panel, |_, _| true);
        };
        flank(outer, &depths, side);
        flank(inner, &reveal, -side);
    }
    let [left, right] = [-1.0, 1.0].map(|side| OPENING.centre.x + side * OPENING.radius);
    slabs.part();
    let door = Panel {
        origin: DVec3::Z * DOOR_Z,
        along: DVec3::X,
        up: DVec3::Y,
        columns: &[left, OPENING.centre.x, right],
        rows: &feet,
        material: DOOR,
    };
    slabs.panel(&door, |_, _| true);
    slabs.below_arch(OPENING, DOOR_Z, DOOR);
}

/// Two steps; the upper one goes on as the door's sill.
pub(super) fn steps(slabs: &mut Slabs) {
    let [left, right] = frame_x();
    let lower = lower_step_x();
    let half = STEP / 2.0;
    let rise = |rows: &[f64], columns: [f64; 2], z: f64, slabs: &mut Slabs| {
        let panel = Panel {
            origin: DVec3::Z * z,
            along: DVec3::X,
            up: DVec3::Y,
            columns: &columns,
            rows,
            material: LIMESTONE,
        };
        slabs.panel(&panel, |_, _| true);
    };
    rise(&[-TUCK, 0.0, half], lower, LOWER_STEP_DEPTH, slabs);
    rise(&[half, STEP], [left, right], STEP_DEPTH, slabs);
    for (x, faces, rows, depth) in [
        (lower[0], -1.0, &[-TUCK, 0.0, half][..], LOWER_STEP_DEPTH),
        (lower[1], 1.0, &[-TUCK, 0.0, half][..], LOWER_STEP_DEPTH),
        (left, -1.0, &[half, PLINTH, STEP][..], STEP_DEPTH),
        (right, 1.0, &[half, PLINTH, STEP][..], STEP_DEPTH),
    ] {
        let ends = lines(-TUCK, depth, &[0.0, STANDS_OUT]);
        let columns: Vec<f64> = match faces < 0.0 {
            true => ends,
            false => ends.iter().rev().map(|z| -z).collect(),
        };
        let panel = Panel {
            origin: DVec3::X * x,
            along: -DVec3::Z * faces,
            up: DVec3::Y,
            columns: &columns,
            rows,
            material: LIMESTONE,
        };
        // What lies within plinth and wall is not there.
        slabs.panel(&panel, |a, y| {
            let z = -faces * a;
            z > STANDS_OUT || (y > PLINTH && z > -TUCK)
        });
    }
    let tread = |y: f64,
                 columns: &[f64],
                 rows: &[f64],
                 slabs: &mut Slabs,
                 there: &dyn Fn(f64, f64) -> bool| {
        let panel = Panel {
            origin: DVec3::Y * y,
            along: DVec3::X,
            up: DVec3::NEG_Z,
            columns,
            rows,
            material: LIMESTONE,
        };
        slabs.panel(&panel, |x, north| there(x, -north));
    };
    let columns = lines(lower[0], lower[1], &[left, right]);
    let rows = [-LOWER_STEP_DEPTH, -STEP_DEPTH, -STANDS_OUT];
    tread(half, &columns, &rows, slabs, &|x, z| {
        !(is_within([left, right], x) && z < STEP_DEPTH)
    });
    let [inner_left, inner_right] =
        [-1.0, 1.0].map(|side| OPENING.centre.x + side * OPENING.radius);
    let columns = [left, inner_left, inner_right, right];
    let rows = [-STEP_DEPTH, -FRAME_STANDS_OUT, -DOOR_Z, TUCK - DOOR_Z];
    tread(STEP, &columns, &rows, slabs, &|x, z| {
        z > FRAME_STANDS_OUT || is_within([inner_left, inner_right], x)
    });
}
