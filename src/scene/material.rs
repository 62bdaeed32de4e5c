//! Diffuse materials.

use std::collections::HashMap;
use std::hash::Hash;
use std::path::Path;

use super::maps::{Channel, holds_normals};
use super::texture::decode;
use super::*;
use crate::error::{Error, Result};

/// A diffuse (Lambertian) material, one-sided.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    /// Reflectance ρ, RGB in 0..=1; multiplied by the texture where there is one.
    pub kd: [f32; 3],
    /// Reflectance texture, linear RGB.
    pub map_kd: Option<Arc<Texture>>,
    /// Relief: heights times `height_scale` above the surface.
    pub map_height: Option<Arc<HeightMap>>,
    /// Scene units between the values 0 and 1 of the height map.
    pub height_scale: f32,
    /// Normals of the relief; None derives them from the heights.
    pub map_normal: Option<Arc<NormalMap>>,
    /// Emitted radiance Le, W·m⁻²·sr⁻¹, RGB.
    pub ke: [f32; 3],
    /// Emission texture, linear RGB, a factor of `ke`.
    pub map_ke: Option<Arc<Texture>>,
    /// What of its surfaces is there; none of a scene that was read, whose triangles are cut.
    pub alpha_mask: Option<AlphaMask>,
}

impl Default for Material {
    /// Black, without a name; a height map, once given, is in scene units.
    fn default() -> Self {
        Self {
            name: String::new(),
            kd: [0.0; 3],
            map_kd: None,
            map_height: None,
            height_scale: 1.0,
            map_normal: None,
            ke: [0.0; 3],
            map_ke: None,
            alpha_mask: None,
        }
    }
}

/// Reflectance of a surface whose file gives none.
pub(super) const DEFAULT_KD: f32 = 0.5;

impl Material {
    /// Checks reflectance in 0..=1, texture included, emission finite and not negative, and the
    /// relief finite; the error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        if !self.kd.iter().all(|c| (0.0..=1.0).contains(c)) {
            return Err(format!("reflectance Kd {} must be in 0..=1", rgb(self.kd)));
        }
        if !self.ke.iter().all(|&c| c.is_finite() && c >= 0.0) {
            return Err(format!(
                "emitted radiance Ke {} must be finite and not negative",
                rgb(self.ke)
            ));
        }
        if let Some(texture) = &self.map_ke {
            let highest = texture.highest();
            if !(0..3).all(|c| (self.ke[c] * highest[c]).is_finite()) {
                return Err(format!(
                    "emitted radiance Ke {} times the brightest texel of {} must be finite",
                    rgb(self.ke),
                    texture.path.display()
                ));
            }
        }
        if let Some(mask) = &self.alpha_mask
            && !(0.0..=1.0).contains(&mask.cutoff)
        {
            return Err(format!("alpha cutoff {} must be in 0..=1", mask.cutoff));
        }
        if !self.height_scale.is_finite() {
            return Err(format!("height scale {} must be finite", self.height_scale));
        }
        if let Some(map) = &self.map_height {
            let highest = map.values.iter().fold(0.0_f32, |most, v| most.max(v.abs()));
            if !(highest * self.height_scale).is_finite() {
                return Err(format!(
                    "the heights of {} times {} are beyond every number",
                    map.path.display(),
                    self.height_scale
                ));
            }
        }
        let Some(texture) = &self.map_kd else {
            return Ok(());
        };
        let highest = texture.highest();
        let product: [f32; 3] = std::array::from_fn(|c| self.kd[c] * highest[c]);
        if !product.iter().all(|c| (0.0..=1.0).contains(c)) {
            return Err(format!(
                "reflectance Kd times the brightest texel of {} is {}, and must be in 0..=1",
                texture.path.display(),
                rgb(product)
            ));
        }
        Ok(())
    }

    /// Whether it has a relief: a height map that is not flat.
    pub fn has_relief(&self) -> bool {
        self.height_scale != 0.0
            && self
                .map_height
                .as_ref()
                .is_some_and(|map| !map.is_constant())
    }

    /// Emitted radiance over a triangle in the mean, W·m⁻²·sr⁻¹, RGB.
    pub fn emitted_over(&self, uv: &[[f32; 2]; 3]) -> [f32; 3] {
        match &self.map_ke {
            None => self.ke,
            Some(map) => product(self.ke, map.mean_over_triangle(uv)),
        }
    }

    /// Emitted radiance at a place of the textures, W·m⁻²·sr⁻¹, RGB.
    pub fn emitted_at(&self, u: f64, v: f64) -> [f32; 3] {
        match &self.map_ke {
            None => self.ke,
            Some(map) => product(self.ke, map.bilinear(u, v)),
        }
    }

    /// Emitted radiance in the mean over the texture, W·m⁻²·sr⁻¹, RGB.
    pub fn mean_emission(&self) -> [f32; 3] {
        match &self.map_ke {
            None => self.ke,
            Some(map) => product(self.ke, map.mean()),
        }
    }

    /// Reflectance in the mean over the texture, RGB.
    pub fn mean_reflectance(&self) -> [f32; 3] {
        match &self.map_kd {
            None => self.kd,
            Some(map) => product(self.kd, map.mean()),
        }
    }

    /// Whether it emits light.
    pub fn emits(&self) -> bool {
        self.ke.iter().any(|&c| c > 0.0)
    }
}

fn product(one: [f32; 3], other: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| one[c] * other[c])
}

fn rgb([r, g, b]: [f32; 3]) -> String {
    format!("({r}, {g}, {b})")
}

/// A reflectance that no file gave, with the sentence that reports it to the user.
#[derive(Debug, Clone)]
pub(super) struct MadeUp {
    pub material: String,
    pub kd: f32,
}

impl std::fmt::Display for MadeUp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "material \"{}\" has no Kd: reflectance {} was used",
            self.material, self.kd
        )
    }
}

/// Textures and relief maps by path, so that materials share them.
#[derive(Default)]
pub(super) struct TextureCache {
    textures: HashMap<PathBuf, Arc<Texture>>,
    heights: HashMap<(PathBuf, Option<Channel>), Arc<HeightMap>>,
    normals: HashMap<PathBuf, Arc<NormalMap>>,
    alphas: HashMap<(PathBuf, Option<Channel>, bool), Arc<AlphaMap>>,
    /// Notes from reading them, for the caller to pass on.
    pub notes: Vec<String>,
}

/// The reference to a map.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    /// The file whose folder the name of the map is relative to.
    pub file: &'a Path,
    pub material: &'a str,
    /// The statement or key that names the map.
    pub keyword: &'a str,
}

impl TextureCache {
    pub fn texture(&mut self, asked: Asked, name: &str) -> Result<Arc<Texture>> {
        cached(
            &mut self.textures,
            asked,
            name,
            Path::to_owned,
            Texture::load,
        )
    }

    /// Heights; of one channel where it is given.
    pub fn heights(
        &mut self,
        asked: Asked,
        name: &str,
        channel: Option<Channel>,
    ) -> Result<Arc<HeightMap>> {
        let key = |path: &Path| (path.to_owned(), channel);
        cached(&mut self.heights, asked, name, key, |path| {
            let (map, note) = HeightMap::load_channel(path, channel)?;
            self.notes.extend(note);
            Ok(map)
        })
    }

    pub fn normals(&mut self, asked: Asked, name: &str) -> Result<Arc<NormalMap>> {
        cached(
            &mut self.normals,
            asked,
            name,
            Path::to_owned,
            NormalMap::load,
        )
    }

    /// Alpha; of one channel where it is given, of the alpha channel alone with `alpha_alone`.
    pub fn alpha(
        &mut self,
        asked: Asked,
        name: &str,
        channel: Option<Channel>,
        alpha_alone: bool,
    ) -> Result<Arc<AlphaMap>> {
        let key = |path: &Path| (path.to_owned(), channel, alpha_alone);
        cached(
            &mut self.alphas,
            asked,
            name,
            key,
            |path| match alpha_alone {
                true => Ok(AlphaMap::alpha_of(path, decode(path)?)),
                false => AlphaMap::load(path, channel),
            },
        )
    }

    /// Heights, or normals if the image holds some and no channel is asked for.
    pub fn bump(&mut self, asked: Asked, name: &str, channel: Option<Channel>) -> Result<Bump> {
        let path = asked.path(name);
        let is_normals = channel.is_none() && holds_normals(&path).map_err(|e| asked.error(e))?;
        Ok(match is_normals {
            true => Bump::Normals(self.normals(asked, name)?),
            false => Bump::Heights(self.heights(asked, name, channel)?),
        })
    }
}

/// What a bump map holds.
pub(super) enum Bump {
    Heights(Arc<HeightMap>),
    Normals(Arc<NormalMap>),
}

impl Asked<'_> {
    fn path(&self, name: &str) -> PathBuf {
        // Exporters on Windows write `textures\brick.png`, which no other system can open.
        self.file.with_file_name(name.replace('\\', "/"))
    }

    fn error(&self, error: Error) -> Error {
        Error::Material {
            path: self.file.to_owned(),
            material: self.material.to_owned(),
            what: format!("{}: {error}", self.keyword),
        }
    }
}

fn cached<K: Eq + Hash, T>(
    known: &mut HashMap<K, Arc<T>>,
    asked: Asked,
    name: &str,
    key: impl FnOnce(&Path) -> K,
    read: impl FnOnce(&Path) -> Result<T>,
) -> Result<Arc<T>> {
    let path = asked.path(name);
    let key = key(&path);
    if let Some(map) = known.get(&key) {
        return Ok(map.clone());
    }
    let map = Arc::new(read(&path).map_err(|error| asked.error(error))?);
    known.insert(key, map.clone());
    Ok(map)
}
