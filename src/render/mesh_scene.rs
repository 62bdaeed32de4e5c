//! What does not depend on the view of a scene's plain triangles.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Joined, Lighting, Show};
use crate::mesh::corners::Corners;
use crate::scene::Scene;

/// Structure of arrays, `[triangle]`.
pub struct MeshScene {
    /// Irradiance as it was baked, or π times what is shown instead, `[corner]`.
    pub light: Vec<[Vec3; 3]>,
    /// None where nothing is lit sharply.
    pub lit: Vec<Normals>,
}

/// Unit.
pub struct Normals {
    pub plane: Vec3,
    pub corners: [Vec3; 3],
}

impl MeshScene {
    /// `neighbours` are the scene's; `sharp` says whether light points light it.
    pub fn new(scene: &Scene, lighting: &Lighting<'_>, neighbours: &Corners, sharp: bool) -> Self {
        let all = || (0..scene.triangles.len()).into_par_iter();
        let light = match lighting.show {
            // L = ρ · E / π is to be what is shown.
            Show::Albedo => vec![[Vec3::splat(PI); 3]; scene.triangles.len()],
            Show::Height => vec![[Vec3::splat(0.5 * PI); 3]; scene.triangles.len()],
            Show::Normal => {
                let smooth = neighbours.smooth();
                let coded = |n: DVec3| (PI * 0.5) * (n.as_vec3() + 1.0);
                all().map(|e| smooth.normals(e).map(coded)).collect()
            }
            _ => neighbours.irradiance(&lighting.baked(), Joined::Smooth),
        };
        let lit = match sharp {
            true => {
                let smooth = neighbours.smooth();
                let normals = |e: usize| Normals {
                    plane: neighbours.normals[e].as_vec3(),
                    corners: smooth.normals(e).map(|normal| normal.as_vec3()),
                };
                all().map(normals).collect()
            }
            false => Vec::new(),
        };
        Self { light, lit }
    }
}
