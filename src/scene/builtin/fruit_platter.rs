//! Oranges and plain fruit on a platter, under an area light.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::panels::Panel;
use super::still_life::{add_panels, even_share, sculpted, table, turned};
use super::{fruit, placing, relief_maps};
use crate::error::{Error, Result};
use crate::scene::assemble::{Assembly, Mesh};
use crate::scene::{BuiltinOptions, Camera, Material, Scene, check};

const NAME: &str = "fruit-platter";
/// Elements in all and of the oranges in the paper's scene.
const PATCHES: usize = 76_304;
const ORANGES: usize = 11_446;
/// Metres: repeat of the peel.
const TILE: f64 = 0.08;
const RELIEF: f64 = 0.06 * TILE;

/// Height of the platter's well, and the gap under what stands in it.
const WELL: f64 = 0.012;
const GAP: f64 = 5e-4;
const ORANGE_RADIUS: f64 = 0.045;
/// Oranges in the well, x and z; the first three carry one more.
const ORANGE_PLACES: [[f64; 2]; 4] = [
    [0.020, 0.0975],
    [0.0655, 0.0187],
    [-0.0255, 0.0187],
    [-0.0765, 0.102],
];

const FIRST_FRUIT_MATERIAL: u32 = 4;
const ORANGE: u32 = FIRST_FRUIT_MATERIAL;
const PLATTER: u32 = 5;
const APPLE: u32 = 6;
const PEAR: u32 = 7;
const BANANA: u32 = 8;
const GRAPES: u32 = 9;
const STALK: u32 = 10;
const LIGHT: u32 = 11;

/// A plain fruit in the well.
struct Fruit {
    name: &'static str,
    distance: fn(DVec3) -> f64,
    material: u32,
    /// Degrees about y, greatest extent, x and z.
    turn: f64,
    size: f64,
    place: [f64; 2],
    /// Share of the triangles that the oranges leave.
    share: f64,
}

const PLAIN: [Fruit; 5] = [
    Fruit {
        name: "apple",
        distance: fruit::apple,
        material: APPLE,
        turn: 0.0,
        size: 0.084,
        place: [0.154, 0.033],
        share: 0.04,
    },
    Fruit {
        name: "apple",
        distance: fruit::apple,
        material: APPLE,
        turn: 80.0,
        size: 0.082,
        place: [0.111, 0.114],
        share: 0.04,
    },
    Fruit {
        name: "pear",
        distance: fruit::pear,
        material: PEAR,
        turn: 0.0,
        size: 0.125,
        place: [-0.135, 0.028],
        share: 0.05,
    },
    Fruit {
        name: "banana",
        distance: fruit::banana,
        material: BANANA,
        turn: 12.0,
        size: 0.18,
        place: [0.055, -0.088],
        share: 0.05,
    },
    Fruit {
        name: "bunch of grapes",
        distance: fruit::grapes,
        material: GRAPES,
        turn: 25.0,
        size: 0.11,
        place: [-0.112, -0.088],
        share: 0.12,
    },
];
const PLATTER_SHARE: f64 = 0.15;

/// Builds the scene in exactly `options.patches` elements.
///
/// # Errors
/// A statue, for which there is no place; too few patches.
pub(super) fn build(options: &BuiltinOptions) -> Result<Scene> {
    if options.statue.is_some() {
        return Err(Error::Usage(format!(
            "{NAME}: there is no statue in this scene that a mesh could replace"
        )));
    }
    let patches = options.patches.unwrap_or(PATCHES);
    let oranges = even_share(patches, ORANGES as f64 / PATCHES as f64);
    let plain = patches - oranges;

    let mut assembly = Assembly::new(NAME.into(), None);
    let materials = assembly.add_materials(&materials());
    for mesh in stack_of_oranges(oranges)? {
        assembly.add_mesh(&mesh, &materials)?;
    }
    let count = even_share(plain, PLATTER_SHARE);
    let mut platter = turned(NAME, "platter", &PLATTER_PROFILE.map(DVec2::from), count)?;
    placing::stand(&mut platter, 0.0, 0.56, DVec3::Y * GAP);
    placing::clothe(&mut platter, PLATTER, 1.0);
    assembly.add_mesh(&platter, &materials)?;
    for one in &PLAIN {
        let count = even_share(plain, one.share);
        let mut mesh = sculpted(
            NAME,
            one.name,
            one.distance,
            [fruit::LOW, fruit::HIGH],
            count,
        )?;
        placing::stand(&mut mesh, one.turn, one.size, in_well(one.place));
        placing::clothe(&mut mesh, one.material, 1.0);
        assembly.add_mesh(&mesh, &materials)?;
    }
    let mut panels = vec![Panel {
        low: DVec3::new(-0.25, 0.85, -0.40),
        high: DVec3::new(0.25, 0.85, 0.0),
        facing: DVec3::NEG_Y,
        material: LIGHT,
    }];
    panels.extend(table(1.1, 0.9, 0.6));
    add_panels(&mut assembly, &panels, &materials, patches)?;

    assembly.scene.cameras.push(Camera {
        name: "front".into(),
        position: DVec3::new(0.0, 0.42, -0.78),
        look_at: DVec3::new(0.0, 0.035, 0.0),
        up: DVec3::Y,
        fov_y: 36.0,
    });
    check::finish(assembly.into_scene())
}

/// Oranges in the well and one on the first three.
fn stack_of_oranges(triangles: usize) -> Result<Vec<Mesh>> {
    let count = ORANGE_PLACES.len() + 1;
    let pairs = triangles / 2;
    let mut meshes = Vec::new();
    for index in 0..count {
        let share = |before: usize| before * pairs / count;
        let own = 2 * (share(index + 1) - share(index));
        let mut mesh = sculpted(
            NAME,
            "orange",
            fruit::orange,
            [fruit::LOW, fruit::HIGH],
            own,
        )?;
        let place = match ORANGE_PLACES.get(index) {
            Some(&place) => in_well(place),
            None => on_three(),
        };
        placing::stand(&mut mesh, 40.0 * index as f64, 2.0 * ORANGE_RADIUS, place);
        placing::clothe(&mut mesh, ORANGE, 1.0 / TILE);
        meshes.push(mesh);
    }
    Ok(meshes)
}

fn in_well([x, z]: [f64; 2]) -> DVec3 {
    DVec3::new(x, GAP + WELL + GAP, z)
}

/// The lowest point of a ball that rests on the first three.
fn on_three() -> DVec3 {
    let [a, b, c] = [0, 1, 2].map(|k| in_well(ORANGE_PLACES[k]));
    let middle = (a + b + c) / 3.0;
    let reach = 2.0 * ORANGE_RADIUS + GAP;
    let rise = (reach * reach - middle.distance_squared(a)).max(0.0).sqrt();
    middle + DVec3::Y * rise
}

fn materials() -> [Material; 12] {
    let diffuse = |name: &str, kd| Material {
        name: name.into(),
        kd,
        ..Material::default()
    };
    [
        diffuse("table", [0.45, 0.30, 0.18]),
        diffuse("back", [0.70, 0.69, 0.66]),
        diffuse("left", [0.45, 0.52, 0.42]),
        diffuse("right", [0.60, 0.50, 0.38]),
        Material {
            map_height: Some(Arc::new(relief_maps::orange_peel(relief_maps::SIZE))),
            height_scale: RELIEF as f32,
            ..diffuse("orange", [0.85, 0.40, 0.05])
        },
        diffuse("platter", [0.75, 0.76, 0.78]),
        diffuse("apple", [0.60, 0.06, 0.05]),
        diffuse("pear", [0.60, 0.62, 0.16]),
        diffuse("banana", [0.82, 0.66, 0.12]),
        diffuse("grapes", [0.22, 0.08, 0.26]),
        diffuse("stalk", [0.20, 0.13, 0.07]),
        Material {
            ke: [14.0, 13.0, 11.5],
            ..diffuse("light", [0.78; 3])
        },
    ]
}

/// Radius and height in metres, from under the foot round the rim to the middle of the well.
const PLATTER_PROFILE: [[f64; 2]; 9] = [
    [0.0, 0.0],
    [0.17, 0.0],
    [0.215, 0.006],
    [0.275, 0.024],
    [0.28, 0.028],
    [0.274, 0.030],
    [0.222, 0.014],
    [0.212, WELL],
    [0.0, WELL],
];
