//! The light that a picture shows, and how.

use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;

use crate::bake::solution::{Bake, DirectionalLight, Solution};
use crate::constants::{
    SHADING_NORMAL, SHADING_PARALLAX, SHADING_RELIEF, VIEW_ALBEDO, VIEW_HEIGHT, VIEW_IRRADIANCE,
    VIEW_NORMAL, VIEW_SHADED, VIEW_SLOTS,
};
use crate::meso::KnownFactors;
use crate::picture::Light;
use crate::scene::Scene;
use crate::solver::BY_PAPER;

/// How triangles with a relief are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ReliefShading {
    /// Relief mapping, lit by the factors of the relief's response.
    #[default]
    Factored,
    /// Relief mapping, lit as in the paper: by parallel lights, the clusters of near-parallel
    /// slots, each shadowed at each pixel; light inside the relief by the factors. Light straight
    /// from emitters is always in the slots: [`Direct`] is ignored.
    Clusters,
    /// Flat, lit by the relief's response: normal mapping, with its shadows and inner light.
    Normal,
    /// The same, with its texture shifted by its height.
    Parallax,
    /// As plain triangles.
    None,
}

impl ReliefShading {
    pub(super) fn code(self) -> Option<u32> {
        match self {
            Self::Factored | Self::Clusters => Some(SHADING_RELIEF),
            Self::Normal => Some(SHADING_NORMAL),
            Self::Parallax => Some(SHADING_PARALLAX),
            Self::None => None,
        }
    }

    /// Whether it is drawn by rays through the height map.
    pub(super) fn is_displaced(self) -> bool {
        self.code() == Some(SHADING_RELIEF)
    }
}

/// How light straight from emitters and point lights falls on surfaces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Direct {
    /// From points on them, shadowed at each sample by the scene and by the relief itself.
    #[default]
    Sharp,
    /// As it was baked: on relief by the slots, as in the paper.
    Slots,
}

/// What a picture shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Show {
    #[default]
    Shaded,
    /// Reflectance.
    Albedo,
    /// Normals in the world, −1..1 as 0..1.
    Normal,
    /// Height of a relief from the lowest, black, to the highest, white; plain triangles are grey.
    Height,
    /// E/π, as on a white surface.
    Irradiance,
    /// The strongest slot of each triangle with a relief, see [`super::slot_colour`]; plain ones
    /// are shaded.
    Slots,
    /// How many fragments of prisms rays are followed for, see [`super::Overdraw`]; plain triangles
    /// are left out.
    Overdraw,
}

impl Show {
    /// Whether light is shown, not what it falls on.
    pub(super) fn is_light(self) -> bool {
        !matches!(self, Self::Albedo | Self::Normal | Self::Height)
    }

    /// Whether surfaces are shown in their colours; white, if not.
    pub(super) fn is_coloured(self) -> bool {
        !matches!(self, Self::Normal | Self::Height | Self::Irradiance)
    }

    pub(super) fn code(self) -> u32 {
        match self {
            // Fragments are counted by a shader of their own.
            Self::Shaded | Self::Overdraw => VIEW_SHADED,
            Self::Albedo => VIEW_ALBEDO,
            Self::Normal => VIEW_NORMAL,
            Self::Height => VIEW_HEIGHT,
            Self::Irradiance => VIEW_IRRADIANCE,
            Self::Slots => VIEW_SLOTS,
        }
    }
}

/// A solution and how it is shown; values `[triangle]` in the order of the input.
#[derive(Clone, Copy)]
pub struct Lighting<'a> {
    /// W·m⁻², RGB, direct and indirect.
    pub irradiance: &'a [Vec3],
    /// The part straight from emitters and point lights; needed to draw parts of the light.
    pub irradiance_direct: Option<&'a [Vec3]>,
    /// Light by direction; without it relief is drawn as plain triangles.
    pub relief: Option<&'a DirectionalLight>,
    pub part: Light,
    pub shading: ReliefShading,
    pub direct: Direct,
    pub show: Show,
    /// Whether samples with nothing between them and the lights skip the shadow rays, and ways that
    /// rise above a relief's horizon the march over it: quicker, and the same picture.
    pub skip_open: bool,
    /// Whether triangles seen from behind are left out, so that one looks into a room through its
    /// walls; else they are black.
    pub hide_backs: bool,
    /// Folder that keeps the visibility of reliefs from run to run.
    pub cache: Option<&'a Path>,
    /// Factors of reliefs, shared by renderers of one scene under different lights.
    pub known: Option<&'a KnownFactors>,
}

impl<'a> Lighting<'a> {
    fn plain(irradiance: &'a [Vec3]) -> Self {
        Self {
            irradiance,
            irradiance_direct: None,
            relief: None,
            part: Light::default(),
            shading: ReliefShading::default(),
            direct: Direct::default(),
            show: Show::default(),
            skip_open: true,
            hide_backs: false,
            cache: None,
            known: None,
        }
    }

    /// What the paper's method solved is drawn by it as well.
    fn by_paper(self, is_so: bool) -> Self {
        match is_so {
            true => Self {
                shading: ReliefShading::Clusters,
                direct: Direct::Slots,
                ..self
            },
            false => self,
        }
    }

    pub(super) fn relief(&self) -> Option<(&'a DirectionalLight, u32)> {
        self.relief.zip(self.shading.code())
    }

    /// Whether light straight from emitters and point lights is drawn from light points: only where
    /// the direct and the indirect light are known separately.
    pub(super) fn sharp(&self) -> bool {
        self.direct == Direct::Sharp
            && self.show.is_light()
            && self.part != Light::Indirect
            && self.irradiance_direct.is_some()
    }

    /// The part of the irradiance that is shown as it was baked on plain triangles.
    pub(super) fn baked(&self) -> Vec<Vec3> {
        match self.irradiance_direct {
            Some(_) if self.sharp() && self.part == Light::Direct => {
                vec![Vec3::ZERO; self.irradiance.len()]
            }
            Some(direct) if self.sharp() => {
                Light::Indirect.of(self.irradiance, direct, |all, direct| all - direct)
            }
            _ => self.irradiance(),
        }
    }

    /// The part of the irradiance that is shown.
    pub(super) fn irradiance(&self) -> Vec<Vec3> {
        match self.irradiance_direct {
            Some(direct) => self
                .part
                .of(self.irradiance, direct, |all, direct| all - direct),
            None => self.irradiance.to_vec(),
        }
    }

    /// Radiosity that elements with relief reflect of the light that is shown,
    /// `[meso element][slot]`, W·m⁻², RGB. The share of a part of the light is taken to be its
    /// share of the irradiance.
    pub(super) fn exits(&self, scene: &Scene, light: &DirectionalLight) -> Vec<Vec3> {
        let k = light.directions.len();
        let shown = self.irradiance();
        light
            .exitant
            .par_chunks(k)
            .zip(&light.elements)
            .flat_map_iter(|(sent, &e)| {
                let e = e as usize;
                let all = self.irradiance[e];
                let share = Vec3::select(all.cmpgt(Vec3::ZERO), shown[e] / all, Vec3::ZERO);
                let triangle = &scene.triangles[e];
                let material = &scene.materials[triangle.material as usize];
                let emitted = Vec3::from(material.emitted_over(&triangle.uv_of_emission()))
                    * std::f32::consts::PI;
                sent.iter()
                    .map(move |s| (*s - emitted).max(Vec3::ZERO) * share)
            })
            .collect()
    }
}

impl<'a> From<&'a Solution> for Lighting<'a> {
    fn from(solution: &'a Solution) -> Self {
        Self {
            irradiance_direct: Some(&solution.irradiance_direct),
            relief: solution.relief.as_ref(),
            ..Self::plain(&solution.irradiance).by_paper(solution.report.estimator == BY_PAPER)
        }
    }
}

impl<'a> From<&'a Bake> for Lighting<'a> {
    fn from(bake: &'a Bake) -> Self {
        Self {
            irradiance_direct: Some(&bake.irradiance_direct),
            relief: bake.relief.as_ref(),
            ..Self::plain(&bake.irradiance).by_paper(bake.by_paper)
        }
    }
}

impl<'a> From<&'a [Vec3]> for Lighting<'a> {
    fn from(irradiance: &'a [Vec3]) -> Self {
        Self::plain(irradiance)
    }
}

impl<'a> From<&'a Vec<Vec3>> for Lighting<'a> {
    fn from(irradiance: &'a Vec<Vec3>) -> Self {
        Self::plain(irradiance)
    }
}

impl<'a, const N: usize> From<&'a [Vec3; N]> for Lighting<'a> {
    fn from(irradiance: &'a [Vec3; N]) -> Self {
        Self::plain(irradiance)
    }
}
