//! Wavefront OBJ meshes.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use glam::DVec3;

use super::assemble::{Mesh, MeshTriangle};
use super::material::{DEFAULT_KD, MadeUp, TextureCache};
use super::meshes::Part;
use super::obj_lint::{self, Checked, brief};
use super::stem::stem;
use super::uv::UvTransform;
use super::{Material, mtl};
use crate::error::{Error, Result};
use crate::input_file::read_text;

/// The material of faces that name none.
const NO_MATERIAL: &str = "default";

/// Reads a mesh with its materials: faces in the order of the file, polygons cut into fans.
///
/// # Errors
/// A file that is missing or is not text; the first wrong line; a material or texture that is wrong
/// or missing; no face.
pub(super) fn read(path: &Path, textures: &mut TextureCache) -> Result<Mesh> {
    let text = read_text(path)?;
    let checked = obj_lint::check(path, &text)?;
    drop(text);
    if checked.has_uv.is_empty() {
        return Err(Error::file(path, "there is no face in it"));
    }
    let mut mesh = Mesh::default();
    if let Some((line, keyword)) = &checked.first_unknown {
        mesh.said.notes.push(format!(
            "{}: {} lines that are no OBJ statements were passed over, the first is line {line}: {keyword}",
            path.display(),
            checked.unknown
        ));
    }
    materials(path, &checked, textures, &mut mesh)?;
    faces(path, &checked, &mut mesh)?;
    mesh.parts = parts(path, checked);
    warn_of_moved_maps(&mut mesh);
    warn_of_clamped_maps(path, &mut mesh);
    Ok(mesh)
}

/// Objects, or groups where there are none; the file has the name of what lies outside of them.
fn parts(path: &Path, checked: Checked) -> Vec<Part> {
    let mut parts = match checked.objects.is_empty() {
        true => checked.groups,
        false => checked.objects,
    };
    if parts.first().is_none_or(|part| part.first > 0) {
        let name = String::new();
        parts.insert(0, Part { name, first: 0 });
    }
    for part in &mut parts {
        if part.name.is_empty() {
            part.name = stem(path);
        }
    }
    parts
}

fn materials(
    path: &Path,
    checked: &Checked,
    textures: &mut TextureCache,
    mesh: &mut Mesh,
) -> Result<()> {
    let mut known: HashSet<String> = HashSet::new();
    for (line, names) in &checked.libraries {
        for name in library_files(path, names) {
            let file = path.with_file_name(&name);
            if !file.exists() {
                let what = format!("mtllib \"{}\": there is no such file", brief(&name));
                return Err(Error::line(path, *line, what));
            }
            let read = mtl::read(&file, textures)?;
            mesh.said.append(read.said);
            mesh.said.notes.append(&mut textures.notes);
            mesh.on_surface.extend(read.on_surface);
            for material in read.materials {
                if !known.insert(material.name.clone()) {
                    return Err(Error::Material {
                        path: file,
                        material: material.name,
                        what: "an earlier mtllib has a material of this name".into(),
                    });
                }
                mesh.materials.push(material);
            }
            mesh.made_up.extend(read.made_up);
        }
    }
    for (line, name) in &checked.used {
        if !known.insert(name.clone()) {
            continue;
        }
        if !checked.libraries.is_empty() {
            let what = format!("material \"{}\" is in no mtllib of this file", brief(name));
            return Err(Error::line(path, *line, what));
        }
        make_up(mesh, name);
    }
    Ok(())
}

fn make_up(mesh: &mut Mesh, name: &str) {
    mesh.materials.push(Material {
        name: name.to_owned(),
        kd: [DEFAULT_KD; 3],
        ..Material::default()
    });
    mesh.made_up.push(MadeUp {
        material: name.to_owned(),
        kd: DEFAULT_KD,
    });
}

/// The files of one `mtllib`: one name, which may hold spaces, or several.
fn library_files(path: &Path, names: &str) -> Vec<String> {
    let several: Vec<String> = names.split_whitespace().map(str::to_owned).collect();
    let all_there = several.iter().all(|n| path.with_file_name(n).is_file());
    if several.len() > 1 && all_there {
        several
    } else {
        vec![names.replace('\\', "/")]
    }
}

fn faces(path: &Path, checked: &Checked, mesh: &mut Mesh) -> Result<()> {
    // One library replaces all, so that tobj knows each name before the first `usemtl`.
    let text = format!("mtllib all\n{}", checked.text);
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let indices: HashMap<String, usize> = mesh
        .materials
        .iter()
        .enumerate()
        .map(|(index, material)| (material.name.clone(), index))
        .collect();
    let library = |_: &Path| {
        Ok((
            vec![tobj::Material::default(); indices.len()],
            indices.clone(),
        ))
    };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, library)
        .map_err(|error| Error::file(path, error.to_string()))?;

    let mut has_uv = checked.has_uv.iter();
    for model in models {
        let model = model.mesh;
        let first = mesh.positions.len() as u32;
        let material = match model.material_id {
            Some(index) => index,
            None => no_material(mesh),
        } as u32;
        let on_surface = mesh.on_surface.get(material as usize);
        let transform = on_surface.map_or(UvTransform::default(), |on| on.transform);
        mesh.positions.extend(
            model
                .positions
                .as_chunks::<3>()
                .0
                .iter()
                .map(|&p| DVec3::from(p)),
        );
        for (index, corners) in model.indices.as_chunks::<3>().0.iter().enumerate() {
            let uv = (has_uv.next() == Some(&true)).then(|| {
                std::array::from_fn(|k| {
                    let at = 2 * model.texcoord_indices[3 * index + k] as usize;
                    transform.apply([model.texcoords[at] as f32, model.texcoords[at + 1] as f32])
                })
            });
            mesh.triangles.push(MeshTriangle {
                corners: corners.map(|v| first + v),
                uv,
                emission_uv: None,
                light_uv: None,
                material,
            });
        }
    }
    assert_eq!(
        mesh.triangles.len(),
        checked.has_uv.len(),
        "tobj and the check see the same faces"
    );
    Ok(())
}

/// Faces without texture coordinates are projected in one way, whatever `-s` and `-o` say.
fn warn_of_moved_maps(mesh: &mut Mesh) {
    let bare = mesh.triangles.iter().filter(|t| t.uv.is_none());
    let bare: HashSet<u32> = bare.map(|t| t.material).collect();
    for (on, index) in mesh.on_surface.iter().zip(0..) {
        if let Some(warning) = &on.moved
            && bare.contains(&index)
        {
            mesh.said.warnings.push(warning.clone());
        }
    }
}

/// Maps repeat, also those that `-clamp` would keep from it: a warning where that shows.
fn warn_of_clamped_maps(path: &Path, mesh: &mut Mesh) {
    let outside = |uv: [[f32; 2]; 3]| uv.as_flattened().iter().any(|c| !(0.0..=1.0).contains(c));
    let repeats = mesh.triangles.iter().filter(|t| t.uv.is_some_and(outside));
    let repeats: HashSet<u32> = repeats.map(|t| t.material).collect();
    for (index, on) in mesh.on_surface.iter().enumerate() {
        let Some((keyword, line)) = &on.clamped else {
            continue;
        };
        if repeats.contains(&(index as u32)) {
            mesh.said.warnings.push(format!(
                "{}: material \"{}\": {keyword} in line {line} of its library repeats outside \
                 0..1: -clamp is not used",
                path.display(),
                mesh.materials[index].name
            ));
        }
    }
}

/// The index of the material for faces that name none.
fn no_material(mesh: &mut Mesh) -> usize {
    if let Some(index) = mesh.materials.iter().position(|m| m.name == NO_MATERIAL) {
        return index;
    }
    make_up(mesh, NO_MATERIAL);
    mesh.materials.len() - 1
}
