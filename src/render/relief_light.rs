//! The light at the corners of prisms: what arrives there and what is sent.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashMap;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::relief_scene::ReliefScene;
use super::{Light, Lighting, ReliefShading};
use crate::bake::solution::DirectionalLight;
use crate::constants::MOST_RANK;
use crate::scene::Scene;

/// All light less its direct part, RGB.
pub fn difference(all: [Vec3; 3], direct: [Vec3; 3]) -> [Vec3; 3] {
    [0, 1, 2].map(|c| all[c] - direct[c])
}

/// Moments by which the relief is lit, `[meso vertex][slot][colour]`.
pub struct Incident<'a> {
    /// Light whose bounces inside the relief are drawn.
    inside: Option<&'a [[Vec3; 3]]>,
    /// Light that arrives and is drawn by factors.
    arriving: Option<Cow<'a, [[Vec3; 3]]>>,
    /// Light that arrives and is drawn by clusters.
    pub clustered: Option<Cow<'a, [[Vec3; 3]]>>,
}

impl<'a> Incident<'a> {
    pub fn new(lighting: &Lighting<'_>, kept: &'a ReliefScene) -> Self {
        let (all, direct) = (&kept.all[..], &kept.direct[..]);
        let indirect = || -> Vec<[Vec3; 3]> {
            let pairs = all.iter().zip(direct);
            pairs.map(|(&all, &d)| difference(all, d)).collect()
        };
        let sharp = lighting.sharp() && lighting.shading == ReliefShading::Factored;
        let arriving = match (lighting.part, sharp) {
            (Light::Global, false) => Some(Cow::Borrowed(all)),
            (Light::Global, true) | (Light::Indirect, _) => Some(Cow::Owned(indirect())),
            (Light::Direct, false) => Some(Cow::Borrowed(direct)),
            (Light::Direct, true) => None,
        };
        let (arriving, clustered) = match lighting.shading {
            ReliefShading::Clusters => (None, arriving),
            _ => (arriving, None),
        };
        Self {
            // Light that has bounced inside the relief counts as indirect.
            inside: (lighting.part != Light::Direct).then_some(all),
            arriving,
            clustered,
        }
    }
}

/// Radiosity that meso vertices send, found when it is first asked for: few pictures show relief
/// from so far that its texels are averaged.
pub struct Exits<'a> {
    lighting: &'a Lighting<'a>,
    scene: &'a Scene,
    light: &'a DirectionalLight,
    kept: &'a ReliefScene,
    found: OnceCell<Vec<Vec3>>,
}

impl<'a> Exits<'a> {
    pub fn new(
        lighting: &'a Lighting<'a>,
        scene: &'a Scene,
        light: &'a DirectionalLight,
        kept: &'a ReliefScene,
    ) -> Self {
        Self {
            lighting,
            scene,
            light,
            kept,
            found: OnceCell::new(),
        }
    }

    /// `[meso vertex][slot]`
    pub fn all(&self) -> &[Vec3] {
        self.found.get_or_init(|| {
            let of_elements = self.lighting.exits(self.scene, self.light);
            let slots = self.kept.directions.count();
            self.kept.vertices.mean(&of_elements, slots)
        })
    }
}

/// Meso vertices with light, each as one surface sees it.
#[derive(Default)]
pub struct LightVertices {
    /// Meso vertex and surface, `[light vertex]`.
    list: Vec<(u32, u32)>,
    known: HashMap<(u32, u32), u32>,
}

impl LightVertices {
    /// The light vertex of a meso vertex as a surface sees it.
    pub fn index(&mut self, vertex: u32, surface: u32) -> u32 {
        let next = self.list.len() as u32;
        let known = *self.known.entry((vertex, surface)).or_insert(next);
        if known == next {
            self.list.push((vertex, surface));
        }
        known
    }

    /// Packed, of the light inside and of the light that arrives, `[light vertex][rank]`.
    pub fn coefficients(&self, kept: &ReliefScene, incident: &Incident<'_>) -> Vec<[u32; 4]> {
        let k = kept.directions.count();
        let ranks = MOST_RANK as usize;
        let mut all = vec![[0; 4]; self.list.len() * ranks];
        let of_vertices = all.par_chunks_mut(ranks).zip(&self.list);
        of_vertices.for_each(|(texels, &(vertex, surface))| {
            let factors = &kept.factors[surface as usize];
            let of = |moments: Option<&[[Vec3; 3]]>| -> Vec<Vec3> {
                let found = moments.map(|m| factors.coefficients(&m[vertex as usize * k..][..k]));
                found.into_iter().flatten().collect()
            };
            let (inside, arriving) = (of(incident.inside), of(incident.arriving.as_deref()));
            let packed = &kept.surfaces.packed[surface as usize];
            let found = packed.coefficients(&inside, &arriving);
            texels
                .iter_mut()
                .zip(found)
                .for_each(|(texel, found)| *texel = found);
        });
        all
    }

    /// Radiosity sent, `[light vertex][slot]`, of `k` slots.
    pub fn exits(&self, exits: &Exits<'_>, k: usize) -> Vec<Vec4> {
        let exits = exits.all();
        let of_vertex = |&(vertex, _): &(u32, u32)| &exits[vertex as usize * k..][..k];
        let sent = self.list.iter().flat_map(of_vertex);
        sent.map(|sent| sent.extend(0.0)).collect()
    }
}
