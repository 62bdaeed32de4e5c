//! The maps of MTL: their statements, options and kinds.

use std::path::Path;

use super::maps::Channel;
use super::masks::{AlphaMask, DEFAULT_CUTOFF};
use super::material::{Asked, Bump, TextureCache};
use super::obj_lint::{brief, finite};
use super::said::Said;
use super::uv::{OnSurface, UvTransform};
use super::{Material, NormalMap};
use crate::error::Result;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Reflectance,
    Emission,
    Displacement,
    /// Heights or normals.
    Bump,
    Normal,
    Alpha,
}

fn kind(keyword: &str) -> Option<Kind> {
    match keyword {
        "map_Kd" => Some(Kind::Reflectance),
        "map_Ke" => Some(Kind::Emission),
        "map_Disp" | "map_disp" | "disp" => Some(Kind::Displacement),
        "map_Bump" | "map_bump" | "bump" => Some(Kind::Bump),
        "map_d" => Some(Kind::Alpha),
        "norm" | "map_Norm" | "map_norm" => Some(Kind::Normal),
        _ => None,
    }
}

pub(super) fn is_keyword(keyword: &str) -> bool {
    kind(keyword).is_some()
}

/// The maps of one material; of two statements of one kind the later counts, as for other keywords.
#[derive(Debug, Default)]
pub(super) struct Maps {
    reflectance: Option<Map>,
    emission: Option<Map>,
    displacement: Option<Map>,
    bump: Option<Map>,
    normal: Option<Map>,
    alpha: Option<Map>,
}

#[derive(Debug)]
struct Map {
    keyword: String,
    line: usize,
    file: String,
    options: MapOptions,
}

#[derive(Debug, Default)]
struct MapOptions {
    /// Product of `-bm` and the gain of `-mm`, where either is given.
    scale: Option<f32>,
    channel: Option<Channel>,
    /// `-s` and `-o`.
    transform: UvTransform,
    clamp: bool,
    /// Options that are read and not used.
    unused: Vec<String>,
}

impl Maps {
    /// Takes a statement of [`is_keyword`]. The error is one clause.
    pub fn add(&mut self, keyword: &str, operands: &str, line: usize) -> Result<(), String> {
        let Some(kind) = kind(keyword) else {
            return Err(format!("{keyword} is no map"));
        };
        let (options, file) = options(keyword, operands)?;
        if file.is_empty() {
            return Err(format!("{keyword} names no file"));
        }
        let map = Some(Map {
            keyword: keyword.to_owned(),
            line,
            file: file.to_owned(),
            options,
        });
        match kind {
            Kind::Reflectance => self.reflectance = map,
            Kind::Emission => self.emission = map,
            Kind::Displacement => self.displacement = map,
            Kind::Bump => self.bump = map,
            Kind::Normal => self.normal = map,
            Kind::Alpha => self.alpha = map,
        }
        Ok(())
    }

    pub fn has_reflectance(&self) -> bool {
        self.reflectance.is_some()
    }

    pub fn has_emission(&self) -> bool {
        self.emission.is_some()
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
        said: &mut Said,
    ) -> Result<OnSurface> {
        let name = material.name.clone();
        if let Some(map) = &self.reflectance {
            material.map_kd = Some(textures.texture(map.asked(file, &name), &map.file)?);
        }
        if let Some(map) = &self.alpha {
            // Blender names the texture of the base colour, whose alpha it means.
            let of_colour = (self.reflectance.iter()).any(|other| other.file == map.file);
            let channel = map.options.channel;
            let alone = of_colour && channel.is_none();
            material.alpha_mask = Some(AlphaMask {
                map: textures.alpha(map.asked(file, &name), &map.file, channel, alone)?,
                factor: 1.0,
                cutoff: DEFAULT_CUTOFF,
            });
        }
        let surface = self.emission.iter().chain(&self.alpha);
        let mut used: Vec<&Map> = surface.chain(&self.reflectance).collect();
        if let Some(map) = &self.emission {
            let texture = textures.texture(map.asked(file, &name), &map.file)?;
            let highest = texture.highest();
            if (0..3).any(|c| material.ke[c] * highest[c] > 0.0) {
                material.map_ke = Some(texture);
            } else {
                material.ke = [0.0; 3];
                let what = "has no effect: it is black, or Ke is 0 (without Ke it counts as 1)";
                said.warnings.push(map.warning(file, &name, what));
            }
        }
        let passed_over = |said: &mut Said, kept: &Map, other: &Map| {
            said.notes.push(format!(
                "material \"{name}\" has {} and {}: the latter was passed over",
                kept.keyword, other.keyword
            ));
        };
        if let Some(map) = &self.normal {
            let read = textures.normals(map.asked(file, &name), &map.file)?;
            material.map_normal = Some(NormalMap::scaled(read, map.scale()));
            used.push(map);
        }
        if let Some(map) = &self.displacement {
            let channel = map.options.channel;
            let read = textures.heights(map.asked(file, &name), &map.file, channel)?;
            material.map_height = Some(read);
            material.height_scale = map.scale();
            used.push(map);
        }
        if let Some(map) = &self.bump {
            let channel = map.options.channel;
            match textures.bump(map.asked(file, &name), &map.file, channel)? {
                Bump::Normals(read) if material.map_normal.is_none() => {
                    material.map_normal = Some(NormalMap::scaled(read, map.scale()));
                    used.push(map);
                    said.notes.push(format!(
                        "material \"{name}\": {} {} holds normals, and is read as a normal map",
                        map.keyword, map.file
                    ));
                }
                Bump::Heights(read) if material.map_height.is_none() => {
                    material.map_height = Some(read);
                    material.height_scale = map.scale();
                    used.push(map);
                }
                Bump::Normals(_) => {
                    if let Some(kept) = &self.normal {
                        passed_over(said, kept, map);
                    }
                }
                Bump::Heights(_) => {
                    if let Some(kept) = &self.displacement {
                        passed_over(said, kept, map);
                    }
                }
            }
        }
        Ok(on_surface(file, &name, &used, said))
    }
}

impl Map {
    fn asked<'a>(&'a self, file: &'a Path, material: &'a str) -> Asked<'a> {
        Asked {
            file,
            material,
            keyword: &self.keyword,
        }
    }

    fn warning(&self, file: &Path, material: &str, what: &str) -> String {
        let (file, line, keyword) = (file.display(), self.line, &self.keyword);
        format!("{file}:{line}: material \"{material}\": {keyword} {what}")
    }

    fn scale(&self) -> f32 {
        self.options.scale.unwrap_or(1.0)
    }
}

/// The one place of all maps of a material on its surface: that of the relief, which light depends
/// on by direction, or else of the reflectance.
fn on_surface(file: &Path, material: &str, used: &[&Map], said: &mut Said) -> OnSurface {
    let warn = |map: &Map, what: &str| map.warning(file, material, what);
    for map in used {
        for option in &map.options.unused {
            (said.warnings).push(warn(map, &format!("option {option} is not used")));
        }
        let is_colour = matches!(kind(&map.keyword), Some(Kind::Reflectance | Kind::Emission));
        if is_colour && map.options.channel.is_some() {
            said.warnings.push(warn(map, "option -imfchan is not used"));
        }
        if is_colour && map.options.scale.is_some() {
            said.warnings
                .push(warn(map, "options -bm and -mm are not used"));
        }
    }
    let Some(leading) = used.last() else {
        return OnSurface::default();
    };
    let transform = leading.options.transform;
    for map in used.iter().filter(|map| map.options.transform != transform) {
        let what = format!(
            "has other -s and -o than {}, whose place it is given: maps of a material lie together",
            leading.keyword
        );
        said.warnings.push(warn(map, &what));
    }
    let clamped = used.iter().find(|map| map.options.clamp);
    let without = "has -s and -o, without effect on faces that have no texture coordinates";
    let is_moved = transform != UvTransform::default();
    OnSurface {
        transform,
        moved: is_moved.then(|| warn(leading, without)),
        clamped: clamped.map(|map| (map.keyword.clone(), map.line)),
    }
}

/// The options of a map, and the file, which follows them.
fn options<'a>(keyword: &str, operands: &'a str) -> Result<(MapOptions, &'a str), String> {
    let mut options = MapOptions::default();
    let mut rest = operands;
    while rest.starts_with('-') {
        let (option, after) = word(rest);
        let refuse = |what: String| format!("{keyword} {option}: {what}");
        let (values, following) = values(option, after)
            .ok_or_else(|| format!("{keyword}: option {} is not known", brief(option)))?;
        let number = |at: usize| -> Result<f32, String> {
            let text = values.get(at).copied().unwrap_or("");
            finite(text).map(|n| n as f32).map_err(refuse)
        };
        // One number for u alone: v is as without the option.
        let pair = |other: f32| -> Result<[f32; 2], String> {
            Ok([
                number(0)?,
                if values.len() > 1 { number(1)? } else { other },
            ])
        };
        match option {
            // The base of `-mm base gain` is ignored: it moves the whole surface, which always
            // lies at the mean height.
            "-bm" | "-mm" => {
                let scale = options.scale.unwrap_or(1.0) * number(values.len().saturating_sub(1))?;
                if option == "-mm" {
                    number(0)?;
                }
                if !scale.is_finite() {
                    return Err(refuse("the factor is too large".into()));
                }
                options.scale = Some(scale);
            }
            "-s" => options.transform.scale = pair(1.0)?,
            "-o" => options.transform.offset = pair(0.0)?,
            "-clamp" => options.clamp = values == ["on"],
            "-imfchan" => {
                let name = values.first().copied().unwrap_or("");
                options.channel =
                    Some(Channel::named(name).ok_or_else(|| {
                        refuse(format!("\"{}\" is none of r, g, b, l", brief(name)))
                    })?);
            }
            "-t" | "-cc" if values != ["off"] => options.unused.push(option.to_owned()),
            _ => {}
        }
        rest = following;
    }
    if options.transform.scale.contains(&0.0) {
        return Err(format!("{keyword} -s: must not be 0"));
    }
    Ok((options, rest))
}

/// The values of an option, and what follows; none of an option that MTL does not have.
fn values<'a>(option: &str, after: &'a str) -> Option<(Vec<&'a str>, &'a str)> {
    let (least, most) = match option {
        "-mm" => (2, 2),
        "-bm" | "-clamp" | "-imfchan" | "-blendu" | "-blendv" | "-boost" | "-cc" | "-texres"
        | "-type" => (1, 1),
        "-s" | "-o" | "-t" => (1, 3),
        _ => return None,
    };
    let (mut values, mut rest) = (Vec::new(), after);
    while values.len() < most {
        let (value, following) = word(rest);
        if values.len() >= least && value.parse::<f64>().is_err() {
            break;
        }
        values.push(value);
        rest = following;
    }
    Some((values, rest))
}

/// The first word, and the rest.
fn word(text: &str) -> (&str, &str) {
    text.split_once(char::is_whitespace)
        .map_or((text, ""), |(word, rest)| (word, rest.trim_start()))
}
