//! Finds the relief of a scene's elements: their tangent frames, and the responses of their tiles.

use glam::{DVec2, Vec3};

use super::elements::Elements;
use super::tiles::{Frame, Tile, tiles};
use crate::constants::NONE;
use crate::error::Result;
use crate::math::directions::Directions;
use crate::meso::{
    Basis, Class, Footprints, March, MesoTexel, Options, RANK, Relief, Response, Scattering,
    Shading, Texels, TextureFacet, Transport, visibility,
};
use crate::scene::Scene;

/// Bytes of all responses at most, unless each tile has only one.
const MOST_RESPONSES: usize = 32 << 20;
/// Most footprints of a tile.
pub const MOST_FOOTPRINTS: usize = 256;

impl Texels {
    /// Adds a tile; `coordinates` are its members' texture coordinates, `[member][corner]`.
    fn add(&mut self, tile: &Tile, coordinates: &[[DVec2; 3]]) {
        let first = self.facets.len() as u32;
        let shading = &tile.shading;
        let facets = shading.normals.iter().zip(&shading.reflectance);
        self.facets
            .extend(facets.map(|(&normal, &reflectance)| TextureFacet {
                reflectance,
                normal,
            }));
        for (&e, uv) in tile.members.iter().zip(coordinates) {
            // Shifted towards the origin, where f32 is most precise.
            let home = uv[0].floor();
            self.elements[e] = MesoTexel {
                uv: uv.map(|p| p - home),
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
        let matrix = RANK * k * size_of::<Vec3>();
        let basis = Basis::even().values.len() * size_of::<f32>();
        let most_responses = MOST_RESPONSES / (matrix + basis);
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
                texels.add(tile, &coordinates);
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
                elements: vec![MesoTexel::default(); count],
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
        let albedo = whole.highest_albedo();
        self.highest_albedo = self.highest_albedo.max(highest * albedo);
        self.classes.push(Class {
            material: material.to_owned(),
            tile: tile.size.to_array(),
            elements: tile.members.len(),
            footprints: footprints.count(),
            facets: tile.field.facet_count(),
            rms_slope: tile.field.rms_slope(),
            reflectance: mean.to_array(),
            albedo: whole.mean_albedo().to_array(),
            visibility_from_cache: responses.visibility_from_cache,
        });
        self.responses.extend(parts);
        if with_whole {
            self.responses.push(whole);
        }
    }
}
