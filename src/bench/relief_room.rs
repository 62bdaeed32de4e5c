//! A room whose floor is one of a few reliefs, and views of it: what pictures of relief are judged
//! by.

use std::sync::Arc;

use glam::DVec3;

use crate::scene::shapes::Shapes;
use crate::scene::{Camera, HeightMap, Material, Scene, Texture};

/// Scene units of a repeat of the reliefs.
pub const REPEAT: f64 = 0.25;
/// Texels a side of a repeat.
pub const TEXELS: u32 = 32;
/// Degrees from straight above at which the floor is seen: steep, oblique and grazing.
pub const ANGLES: [f64; 3] = [20.0, 50.0, 75.0];

/// A relief to be seen.
pub struct Case {
    pub name: &'static str,
    /// Over 0..1 × 0..1; in repeats.
    pub height: fn(f64, f64) -> f64,
    /// Reflectance of the whole, and of the lowest places where they have another.
    pub colour: [f32; 3],
    pub lowest: Option<[f32; 3]>,
    /// Texture coordinates that turn to the right.
    pub mirrored: bool,
}

const FLAT: Case = Case {
    name: "flat",
    height: |_, _| 0.0,
    colour: [0.5; 3],
    lowest: None,
    mirrored: false,
};

/// The flat floor, which shows what is not the relief's own error, and three reliefs.
pub const CASES: [Case; 4] = [
    FLAT,
    Case {
        name: "bricks",
        height: |x, y| 0.06 * brick(x, y),
        colour: [0.7, 0.3, 0.2],
        lowest: Some([0.5, 0.5, 0.45]),
        ..FLAT
    },
    Case {
        name: "bumps",
        height: |x, y| 0.12 * bumps(x, y),
        colour: [0.3, 0.5, 0.8],
        mirrored: true,
        ..FLAT
    },
    Case {
        name: "noise",
        height: |x, y| 0.15 * noise(x, y),
        colour: [0.5, 0.7, 0.3],
        ..FLAT
    },
];

/// Signed distance from `a` to the nearest of c + integers.
fn apart(a: f64, c: f64) -> f64 {
    a - c - (a - c).round()
}

/// 0 up to 0, 1 from 1 on, without a kink.
pub fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// 0 in the mortar of two rows of bricks, 1 on them.
fn brick(x: f64, y: f64) -> f64 {
    let row = (2.0 * y).floor();
    let to_row = apart(2.0 * y, 0.0).abs() / 2.0;
    let to_end = apart(x, 0.25 + 0.5 * row).abs();
    smooth_step((to_row.min(to_end) - 0.03) / 0.07)
}

/// Two round bumps on a plain, 0 to 1.2.
pub fn bumps(x: f64, y: f64) -> f64 {
    let bump = |cx: f64, cy: f64, r: f64| {
        let q = apart(x, cx).hypot(apart(y, cy)) / r;
        (1.0 - q * q).max(0.0).powi(2)
    };
    1.2 * bump(0.3, 0.3, 0.3) + bump(0.8, 0.7, 0.22)
}

/// Two octaves between values at the points of a periodic lattice.
pub fn noise(x: f64, y: f64) -> f64 {
    let lattice = |i: i64, j: i64, n: i64| {
        let (i, j) = (i.rem_euclid(n) as u64, j.rem_euclid(n) as u64);
        let mut z = (i * 73 + j * 151 + n as u64 * 977 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 31)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 40) as f64 / (1_u64 << 24) as f64
    };
    let octave = |n: i64| {
        let (x, y) = (x * n as f64, y * n as f64);
        let (i, j) = (x.floor(), y.floor());
        let (s, t) = (smooth_step(x - i), smooth_step(y - j));
        let (i, j) = (i as i64, j as i64);
        let row = |j| lattice(i, j, n) * (1.0 - s) + lattice(i + 1, j, n) * s;
        row(j) * (1.0 - t) + row(j + 1) * t
    };
    octave(3) + 0.4 * octave(6)
}

/// A camera that sees `look_at` from a distance, so many degrees from straight above, along no axis
/// of the relief.
pub fn camera(look_at: DVec3, angle: f64, distance: f64, fov_y: f64) -> Camera {
    let (s, c) = angle.to_radians().sin_cos();
    let aside = DVec3::new(0.6, 0.0, 0.8);
    Camera {
        name: format!("{angle} degrees"),
        position: look_at + distance * (s * aside + c * DVec3::Y),
        look_at,
        up: DVec3::Y,
        fov_y,
    }
}

/// A room with a relief as its floor, lit from above and aside; one wall is red. Its cameras see
/// the floor alone, one for each of [`ANGLES`].
pub fn room(case: &Case) -> Scene {
    let material = |name: &str, kd, ke| Material {
        name: name.into(),
        kd,
        ke: [ke; 3],
        ..Material::default()
    };
    let mut floor = material("floor", case.colour, 0.0);
    floor.map_height = Some(Arc::new(HeightMap {
        path: case.name.into(),
        width: TEXELS,
        height: TEXELS,
        values: texels(|x, y| (REPEAT * (case.height)(x, y)) as f32),
    }));
    if let Some(lowest) = case.lowest {
        floor.kd = [1.0; 3];
        floor.map_kd = Some(Arc::new(Texture {
            path: case.name.into(),
            width: TEXELS,
            height: TEXELS,
            texels: texels(|x, y| {
                let share = brick(x, y) as f32;
                std::array::from_fn(|c| share * case.colour[c] + (1.0 - share) * lowest[c])
            }),
        }));
    }
    let scene = Scene {
        name: case.name.into(),
        materials: vec![
            material("white", [0.4; 3], 0.0),
            material("red", [0.6, 0.1, 0.1], 0.0),
            material("lamp", [0.0; 3], 10.0),
            floor,
        ],
        ..Scene::default()
    };
    let mut shapes = Shapes { scene };
    let [white, red, lamp, floor] = [0, 1, 2, 3];
    let size = DVec3::new(2.0, 4.0, 2.0);
    let [below, _, left, ..] = shapes.room(DVec3::ZERO, size, 8, white);
    for triangle in &mut shapes.scene.triangles[left] {
        triangle.material = red;
    }
    let corner = DVec3::new(0.1, 3.98, 0.3);
    shapes.quad(corner, DVec3::X, DVec3::Z, (3, 3), lamp);
    let turned = if case.mirrored { -1.0 } else { 1.0 };
    for triangle in &mut shapes.scene.triangles[below] {
        triangle.material = floor;
        triangle.uv = triangle.vertices.map(|v| {
            let at = shapes.scene.vertices[v as usize] / REPEAT;
            // Corners of the repeats lie in the middle of texels, so that `displace` cuts along the
            // cells of the map.
            [at.z, turned * at.x].map(|a| a as f32 + 0.5 / TEXELS as f32)
        });
    }
    shapes.weld();
    let mut scene = shapes.scene;
    let middle = DVec3::new(1.0, 0.0, 1.0);
    let [steep, oblique, grazing] = ANGLES;
    scene.cameras = vec![
        camera(middle, steep, 1.0, 30.0),
        camera(middle, oblique, 1.0, 30.0),
        camera(middle, grazing, 0.9, 14.0),
    ];
    scene
}

/// Values at the middles of a repeat's texels, from its upper left.
fn texels<T>(value: impl Fn(f64, f64) -> T) -> Vec<T> {
    let centre = |i: u32| (f64::from(i) + 0.5) / f64::from(TEXELS);
    (0..TEXELS * TEXELS)
        .map(|i| value(centre(i % TEXELS), 1.0 - centre(i / TEXELS)))
        .collect()
}
