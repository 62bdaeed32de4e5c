//! The result of a bake, in scene units and in the order of the input.

mod origin;
mod read;
mod write;

use glam::{DVec3, Vec3};

use crate::bake::discretisation::discretisation;
use crate::math::directions::Directions;
use crate::mesh::corners::{Joined, corner_irradiance};
use crate::mesh::elements::Elements;
use crate::meso::Relief;
use crate::scene::contents::Contents;
use crate::scene::{OnInput, Scene};
use crate::solver::{BY_PAPER, Light, ReliefLight, Report};
pub use origin::Origin;
pub use read::{About, Bake};
#[cfg(feature = "export")]
pub(crate) use write::write_tensors;
pub use write::{Dtype, Tensor, VERSION};

/// A solution, `[triangle]` in the order of the input.
pub struct Solution {
    /// Corners, scene units.
    pub vertices: Vec<[DVec3; 3]>,
    /// Scene units squared.
    pub area: Vec<f64>,
    pub normal: Vec<DVec3>,
    /// Index into the scene's materials.
    pub material: Vec<u32>,
    /// W·m⁻², RGB, direct and indirect.
    pub irradiance: Vec<Vec3>,
    /// W·m⁻², RGB, straight from emitters and point lights.
    pub irradiance_direct: Vec<Vec3>,
    /// Where each triangle lies in the scene as it was read.
    pub on_input: Vec<OnInput>,
    /// None of a solution under way.
    pub corners: Option<CornerLight>,
    /// W·m⁻², RGB: πLe + ρE; of an element with a relief, the mean of what it sends.
    pub radiosity: Vec<Vec3>,
    /// Light by direction of the elements with a relief; none where no element has one.
    pub relief: Option<DirectionalLight>,
    /// What is in the scene; none of a solution under way.
    pub contents: Option<Contents>,
    pub report: Report,
}

/// Irradiance at the corners, `[triangle][corner]`, W·m⁻², RGB: linear between them, continuous
/// over planes.
#[derive(Default)]
pub struct CornerLight {
    pub irradiance: Vec<[Vec3; 3]>,
    /// The part straight from emitters and point lights.
    pub irradiance_direct: Vec<[Vec3; 3]>,
}

/// Light by direction, `[meso element]` in the order of the input; slots as in
/// [`crate::math::directions::Directions`].
pub struct DirectionalLight {
    /// Triangles of the input.
    pub elements: Vec<u32>,
    /// Middles of the slots in the tangent frame, `[slot]`.
    pub directions: Vec<DVec3>,
    /// Tangent (along u), bitangent (along v) and normal.
    pub frames: Vec<[Vec3; 3]>,
    /// ∫ L ω dω in the tangent frame, `[meso element][slot][colour]`, W·m⁻².
    pub incident_moment: Vec<[Vec3; 3]>,
    /// The part straight from emitters and point lights.
    pub incident_moment_direct: Vec<[Vec3; 3]>,
    /// πL sent into each slot, `[meso element][slot]`, RGB, W·m⁻².
    pub exitant: Vec<Vec3>,
}

impl DirectionalLight {
    fn new(elements: &Elements, relief: &Relief, light: &ReliefLight) -> Self {
        let kept = relief.kept();
        let k = kept.count();
        let mut order: Vec<usize> = (0..light.elements.len()).collect();
        let input = |m: usize| elements.input_index[light.elements[m] as usize];
        order.sort_by_key(|&m| input(m));
        let slots = |m: usize| m * k..(m + 1) * k;
        let moments = |of: &[[Vec3; 3]]| {
            let mut ordered = Vec::with_capacity(of.len());
            order
                .iter()
                .for_each(|&m| ordered.extend_from_slice(&of[slots(m)]));
            ordered
        };
        Self {
            elements: order.iter().map(|&m| input(m)).collect(),
            directions: (0..k).map(|slot| kept.centre(slot)).collect(),
            frames: order
                .iter()
                .map(|&m| light.elements[m] as usize)
                .map(|e| {
                    [
                        relief.tangent[e],
                        relief.bitangent[e],
                        elements.normal[e].as_vec3(),
                    ]
                })
                .collect(),
            incident_moment: moments(&light.moments),
            incident_moment_direct: moments(&light.moments_direct),
            exitant: order
                .iter()
                .flat_map(|&m| in_slots(relief, &kept, light.sent(relief, m)))
                .collect(),
        }
    }
}

/// What is sent by direction, `[direction]`, in the slots that are kept.
fn in_slots(relief: &Relief, kept: &Directions, sent: &[Vec3]) -> Vec<Vec3> {
    if *kept == relief.directions {
        return sent.to_vec();
    }
    let look = |slot: usize| {
        let four = relief.directions.bilinear(kept.centre(slot)).into_iter();
        four.map(|(k, weight)| sent[k] * weight as f32).sum()
    };
    (0..kept.count()).map(look).collect()
}

impl Solution {
    pub fn new(scene: &Scene, elements: &Elements, light: &Light, report: Report) -> Self {
        let unit = elements.unit;
        let area: Vec<f64> = elements.area.iter().map(|a| a * unit * unit).collect();
        Self {
            vertices: scene.triangles.iter().map(|t| scene.corners(t)).collect(),
            area: elements.to_input_order(&area),
            normal: elements.to_input_order(&elements.normal),
            material: elements.to_input_order(&elements.material),
            irradiance: elements.to_input_order(&light.irradiance),
            irradiance_direct: elements.to_input_order(&light.irradiance_direct),
            corners: None,
            on_input: scene.on_input(),
            radiosity: elements.to_input_order(&light.radiosity),
            relief: elements
                .relief
                .as_ref()
                .zip(light.relief.as_ref())
                .map(|(relief, light)| DirectionalLight::new(elements, relief, light)),
            contents: None,
            report,
        }
    }

    /// The bake that a file of this holds.
    pub fn into_bake(self, origin: Origin) -> Bake {
        let corners = self.corners.map(|c| (c.irradiance, c.irradiance_direct));
        let (corner_irradiance, corner_irradiance_direct) = corners.unzip();
        Bake {
            origin,
            irradiance: self.irradiance,
            irradiance_direct: self.irradiance_direct,
            radiosity: self.radiosity,
            corner_irradiance,
            corner_irradiance_direct,
            relief: self.relief,
            on_input: self.on_input,
            by_paper: self.report.estimator == BY_PAPER,
        }
    }

    /// With the light at the corners, an estimate of its error in the report, and what is in the
    /// scene.
    pub fn with_corners(mut self, scene: &Scene) -> Self {
        let irradiance = corner_light(scene, &self.irradiance);
        let estimate = discretisation(scene, &self.irradiance, &irradiance);
        self.report.discretisation = Some(estimate);
        self.contents = Some(Contents::of(scene));
        self.corners = Some(CornerLight {
            irradiance,
            irradiance_direct: corner_light(scene, &self.irradiance_direct),
        });
        self
    }
}

/// The light at the corners that a bake holds, `[triangle][corner]`, from that of the triangles.
pub fn corner_light(scene: &Scene, irradiance: &[Vec3]) -> Vec<[Vec3; 3]> {
    corner_irradiance(scene, irradiance, Joined::Plane)
}
