//! The fruit of the platter. Places are metres about the middle of the dish, y above its flat
//! inside.

use glam::{DVec2, DVec3};

use super::round_cone::{cone, smooth_union};
use super::solid::{revolve, sculpt};
use super::stage::diffuse;
use super::surface_nets::Implicit;
use crate::scene::Material;
use crate::scene::assemble::Mesh;

/// Radii, metres.
const ORANGE: f64 = 0.040;
const GRAPE: f64 = 0.0125;

/// Four in a pyramid, 1.5 mm apart, and one aside.
pub(super) const ORANGES: [[f64; 3]; 5] = [
    [-0.105, 0.0, -0.020],
    [-0.0235, 0.0, -0.020],
    [-0.06425, 0.0, 0.0506],
    [-0.06425, 0.0667, 0.0035],
    [0.100, 0.0, -0.078],
];

pub(super) struct Fruit {
    /// A fruit with its number of triangles.
    pub build: fn(usize) -> Mesh,
    /// The middle of its underside; on the table where y is negative.
    pub at: DVec3,
    /// Share of all triangles.
    pub share: f64,
    /// Index into [`materials`], counted from 1.
    pub material: u32,
}

impl Fruit {
    /// Whether it has a stem.
    pub fn has_stem(&self) -> bool {
        [RED_APPLE, GREEN_APPLE, PEAR].contains(&self.material)
    }
}

const RED_APPLE: u32 = 1;
const GREEN_APPLE: u32 = 2;
const PEAR: u32 = 3;
const BANANA: u32 = 4;
const GRAPES: u32 = 5;
pub(super) const STEM: u32 = 6;
pub(super) const STEM_SHARE: f64 = 0.0012;
/// Radius that a stem needs about the middle, metres.
pub(super) const STEM_RADIUS: f64 = 0.0033;

/// In the order of [`Fruit::material`].
pub(super) fn materials() -> [Material; 6] {
    [
        diffuse("red apple", [0.58, 0.05, 0.04]),
        diffuse("green apple", [0.36, 0.50, 0.08]),
        diffuse("pear", [0.62, 0.58, 0.14]),
        diffuse("banana", [0.84, 0.66, 0.10]),
        diffuse("grape", [0.20, 0.05, 0.22]),
        diffuse("stem", [0.16, 0.10, 0.05]),
    ]
}

/// Everything but the oranges.
pub(super) fn others() -> Vec<Fruit> {
    let fruit = |build, at: [f64; 3], share, material| Fruit {
        build,
        at: DVec3::from(at),
        share,
        material,
    };
    let mut all = Vec::new();
    let apples = [
        ([0.076, 0.0, 0.068], RED_APPLE),
        ([0.012, 0.0, -0.118], GREEN_APPLE),
        ([0.156, 0.0, 0.010], RED_APPLE),
    ];
    for (at, material) in apples {
        all.push(fruit(apple, at, 0.032, material));
    }
    all.push(fruit(pear, [-0.005, 0.0, 0.135], 0.032, PEAR));
    all.push(fruit(banana, [-0.10, -1.0, -0.328], 0.036, BANANA));
    // A hexagonal layer, and a second one in its hollows.
    let apart = 2.0 * GRAPE + 3e-4;
    let row = apart * 0.75_f64.sqrt();
    let low = [
        (-1.0, 0),
        (0.0, 0),
        (1.0, 0),
        (-0.5, 1),
        (0.5, 1),
        (-0.5, -1),
        (0.5, -1),
        (1.5, -1),
    ];
    let high = [(-0.5, 0), (0.5, 0), (0.0, -1), (1.0, -1)];
    let mut grapes = |places: &[(f64, i32)], up: f64, shift: f64| {
        for &(column, line) in places {
            let at = [
                -0.090 + column * apart,
                up,
                -0.112 + f64::from(line) * row + shift,
            ];
            all.push(fruit(grape, at, 0.006, GRAPES));
        }
    };
    grapes(&low, 0.0, 0.0);
    grapes(
        &high,
        apart * (2.0_f64 / 3.0).sqrt(),
        apart / 12.0_f64.sqrt(),
    );
    all
}

pub(super) fn orange(count: usize) -> Mesh {
    sphere(ORANGE, count)
}

fn grape(count: usize) -> Mesh {
    sphere(GRAPE, count)
}

fn sphere(radius: f64, count: usize) -> Mesh {
    let ball = Implicit {
        distance: |p: DVec3| p.length() - radius,
        low: DVec3::splat(-radius),
        high: DVec3::splat(radius),
    };
    sculpt(&ball, count)
}

/// A spindle torus, narrower below, so that it has hollows above and below.
pub(super) const APPLE: Implicit<fn(DVec3) -> f64> = Implicit {
    distance: |p| {
        let (ring, tube) = (0.0175, 0.0225);
        let narrow = 1.0 + 4.0 * p.y.min(0.03);
        let across = DVec3::new(p.x, 0.0, p.z).length() / narrow;
        (across - ring).hypot(p.y / 1.45) - tube
    },
    low: DVec3::splat(-0.05),
    high: DVec3::splat(0.05),
};

fn apple(count: usize) -> Mesh {
    sculpt(&APPLE, count)
}

pub(super) const PEAR_BODY: Implicit<fn(DVec3) -> f64> = Implicit {
    distance: |p| {
        let below = cone([0.0, 0.036, 0.0], 0.036, [0.0, 0.044, 0.0], 0.036);
        let above = cone([0.0, 0.060, 0.0], 0.026, [0.003, 0.092, 0.0], 0.015);
        smooth_union(below.distance(p), above.distance(p), 0.03)
    },
    low: DVec3::new(-0.05, -0.01, -0.05),
    high: DVec3::new(0.05, 0.12, 0.05),
};

fn pear(count: usize) -> Mesh {
    sculpt(&PEAR_BODY, count)
}

pub(super) fn stem(count: usize) -> Mesh {
    let profile = [
        [0.0, 0.0],
        [0.0024, 0.0],
        [0.0018, 0.012],
        [0.0032, 0.024],
        [0.0, 0.025],
    ];
    revolve(&profile.map(DVec2::from), count)
}

fn banana(count: usize) -> Mesh {
    sculpt(&bent(), count)
}

/// Round cones along an arc that lies on the table, thin towards the ends.
pub(super) fn bent() -> Implicit<impl Fn(DVec3) -> f64 + Sync> {
    let parts: Vec<_> = (0..10)
        .map(|i| {
            let at = |i: i32| {
                let angle = (200.0 + 14.0 * f64::from(i)).to_radians();
                [0.11 * angle.cos(), 0.0, 0.11 * angle.sin()]
            };
            let radius = |i: i32| 0.0185 - 0.0115 * ((f64::from(i) - 5.0).abs() / 5.0).powi(3);
            cone(at(i), radius(i), at(i + 1), radius(i + 1))
        })
        .collect();
    Implicit {
        distance: move |p: DVec3| {
            parts
                .iter()
                .map(|part| part.distance(p))
                .fold(f64::INFINITY, |a, b| smooth_union(a, b, 0.01))
        },
        low: DVec3::new(-0.15, -0.03, -0.15),
        high: DVec3::new(0.15, 0.03, 0.05),
    }
}
