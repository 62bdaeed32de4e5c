//! The relief maps of MTL: `map_Disp`, `map_Bump` and `norm`.

use std::path::Path;

use super::Material;
use super::material::{Asked, TextureCache};
use super::obj_lint::{brief, finite};
use crate::error::Result;

pub(super) fn is_keyword(keyword: &str) -> bool {
    kind(keyword).is_some()
}

#[derive(Clone, Copy)]
enum Kind {
    Displacement,
    Bump,
    Normal,
}

fn kind(keyword: &str) -> Option<Kind> {
    match keyword {
        "map_Disp" | "map_disp" | "disp" => Some(Kind::Displacement),
        "map_Bump" | "map_bump" | "bump" => Some(Kind::Bump),
        "norm" | "map_Norm" | "map_norm" => Some(Kind::Normal),
        _ => None,
    }
}

/// The relief statements of one material; of two statements of one kind the later counts, as for
/// other keywords.
#[derive(Debug, Default)]
pub(super) struct Relief {
    displacement: Option<Map>,
    bump: Option<Map>,
    normal: Option<Map>,
}

#[derive(Debug)]
struct Map {
    keyword: String,
    file: String,
    /// Product of `-bm` and the gain of `-mm`.
    scale: f32,
}

impl Relief {
    /// Takes a statement of [`is_keyword`]. The error is one clause.
    pub fn add(&mut self, keyword: &str, operands: &str) -> Result<(), String> {
        let Some(kind) = kind(keyword) else {
            return Err(format!("{keyword} is no relief map"));
        };
        let scaled = !matches!(kind, Kind::Normal);
        let (scale, file) = options(keyword, operands, scaled)?;
        if file.is_empty() {
            return Err(format!("{keyword} names no file"));
        }
        let map = Some(Map {
            keyword: keyword.to_owned(),
            file: file.to_owned(),
            scale,
        });
        match kind {
            Kind::Displacement => self.displacement = map,
            Kind::Bump => self.bump = map,
            Kind::Normal => self.normal = map,
        }
        Ok(())
    }

    /// Reads the maps into `material`; their paths are relative to `file`.
    ///
    /// # Errors
    /// A map that cannot be read or used.
    pub fn read(
        &self,
        file: &Path,
        textures: &mut TextureCache,
        material: &mut Material,
        notes: &mut Vec<String>,
    ) -> Result<()> {
        let name = material.name.clone();
        let asked = |keyword| Asked {
            file,
            material: &name,
            keyword,
        };
        if let (Some(kept), Some(passed_over)) = (&self.displacement, &self.bump) {
            notes.push(format!(
                "material \"{name}\" has {} and {}: the latter was passed over",
                kept.keyword, passed_over.keyword
            ));
        }
        if let Some(map) = self.displacement.as_ref().or(self.bump.as_ref()) {
            material.map_height = Some(textures.heights(asked(&map.keyword), &map.file)?);
            material.height_scale = map.scale;
        }
        if let Some(map) = &self.normal {
            material.map_normal = Some(textures.normals(asked(&map.keyword), &map.file)?);
        }
        Ok(())
    }
}

/// The multiplier, and the file, which follows the options.
fn options<'a>(keyword: &str, operands: &'a str, scaled: bool) -> Result<(f32, &'a str), String> {
    let mut scale = 1.0_f32;
    let mut rest = operands;
    while rest.starts_with('-') {
        let (option, mut after) = word(rest);
        let numbers = match option {
            "-bm" if scaled => 1,
            "-mm" if scaled => 2,
            _ => {
                let known = if scaled { " (known: -bm, -mm)" } else { "" };
                return Err(format!(
                    "{keyword}: option {} is not known here{known}",
                    brief(option)
                ));
            }
        };
        // The base of `-mm base gain` is ignored: it moves the whole surface, which always lies at
        // the mean height.
        let mut number = 1.0;
        for _ in 0..numbers {
            let (text, following) = word(after);
            number = finite(text).map_err(|what| format!("{keyword} {option}: {what}"))? as f32;
            after = following;
        }
        scale *= number;
        if !scale.is_finite() {
            return Err(format!("{keyword} {option}: the factor is too large"));
        }
        rest = after;
    }
    Ok((scale, rest))
}

/// The first word, and the rest.
fn word(text: &str) -> (&str, &str) {
    text.split_once(char::is_whitespace)
        .map_or((text, ""), |(word, rest)| (word, rest.trim_start()))
}
