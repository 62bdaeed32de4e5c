//! The relief of a scene's elements: tangent frames, and responses: one for each material and size of its tiles, and where
//! elements are smaller than a tile one for each footprint.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{DVec2, Vec3};
use serde::Serialize;

use super::response::Block;
use super::scattering::Scattering;
use super::tiles::{Tile, tiles};
use super::{Footprints, HeightField, Response, Visibility};
use crate::constants::NONE;
use crate::directions::Directions;
use crate::elements::Elements;
use crate::error::Result;
use crate::passes::relief_visibility::ReliefVisibility;
use crate::passes::types::{MesoTexel, TextureFacet};
use crate::scene::Scene;
use crate::vk::Device;

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

/// What of the scene's relief is wanted.
#[derive(Debug, Clone)]
pub struct Options {
    pub transport: Transport,
    pub directions: Directions,
    /// Folder in which visibility is kept from run to run; none: computed anew.
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
    /// Along growing u and growing v, orthogonal, unit; zero for an element without relief.
    pub tangent: Vec<Vec3>,
    pub bitangent: Vec<Vec3>,
    /// The element's own mean reflectance over that of its response's facets.
    pub scale: Vec<Vec3>,
    pub responses: Vec<Response>,
    pub classes: Vec<Class>,
    /// Where the elements lie in their textures; `paper` transport alone.
    pub texels: Option<Texels>,
    /// Most of what reaches any relief, the same light over all of its tile, that leaves it again.
    pub highest_albedo: f32,
}

/// Normals and reflectance that the pixels of an item buffer look up.
#[derive(Debug, Clone, Default)]
pub struct Texels {
    /// `[element]` in the elements' own order; zero for one without relief.
    pub elements: Vec<MesoTexel>,
    /// Those of each tile's height field after those of the last.
    pub facets: Vec<TextureFacet>,
}

/// Bytes of all responses at most, unless each tile has but one.
const MOST_RESPONSES: usize = 32 << 20;
/// Footprints of a tile at most.
pub const MOST_FOOTPRINTS: usize = 256;

/// One material at one size of its tiles.
#[derive(Debug, Clone, Serialize)]
pub struct Class {
    pub material: String,
    /// Scene units that a repeat of the texture is wide and high.
    pub tile: [f64; 2],
    pub elements: usize,
    /// Responses to parts of the tile, for elements smaller than it.
    pub footprints: usize,
    pub facets: usize,
    pub rms_slope: f64,
    /// Mean reflectance of the facets, and share of a uniform sky's light that leaves the tile again, RGB.
    pub reflectance: [f32; 3],
    pub albedo: [f32; 3],
    pub visibility_from_cache: bool,
}

impl Texels {
    /// A tile, whose members have these texture coordinates.
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
            // Near the origin, where f32 is finest.
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

impl Relief {
    /// The relief of a scene, none where no element has one or none is wanted.
    ///
    /// # Errors
    /// A relief too steep to be meant; a device or a cache that fails.
    pub fn new(
        device: &Arc<Device>,
        scene: &Scene,
        elements: &Elements,
        options: &Options,
    ) -> Result<Option<Self>> {
        if options.transport == Transport::Lambert {
            return Ok(None);
        }
        let (tiles, frames) = tiles(scene, elements)?;
        let count = elements.len();
        let mut relief = Self {
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
        };
        let k = options.directions.count();
        let most_responses = MOST_RESPONSES / (size_of::<Block>() * k * k);
        let members_of_all: usize = tiles.iter().map(|tile| tile.members.len()).sum();
        let mut marcher = None;
        for tile in &tiles {
            let Tile {
                field,
                shading,
                members,
                ..
            } = tile;
            let material = &scene.materials[tile.material as usize];
            let coordinates: Vec<[DVec2; 3]> = members
                .iter()
                .map(|&e| scene.triangles[elements.input_index[e] as usize].uv)
                .map(|uv| uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v))))
                .collect();
            // Responses are dealt out by the tiles' elements.
            let most = (most_responses * tile.members.len() / members_of_all).min(MOST_FOOTPRINTS);
            let footprints = Footprints::new(field, &coordinates, most);
            let (whole, parts, visibility_from_cache) = match options.transport {
                Transport::Physical => {
                    let (visibility, cached) =
                        visibility(device, field, options.cache.as_deref(), &mut marcher)?;
                    let scattering = Scattering::new(
                        &options.directions,
                        field,
                        &visibility,
                        &shading.normals,
                        &shading.reflectance,
                    );
                    let whole = scattering.whole();
                    let parts = scattering.of_footprints(&footprints, &whole);
                    (whole, parts, cached)
                }
                _ => {
                    let paper = |shares: Option<&[f32]>| {
                        Response::paper(
                            &options.directions,
                            &shading.normals,
                            &shading.reflectance,
                            shares,
                        )
                    };
                    let parts = (0..footprints.count())
                        .map(|f| paper(Some(&footprints.shares(f))))
                        .collect();
                    (paper(None), parts, false)
                }
            };
            let mean = shading.mean_reflectance();
            let over = |own: Vec3, mean: Vec3| {
                Vec3::select(mean.cmpgt(Vec3::ZERO), own / mean, Vec3::ZERO)
            };
            let means: Vec<Vec3> = (0..footprints.count())
                .map(|f| footprints.mean(f, &shading.reflectance))
                .collect();
            let mut highest = 0.0_f32;
            let first = relief.responses.len() as u32;
            let mut with_whole = false;
            for (&e, &footprint) in members.iter().zip(&footprints.of) {
                let Some(frame) = &frames[e] else { continue };
                let own = elements.reflectance[e];
                highest = highest.max(over(own, mean).max_element());
                relief.tangent[e] = frame.tangent.as_vec3();
                relief.bitangent[e] = frame.bitangent.as_vec3();
                with_whole |= footprint == NONE;
                (relief.class[e], relief.scale[e]) = if footprint == NONE {
                    (first + parts.len() as u32, over(own, mean))
                } else {
                    let mean = means[footprint as usize];
                    (first + footprint, over(own, mean))
                };
            }
            let albedo = whole.highest_albedo(&options.directions);
            relief.highest_albedo = relief.highest_albedo.max(highest * albedo);
            if let Some(texels) = &mut relief.texels {
                texels.add(&options.directions, tile, &coordinates);
            }
            relief.classes.push(Class {
                material: material.name.clone(),
                tile: tile.size.to_array(),
                elements: members.len(),
                footprints: footprints.count(),
                facets: field.facet_count(),
                rms_slope: field.rms_slope(),
                reflectance: mean.to_array(),
                albedo: whole.mean_albedo(&options.directions).to_array(),
                visibility_from_cache,
            });
            relief.responses.extend(parts);
            if with_whole {
                relief.responses.push(whole);
            }
        }
        Ok((!relief.responses.is_empty()).then_some(relief))
    }

    pub fn is_meso(&self, element: usize) -> bool {
        self.class[element] != NONE
    }

    /// Meso elements; in a solver's order they are the last ones.
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

/// Visibility from the cache or from the device, and whether it came from the cache.
pub(crate) fn visibility(
    device: &Arc<Device>,
    field: &HeightField,
    cache: Option<&Path>,
    marcher: &mut Option<ReliefVisibility>,
) -> Result<(Visibility, bool)> {
    if let Some(kept) = cache.and_then(|dir| Visibility::load(field, dir)) {
        return Ok((kept, true));
    }
    let marcher = match marcher {
        Some(marcher) => marcher,
        none => none.insert(ReliefVisibility::new(device)?),
    };
    let computed = marcher.run(field)?;
    if let Some(dir) = cache {
        // A cache that cannot be written costs time in the next run and nothing in this one.
        if let Err(error) = computed.save(field, dir) {
            tracing::warn!("relief visibility is not kept: {error}");
        }
    }
    Ok((computed, false))
}
