//! A scene with the light of a bake, to be looked at from places.

use glam::Vec3;

use crate::bake::solution::{Bake, DirectionalLight};
use crate::error::Result;
use crate::math::directions::Directions;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::{self, Grouping, Source};
use crate::scene::Scene;
use crate::scene::sky::Sky;
use crate::solver::{Lit, Senders, SentByDirection};
use crate::structs::ShadowOccluder;

/// A scene, cut as it was baked, with what its surfaces send. Its sources need not be those of the
/// bake: places look at them part by part.
pub struct LitScene {
    elements: Elements,
    sources: Vec<Source>,
    occluders: ShadowTree<ShadowOccluder>,
    sky: Option<Sky>,
    /// `[element]`
    radiosity: Vec<Vec3>,
    by_direction: Option<SentByDirection>,
}

/// Large sources: places find the parts that they need by halving.
const GROUPING: Grouping = Grouping {
    max_elements: 4096,
    max_area: 1.0 / 16.0,
    max_power: f64::INFINITY,
    max_unevenness: f64::INFINITY,
    alone: false,
    sky_bands: Grouping::SKY_BANDS,
};

impl LitScene {
    /// Of a bake and its scene, cut as it was baked.
    ///
    /// # Errors
    /// Light by directions that no bake has.
    pub fn new(scene: &Scene, bake: &Bake) -> Result<Self> {
        let mut elements = Elements::new(scene);
        let (sources, connections) = sources::build(&mut elements, &scene.lights, &GROUPING, 0);
        let occluders = Occluders::merged(&elements, &connections);
        let occluders = ShadowTree::new(occluders.casters(&elements, &connections));
        let inputs = elements.input_index.iter().map(|&i| i as usize);
        let radiosity = inputs.map(|i| bake.radiosity[i]).collect();
        let relief = bake.relief.as_ref();
        Ok(Self {
            by_direction: relief.map(|of| directed(&elements, of)).transpose()?,
            sources: sources.list,
            sky: scene.lights.sky.clone(),
            elements,
            occluders,
            radiosity,
        })
    }

    pub fn look(&self) -> Lit<'_> {
        let of = Senders {
            elements: &self.elements,
            sources: &self.sources,
            occluders: &self.occluders,
            sky: self.sky.as_ref(),
        };
        Lit::new(of, &self.radiosity, self.by_direction.as_ref())
    }
}

fn directed(elements: &Elements, light: &DirectionalLight) -> Result<SentByDirection> {
    let mut of_input = vec![None; elements.len()];
    for (m, &triangle) in (0..).zip(&light.elements) {
        of_input[triangle as usize] = Some(m);
    }
    let inputs = elements.input_index.iter().map(|&i| i as usize);
    Ok(SentByDirection {
        directions: Directions::new(light.directions.len() as u32)?,
        meso: inputs.map(|i| of_input[i]).collect(),
        frames: light.frames.clone(),
        exitant: light.exitant.clone(),
    })
}
