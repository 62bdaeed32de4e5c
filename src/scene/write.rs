//! Scenes written out, so that reading them back gives the same bits.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use toml::Spanned;

use super::Scene;
use super::map_files::{self, MapFiles};
use super::scene_file::{CameraTable, MeshTable, SceneFile};
use super::sides::Sides;
use super::write_lights::{self, LightTables};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

const MESH: &str = "scene.obj";
const MATERIALS: &str = "scene.mtl";
const SCENE: &str = "scene.toml";

/// Writes `scene.obj`, `scene.mtl`, the textures and relief maps, the beams and pictures of lights
/// and `scene.toml` into `dir`, and returns the path of the last.
///
/// Loading that gives the same triangles in the same order, the same f64 positions, materials,
/// lights and cameras. A normal map made by code may change by 10⁻⁵.
///
/// # Errors
/// A file that cannot be written; a texture that cannot be copied; two materials of one name, or a
/// name that a material file cannot hold; only a scene made by code can have one.
pub fn write_scene(scene: &Scene, dir: &Path) -> Result<PathBuf> {
    check_names(scene)?;
    if scene.triangles.iter().any(|t| t.emission_uv.is_some()) {
        return Err(Error::Scene {
            scene: scene.name.clone(),
            what: "the emission has texture coordinates of its own, which OBJ cannot hold".into(),
        });
    }
    fs::create_dir_all(dir).map_err(|source| Error::write(dir, source))?;
    let maps = map_files::write(scene, dir)?;
    let lights = write_lights::write(&scene.lights, dir)?;
    write_atomically(&dir.join(MATERIALS), |out| materials(scene, &maps, out))?;
    write_atomically(&dir.join(MESH), |out| mesh(scene, out))?;
    // Last, so that a scene file is never beside another scene's mesh.
    let path = dir.join(SCENE);
    let text = toml::to_string(&tables(scene, lights))
        .map_err(|error| Error::file(&path, format!("cannot be put in words: {error}")))?;
    write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
    Ok(path)
}

fn check_names(scene: &Scene) -> Result<()> {
    let mut known = HashSet::new();
    for material in &scene.materials {
        let name = material.name.as_str();
        let writable = !name.is_empty() && name.trim() == name && !name.contains(char::is_control);
        if !writable || !known.insert(name) {
            return Err(Error::Scene {
                scene: scene.name.clone(),
                what: format!("material name {name:?} is in use twice or cannot stand in a file"),
            });
        }
    }
    Ok(())
}

fn materials(scene: &Scene, maps: &MapFiles, out: &mut dyn Write) -> io::Result<()> {
    for material in &scene.materials {
        let ([r, g, b], [er, eg, eb]) = (material.kd, material.ke);
        writeln!(
            out,
            "newmtl {}\nKd {r} {g} {b}\nKe {er} {eg} {eb}",
            material.name
        )?;
        if let Some(texture) = &material.map_kd {
            writeln!(out, "map_Kd {}", maps.textures[&texture.path])?;
        }
        if let Some(texture) = &material.map_ke {
            writeln!(out, "map_Ke {}", maps.textures[&texture.path])?;
        }
        if let Some(map) = &material.map_height {
            let name = maps.of(map);
            writeln!(out, "map_Disp -bm {} {name}", material.height_scale)?;
        }
        if let Some(map) = &material.map_normal {
            writeln!(out, "norm {}", maps.of(map))?;
        }
    }
    Ok(())
}

/// Rust prints the shortest decimals that read back as the same float.
fn mesh(scene: &Scene, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "mtllib {MATERIALS}")?;
    for p in &scene.vertices {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    let mut uvs: HashMap<[u32; 2], usize> = HashMap::new();
    let mut material = None;
    // Those of a refined scene are ranges of its input.
    let is_input = scene.refined_from.is_none();
    let ranges = scene.meshes.iter().filter(|_| is_input);
    let mut meshes = ranges.peekable();
    for (index, triangle) in (0..).zip(&scene.triangles) {
        if let Some(mesh) = meshes.next_if(|mesh| mesh.first == index) {
            writeln!(out, "o {}", mesh.name.replace(char::is_control, " "))?;
        }
        let mut uv_indices = [0; 3];
        for (uv, index) in triangle.uv.iter().zip(&mut uv_indices) {
            let next = uvs.len() + 1;
            *index = *uvs.entry(uv.map(f32::to_bits)).or_insert(next);
            if *index == next {
                writeln!(out, "vt {} {}", uv[0], uv[1])?;
            }
        }
        if material != Some(triangle.material) {
            material = Some(triangle.material);
            writeln!(
                out,
                "usemtl {}",
                scene.materials[triangle.material as usize].name
            )?;
        }
        let [a, b, c] = triangle.vertices.map(|v| v + 1);
        let [ta, tb, tc] = uv_indices;
        writeln!(out, "f {a}/{ta} {b}/{tb} {c}/{tc}")?;
    }
    Ok(())
}

fn tables(scene: &Scene, lights: LightTables) -> SceneFile {
    SceneFile {
        name: Some(scene.name.clone()),
        mesh: vec![bare(MeshTable {
            file: MESH.into(),
            sides: Some(Sides::AsGiven),
            ..MeshTable::default()
        })],
        point_light: lights.points,
        sun: lights.suns,
        sky: lights.sky,
        sphere_lamp: Vec::new(),
        disk_lamp: Vec::new(),
        camera: scene
            .cameras
            .iter()
            .map(|camera| {
                bare(CameraTable {
                    name: Some(camera.name.clone()),
                    position: camera.position.to_array(),
                    look_at: camera.look_at.to_array(),
                    up: camera.up.to_array(),
                    fov: camera.fov_y,
                })
            })
            .collect(),
        heights_from_normals: false,
        material: Default::default(),
    }
}

/// A table without a place in a text.
pub(super) fn bare<T>(table: T) -> Spanned<T> {
    Spanned::new(0..0, table)
}
