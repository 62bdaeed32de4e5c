//! Lamps that are surfaces: spheres and disks, as triangles that emit.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Material;
use super::assemble::Mesh;
use super::light_tables::{Amount, Power, Strength, direction, one_of};
use super::shapes::Shapes;

/// A sphere that emits all around.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereLampTable {
    pub name: Option<String>,
    pub position: [f64; 3],
    pub radius: f64,
    pub radiance: Option<Amount>,
    pub lumens: Option<f64>,
    pub watts: Option<f64>,
    pub color: Option<[f64; 3]>,
    pub kelvin: Option<f64>,
}

/// A disk that emits from the side that its axis points out of.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DiskLampTable {
    pub name: Option<String>,
    pub position: [f64; 3],
    pub radius: f64,
    pub axis: Option<[f64; 3]>,
    pub radiance: Option<Amount>,
    pub lumens: Option<f64>,
    pub watts: Option<f64>,
    pub color: Option<[f64; 3]>,
    pub kelvin: Option<f64>,
}

/// Times that an icosahedron is divided: 320 triangles.
const LEVELS: u32 = 2;

/// Triangles about the middle of a disk, and rings.
const SECTORS: u32 = 12;
const RINGS: u32 = 3;

impl SphereLampTable {
    /// The triangles with their material, which has no name. The error is one clause.
    pub fn mesh(&self) -> Result<Mesh, String> {
        check_radius(self.position, self.radius)?;
        let power = power(
            self.radiance,
            self.lumens,
            self.watts,
            (self.color, self.kelvin),
        )?;
        let mut sphere = Shapes::new();
        let centre = DVec3::from(self.position);
        sphere.sphere(centre, self.radius, LEVELS, true, 0);
        let triangles = sphere.scene.triangles.iter().map(|t| t.vertices).collect();
        Ok(emitting(
            Mesh::bare(sphere.scene.vertices, triangles),
            &power,
        ))
    }
}

impl DiskLampTable {
    /// As that of a sphere.
    pub fn mesh(&self) -> Result<Mesh, String> {
        check_radius(self.position, self.radius)?;
        let power = power(
            self.radiance,
            self.lumens,
            self.watts,
            (self.color, self.kelvin),
        )?;
        let axis = direction("axis", self.axis.map_or(-DVec3::Y, DVec3::from))?;
        let (x, y) = axis.any_orthonormal_pair();
        // About +axis from x to y, whichever way the pair turns.
        let y = if x.cross(y).dot(axis) < 0.0 { -y } else { y };
        let mut positions = vec![DVec3::from(self.position)];
        let mut triangles = Vec::new();
        // Ring k has SECTORS k corners, so that all triangles are of a like size.
        let first = |ring: u32| 1 + SECTORS * ring * (ring - 1) / 2;
        for ring in 1..=RINGS {
            let corners = SECTORS * ring;
            let radius = self.radius * f64::from(ring) / f64::from(RINGS);
            for corner in 0..corners {
                let (sin, cos) = (TAU * f64::from(corner) / f64::from(corners)).sin_cos();
                positions.push(positions[0] + radius * (cos * x + sin * y));
            }
            for sector in 0..SECTORS {
                let outer = |i: u32| first(ring) + (sector * ring + i) % corners;
                let inner = |i: u32| match ring {
                    1 => 0,
                    _ => first(ring - 1) + (sector * (ring - 1) + i) % (corners - SECTORS),
                };
                for i in 0..ring {
                    triangles.push([inner(i), outer(i), outer(i + 1)]);
                    if i + 1 < ring {
                        triangles.push([inner(i), outer(i + 1), inner(i + 1)]);
                    }
                }
            }
        }
        Ok(emitting(Mesh::bare(positions, triangles), &power))
    }
}

fn check_radius(position: [f64; 3], radius: f64) -> Result<(), String> {
    if !DVec3::from(position).is_finite() {
        return Err("position must be finite".into());
    }
    match radius > 0.0 && radius.is_finite() {
        true => Ok(()),
        false => Err(format!("radius {radius} must be above 0 and finite")),
    }
}

fn power(
    radiance: Option<Amount>,
    lumens: Option<f64>,
    watts: Option<f64>,
    (color, kelvin): (Option<[f64; 3]>, Option<f64>),
) -> Result<Power, String> {
    let key = one_of([
        ("radiance", radiance.is_some()),
        ("lumens", lumens.is_some()),
        ("watts", watts.is_some()),
    ])?;
    let amount = radiance.or(lumens.or(watts).map(Amount::Grey));
    let (Some(key), Some(amount)) = (key, amount) else {
        return Err("radiance, lumens or watts is missing".into());
    };
    let strength = Strength {
        key,
        amount,
        is_luminous: key == "lumens",
        color,
        kelvin,
    };
    Ok(Power {
        is_flux: key != "radiance",
        rgb: strength.rgb()?,
    })
}

/// The mesh with a black material that emits. A flux is spread over the area of the triangles,
/// which is less than that of what they stand for, so that the power is exact.
fn emitting(mut mesh: Mesh, power: &Power) -> Mesh {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let total: f64 = mesh.triangles.iter().map(|t| area(&t.corners)).sum();
    let over = if power.is_flux { PI * total } else { 1.0 };
    mesh.materials = vec![Material {
        ke: power.rgb.map(|c| (c / over) as f32),
        ..Material::default()
    }];
    mesh
}
