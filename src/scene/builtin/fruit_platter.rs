//! The fruit platter of the paper's Table 1: a dish of fruit on a table, oranges with a peel, an
//! area light above.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::grid::{Part, Room};
use super::stage::{self, Stage, diffuse, even_share};
use super::{fruit, relief_maps, solid};
use crate::error::{Error, Result};
use crate::scene::assemble::Mesh;
use crate::scene::{Camera, Lights, LoadOptions, Material, Scene};

const NAME: &str = "fruit-platter";
const PATCHES: usize = 76_304;
/// The material of the oranges, the only one with relief.
const SHARE: f64 = 0.15;
const DISH_SHARE: f64 = 0.12;
/// With fewer the smallest grape loses its shape.
const LEAST_PATCHES: usize = 6_000;

/// Triangles of the smallest solid.
const LEAST_TRIANGLES: usize = 24;

/// Metres; the table is its floor.
const ROOM: Room = Room {
    size: DVec3::new(1.4, 0.9, 1.0),
    light_x: [0.45, 0.95],
    light_z: [0.25, 0.65],
};
/// The dish's place, and the height of its flat inside.
const DISH_FOOT: DVec3 = DVec3::new(0.70, 1e-3, 0.52);
const DISH_THICKNESS: f64 = 0.010;
/// Gap between an object and what it lies on, metres.
const GAP: f64 = 1e-3;
/// Tiles of peel a metre, and its depth in metres: a texel is about a third of an element's edge in
/// the default number, and the rms slope of the relief is 0.26.
const REPEATS: f64 = 10.0;
const HEIGHT: f32 = 0.0024;

const ORANGE: u32 = 5;
const DISH: u32 = 6;

/// Builds the scene in exactly as many elements as asked for.
///
/// # Errors
/// Too few patches; a statue, which this scene has no place for.
pub(super) fn build(options: &LoadOptions) -> Result<Scene> {
    if options.statue.is_some() {
        return Err(Error::Usage(format!(
            "{NAME}: there is no statue in it to replace"
        )));
    }
    let patches = stage::planned(NAME, options, PATCHES, LEAST_PATCHES)?;
    let mut dish = solid::revolve(&dish_profile(), even_share(patches, DISH_SHARE));
    stage::stand(&mut dish, DISH_FOOT);
    stage::cover(&mut dish, DISH, 1.0);
    let mut solids = vec![dish.named("dish")];

    let oranges = fruit::ORANGES.len();
    let pairs = even_share(patches, SHARE) / 2;
    for (index, at) in fruit::ORANGES.iter().enumerate() {
        let count = 2 * (pairs * (index + 1) / oranges - pairs * index / oranges);
        let mut orange = fruit::orange(count);
        lay(&mut orange, DVec3::from(*at));
        stage::cover(&mut orange, ORANGE, REPEATS);
        solids.push(orange.named("orange"));
    }
    let names = fruit::materials().map(|material| material.name);
    for fruit in fruit::others() {
        let count = |share| even_share(patches, share).max(LEAST_TRIANGLES);
        let mut mesh = (fruit.build)(count(fruit.share));
        lay(&mut mesh, fruit.at);
        stage::cover(&mut mesh, ORANGE + 1 + fruit.material, 1.0);
        if fruit.has_stem() {
            let mut stem = fruit::stem(count(fruit::STEM_SHARE));
            let foot = stage::top(&mesh, fruit::STEM_RADIUS) + DVec3::Y * GAP;
            stage::stand(&mut stem, foot);
            stage::cover(&mut stem, ORANGE + 1 + fruit::STEM, 1.0);
            solids.push(stem.named("stem"));
        }
        solids.push(mesh.named(&names[fruit.material as usize - 1]));
    }

    let peel = Material {
        map_height: Some(Arc::new(relief_maps::orange_peel(relief_maps::SIZE))),
        height_scale: HEIGHT,
        ..diffuse("peel", [0.86, 0.36, 0.04])
    };
    let mut materials = vec![
        diffuse("plaster", [0.72, 0.70, 0.66]),
        diffuse("wood", [0.46, 0.29, 0.16]),
        diffuse("rose", [0.62, 0.26, 0.22]),
        diffuse("blue", [0.20, 0.32, 0.52]),
        Material {
            ke: [9.0, 8.2, 6.8],
            ..diffuse("light", [0.78; 3])
        },
        peel,
        diffuse("porcelain", [0.80, 0.80, 0.78]),
    ];
    materials.extend(fruit::materials());
    let stage = Stage {
        name: NAME,
        patches: PATCHES,
        room: ROOM,
        material_of,
        materials,
        solids,
        lights: Lights::default(),
        camera: Camera {
            name: "front".into(),
            position: DVec3::new(0.70, 0.47, -0.30),
            look_at: DVec3::new(0.70, 0.03, 0.48),
            up: DVec3::Y,
            fov_y: 40.0,
        },
    };
    stage.build(options)
}

/// Moves a fruit to a place relative to the middle of the dish; y is above the flat inside, or
/// below it for the table.
fn lay(mesh: &mut Mesh, at: DVec3) {
    let inside = DISH_FOOT + DVec3::Y * DISH_THICKNESS;
    let y = match at.y < 0.0 {
        true => GAP,
        false => inside.y + at.y + GAP,
    };
    stage::stand(mesh, DVec3::new(inside.x + at.x, y, inside.z + at.z));
}

fn material_of(part: Part) -> u32 {
    match part {
        Part::Back | Part::Ceiling => 0,
        Part::Floor => 1,
        Part::Left => 2,
        Part::Right => 3,
        Part::Light => 4,
    }
}

/// Flat to a radius of 0.2 m, with a rim that rises outward.
fn dish_profile() -> Vec<DVec2> {
    [
        [0.0, 0.0],
        [0.195, 0.0],
        [0.215, 0.006],
        [0.255, 0.026],
        [0.258, 0.029],
        [0.258, 0.033],
        [0.254, 0.034],
        [0.212, 0.014],
        [0.200, DISH_THICKNESS],
        [0.0, DISH_THICKNESS],
    ]
    .map(DVec2::from)
    .to_vec()
}
