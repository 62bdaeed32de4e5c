//! The relief of a scene's elements: tangent frames, and one response for each material and size of its tiles.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use serde::Serialize;

use super::{HeightField, Response, Visibility};
use crate::constants::NONE;
use crate::directions::Directions;
use crate::elements::Elements;
use crate::error::{Error, Result};
use crate::passes::relief_visibility::ReliefVisibility;
use crate::scene::{Material, Scene};
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

/// Octaves that the width or height of a tile may vary within a class.
const CLASS_OCTAVES: f64 = 0.5;
/// A steeper relief is a mistake in the scale of its heights.
const MOST_SLOPE: f64 = 1e3;

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
        let any = scene.materials.iter().any(Material::has_relief);
        if options.transport == Transport::Lambert || !any {
            return Ok(None);
        }
        let frames: Vec<Option<Frame>> = (0..elements.len())
            .map(|e| Frame::new(scene, elements, e))
            .collect();
        // Width and height of a tile in steps of CLASS_OCTAVES decide the class.
        let mut members: BTreeMap<(u32, i64, i64), Vec<usize>> = BTreeMap::new();
        for (e, frame) in frames.iter().enumerate() {
            if let Some(frame) = frame {
                let step = |size: f64| (size.log2() / CLASS_OCTAVES).round() as i64;
                let key = (elements.material[e], step(frame.tile.x), step(frame.tile.y));
                members.entry(key).or_default().push(e);
            }
        }
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
        for ((material, _, _), members) in &members {
            let area: f64 = members.iter().map(|&e| elements.area[e]).sum();
            let tile = members
                .iter()
                .map(|&e| frames[e].as_ref().map_or(DVec2::ZERO, |f| f.tile) * elements.area[e])
                .sum::<DVec2>()
                / area;
            let material = &scene.materials[*material as usize];
            let Some(field) = HeightField::new(material, tile) else {
                continue;
            };
            let rms_slope = field.rms_slope();
            if rms_slope.is_nan() || rms_slope > MOST_SLOPE {
                return Err(Error::Scene {
                    scene: scene.name.clone(),
                    what: format!(
                        "material \"{}\": its relief has an rms slope of {rms_slope:.3e}: height_scale or the texture coordinates are wrong",
                        material.name
                    ),
                });
            }
            let shading = Shading::new(material, &field);
            let (response, visibility_from_cache) = match options.transport {
                Transport::Physical => {
                    let (visibility, cached) = visibility(device, &field, options, &mut marcher)?;
                    let response = Response::physical(
                        &options.directions,
                        &field,
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
                tile: tile.to_array(),
                elements: members.len(),
                facets: field.facet_count(),
                rms_slope,
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
fn visibility(
    device: &Arc<Device>,
    field: &HeightField,
    options: &Options,
    marcher: &mut Option<ReliefVisibility>,
) -> Result<(Visibility, bool)> {
    if let Some(kept) = options
        .cache
        .as_deref()
        .and_then(|dir| Visibility::load(field, dir))
    {
        return Ok((kept, true));
    }
    let marcher = match marcher {
        Some(marcher) => marcher,
        none => none.insert(ReliefVisibility::new(device)?),
    };
    let computed = marcher.run(field)?;
    if let Some(dir) = &options.cache {
        // A cache that cannot be written costs time in the next run and nothing in this one.
        if let Err(error) = computed.save(field, dir) {
            tracing::warn!("relief visibility is not kept: {error}");
        }
    }
    Ok((computed, false))
}

/// Tangent frame of an element by its texture coordinates.
struct Frame {
    tangent: DVec3,
    bitangent: DVec3,
    /// Scene units of a repeat of the texture along tangent and bitangent.
    tile: DVec2,
}

impl Frame {
    /// None for an element without relief, or whose texture coordinates span no area.
    fn new(scene: &Scene, elements: &Elements, e: usize) -> Option<Self> {
        let triangle = &scene.triangles[elements.input_index[e] as usize];
        if !scene.materials[triangle.material as usize].has_relief() {
            return None;
        }
        let [a, b, c] = elements.triangle(e);
        let uv = triangle
            .uv
            .map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)));
        let (along, across) = (uv[1] - uv[0], uv[2] - uv[0]);
        let turn = along.perp_dot(across);
        let along_u = ((b - a) * across.y - (c - a) * along.y) / turn;
        let along_v = ((c - a) * along.x - (b - a) * across.x) / turn;
        let tangent = along_u.try_normalize()?;
        let bitangent = elements.normal[e].cross(tangent) * turn.signum();
        let tile = DVec2::new(along_u.length(), along_v.dot(bitangent)) * elements.unit;
        (tile.is_finite() && tile.min_element() > 0.0).then_some(Self {
            tangent,
            bitangent,
            tile,
        })
    }
}

/// Normals and reflectance of a tile's facets, `[facet]`.
struct Shading {
    normals: Vec<DVec3>,
    reflectance: Vec<Vec3>,
}

impl Shading {
    fn new(material: &Material, field: &HeightField) -> Self {
        let kd = Vec3::from_array(material.kd);
        let (normals, reflectance) = (0..field.facet_count())
            .map(|q| {
                let facet = field.facet(q);
                let u = (facet.centre.x + 0.5) / f64::from(field.columns);
                let v = (facet.centre.y + 0.5) / f64::from(field.rows);
                let normal = material.map_normal.as_deref().map_or(facet.normal, |map| {
                    let column = (u.rem_euclid(1.0) * f64::from(map.width)) as u32 % map.width;
                    let row =
                        ((1.0 - v).rem_euclid(1.0) * f64::from(map.height)) as u32 % map.height;
                    let n = map.normals[(row * map.width + column) as usize];
                    DVec3::from_array(n.map(f64::from))
                });
                let texel = material.map_kd.as_deref().map_or(Vec3::ONE, |map| {
                    Vec3::from_array(map.sample_bilinear(u as f32, v as f32))
                });
                (normal, kd * texel)
            })
            .unzip();
        Self {
            normals,
            reflectance,
        }
    }

    fn mean_reflectance(&self) -> Vec3 {
        self.reflectance.iter().sum::<Vec3>() / self.reflectance.len() as f32
    }
}
