//! The relief of a scene's elements: tangent frames and responses. There is one response for each
//! material and size of its tiles, and one for each footprint where elements are smaller than a
//! tile.

use std::path::{Path, PathBuf};

use bytemuck::Zeroable;
use glam::{DVec2, Vec3};
use serde::Serialize;

use super::response::Block;
use super::scattering::Scattering;
use super::tiles::{Frame, Shading, Tile, tiles};
use super::{Footprints, HeightField, MesoTexel, Response, TextureFacet, Visibility};
use crate::constants::NONE;
use crate::error::Result;
use crate::math::directions::Directions;
use crate::mesh::elements::Elements;
use crate::scene::Scene;

/// How relief takes part in the transport of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Transport {
    /// Masking, shadowing and bounces inside the relief; keeps energy.
    #[default]
    Physical,
    /// The paper's equations (1) to (4) as printed; loses energy.
    Paper,
    /// No relief: every element is a flat diffuse one.
    Lambert,
}

/// Settings of a scene's relief.
#[derive(Debug, Clone)]
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

/// Normals and reflectance for look-ups by the pixels of an item buffer.
#[derive(Debug, Clone, Default)]
pub struct Texels {
    /// `[element]` in the elements' own order; zero for one without relief.
    pub elements: Vec<MesoTexel>,
    /// Facets of the tiles' height fields, one tile after another.
    pub facets: Vec<TextureFacet>,
}

/// Bytes of all responses at most, unless each tile has only one.
const MOST_RESPONSES: usize = 32 << 20;
/// Most footprints of a tile.
pub const MOST_FOOTPRINTS: usize = 256;

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

impl Texels {
    /// Adds a tile; `coordinates` are its members' texture coordinates, `[member][corner]`.
    fn add(&mut self, directions: &Directions, tile: &Tile, coordinates: &[[DVec2; 3]]) {
        let first = self.facets.len() as u32;
        let shading = &tile.shading;
        let facets = shading.normals.iter().zip(&shading.reflectance);
        self.facets.extend(facets.map(|(normal, &reflectance)| {
            let above = (0..directions.count())
                .filter(|&k| normal.dot(directions.centre(k)) > 0.0)
                .fold(0_u64, |bits, k| bits | 1 << k);
            TextureFacet {
                reflectance,
                above_low: above as u32,
                above_high: (above >> 32) as u32,
            }
        }));
        for (&e, uv) in tile.members.iter().zip(coordinates) {
            // Shifted towards the origin, where f32 is most precise.
            let home = uv[0].floor();
            let [uv_a, uv_b, uv_c] = uv.map(|p| (p - home).as_vec2());
            self.elements[e] = MesoTexel {
                uv_a,
                uv_b,
                uv_c,
                first,
                columns: tile.field.columns,
                rows: tile.field.rows,
            };
        }
    }
}

/// Responses of one tile.
struct TileResponses {
    /// To light over all of the tile.
    whole: Response,
    /// To light over a part of it, `[footprint]`.
    parts: Vec<Response>,
    visibility_from_cache: bool,
}

impl TileResponses {
    fn physical(
        tile: &Tile,
        footprints: &Footprints,
        options: &Options,
        march: &mut March<'_>,
    ) -> Result<Self> {
        let (visibility, visibility_from_cache) =
            visibility(&tile.field, options.cache.as_deref(), march)?;
        let scattering = Scattering::new(
            &options.directions,
            &tile.field,
            &visibility,
            &tile.shading.normals,
            &tile.shading.reflectance,
        );
        let whole = scattering.whole();
        Ok(Self {
            parts: scattering.of_footprints(footprints, &whole),
            whole,
            visibility_from_cache,
        })
    }

    fn paper(tile: &Tile, footprints: &Footprints, directions: &Directions) -> Self {
        let Shading {
            normals,
            reflectance,
            ..
        } = &tile.shading;
        let response =
            |shares: Option<&[f32]>| Response::paper(directions, normals, reflectance, shares);
        Self {
            whole: response(None),
            parts: (0..footprints.count())
                .map(|f| response(Some(&footprints.shares(f))))
                .collect(),
            visibility_from_cache: false,
        }
    }
}

impl Relief {
    /// The relief of a scene. None where no element has one or none is wanted. `march` is called
    /// for each tile whose visibility is not in the cache.
    ///
    /// # Errors
    /// A relief whose scale is implausibly steep; a march or a cache that fails.
    pub fn new(
        scene: &Scene,
        elements: &Elements,
        options: &Options,
        march: &mut March<'_>,
    ) -> Result<Option<Self>> {
        if options.transport == Transport::Lambert {
            return Ok(None);
        }
        let (tiles, frames) = tiles(scene, elements)?;
        let mut relief = Self::empty(elements.len(), options);
        let k = options.directions.count();
        let most_responses = MOST_RESPONSES / (size_of::<Block>() * k * k);
        let members_of_all: usize = tiles.iter().map(|tile| tile.members.len()).sum();
        for tile in &tiles {
            let coordinates: Vec<[DVec2; 3]> = tile
                .members
                .iter()
                .map(|&e| scene.triangles[elements.input_index[e] as usize].uv)
                .map(|uv| uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v))))
                .collect();
            // Each tile has a share of the responses, by its number of elements.
            let most = (most_responses * tile.members.len() / members_of_all).min(MOST_FOOTPRINTS);
            let footprints = Footprints::new(&tile.field, &coordinates, most);
            let responses = match options.transport {
                Transport::Physical => TileResponses::physical(tile, &footprints, options, march)?,
                _ => TileResponses::paper(tile, &footprints, &options.directions),
            };
            if let Some(texels) = &mut relief.texels {
                texels.add(&options.directions, tile, &coordinates);
            }
            let material = &scene.materials[tile.material as usize].name;
            relief.add(material, tile, elements, &frames, &footprints, responses);
        }
        Ok((!relief.responses.is_empty()).then_some(relief))
    }

    /// `count` elements without relief.
    fn empty(count: usize, options: &Options) -> Self {
        Self {
            directions: options.directions,
            transport: options.transport,
            class: vec![NONE; count],
            tangent: vec![Vec3::ZERO; count],
            bitangent: vec![Vec3::ZERO; count],
            scale: vec![Vec3::ZERO; count],
            responses: Vec::new(),
            classes: Vec::new(),
            texels: (options.transport == Transport::Paper).then(|| Texels {
                elements: vec![MesoTexel::zeroed(); count],
                facets: Vec::new(),
            }),
            highest_albedo: 0.0,
        }
    }

    /// Adds a tile of the material of that name. `frames` are `[element]`.
    fn add(
        &mut self,
        material: &str,
        tile: &Tile,
        elements: &Elements,
        frames: &[Option<Frame>],
        footprints: &Footprints,
        responses: TileResponses,
    ) {
        let TileResponses { whole, parts, .. } = responses;
        let mean = tile.shading.mean_reflectance();
        let over =
            |own: Vec3, mean: Vec3| Vec3::select(mean.cmpgt(Vec3::ZERO), own / mean, Vec3::ZERO);
        let means: Vec<Vec3> = (0..footprints.count())
            .map(|f| footprints.mean(f, &tile.shading.reflectance))
            .collect();
        let mut highest = 0.0_f32;
        let first = self.responses.len() as u32;
        let mut with_whole = false;
        for (&e, &footprint) in tile.members.iter().zip(&footprints.of) {
            let Some(frame) = &frames[e] else { continue };
            let own = elements.reflectance[e];
            highest = highest.max(over(own, mean).max_element());
            self.tangent[e] = frame.tangent.as_vec3();
            self.bitangent[e] = frame.bitangent.as_vec3();
            with_whole |= footprint == NONE;
            (self.class[e], self.scale[e]) = if footprint == NONE {
                (first + parts.len() as u32, over(own, mean))
            } else {
                let mean = means[footprint as usize];
                (first + footprint, over(own, mean))
            };
        }
        let albedo = whole.highest_albedo(&self.directions);
        self.highest_albedo = self.highest_albedo.max(highest * albedo);
        self.classes.push(Class {
            material: material.to_owned(),
            tile: tile.size.to_array(),
            elements: tile.members.len(),
            footprints: footprints.count(),
            facets: tile.field.facet_count(),
            rms_slope: tile.field.rms_slope(),
            reflectance: mean.to_array(),
            albedo: whole.mean_albedo(&self.directions).to_array(),
            visibility_from_cache: responses.visibility_from_cache,
        });
        self.responses.extend(parts);
        if with_whole {
            self.responses.push(whole);
        }
    }

    pub fn is_meso(&self, element: usize) -> bool {
        self.class[element] != NONE
    }

    /// Number of meso elements; in a solver's order they are the last ones.
    pub fn count(&self) -> usize {
        self.class.iter().filter(|&&c| c != NONE).count()
    }

    /// As [`Elements::permute`].
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
    if let Some(kept) = cache.and_then(|dir| Visibility::load(field, dir)) {
        return Ok((kept, true));
    }
    let found = march(field)?;
    if let Some(dir) = cache {
        // A cache that cannot be written costs time in the next run but does not harm this one.
        if let Err(error) = found.save(field, dir) {
            tracing::warn!("relief visibility is not kept: {error}");
        }
    }
    Ok((found, false))
}
