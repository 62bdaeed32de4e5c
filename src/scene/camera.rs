//! Cameras: checks, and a default for a scene without one.

use super::*;

/// Directions closer than this sine count as parallel.
#[cfg(feature = "formats")]
const PARALLEL: f64 = 1e-6;

impl Camera {
    /// The error is one clause.
    #[cfg(feature = "formats")]
    pub(super) fn check(&self) -> Result<(), String> {
        if ![self.position, self.look_at, self.up]
            .iter()
            .all(|p| p.is_finite())
        {
            return Err("position, look_at and up must be finite".into());
        }
        if !(self.fov_y > 0.0 && self.fov_y < 180.0) {
            return Err(format!(
                "fov {} must be between 0 and 180 degrees",
                self.fov_y
            ));
        }
        if self.up == DVec3::ZERO {
            return Err("up must not be zero".into());
        }
        let Some(forward) = (self.look_at - self.position).try_normalize() else {
            return Err("position and look_at are the same point".into());
        };
        if forward.cross(self.up.normalize_or_zero()).length() < PARALLEL {
            return Err("up is parallel to the viewing direction".into());
        }
        Ok(())
    }

    /// A view of the whole scene from the front, the right and above; from inside where the
    /// surfaces face inward.
    pub(super) fn for_scene(scene: &Scene) -> Self {
        let (low, high) = scene.bounds();
        let (centre, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let (position, fov_y) = if faces_inward(scene, centre) {
            (centre + half * DVec3::new(0.6, 0.3, 0.9), 75.0)
        } else {
            let fov_y = 40.0_f64;
            let distance = 1.05 * half.length() / (fov_y / 2.0).to_radians().sin();
            let aside = DVec3::new(0.55, 0.4, 1.0).normalize();
            (centre + aside * distance, fov_y)
        };
        Self {
            name: "default".into(),
            position,
            look_at: centre,
            up: DVec3::Y,
            fov_y,
        }
    }
}

/// Whether the fronts look towards the centre, as in a room: the sign of ∫ n·(p − centre) dA.
fn faces_inward(scene: &Scene, centre: DVec3) -> bool {
    let flux: f64 = scene
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = scene.corners(triangle).map(|p| p - centre);
            (b - a).cross(c - a).dot((a + b + c) / 3.0)
        })
        .sum();
    flux < 0.0
}
