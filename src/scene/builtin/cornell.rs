//! The Cornell box (Goral et al. 1984; measured data of Cornell's Program of Computer Graphics)
//! with a statue.

use glam::DVec3;

use super::grid::{self, Part, Room};
use super::stage::{self, diffuse};
use super::statue;
use crate::error::{Error, Result};
use crate::scene::assemble::Assembly;
use crate::scene::uv::box_projection;
use crate::scene::{Camera, LoadOptions, Material, Scene, check};

/// Default number of elements.
const PATCHES: usize = 12_000;
/// The measured box.
pub(super) const ROOM: Room = Room {
    size: DVec3::new(5.56, 5.488, 5.592),
    light_x: [2.13, 3.43],
    light_z: [2.27, 3.32],
};
/// The greatest extent of the statue over the height of the room.
pub(super) const STATUE_SIZE: f64 = 0.6;
/// Degrees that turn a head that looks towards −z, at the camera, to the left and halfway back.
pub(super) const STATUE_TURN: f64 = -60.0;
/// Triangles of the statue made by code: with fewer it loses its ears, more show no more detail.
const STATUE_TRIANGLES: std::ops::RangeInclusive<usize> = 3_000..=25_780;

/// Builds the box in exactly `options.patches` elements, statue and light included.
///
/// # Errors
/// A statue that cannot be read; fewer patches than statue and coarsest room need.
pub(super) fn build(options: &LoadOptions) -> Result<Scene> {
    let patches = options.patches.unwrap_or(PATCHES);
    let mut mesh = match &options.statue {
        Some(path) => stage::read_statue(path)?,
        None => {
            statue::build((patches / 2).clamp(*STATUE_TRIANGLES.start(), *STATUE_TRIANGLES.end()))
        }
    };
    stage::place(&mut mesh, STATUE_SIZE * ROOM.size.y, STATUE_TURN, FOOT);
    for triangle in &mut mesh.triangles {
        triangle.material = STATUE_MATERIAL;
        // The note about made-up texture coordinates is for meshes from files; it does not apply
        // here.
        if options.statue.is_none() {
            let corners = triangle.corners.map(|v| mesh.positions[v as usize]);
            triangle.uv = Some(box_projection(corners));
        }
    }
    let mut notes = std::mem::take(&mut mesh.said.notes);
    let statue = stage::count(&mesh);
    let least = statue + grid::least_triangles();
    // Only a statue given by the user may need more than the default number of patches.
    let patches = match options.patches {
        None => patches.max(2 * statue),
        Some(patches) if patches < least => {
            return Err(Error::Usage(format!(
                "cornell: {patches} patches are too few: the statue takes {statue}, and with the coarsest room it is {least}"
            )));
        }
        Some(patches) => patches,
    };

    let mut assembly = Assembly::new("cornell".into(), None);
    let materials = assembly.add_materials(&materials());
    assembly.add_mesh(
        &stage::room(&ROOM, patches - statue, material_of),
        &materials,
    )?;
    assembly.add_mesh(&mesh.named("statue"), &materials)?;
    let scene = &mut assembly.scene;
    scene.notes.append(&mut notes);
    scene.cameras.push(camera());
    assert_eq!(
        scene.triangles.len(),
        patches,
        "every patch is there, and no other"
    );
    check::finish(assembly.into_scene(), &options.import)
}

/// The middle of the floor, where the statue stands.
pub(super) const FOOT: DVec3 = DVec3::new(ROOM.size.x / 2.0, 0.0, ROOM.size.z / 2.0);

/// The camera of the measured data.
pub(super) fn camera() -> Camera {
    Camera {
        name: "front".into(),
        position: DVec3::new(2.78, 2.73, -8.0),
        look_at: DVec3::new(2.78, 2.73, 0.0),
        up: DVec3::Y,
        fov_y: 39.3,
    }
}

/// In the order of [`material_of`].
pub(super) fn materials() -> [Material; 5] {
    [
        diffuse("white", [0.725, 0.71, 0.68]),
        diffuse("red", [0.63, 0.065, 0.05]),
        diffuse("green", [0.14, 0.45, 0.091]),
        Material {
            ke: [17.0, 12.0, 4.0],
            ..diffuse("light", [0.78; 3])
        },
        diffuse("statue", [0.75, 0.55, 0.10]),
    ]
}

pub(super) const STATUE_MATERIAL: u32 = 4;

pub(super) fn material_of(part: Part) -> u32 {
    match part {
        Part::Floor | Part::Ceiling | Part::Back => 0,
        Part::Left => 1,
        Part::Right => 2,
        Part::Light => 3,
    }
}
