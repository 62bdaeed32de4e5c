//! Materials of a glTF file as diffuse ones.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use gltf::material::AlphaMode;
use gltf::texture::{TextureTransform, WrappingMode};
use image::DynamicImage;

use super::document::File;
use super::images;
use crate::error::{Error, Result};
use crate::scene::assemble::free_name;
use crate::scene::masks::{AlphaMap, AlphaMask, DEFAULT_CUTOFF};
use crate::scene::material::{DEFAULT_KD, MadeUp};
use crate::scene::said::Said;
use crate::scene::{HeightMap, Material, NormalMap, Texture};

/// The materials of a file, and after them the one of primitives without any.
pub(super) struct Materials {
    pub list: Vec<Material>,
    pub two_sided: Vec<bool>,
    /// Where the maps of each lie, `[material]`.
    pub places: Vec<Place>,
    /// Where the emission of each lies, if that is elsewhere, `[material]`.
    pub emission_places: Vec<Option<Place>>,
    /// What there is to say of each, if it is used.
    pub said: Vec<Said>,
    pub made_up: Vec<MadeUp>,
}

/// Where a texture lies: its set of coordinates, and the transform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub set: u32,
    offset: [f32; 2],
    rotation: f32,
    scale: [f32; 2],
}

impl Place {
    const FIRST: Self = Self {
        set: 0,
        offset: [0.0; 2],
        rotation: 0.0,
        scale: [1.0; 2],
    };

    pub fn of_set(set: u32) -> Self {
        Self { set, ..Self::FIRST }
    }

    fn new(set: u32, transform: Option<TextureTransform>) -> Self {
        let plain = Self::of_set(set);
        transform.map_or(plain, |by| Self {
            set: by.tex_coord().unwrap_or(set),
            offset: by.offset(),
            rotation: by.rotation(),
            scale: by.scale(),
        })
    }

    /// By a `KHR_texture_transform`, which the crate does not read of normal textures.
    fn transformed(self, by: &serde_json::Value) -> Self {
        let number = |value: &serde_json::Value| value.as_f64().map(|n| n as f32);
        let pair = |key: &str, other: [f32; 2]| {
            let values = by.get(key).and_then(|of| of.as_array());
            let at = |k: usize| values.and_then(|of| number(of.get(k)?)).unwrap_or(other[k]);
            [at(0), at(1)]
        };
        let set = by.get("texCoord").and_then(serde_json::Value::as_u64);
        Self {
            set: set.map_or(self.set, |set| set as u32),
            offset: pair("offset", self.offset),
            rotation: by.get("rotation").and_then(number).unwrap_or(self.rotation),
            scale: pair("scale", self.scale),
        }
    }

    /// glTF's v points down, from the top.
    pub fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let [u, v] = [u * self.scale[0], v * self.scale[1]];
        let [x, y] = self.offset;
        [cos * u + sin * v + x, 1.0 - (cos * v - sin * u + y)]
    }
}

/// Maps by the image, each read once.
#[derive(Default)]
struct Maps {
    colours: HashMap<usize, Arc<Texture>>,
    normals: HashMap<usize, Arc<NormalMap>>,
    alphas: HashMap<usize, Arc<AlphaMap>>,
    heights: HashMap<usize, Arc<HeightMap>>,
}

impl Materials {
    /// # Errors
    /// A texture that cannot be used.
    pub fn read(file: &File) -> Result<Self> {
        let mut materials = Self {
            list: Vec::new(),
            two_sided: Vec::new(),
            places: Vec::new(),
            emission_places: Vec::new(),
            said: Vec::new(),
            made_up: Vec::new(),
        };
        let mut maps = Maps::default();
        for material in file.document.materials() {
            materials.add(file, &material, &mut maps)?;
        }
        materials.list.push(Material {
            name: materials.free_name("default"),
            kd: [DEFAULT_KD; 3],
            ..Material::default()
        });
        materials.two_sided.push(false);
        materials.places.push(Place::FIRST);
        materials.emission_places.push(None);
        materials.said.push(Said::default());
        Ok(materials)
    }

    fn free_name(&self, name: &str) -> String {
        free_name(name.to_owned(), self.list.iter().map(|m| &m.name))
    }

    fn add(&mut self, file: &File, from: &gltf::Material, maps: &mut Maps) -> Result<()> {
        let number = from.index().unwrap_or(self.list.len());
        let given = from.name().map(str::trim).filter(|name| !name.is_empty());
        let name = match given {
            Some(name) if !name.contains(char::is_control) => self.free_name(name),
            _ => self.free_name(&format!("material {number}")),
        };
        let mut said = Said::default();
        let about = |what: &str| format!("{}: material \"{name}\": {what}", file.path.display());
        let surface = from.pbr_metallic_roughness();
        let [r, g, b, alpha] = surface.base_color_factor();
        let strength = from.emissive_strength().unwrap_or(1.0);
        let mut material = Material {
            name: name.clone(),
            kd: [r, g, b],
            ke: from.emissive_factor().map(|c| c * strength),
            ..Material::default()
        };
        // Reflectance lies where the relief does: light goes to and fro between its texels.
        let mut place = None;
        if let Some(map) = from.normal_texture() {
            let read = maps.normals(file, &map.texture())?;
            material.map_normal = Some(NormalMap::scaled(read, map.scale()));
            let plain = Place::new(map.tex_coord(), None);
            let transform = map.extension_value("KHR_texture_transform");
            place = Some(transform.map_or(plain, |by| plain.transformed(by)));
        }
        if let Some(map) = surface.base_color_texture() {
            material.map_kd = Some(maps.colours(file, &map.texture())?);
            let own = Place::new(map.tex_coord(), map.texture_transform());
            let other = *place.get_or_insert(own);
            if own != other {
                said.warnings.push(about(
                    "the base colour lies elsewhere than the normals, whose place it is given",
                ));
            }
            let sampler = map.texture().sampler();
            let repeats = |mode| mode == WrappingMode::Repeat;
            if !(repeats(sampler.wrap_s()) && repeats(sampler.wrap_t())) {
                said.notes
                    .push(about("the base colour repeats outside 0..1"));
            }
        }
        if let Some((texture, scale)) = heights(file, from) {
            material.map_height = Some(maps.heights(file, &texture)?);
            material.height_scale = scale;
            place.get_or_insert(Place::FIRST);
        }
        let mut emission_place = None;
        if let Some(map) = from.emissive_texture() {
            let texture = maps.colours(file, &map.texture())?;
            let highest = texture.highest();
            if (0..3).any(|c| material.ke[c] * highest[c] > 0.0) {
                material.map_ke = Some(texture);
                let own = Place::new(map.tex_coord(), map.texture_transform());
                emission_place = Some(own).filter(|own| *own != *place.get_or_insert(*own));
            } else {
                material.ke = [0.0; 3];
            }
        }
        match from.alpha_mode() {
            AlphaMode::Opaque => {}
            AlphaMode::Mask => {
                let map = match surface.base_color_texture() {
                    Some(map) => maps.alphas(file, &map.texture())?,
                    None => Arc::new(AlphaMap::even(&file.path, 1.0)),
                };
                material.alpha_mask = Some(AlphaMask {
                    map,
                    factor: alpha,
                    cutoff: from.alpha_cutoff().unwrap_or(DEFAULT_CUTOFF),
                });
            }
            AlphaMode::Blend if alpha < 1.0 || surface.base_color_texture().is_some() => {
                said.warnings
                    .push(about("surfaces are opaque: alpha is not used"));
            }
            AlphaMode::Blend => {}
        }
        if surface.metallic_factor() > 0.5 && surface.metallic_roughness_texture().is_none() {
            said.notes
                .push(about("a metal is taken as diffuse with its base colour"));
        }
        material.check().map_err(|what| Error::Material {
            path: file.path.clone(),
            material: name.clone(),
            what,
        })?;
        self.two_sided.push(from.double_sided());
        self.places.push(place.unwrap_or(Place::FIRST));
        self.emission_places.push(emission_place);
        self.list.push(material);
        self.said.push(said);
        Ok(())
    }
}

impl Maps {
    fn colours(&mut self, file: &File, texture: &gltf::Texture) -> Result<Arc<Texture>> {
        kept(&mut self.colours, file, texture, Texture::from_image)
    }

    fn alphas(&mut self, file: &File, texture: &gltf::Texture) -> Result<Arc<AlphaMap>> {
        let alphas = |path: &Path, image| Ok(AlphaMap::alpha_of(path, image));
        kept(&mut self.alphas, file, texture, alphas)
    }

    fn heights(&mut self, file: &File, texture: &gltf::Texture) -> Result<Arc<HeightMap>> {
        kept(&mut self.heights, file, texture, HeightMap::from_image)
    }

    fn normals(&mut self, file: &File, texture: &gltf::Texture) -> Result<Arc<NormalMap>> {
        kept(&mut self.normals, file, texture, NormalMap::from_image)
    }
}

/// Heights that Mesolux itself has written in the extras of a material, and their scale.
fn heights<'a>(file: &'a File, from: &gltf::Material) -> Option<(gltf::Texture<'a>, f32)> {
    let extras: serde_json::Value = serde_json::from_str(from.extras().as_ref()?.get()).ok()?;
    let of = extras.get("mesolux")?;
    let index = of.get("heightTexture")?.get("index")?.as_u64()?;
    let scale = of.get("heightScale")?.as_f64()? as f32;
    let texture = file.document.textures().nth(usize::try_from(index).ok()?)?;
    Some((texture, scale))
}

/// The map of a texture, made of its image unless that has been done.
fn kept<T>(
    known: &mut HashMap<usize, Arc<T>>,
    file: &File,
    texture: &gltf::Texture,
    make: impl FnOnce(&Path, DynamicImage) -> Result<T>,
) -> Result<Arc<T>> {
    let image = texture.source();
    if let Some(map) = known.get(&image.index()) {
        return Ok(map.clone());
    }
    let (path, decoded) = images::read(file, &image)?;
    let map = Arc::new(make(&path, decoded)?);
    known.insert(image.index(), map.clone());
    Ok(map)
}
