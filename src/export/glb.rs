//! A scene with its light as binary glTF 2.0.

mod document;
mod images;
mod primitives;

use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};

use super::baked_colours::CornerColours;
use super::light_map::LightMap;
use super::map_files::{MapFile, Part};
use super::surface::Surface;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::scene::light_units::LUMENS_OF_A_WATT;
use crate::scene::{Camera, Lights, Material};
use document::Document;
use images::Images;

/// How surfaces show their light.
#[derive(Clone, Copy)]
pub enum Shown<'a> {
    /// The scene alone.
    Unlit,
    /// By materials with a light map, extension `MOZ_lightmap`.
    LightMap(&'a LightMap, Part),
    /// By colours that hold light and reflectance together, extension `KHR_materials_unlit`, one
    /// PNG a page.
    Baked(&'a [Vec<u8>]),
    /// By colours of the vertices, `COLOR_0`, extension `KHR_materials_unlit`; the surface is that
    /// of a [`VertexLight`](super::vertex_light::VertexLight).
    Vertices(&'a CornerColours),
}

/// The extension of materials that show their colours as they are.
const UNLIT: &str = "KHR_materials_unlit";

/// Name of the extras of a material that hold what glTF cannot.
pub const EXTRAS: &str = "mesolux";

/// Writes a scene; returns what of it glTF cannot hold, one sentence each.
///
/// Triangles keep their order, but for those of a mesh with many materials. Light maps hold
/// irradiance in 8-bit sRGB times the extension's `intensity`; `TEXCOORD_1` says where. Vertices
/// have their irradiance, W·m⁻², as `_IRRADIANCE` beside their colours. A height
/// map is in the extras of its material: `mesolux.heightTexture` and `mesolux.heightScale`.
///
/// # Errors
/// A map that cannot be encoded; a file that cannot be written.
pub fn write(path: &Path, surface: &Surface, shown: Shown<'_>) -> Result<Vec<String>> {
    let bytes = encode(surface, shown)?;
    write_atomically(path, |out| out.write_all(&bytes.0))?;
    Ok(bytes.1)
}

/// The bytes of the file, and what is left out.
///
/// # Errors
/// As [`write()`].
pub fn encode(surface: &Surface, shown: Shown<'_>) -> Result<(Vec<u8>, Vec<String>)> {
    let mut document = Document::default();
    let mut said = Vec::new();
    let light_textures = light_textures(&mut document, shown)?;
    let scene = &surface.scene;
    let mut images = Images::default();
    let materials: Vec<Value> = (scene.materials.iter())
        .map(|material| written(&mut document, &mut images, material, &mut said))
        .collect::<Result<_>>()?;
    let place = |material: u32, page: Option<u32>| {
        let mut written = materials[material as usize].clone();
        let texture = page.and_then(|page| light_textures.get(page as usize));
        show(&mut written, shown, texture);
        if page.is_some_and(|page| page > 0) {
            let name = &scene.materials[material as usize].name;
            written["name"] = json!(format!("{name} {}", page.unwrap_or(0) + 1));
        }
        written
    };
    let colours = match shown {
        Shown::Vertices(colours) => Some(colours),
        _ => None,
    };
    primitives::add(&mut document, surface, colours, place);
    lights(&mut document, &scene.lights, &mut said);
    for camera in &scene.cameras {
        add_camera(&mut document, camera);
    }
    let extensions = match shown {
        Shown::Unlit => None,
        Shown::LightMap(..) => Some("MOZ_lightmap"),
        Shown::Baked(_) | Shown::Vertices(_) => Some(UNLIT),
    };
    document.extensions.extend(extensions);
    let bytes = document.into_bytes(&scene.name).map_err(|e| Error::Scene {
        scene: scene.name.clone(),
        what: format!("cannot be written as glTF: {e}"),
    })?;
    Ok((bytes, said))
}

/// A texture of each page of light.
fn light_textures(document: &mut Document, shown: Shown<'_>) -> Result<Vec<Value>> {
    let pages: Vec<Vec<u8>> = match shown {
        Shown::Unlit | Shown::Vertices(_) => Vec::new(),
        Shown::Baked(pages) => pages.to_vec(),
        Shown::LightMap(map, part) => (0..map.pages.count)
            .map(|page| {
                let encoded = map.page(page, part).encoded(MapFile::Srgb, map.scale(part));
                encoded.map_err(|e| Error::Usage(format!("a light map cannot be encoded: {e}")))
            })
            .collect::<Result<_>>()?,
    };
    let textures = (pages.iter().enumerate()).map(|(page, png)| {
        let sampler = document.clamped_sampler();
        let image = document.image(&format!("light {}", page + 1), png);
        json!({ "index": document.texture(image, sampler), "texCoord": 1 })
    });
    Ok(textures.collect())
}

/// A material without its light.
fn written(
    document: &mut Document,
    images: &mut Images,
    material: &Material,
    said: &mut Vec<String>,
) -> Result<Value> {
    let [r, g, b] = material.kd;
    let mut surface = json!({
        "baseColorFactor": [r, g, b, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
    });
    if let Some(texture) = &material.map_kd {
        surface["baseColorTexture"] = images.colours(document, texture)?;
    }
    let mut written = json!({ "name": material.name, "pbrMetallicRoughness": surface });
    let strength = material.ke.into_iter().fold(0.0, f32::max);
    if strength > 0.0 {
        let unit = strength.max(1.0);
        written["emissiveFactor"] = json!(material.ke.map(|c| c / unit));
        if unit > 1.0 {
            let extension = "KHR_materials_emissive_strength";
            written["extensions"][extension] = json!({ "emissiveStrength": unit });
            document.extensions.insert(extension);
        }
        if let Some(texture) = &material.map_ke {
            let mut place = images.colours(document, texture)?;
            place["texCoord"] = json!(primitives::EMISSION_SET);
            written["emissiveTexture"] = place;
        }
    }
    if let Some(map) = &material.map_normal {
        written["normalTexture"] = images.normals(document, map)?;
    }
    if let Some(map) = &material.map_height {
        match images.heights(document, map)? {
            Some(texture) => {
                written["extras"][EXTRAS] = json!({
                    "heightTexture": texture,
                    "heightScale": material.height_scale,
                });
            }
            None => said.push(format!(
                "material \"{}\": its heights are not in 0..1, and are left out",
                material.name
            )),
        }
    }
    Ok(written)
}

/// Adds its light to a material.
fn show(material: &mut Value, shown: Shown<'_>, texture: Option<&Value>) {
    match (shown, texture) {
        (Shown::LightMap(map, part), Some(texture)) => {
            let mut light = texture.clone();
            light["intensity"] = json!(map.scale(part));
            material["extensions"]["MOZ_lightmap"] = light;
        }
        (Shown::Baked(_), Some(texture)) => {
            *material = json!({
                "name": material["name"],
                "pbrMetallicRoughness": {
                    "baseColorTexture": texture,
                    "metallicFactor": 0.0,
                    "roughnessFactor": 1.0,
                },
                "extensions": { (UNLIT): {} },
            });
        }
        (Shown::Vertices(_), _) => {
            let mut surface = json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0 });
            let written = &material["pbrMetallicRoughness"];
            if let Some(texture) = written.get("baseColorTexture") {
                surface["baseColorTexture"] = texture.clone();
                surface["baseColorFactor"] = written["baseColorFactor"].clone();
            }
            *material = json!({
                "name": material["name"],
                "pbrMetallicRoughness": surface,
                "extensions": { (UNLIT): {} },
            });
        }
        _ => {}
    }
}

/// Candelas and lux. IES files and skies cannot be held.
fn lights(document: &mut Document, lights: &Lights, said: &mut Vec<String>) {
    let mut add = |name: &str, kind: &str, strength: [f32; 3], node: Value| {
        let most = strength.into_iter().fold(0.0, f32::max);
        let colour = strength.map(|c| if most > 0.0 { c / most } else { 1.0 });
        let intensity = f64::from(most) * LUMENS_OF_A_WATT;
        let light = json!({ "name": name, "type": kind, "color": colour, "intensity": intensity });
        document.light(light, node);
    };
    for light in &lights.points {
        if light.beam.is_some() {
            said.push(format!(
                "light \"{}\" has a beam, and is left out",
                light.name
            ));
            continue;
        }
        let node = json!({ "name": light.name, "translation": light.position.to_array() });
        add(&light.name, "point", light.intensity, node);
    }
    for sun in &lights.suns {
        let turn = DQuat::from_rotation_arc(DVec3::Z, sun.towards);
        let node = json!({ "name": sun.name, "rotation": turn.to_array() });
        add(&sun.name, "directional", sun.irradiance, node);
        if sun.angle > 0.0 {
            said.push(format!(
                "sun \"{}\" has a size, which is left out",
                sun.name
            ));
        }
    }
    if lights.sky.is_some() {
        said.push("the sky is left out".into());
    }
}

fn add_camera(document: &mut Document, camera: &Camera) {
    let way = camera.look_at - camera.position;
    // A camera looks along −z, with y up.
    let back = -way.normalize_or(DVec3::NEG_Z);
    let right = camera.up.cross(back).normalize_or(DVec3::X);
    let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
    let distance = way.length();
    document.camera(
        json!({
            "name": camera.name,
            "type": "perspective",
            "perspective": {
                "yfov": camera.fov_y.to_radians(),
                "znear": 1e-3 * distance,
            },
        }),
        json!({
            "name": camera.name,
            "translation": camera.position.to_array(),
            "rotation": rotation.normalize().to_array(),
        }),
    );
}
