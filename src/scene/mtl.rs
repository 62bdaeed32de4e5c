//! Wavefront MTL material libraries: `Kd`, `Ke`, `map_Kd`, and the maps of the relief.

use std::path::Path;

use super::Material;
use super::material::{Asked, DEFAULT_KD, MadeUp, TextureCache};
use super::mtl_relief::{self, Relief};
use super::obj_lint::{brief, finite, statements};
use super::text_file::read_text;
use crate::error::{Error, Result};

pub(super) struct Library {
    /// In the order of the file.
    pub materials: Vec<Material>,
    pub made_up: Vec<MadeUp>,
    pub notes: Vec<String>,
}

/// Reads a library with its textures, whose paths are relative to it.
///
/// # Errors
/// The first wrong line; a material whose numbers or texture cannot be used.
pub(super) fn read(path: &Path, textures: &mut TextureCache) -> Result<Library> {
    let checked = check(path, &read_text(path)?)?;
    let (read, _) = tobj::load_mtl_buf(&mut checked.text.as_bytes())
        .map_err(|error| Error::file(path, error.to_string()))?;

    let mut library = Library {
        materials: Vec::new(),
        made_up: Vec::new(),
        notes: Vec::new(),
    };
    assert_eq!(
        read.len(),
        checked.reliefs.len(),
        "tobj and the check see the same materials"
    );
    for (material, relief) in read.into_iter().zip(&checked.reliefs) {
        // A texture without a factor is the reflectance itself.
        let default = if material.diffuse_texture.is_some() {
            1.0
        } else {
            DEFAULT_KD
        };
        if material.diffuse.is_none() {
            library.made_up.push(MadeUp {
                material: material.name.clone(),
                kd: default,
            });
        }
        let map_kd = match &material.diffuse_texture {
            Some(name) => {
                let asked = Asked {
                    file: path,
                    material: &material.name,
                    keyword: "map_Kd",
                };
                Some(textures.texture(asked, name)?)
            }
            None => None,
        };
        let mut material = Material {
            kd: material
                .diffuse
                .map_or([default; 3], |kd| kd.map(|c| c as f32)),
            ke: material
                .emissive
                .map_or([0.0; 3], |ke| ke.map(|c| c as f32)),
            name: material.name,
            map_kd,
            ..Material::default()
        };
        relief.read(path, textures, &mut material, &mut library.notes)?;
        material.check().map_err(|what| Error::Material {
            path: path.to_owned(),
            material: material.name.clone(),
            what,
        })?;
        library.materials.push(material);
    }
    Ok(library)
}

struct Checked {
    /// The text for tobj.
    text: String,
    /// `[material]`, in the order of the file.
    reliefs: Vec<Relief>,
}

/// Checks the text line by line. tobj panics at a `Ka`, `Kd`, `Ks` or `Ke` that is too short, and
/// does not read all statements of relief maps.
fn check(path: &Path, text: &str) -> Result<Checked> {
    let mut kept = String::new();
    let mut names: Vec<String> = Vec::new();
    let mut reliefs: Vec<Relief> = Vec::new();
    for (line, statement) in statements(text) {
        let statement = statement.trim();
        let (keyword, rest) = statement
            .split_once(char::is_whitespace)
            .map_or((statement, ""), |(keyword, rest)| (keyword, rest.trim()));
        let checked = match keyword {
            "newmtl" => new_material(rest, &mut names),
            "Kd" | "Ke" => colour(keyword, rest),
            "map_Kd" => texture(rest),
            _ if mtl_relief::is_keyword(keyword) => match reliefs.last_mut() {
                Some(relief) => relief.add(keyword, rest),
                None => Ok(()),
            },
            _ => continue,
        };
        let checked = checked.and_then(|()| match names.is_empty() {
            true => Err(format!("{keyword} stands before the first newmtl")),
            false => Ok(()),
        });
        checked.map_err(|what| {
            let what = match names.last() {
                Some(name) if keyword != "newmtl" => format!("material \"{name}\": {what}"),
                _ => what,
            };
            Error::line(path, line, what)
        })?;
        reliefs.resize_with(names.len(), Relief::default);
        if mtl_relief::is_keyword(keyword) {
            continue;
        }
        let operands = match keyword {
            "Kd" | "Ke" => rest.split_once('#').map_or(rest, |(numbers, _)| numbers),
            _ => rest,
        };
        kept.push_str(&format!("{keyword} {operands}\n"));
    }
    Ok(Checked {
        text: kept,
        reliefs,
    })
}

fn new_material(name: &str, names: &mut Vec<String>) -> Result<(), String> {
    if name.is_empty() {
        return Err("newmtl has no name".into());
    }
    if names.iter().any(|known| known == name) {
        return Err(format!("material \"{}\" is defined twice", brief(name)));
    }
    names.push(name.to_owned());
    Ok(())
}

fn colour(keyword: &str, rest: &str) -> Result<(), String> {
    let numbers: Vec<&str> = rest
        .split_whitespace()
        .take_while(|word| !word.starts_with('#'))
        .collect();
    for word in &numbers {
        let number = finite(word).map_err(|what| format!("{keyword}: {what}"))?;
        if !(number as f32).is_finite() {
            return Err(format!("{keyword}: \"{}\" is too large", brief(word)));
        }
    }
    match numbers.len() {
        3 => Ok(()),
        found => Err(format!("{keyword} needs 3 numbers, found {found}")),
    }
}

fn texture(rest: &str) -> Result<(), String> {
    if rest.is_empty() {
        Err("map_Kd names no file".into())
    } else if rest.starts_with('-') {
        Err(format!(
            "map_Kd options are not known here: {}",
            brief(rest)
        ))
    } else {
        Ok(())
    }
}
