//! Small scenes of one surface with relief each: a brick wall in raking light, the same wall beside a
//! coloured one with a lamp to move, a woven cloth beside a coloured wall, an embossed plate.

use std::sync::Arc;

use glam::DVec3;

use super::masonry_maps::{self, BRICKWORK};
use super::relief_maps;
use super::stage::diffuse;
use crate::error::Result;
use crate::scene::assemble::{Assembly, Mesh, MeshTriangle};
use crate::scene::sky::{Dome, Sky};
use crate::scene::{
    Camera, HeightMap, Lights, LoadOptions, Material, NormalMap, PointLight, Scene, Sun, check,
};

/// Texels a side of the brickwork's map, and half as many up.
const BRICK_TEXELS: u32 = 256;
/// Metres of a repeat of the weave, and its depth.
const WEAVE: f64 = 0.16;
const WEAVE_HEIGHT: f32 = 0.011;
/// Metres that the plate is wide and high, and its depth.
const PLATE: f64 = 0.6;
const PLATE_HEIGHT: f32 = 0.014;

/// A parallelogram that faces `u` × `v`, in cells; its texture begins at its origin.
struct Sheet {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    cells: [u32; 2],
    /// Of the texture, along u and v.
    repeats: [f64; 2],
    material: u32,
}

impl Sheet {
    /// In one cell and without relief.
    fn plain(origin: DVec3, u: DVec3, v: DVec3, material: u32) -> Self {
        Self {
            origin,
            u,
            v,
            cells: [1; 2],
            repeats: [1.0; 2],
            material,
        }
    }

    fn mesh(&self) -> Mesh {
        let [n, m] = self.cells;
        let mut mesh = Mesh::default();
        let share = |i: u32, of: u32| f64::from(i) / f64::from(of);
        for j in 0..=m {
            for i in 0..=n {
                let at = self.u * share(i, n) + self.v * share(j, m);
                mesh.positions.push(self.origin + at);
            }
        }
        for j in 0..m {
            for i in 0..n {
                for corners in [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]] {
                    let uv = corners.map(|[a, b]| {
                        let at = [share(i + a, n), share(j + b, m)];
                        std::array::from_fn(|k| (at[k] * self.repeats[k]) as f32)
                    });
                    mesh.triangles.push(MeshTriangle {
                        corners: corners.map(|[a, b]| (j + b) * (n + 1) + i + a),
                        uv: Some(uv),
                        emission_uv: None,
                        light_uv: None,
                        material: self.material,
                    });
                }
            }
        }
        mesh
    }
}

/// A material with heights and the normals that belong to them; a repeat is `size` metres.
fn relief(name: &str, kd: [f32; 3], heights: HeightMap, scale: f32, size: [f64; 2]) -> Material {
    Material {
        map_normal: Some(Arc::new(normals(&heights, scale, size))),
        map_height: Some(Arc::new(heights)),
        height_scale: scale,
        ..diffuse(name, kd)
    }
}

/// Normals of a height map by differences between neighbours on both sides.
fn normals(heights: &HeightMap, scale: f32, size: [f64; 2]) -> NormalMap {
    let (width, height) = (heights.width, heights.height);
    let at = |column: u32, row: u32| {
        let texel = (row % height) * width + column % width;
        f64::from(heights.values[texel as usize] * scale)
    };
    let normal = |column: u32, row: u32| {
        let across = at(column + 1, row) - at(column + width - 1, row);
        // Rows go down, v goes up.
        let up = at(column, row + height - 1) - at(column, row + 1);
        let slope = |rise: f64, texels: u32, size: f64| rise * f64::from(texels) / (2.0 * size);
        let slopes = [slope(across, width, size[0]), slope(up, height, size[1])];
        let n = DVec3::new(-slopes[0], -slopes[1], 1.0).normalize();
        n.as_vec3().to_array()
    };
    let name = heights.path.display().to_string();
    NormalMap {
        path: name.replace(".png", "-normal.png").into(),
        width,
        height,
        normals: (0..width * height)
            .map(|i| normal(i % width, i / width))
            .collect(),
    }
}

fn assembled(
    name: &str,
    materials: &[Material],
    sheets: &[(&str, Sheet)],
    lights: Lights,
    camera: Camera,
    options: &LoadOptions,
) -> Result<Scene> {
    let mut assembly = Assembly::new(name.into(), None);
    let materials = assembly.add_materials(materials);
    for (name, sheet) in sheets {
        assembly.add_mesh(&sheet.mesh().named(name), &materials)?;
    }
    assembly.scene.lights = lights;
    assembly.scene.cameras.push(camera);
    check::finish(assembly.into_scene(), &options.import)
}

fn camera(position: DVec3, look_at: DVec3, fov_y: f64) -> Camera {
    Camera {
        name: "front".into(),
        position,
        look_at,
        up: DVec3::Y,
        fov_y,
    }
}

/// Old bricks.
fn bricks() -> Result<Material> {
    let maps = masonry_maps::brickwork([BRICK_TEXELS, BRICK_TEXELS / 2])?;
    let size = BRICKWORK.to_array();
    Ok(Material {
        map_kd: Some(Arc::new(maps.colours)),
        ..relief("bricks", [1.0; 3], maps.heights, maps.height_scale, size)
    })
}

/// A wall of old bricks beside a blue one; a lamp close to the bricks grazes them, and can be moved.
///
/// # Errors
/// None that maps made by code can cause.
pub(super) fn brick_corner(options: &LoadOptions) -> Result<Scene> {
    let materials = [
        bricks()?,
        diffuse("blue", [0.07, 0.19, 0.60]),
        diffuse("paving", [0.62, 0.60, 0.56]),
    ];
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let (wide, high, deep) = (2.4, 2.1, 1.6);
    // Of the bricks, behind the blue wall and beneath the paving.
    let under = 0.075;
    let sheets = [
        (
            "bricks",
            Sheet {
                origin: -under * y,
                u: (wide + under) * x,
                v: (high + under) * y,
                cells: [16, 12],
                repeats: [(wide + under) / BRICKWORK.x, (high + under) / BRICKWORK.y],
                material: 0,
            },
        ),
        ("blue wall", Sheet::plain(wide * x, deep * z, high * y, 1)),
        ("ground", Sheet::plain(deep * z, wide * x, -deep * z, 2)),
    ];
    let lamp = PointLight {
        name: "lamp".into(),
        position: DVec3::new(1.05, 1.38, 0.42),
        intensity: [1.50, 1.22, 0.86],
        beam: None,
    };
    let lights = Lights::from(lamp);
    let look = camera(
        DVec3::new(0.72, 1.06, 3.05),
        DVec3::new(1.30, 0.80, 0.0),
        36.0,
    );
    assembled("brick-corner", &materials, &sheets, lights, look, options)
}

/// A wall of old bricks above pale paving; the sun grazes it from the left.
///
/// # Errors
/// None that maps made by code can cause.
pub(super) fn brick_wall(options: &LoadOptions) -> Result<Scene> {
    let materials = [bricks()?, diffuse("paving", [0.62, 0.60, 0.56])];
    let size = BRICKWORK.to_array();
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let wall = DVec3::new(3.6, 1.8, 0.0);
    let sheets = [
        (
            "wall",
            Sheet {
                origin: DVec3::ZERO,
                u: wall.x * x,
                v: wall.y * y,
                cells: [24, 12],
                repeats: [wall.x / size[0], wall.y / size[1]],
                material: 0,
            },
        ),
        ("ground", Sheet::plain(2.4 * z, wall.x * x, -2.4 * z, 1)),
    ];
    // 14° from the wall's plane and 24° high.
    let towards = DVec3::new(-0.886, 0.407, 0.221).normalize();
    let lights = Lights {
        points: Vec::new(),
        suns: vec![Sun {
            name: "sun".into(),
            towards,
            irradiance: [9.0, 8.0, 6.4],
            angle: 0.53,
        }],
        sky: Some(Sky {
            up: DVec3::Y,
            north: DVec3::NEG_Z,
            scale: [0.16, 0.20, 0.28],
            dome: Dome::Uniform,
        }),
    };
    let look = camera(
        DVec3::new(2.3, 1.25, 3.4),
        DVec3::new(1.75, 0.82, 0.0),
        32.0,
    );
    assembled("brick-wall", &materials, &sheets, lights, look, options)
}

/// A pale cloth on a table beside a red wall that a lamp shines on.
///
/// # Errors
/// None that maps made by code can cause.
pub(super) fn woven_cloth(options: &LoadOptions) -> Result<Scene> {
    let weave = relief_maps::weave(relief_maps::SIZE);
    let materials = [
        relief("cloth", [0.78, 0.76, 0.70], weave, WEAVE_HEIGHT, [WEAVE; 2]),
        diffuse("red", [0.63, 0.07, 0.05]),
        diffuse("white", [0.70; 3]),
        Material {
            ke: [14.0, 12.5, 10.0],
            ..diffuse("lamp", [0.78; 3])
        },
    ];
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let side = 0.96;
    // Of the cloth, beneath the walls.
    let under = 0.08;
    // Below the lowest threads.
    let foot = -f64::from(WEAVE_HEIGHT) * y;
    let sheets = [
        (
            "cloth",
            Sheet {
                origin: side * z - under * x,
                u: (side + under) * x,
                v: -(side + under) * z,
                cells: [13, 13],
                repeats: [(side + under) / WEAVE; 2],
                material: 0,
            },
        ),
        (
            "red wall",
            Sheet::plain(side * z + foot, -side * z, 1.1 * y, 1),
        ),
        ("back wall", Sheet::plain(foot, side * x, 1.1 * y, 2)),
        (
            "lamp",
            Sheet::plain(
                DVec3::new(0.66, 0.82, 0.30),
                0.2 * x + 0.12 * y,
                0.25 * z,
                3,
            ),
        ),
    ];
    let look = camera(
        DVec3::new(0.80, 0.48, 1.15),
        DVec3::new(0.30, 0.03, 0.36),
        38.0,
    );
    let lights = Lights::default();
    assembled("woven-cloth", &materials, &sheets, lights, look, options)
}

/// A plate with a star and rings, upright on a shelf, lit from one side.
///
/// # Errors
/// None that maps made by code can cause.
pub(super) fn embossed_plate(options: &LoadOptions) -> Result<Scene> {
    let star = relief_maps::star(4 * relief_maps::SIZE);
    let materials = [
        relief("plate", [0.62, 0.60, 0.52], star, PLATE_HEIGHT, [PLATE; 2]),
        diffuse("shelf", [0.45, 0.32, 0.22]),
        diffuse("wall", [0.30, 0.36, 0.42]),
        Material {
            ke: [26.0, 22.0, 16.0],
            ..diffuse("lamp", [0.78; 3])
        },
    ];
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let sheets = [
        (
            "plate",
            Sheet {
                origin: DVec3::new(-0.5 * PLATE, 0.0, 0.1),
                u: PLATE * x,
                v: PLATE * y,
                cells: [16, 16],
                repeats: [1.0; 2],
                material: 0,
            },
        ),
        (
            "shelf",
            Sheet::plain(DVec3::new(-0.8, 0.0, 0.9), 1.6 * x, -0.9 * z, 1),
        ),
        (
            "wall",
            Sheet::plain(DVec3::new(-0.8, 0.0, 0.0), 1.6 * x, 0.9 * y, 2),
        ),
        (
            "lamp",
            Sheet::plain(
                DVec3::new(-0.78, 0.55, 0.25),
                0.16 * y,
                0.2 * z - 0.02 * x,
                3,
            ),
        ),
    ];
    let look = camera(
        DVec3::new(0.12, 0.42, 1.55),
        DVec3::new(0.0, 0.31, 0.1),
        34.0,
    );
    let lights = Lights::default();
    assembled("embossed-plate", &materials, &sheets, lights, look, options)
}
