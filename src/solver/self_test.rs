//! Opening a device and testing, before anything is trusted to it, that element IDs come back
//! right.

use std::sync::Arc;

use glam::DVec3;

use super::Settings;
use super::drawing::Drawing;
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::mesh::near::NearPairs;
use crate::mesh::occluders::Occluders;
use crate::mesh::sources;
use crate::passes::batch::BatchSize;
use crate::passes::buffers::SceneBuffers;
use crate::passes::scene_data::SceneData;
use crate::scene::shapes::Shapes;
use crate::scene::{Lights, Scene};
use crate::vk::{Candidate, Device, Instance};

/// Opens the device asked for, by index or part of its name, or else the best one that can run this
/// program.
pub fn open_device(wanted: Option<&str>, validation: bool) -> Result<Arc<Device>> {
    let instance = Instance::new(validation)?;
    let candidate = choose_device(&instance, wanted)?;
    let device = Device::new(&instance, &candidate)?;
    if !ids_come_back_right(&device)? {
        return Err(Error::Device(format!(
            "device {} ({}) gives wrong primitive numbers to fragment shaders (some Mesa 25.3 to 26.1 drivers do); \
             update the driver or choose another --device",
            candidate.name, candidate.driver
        )));
    }
    Ok(device)
}

/// The device that [`open_device`] opens.
pub fn choose_device(instance: &Instance, wanted: Option<&str>) -> Result<Candidate> {
    let candidates = instance.candidates()?;
    let chosen = match wanted {
        None => candidates.first(),
        Some(wanted) => {
            let by_index = wanted
                .parse::<usize>()
                .ok()
                .and_then(|i| candidates.iter().find(|c| c.index == i));
            by_index.or_else(|| {
                let lower = wanted.to_lowercase();
                // A number is an index or a model: that of a version somewhere in a name is
                // neither.
                let number = lower.bytes().all(|b| b.is_ascii_digit());
                candidates.iter().find(|c| {
                    let name = c.name.to_lowercase();
                    match number {
                        true => name.split_whitespace().any(|word| word == lower),
                        false => name.contains(&lower),
                    }
                })
            })
        }
    };
    if let Some(candidate) = chosen {
        return Ok(candidate.clone());
    }
    let names: Vec<_> = candidates
        .iter()
        .map(|c| format!("{}: {}", c.index, c.name))
        .collect();
    Err(Error::Device(match wanted {
        Some(wanted) if !names.is_empty() => {
            format!("no device \"{wanted}\"; there are {}", names.join(", "))
        }
        _ => "no Vulkan device; on Debian install mesa-vulkan-drivers for a software one".into(),
    }))
}

/// Draws one hemicube inside a small box of distinct triangles and compares every pixel's ID with
/// the triangle that the pixel's own ray meets.
pub fn ids_come_back_right(device: &Arc<Device>) -> Result<bool> {
    const SIZE: u32 = 16;
    let mut elements = Elements::new(&open_box());
    let settings = Settings::default();
    let (sources, connections) =
        sources::build(&mut elements, &Lights::NONE, &settings.grouping, 0);
    let occluders = Occluders::elements(&elements);
    let near = NearPairs::none(&elements, sources.list.len());
    let scene = SceneData::new(&elements, &sources, &connections, &occluders, &near);
    let scene = SceneBuffers::new(device, &scene, scene.shape)?;
    let size = BatchSize {
        slots: 1,
        face: SIZE,
        list_room: None,
    };
    let (drawing, batch) = Drawing::new(device, &scene, settings.culling, &size)?;
    // Only one source emits.
    let (index, emitter) = (sources.list.iter().enumerate())
        .find(|(_, s)| s.emitted.max_element() > 0.0)
        .expect("the test scene has a light");
    let drawn = drawing.draw(device, &batch, index as u32)?;
    Ok(crate::reference::item_buffer::disagreements(
        &elements,
        &connections,
        &occluders,
        emitter,
        SIZE,
        &drawn,
    )
    .is_empty())
}

/// Five walls of a box, an emitter in the floor, and a triangle afloat. Walls are wound to face
/// inward or outward alike: both sides block light.
fn open_box() -> Scene {
    let mut shapes = Shapes::new();
    let (wall, light) = (shapes.material(0.5, 0.0), shapes.material(0.0, 1.0));
    for (corners, material) in [
        ([[0.3, 0.3, 0.0], [0.7, 0.35, 0.0], [0.5, 0.6, 0.0]], light),
        ([[0.2, 0.3, 0.6], [0.5, 0.8, 0.7], [0.6, 0.2, 0.5]], wall),
    ] {
        let corners = corners.map(|corner| shapes.vertex(DVec3::from_array(corner)));
        shapes.triangle(corners, material);
    }
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (origin, u, v) in [
        (z, x, y),
        (y, z, x),
        (DVec3::ZERO, x, z),
        (DVec3::ZERO, z, y),
        (x, y, z),
    ] {
        shapes.quad(origin, u, v, (1, 1), wall);
    }
    shapes.scene
}
