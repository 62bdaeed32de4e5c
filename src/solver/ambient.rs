//! An estimate of the light that has not been shot yet, for pictures of a solution under way (Cohen
//! et al. 1988).

use glam::{DVec3, Vec3};

use super::{Method, Solver};
use crate::error::Result;
use crate::mesh::elements::Elements;

/// How unshot light would arrive if it were spread evenly over the whole scene.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ambient {
    /// Irradiance to be added everywhere, W·m⁻², RGB.
    pub irradiance: Vec3,
}

impl Ambient {
    /// E = 1/(1 − ρ̄) · Φ / ΣA of an unshot power Φ, with the mean reflectance ρ̄ by area: Cohen's
    /// ambient radiosity, his form factors to elements being their shares of the area. Power and
    /// areas in internal units.
    pub fn new(unshot: DVec3, elements: &Elements) -> Self {
        let area: f64 = elements.area.iter().sum();
        let reflected: DVec3 = elements
            .area
            .iter()
            .zip(&elements.reflectance)
            .map(|(&area, rho)| rho.as_dvec3() * area)
            .sum();
        let kept = (DVec3::ONE - reflected / area).max(DVec3::splat(LEAST_LOST));
        Self {
            irradiance: (unshot / area / kept).as_vec3(),
        }
    }
}

/// A scene that loses less of its light at each bounce than this has no estimate worth showing.
const LEAST_LOST: f64 = 1e-3;

impl Solver {
    /// The estimate for what is unshot now: since the last [`Solver::run`].
    pub fn ambient(&self) -> Result<Ambient> {
        let unshot = match &self.method {
            Method::Rows(spine) => spine.ledger.unshot_by_colour(),
            Method::Shots(shots) => shots.unshot_by_colour(),
        };
        Ok(Ambient::new(unshot, &self.problem.elements))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a closed room of one reflectance light of power Φ ends as E = Φ / (A (1 − ρ)) wherever it
    /// is spread evenly, so that the estimate is the solution.
    #[test]
    fn of_an_even_room_it_is_the_solution() {
        let elements = Elements {
            area: vec![1.0, 2.0, 5.0],
            reflectance: vec![Vec3::new(0.5, 0.75, 0.0); 3],
            ..Elements::default()
        };
        let found = Ambient::new(DVec3::splat(4.0), &elements).irradiance;
        assert!(found.distance(Vec3::new(1.0, 2.0, 0.5)) < 1e-6, "{found}");
    }
}
