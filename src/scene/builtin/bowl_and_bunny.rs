//! Bowl and bunny of the paper's Table 1: a point light, a knitted bunny beside a bowl.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::grid::{Part, Room};
use super::stage::{self, Stage, diffuse, even_share};
use super::{bunny, relief_maps, solid};
use crate::error::Result;
use crate::scene::{Camera, Lights, LoadOptions, Material, PointLight, Scene};

const NAME: &str = "bowl-and-bunny";
const PATCHES: usize = 73_256;
const SHARE: f64 = 0.21;
const BOWL_SHARE: f64 = 0.16;
/// With fewer the bunny loses its ears.
const LEAST_PATCHES: usize = 6_000;

/// Metres. The light's rectangle is part of the ceiling here.
const ROOM: Room = Room {
    size: DVec3::new(1.2, 0.8, 0.9),
    light_x: [0.4, 0.8],
    light_z: [0.3, 0.6],
};
const BUNNY_HEIGHT: f64 = 0.26;
const BUNNY_TURN: f64 = -25.0;
const BUNNY_FOOT: DVec3 = DVec3::new(0.71, 1e-3, 0.46);
const BOWL_FOOT: DVec3 = DVec3::new(0.46, 1e-3, 0.40);
/// Tiles of knit a metre, and its depth in metres: a texel is about a third of an element's edge in
/// the default number, and the rms slope of the relief is 0.27.
const REPEATS: f64 = 11.0;
const HEIGHT: f32 = 0.0014;

const BUNNY: u32 = 4;
const BOWL: u32 = 5;

/// Builds the scene in exactly as many elements as asked for.
///
/// # Errors
/// Too few patches; a statue that cannot be read.
pub(super) fn build(options: &LoadOptions) -> Result<Scene> {
    let patches = stage::planned(NAME, options, PATCHES, LEAST_PATCHES)?;
    let mut figure = match &options.statue {
        Some(path) => stage::read_statue(path)?,
        None => solid::sculpt(&bunny::BUNNY, even_share(patches, SHARE)),
    };
    stage::place(&mut figure, BUNNY_HEIGHT, BUNNY_TURN, BUNNY_FOOT);
    stage::cover(&mut figure, BUNNY, REPEATS);
    let mut bowl = solid::revolve(&bowl_profile(), even_share(patches, BOWL_SHARE));
    stage::stand(&mut bowl, BOWL_FOOT);
    stage::cover(&mut bowl, BOWL, 1.0);

    let wool = Material {
        map_height: Some(Arc::new(relief_maps::knit(relief_maps::SIZE))),
        height_scale: HEIGHT,
        ..diffuse("wool", [0.72, 0.62, 0.50])
    };
    let stage = Stage {
        name: NAME,
        patches: PATCHES,
        room: ROOM,
        material_of,
        materials: vec![
            diffuse("plaster", [0.72, 0.70, 0.66]),
            diffuse("wood", [0.50, 0.33, 0.19]),
            diffuse("terracotta", [0.62, 0.24, 0.13]),
            diffuse("teal", [0.12, 0.38, 0.42]),
            wool,
            diffuse("glaze", [0.16, 0.30, 0.58]),
        ],
        solids: vec![figure.named("bunny"), bowl.named("bowl")],
        lights: Lights::from(PointLight {
            name: "bulb".into(),
            position: DVec3::new(0.36, 0.62, 0.16),
            intensity: [0.62, 0.56, 0.46],
            beam: None,
        }),
        camera: Camera {
            name: "front".into(),
            position: DVec3::new(0.575, 0.32, -0.30),
            look_at: DVec3::new(0.575, 0.12, 0.44),
            up: DVec3::Y,
            fov_y: 40.0,
        },
    };
    stage.build(options)
}

fn material_of(part: Part) -> u32 {
    match part {
        Part::Ceiling | Part::Light | Part::Back => 0,
        Part::Floor => 1,
        Part::Left => 2,
        Part::Right => 3,
    }
}

/// A foot, a round wall 6 mm thick, a round rim: metres, from the axis below to the axis above.
fn bowl_profile() -> Vec<DVec2> {
    let mut profile = vec![DVec2::new(0.0, 0.003), DVec2::new(0.036, 0.003)];
    profile.extend([
        DVec2::new(0.038, 0.0),
        DVec2::new(0.044, 0.0),
        DVec2::new(0.046, 0.008),
    ]);
    // An arc about a centre above the foot; outside upwards, inside downwards.
    let centre = DVec2::new(0.0, 0.118);
    let arc = |radius: f64, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        centre + radius * DVec2::new(cos, sin)
    };
    profile.extend((0..=12).map(|i| arc(0.118, -65.0 + 62.0 * f64::from(i) / 12.0)));
    profile.push(arc(0.115, 0.0));
    profile.extend((0..=16).map(|i| arc(0.112, -3.0 - 87.0 * f64::from(i) / 16.0)));
    if let Some(last) = profile.last_mut() {
        last.x = 0.0;
    }
    profile
}
