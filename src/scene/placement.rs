//! Placement of a mesh in a scene: scale, then rotate, then translate.

use glam::{DAffine3, DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::lights::unit;
use super::mesh_file::MeshFile;

/// One factor, or one for each axis; a negative one mirrors.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(untagged, expecting = "a number or [x, y, z]")]
pub(super) enum Scale {
    Uniform(f64),
    PerAxis([f64; 3]),
}

pub(super) struct Placement(DAffine3);

impl Placement {
    /// `rotate` is in degrees, about x, then y, then z. The error is one clause.
    pub fn new(
        scale: Option<Scale>,
        rotate: Option<[f64; 3]>,
        translate: Option<[f64; 3]>,
    ) -> Result<Self, String> {
        let scale = match scale.unwrap_or(Scale::Uniform(1.0)) {
            Scale::Uniform(factor) => DVec3::splat(factor),
            Scale::PerAxis(factors) => DVec3::from(factors),
        };
        let degrees = DVec3::from(rotate.unwrap_or_default());
        let translation = DVec3::from(translate.unwrap_or_default());
        for (what, value) in [
            ("scale", scale),
            ("rotate", degrees),
            ("translate", translation),
        ] {
            if !value.is_finite() {
                return Err(format!("{what} must be finite"));
            }
        }
        if scale.to_array().contains(&0.0) {
            return Err("scale must not be 0".into());
        }
        let rotation = turn(DMat3::from_rotation_z, degrees.z)
            * turn(DMat3::from_rotation_y, degrees.y)
            * turn(DMat3::from_rotation_x, degrees.x);
        let matrix = rotation * DMat3::from_diagonal(scale);
        Ok(Self(DAffine3::from_mat3_translation(matrix, translation)))
    }

    /// Moves a mesh with its lights and cameras. A mirroring placement turns the winding as well,
    /// so that fronts stay fronts; `reverse` turns it a second time.
    pub fn apply(&self, file: &mut MeshFile, reverse: bool) -> Result<(), String> {
        let mesh = &mut file.mesh;
        if self.0 != DAffine3::IDENTITY {
            for position in &mut mesh.positions {
                *position = self.0.transform_point3(*position);
                if !position.is_finite() {
                    return Err("a vertex is moved beyond every number".into());
                }
            }
        }
        for light in &mut file.lights.points {
            light.position = self.0.transform_point3(light.position);
            if let Some(beam) = &mut light.beam {
                *beam =
                    (beam.turned(self.0.matrix3)).ok_or("a light's axis is turned to nothing")?;
            }
        }
        for sun in &mut file.lights.suns {
            let towards = unit(self.0.matrix3 * sun.towards);
            sun.towards = towards.ok_or("a sun's direction is turned to nothing")?;
        }
        for camera in &mut file.cameras {
            camera.position = self.0.transform_point3(camera.position);
            camera.look_at = self.0.transform_point3(camera.look_at);
            camera.up = self.0.transform_vector3(camera.up);
        }
        if (self.0.matrix3.determinant() < 0.0) != reverse {
            for triangle in &mut mesh.triangles {
                triangle.corners.swap(1, 2);
                let uv = [
                    &mut triangle.uv,
                    &mut triangle.emission_uv,
                    &mut triangle.light_uv,
                ];
                uv.into_iter().flatten().for_each(|uv| uv.swap(1, 2));
            }
        }
        Ok(())
    }
}

/// Quarter turns are exact, so that points on the axes stay on them.
fn turn(rotation: fn(f64) -> DMat3, degrees: f64) -> DMat3 {
    let turned = rotation(degrees.to_radians());
    if degrees % 90.0 == 0.0 {
        DMat3::from_cols_array(&turned.to_cols_array().map(f64::round))
    } else {
        turned
    }
}
