//! Checks of a whole scene, from any source.

use super::{Camera, ImportOptions, Scene, heights_from_normals, relief_notes};
use crate::error::{Error, Result};

/// Extents within which the squares and areas of later steps stay well within the range of f32.
const EXTENTS: std::ops::RangeInclusive<f64> = 1e-15..=1e15;

/// Checks a scene and gives it a camera if it has none.
pub(super) fn finish(mut scene: Scene, import: &ImportOptions) -> Result<Scene> {
    let refuse = |what: String| Error::Scene {
        scene: match &scene.path {
            Some(path) => path.display().to_string(),
            None => scene.name.clone(),
        },
        what,
    };
    if scene.triangles.is_empty() {
        return Err(refuse(match scene.dropped_degenerate {
            0 => "there is no triangle in it".into(),
            dropped => format!("there is no triangle in it with an area ({dropped} without)"),
        }));
    }
    let of_meshes: usize = scene.meshes.iter().map(|mesh| mesh.count as usize).sum();
    assert_eq!(
        of_meshes,
        scene.triangles.len(),
        "every triangle is of one mesh"
    );
    let (low, high) = scene.bounds();
    let extent = (high - low).max_element();
    if !EXTENTS.contains(&extent) {
        return Err(refuse(format!(
            "it is {extent:e} units across: it must be between {:e} and {:e}",
            EXTENTS.start(),
            EXTENTS.end()
        )));
    }
    for material in &scene.materials {
        material
            .check()
            .map_err(|what| refuse(format!("material \"{}\": {what}", material.name)))?;
    }
    let lights = &scene.lights;
    let points = lights
        .points
        .iter()
        .map(|l| (l.check(), format!("point light \"{}\"", l.name)));
    let suns = lights
        .suns
        .iter()
        .map(|l| (l.check(), format!("sun \"{}\"", l.name)));
    let sky = lights.sky.iter().map(|sky| (sky.check(), "sky".into()));
    for (checked, light) in points.chain(suns).chain(sky) {
        checked.map_err(|what| refuse(format!("{light}: {what}")))?;
    }
    if !has_light(&scene) {
        return Err(refuse(
            "there is no light: no material in use has Ke above 0, and no point light, sun or sky \
             shines"
                .into(),
        ));
    }

    if import.heights_from_normals {
        heights_from_normals::add_to(&mut scene);
    }
    let mut notes = relief_notes::collect(&scene);
    scene.notes.append(&mut notes);
    if scene.cameras.is_empty() {
        let camera = Camera::for_scene(&scene);
        scene
            .notes
            .push("there is no camera: \"default\" looks at the whole scene".into());
        scene.cameras.push(camera);
    }
    if scene.dropped_degenerate > 0 {
        scene.notes.push(format!(
            "{} triangles without area were left out",
            scene.dropped_degenerate
        ));
    }
    if scene.dropped_duplicates > 0 {
        scene.notes.push(format!(
            "{} triangles were left out, since earlier ones have the same corners and the same front",
            scene.dropped_duplicates
        ));
    }
    Ok(scene)
}

fn has_light(scene: &Scene) -> bool {
    let emits: Vec<bool> = scene.materials.iter().map(|m| m.emits()).collect();
    let shines = |rgb: &[f32; 3]| rgb.iter().any(|&c| c > 0.0);
    let lights = &scene.lights;
    scene.triangles.iter().any(|t| emits[t.material as usize])
        || lights.points.iter().any(|light| shines(&light.intensity))
        || lights.suns.iter().any(|sun| shines(&sun.irradiance))
        || lights.sky.as_ref().is_some_and(|sky| !sky.is_black())
}
