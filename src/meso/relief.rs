//! The relief of a scene's elements: tangent frames, and one response for each material and size of its tiles.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use serde::Serialize;

use super::tiles::{Tile, tiles};
use super::{HeightField, Response, Visibility};
use crate::constants::NONE;
use crate::directions::Directions;
use crate::elements::Elements;
use crate::error::Result;
use crate::passes::relief_visibility::ReliefVisibility;
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
    /// The element's own mean reflectance over the tile's.
    pub scale: Vec<Vec3>,
    pub responses: Vec<Response>,
    pub classes: Vec<Class>,
}

/// One material at one size of its tiles.
#[derive(Debug, Clone, Serialize)]
pub struct Class {
    pub material: String,
    /// Scene units that a repeat of the texture is wide and high.
    pub tile: [f64; 2],
    pub elements: usize,
    pub facets: usize,
    pub rms_slope: f64,
    /// Mean reflectance of the facets, and share of a uniform sky's light that leaves the tile again, RGB.
    pub reflectance: [f32; 3],
    pub albedo: [f32; 3],
    pub visibility_from_cache: bool,
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
        };
        let mut marcher = None;
        for tile in &tiles {
            let Tile {
                field,
                shading,
                members,
                ..
            } = tile;
            let material = &scene.materials[tile.material as usize];
            let (response, visibility_from_cache) = match options.transport {
                Transport::Physical => {
                    let (visibility, cached) =
                        visibility(device, field, options.cache.as_deref(), &mut marcher)?;
                    let response = Response::physical(
                        &options.directions,
                        field,
                        &visibility,
                        &shading.normals,
                        &shading.reflectance,
                    );
                    (response, cached)
                }
                _ => {
                    let paper = Response::paper(
                        &options.directions,
                        &shading.normals,
                        &shading.reflectance,
                    );
                    (paper, false)
                }
            };
            let mean = shading.mean_reflectance();
            for &e in members {
                let Some(frame) = &frames[e] else { continue };
                relief.class[e] = relief.responses.len() as u32;
                relief.tangent[e] = frame.tangent.as_vec3();
                relief.bitangent[e] = frame.bitangent.as_vec3();
                relief.scale[e] = Vec3::select(
                    mean.cmpgt(Vec3::ZERO),
                    elements.reflectance[e] / mean,
                    Vec3::ZERO,
                );
            }
            relief.classes.push(Class {
                material: material.name.clone(),
                tile: tile.size.to_array(),
                elements: members.len(),
                facets: field.facet_count(),
                rms_slope: field.rms_slope(),
                reflectance: mean.to_array(),
                albedo: response.mean_albedo(&options.directions).to_array(),
                visibility_from_cache,
            });
            relief.responses.push(response);
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
    }

    pub fn response(&self, element: usize) -> &Response {
        &self.responses[self.class[element] as usize]
    }

    /// Most of what reaches any relief that leaves it again.
    pub fn highest_albedo(&self) -> f32 {
        let mut scales = vec![0.0_f32; self.responses.len()];
        for (&class, scale) in self.class.iter().zip(&self.scale) {
            if class != NONE {
                let highest = &mut scales[class as usize];
                *highest = highest.max(scale.max_element());
            }
        }
        self.responses
            .iter()
            .zip(scales)
            .map(|(response, scale)| scale * response.highest_albedo(&self.directions))
            .fold(0.0, f32::max)
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
