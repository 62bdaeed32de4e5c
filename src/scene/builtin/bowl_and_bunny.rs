//! A knitted rabbit beside a bowl, lit by a point light.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::still_life::{add_panels, even_share, sculpted, table, turned};
use super::{bunny, placing, relief_maps};
use crate::error::Result;
use crate::scene::assemble::Assembly;
use crate::scene::{BuiltinOptions, Camera, Material, PointLight, Scene, check};

const NAME: &str = "bowl-and-bunny";
/// Elements in all and of the rabbit in the paper's scene.
const PATCHES: usize = 73_256;
const BUNNY: usize = 15_384;
/// Share of the other elements that the bowl has.
const BOWL_SHARE: f64 = 0.3;
/// Metres: greatest extent of the rabbit, repeat of the knit.
const BUNNY_SIZE: f64 = 0.40;
const TILE: f64 = 0.12;
const RELIEF: f64 = 0.05 * TILE;

const BUNNY_MATERIAL: u32 = 4;
const BOWL_MATERIAL: u32 = 5;

/// Builds the scene in exactly `options.patches` elements.
///
/// # Errors
/// A statue that cannot be read; too few patches.
pub(super) fn build(options: &BuiltinOptions) -> Result<Scene> {
    let patches = options.patches.unwrap_or(PATCHES);
    let mut mesh = match &options.statue {
        Some(path) => placing::read_statue(path)?,
        None => {
            let count = even_share(patches, BUNNY as f64 / PATCHES as f64);
            sculpted(
                NAME,
                "rabbit",
                bunny::distance,
                [bunny::LOW, bunny::HIGH],
                count,
            )?
        }
    };
    placing::stand(&mut mesh, -55.0, BUNNY_SIZE, DVec3::new(0.17, 0.0, 0.02));
    placing::clothe(&mut mesh, BUNNY_MATERIAL, 1.0 / TILE);
    let statue = placing::count(&mesh);
    // Only a statue that was asked for may need more than the patches that were not.
    let patches = options.patches.unwrap_or(PATCHES.max(2 * statue));

    let mut assembly = Assembly::new(NAME.into(), None);
    let materials = assembly.add_materials(&materials());
    assembly.add_mesh(&mesh, &materials)?;
    let count = even_share(patches.saturating_sub(statue), BOWL_SHARE);
    let mut bowl = turned(NAME, "bowl", &bowl_profile(), count)?;
    placing::stand(&mut bowl, 0.0, 0.34, DVec3::new(-0.22, 5e-4, -0.02));
    placing::clothe(&mut bowl, BOWL_MATERIAL, 1.0);
    assembly.add_mesh(&bowl, &materials)?;
    add_panels(&mut assembly, &table(1.4, 1.0, 0.8), &materials, patches)?;

    let scene = &mut assembly.scene;
    scene.notes.append(&mut mesh.notes);
    scene.point_lights.push(PointLight {
        name: "lamp".into(),
        position: DVec3::new(-0.25, 0.75, -0.40),
        intensity: [3.0, 2.8, 2.5],
    });
    scene.cameras.push(Camera {
        name: "front".into(),
        position: DVec3::new(0.0, 0.50, -1.35),
        look_at: DVec3::new(0.0, 0.16, 0.0),
        up: DVec3::Y,
        fov_y: 36.0,
    });
    check::finish(assembly.into_scene())
}

fn materials() -> [Material; 6] {
    let diffuse = |name: &str, kd| Material {
        name: name.into(),
        kd,
        ..Material::default()
    };
    [
        diffuse("table", [0.55, 0.38, 0.24]),
        diffuse("back", [0.70, 0.70, 0.68]),
        diffuse("left", [0.25, 0.40, 0.62]),
        diffuse("right", [0.62, 0.30, 0.22]),
        Material {
            map_height: Some(Arc::new(relief_maps::knit(relief_maps::SIZE))),
            height_scale: RELIEF as f32,
            ..diffuse("bunny", [0.78, 0.70, 0.58])
        },
        diffuse("bowl", [0.75, 0.75, 0.72]),
    ]
}

/// Radius and height, from under the foot round the rim to the bottom inside; the wall bellies out.
fn bowl_profile() -> Vec<DVec2> {
    const STEPS: usize = 12;
    let mut profile = vec![DVec2::ZERO, DVec2::new(0.46, 0.0), DVec2::new(0.48, 0.06)];
    let belly = |radius: f64, depth: f64, step: usize| {
        let angle = std::f64::consts::FRAC_PI_2 * (0.26 + 0.74 * step as f64 / STEPS as f64);
        DVec2::new(radius * angle.sin(), 0.80 - depth * angle.cos())
    };
    profile.extend((0..=STEPS).map(|step| belly(1.0, 0.75, step)));
    profile.push(DVec2::new(0.97, 0.83));
    profile.extend((0..=STEPS).rev().map(|step| belly(0.93, 0.67, step)));
    profile.push(DVec2::new(0.0, 0.80 - 0.67));
    profile
}
