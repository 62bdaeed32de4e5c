//! How evenly the members of a group are lit: a source sends the mean of its members.

use glam::DVec3;
use rayon::prelude::*;

use super::LitBy;
use crate::mesh::charts::{Connections, morton_order};
use crate::mesh::elements::Elements;
use crate::mesh::near::blocked;
use crate::mesh::occluders::Occluders;
use crate::mesh::shadow_tree::ShadowTree;
use crate::scene::even_light::{EvenLight, LightPlace, Surface, luminance};
use crate::structs::ShadowOccluder;

/// Places on the lights, and on all surfaces.
const PLACES: usize = 32;

/// Members of a group that are looked at.
const MEMBERS: usize = 8;

/// Light as it may be on the elements.
pub(super) struct Lit<'a> {
    elements: &'a Elements,
    light: EvenLight,
    tree: ShadowTree<ShadowOccluder>,
}

impl<'a> Lit<'a> {
    /// None where nothing emits.
    pub fn new(elements: &'a Elements, connections: &Connections, by: LitBy) -> Option<Self> {
        let surface = |e: usize| Surface {
            corners: elements.triangle(e),
            emitted: luminance(elements.emitted[e].into()),
            reflectance: luminance(elements.reflectance[e].into()),
        };
        // In an order that does not depend on that of the input.
        let order = morton_order(elements);
        let surfaces: Vec<Surface> = order.iter().map(|&e| surface(e as usize)).collect();
        let points = by.points.iter().map(|light| {
            let position = (light.position - elements.origin) / elements.unit;
            let square = elements.unit * elements.unit;
            (position, luminance(light.intensity) / square)
        });
        let light = EvenLight::new(&surfaces, points, by.far, PLACES)?;
        let occluders = Occluders::elements(elements);
        Some(Self {
            elements,
            light,
            tree: ShadowTree::new(occluders.casters(elements, connections)),
        })
    }

    /// What a group reflects more or less than its mean, root mean square over its area, as a share
    /// of what the scene reflects in the mean.
    pub fn unevenness(&self, members: &[u32]) -> f64 {
        let chosen = self.chosen(members);
        let light: Vec<f64> = (chosen.par_iter())
            .map(|&e| {
                let e = e as usize;
                let (at, normal) = (self.elements.centroid[e], self.elements.normal[e]);
                luminance(self.elements.reflectance[e].into()) * self.at(at, normal)
            })
            .collect();
        let mean = light.iter().sum::<f64>() / light.len() as f64;
        let square = light.iter().map(|of| (of - mean).powi(2)).sum::<f64>() / light.len() as f64;
        square.sqrt() / self.light.mean
    }

    /// Members at equal steps of area.
    fn chosen(&self, members: &[u32]) -> Vec<u32> {
        let area = |e: u32| self.elements.area[e as usize];
        let all: f64 = members.iter().map(|&e| area(e)).sum();
        let mut chosen = Vec::with_capacity(MEMBERS);
        let mut before = 0.0;
        for &e in members {
            before += area(e);
            if before * MEMBERS as f64 >= (chosen.len() as f64 + 0.5) * all {
                chosen.push(e);
            }
        }
        chosen
    }

    fn at(&self, place: DVec3, normal: DVec3) -> f64 {
        let of = |from: &LightPlace| {
            let light = from.irradiance(place, normal);
            let hidden = light > 0.0 && blocked(&self.tree, place, from.position);
            if hidden { 0.0 } else { light }
        };
        self.light.places.iter().map(of).sum()
    }
}
