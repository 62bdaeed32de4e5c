//! The relief of a scene's elements: tangent frames and responses. There is one response for each
//! material and size of its tiles, and one for each footprint where elements are smaller than a
//! tile.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::{HeightField, Response, Visibility};
use crate::cache_folder::kept_or_found;
use crate::constants::NONE;
use crate::error::Result;
use crate::math::directions::Directions;

/// How relief takes part in the transport of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Transport {
    /// Masking, shadowing and bounces inside the relief; keeps energy.
    #[default]
    Physical,
    /// The paper's equation (3): what a texel reflects leaves in every direction less than 90° from
    /// its normal; loses energy.
    Paper,
    /// No relief: every element is a flat diffuse one.
    Lambert,
}

/// Settings of a scene's relief.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Options {
    pub transport: Transport,
    pub directions: Directions,
    /// Folder in which visibility is kept from run to run; None computes it each time.
    pub cache: Option<PathBuf>,
}

impl Default for Options {
    /// Physical transport in 64 directions, nothing kept on disk.
    fn default() -> Self {
        Self {
            transport: Transport::default(),
            directions: Directions {
                columns: 8,
                rows: 8,
            },
            cache: None,
        }
    }
}

/// The relief of elements, `[element]` in the elements' own order.
#[derive(Debug, Clone)]
pub struct Relief {
    pub directions: Directions,
    pub transport: Transport,
    /// Index into `responses`, NONE for an element without relief.
    pub class: Vec<u32>,
    /// Along increasing u and increasing v, orthogonal, unit; zero for an element without relief.
    pub tangent: Vec<Vec3>,
    pub bitangent: Vec<Vec3>,
    /// The element's own mean reflectance over that of its response's facets.
    pub scale: Vec<Vec3>,
    pub responses: Vec<Response>,
    pub classes: Vec<Class>,
    /// The elements' places in their textures; only for `paper` transport.
    pub texels: Option<Texels>,
    /// Largest share of light, the same over all of a tile, that leaves the tile again; over all
    /// elements, directions and colours.
    pub highest_albedo: f32,
}

/// Where an element lies in its texture.
#[derive(Debug, Clone, Copy, Default)]
pub struct MesoTexel {
    /// Texture coordinates of the corners.
    pub uv: [DVec2; 3],
    /// Facet of the texture among those of all textures.
    pub first: u32,
    pub columns: u32,
    pub rows: u32,
}

/// Half a texel of a texture: one side of a cell's diagonal.
#[derive(Debug, Clone, Copy)]
pub struct TextureFacet {
    pub reflectance: Vec3,
    /// In the frame of the element.
    pub normal: DVec3,
}

/// Normals and reflectance for look-ups by the pixels of an item buffer.
#[derive(Debug, Clone, Default)]
pub struct Texels {
    /// `[element]` in the elements' own order; zero for one without relief.
    pub elements: Vec<MesoTexel>,
    /// Facets of the tiles' height fields, `[row][column][half]`, one tile after another.
    pub facets: Vec<TextureFacet>,
}

/// One material at one size of its tiles.
#[derive(Debug, Clone, Serialize)]
pub struct Class {
    pub material: String,
    /// Width and height of one repeat of the texture, scene units.
    pub tile: [f64; 2],
    pub elements: usize,
    /// Responses to parts of the tile, for elements smaller than it.
    pub footprints: usize,
    pub facets: usize,
    pub rms_slope: f64,
    /// Mean reflectance of the facets, and share of a uniform sky's light that leaves the tile
    /// again, RGB.
    pub reflectance: [f32; 3],
    pub albedo: [f32; 3],
    pub visibility_from_cache: bool,
}

impl Relief {
    /// Frames alone, of elements of these classes: tangents and bitangents.
    pub fn of_frames(class: Vec<u32>, [tangent, bitangent]: [Vec<Vec3>; 2]) -> Self {
        Self {
            directions: Options::default().directions,
            transport: Transport::default(),
            class,
            tangent,
            bitangent,
            scale: Vec::new(),
            responses: Vec::new(),
            classes: Vec::new(),
            texels: None,
            highest_albedo: 0.0,
        }
    }

    pub fn is_meso(&self, element: usize) -> bool {
        self.class[element] != NONE
    }

    /// Number of meso elements; in a solver's order they are the last ones.
    pub fn count(&self) -> usize {
        self.class.iter().filter(|&&c| c != NONE).count()
    }

    /// As [`crate::mesh::elements::Elements::permute`].
    pub fn permute(&mut self, order: &[u32]) {
        fn apply<T: Copy>(values: &mut Vec<T>, order: &[u32]) {
            *values = order.iter().map(|&i| values[i as usize]).collect();
        }
        apply(&mut self.class, order);
        apply(&mut self.tangent, order);
        apply(&mut self.bitangent, order);
        apply(&mut self.scale, order);
        if let Some(texels) = &mut self.texels {
            apply(&mut texels.elements, order);
        }
    }

    /// Slots in which elements keep what arrives, for drawing: the directions, or 64 of more. Light
    /// is moved by its own direction whatever they are.
    pub fn kept(&self) -> Directions {
        match self.directions.count() {
            0..=64 => self.directions,
            _ => Options::default().directions,
        }
    }

    pub fn response(&self, element: usize) -> &Response {
        &self.responses[self.class[element] as usize]
    }
}

/// Finds what a height field sees of itself.
pub type March<'a> = dyn FnMut(&HeightField) -> Result<Visibility> + 'a;

/// Visibility of a height field, and whether it came from the folder `cache`; what `march` finds is
/// kept there.
///
/// # Errors
/// Those of `march`.
pub fn visibility(
    field: &HeightField,
    cache: Option<&Path>,
    march: &mut March<'_>,
) -> Result<(Visibility, bool)> {
    kept_or_found(
        cache,
        "visibility of a relief",
        |folder| Visibility::load(field, folder),
        || march(field),
        |found, folder| found.save(field, folder),
    )
}
