//! The statue of a scene: read from a file or sculpted, given its material and stood on its place.

use std::path::Path;

use glam::{DMat3, DVec3};

use super::surface_nets::Surface;
use crate::error::{Error, Result};
use crate::scene::assemble::{Mesh, MeshTriangle, is_degenerate};
use crate::scene::material::TextureCache;
use crate::scene::obj;
use crate::scene::uv::box_projection;

/// Reads the mesh that takes the place of the statue.
pub(super) fn read_statue(path: &Path) -> Result<Mesh> {
    let mut mesh = obj::read(path, &mut TextureCache::default())?;
    if mesh.materials.iter().any(|m| m.name != "default") {
        mesh.notes.push(format!(
            "{}: the statue has the material of the scene, not its own",
            path.display()
        ));
    }
    let (low, high) = bounds(&mesh);
    let extent = (high - low).max_element();
    // The placing divides by the extent.
    if !(extent.is_finite() && extent > f64::MIN_POSITIVE * 1e9) {
        return Err(Error::file(path, "the statue has no extent to scale by"));
    }
    Ok(mesh)
}

/// Triangles that have an area, and so come to be in the scene.
pub(super) fn count(mesh: &Mesh) -> usize {
    mesh.triangles
        .iter()
        .filter(|t| !is_degenerate(t.corners.map(|v| mesh.positions[v as usize])))
        .count()
}

/// Turns a mesh about y by `degrees`, scales it to the greatest extent `size` and stands it on `place`, its lowest
/// vertex at exactly that height.
pub(super) fn stand(mesh: &mut Mesh, degrees: f64, size: f64, place: DVec3) {
    let (low, high) = bounds(mesh);
    let scale = size / (high - low).max_element();
    let centre = (low + high) / 2.0;
    let turn = DMat3::from_rotation_y(degrees.to_radians());
    for position in &mut mesh.positions {
        *position = turn * ((*position - centre) * scale);
    }
    let (low, high) = bounds(mesh);
    let foot = DVec3::new((low.x + high.x) / 2.0, low.y, (low.z + high.z) / 2.0);
    for position in &mut mesh.positions {
        *position = *position - foot + place;
    }
}

/// Gives every triangle a material and box projection, `repeats` of its maps a scene unit.
pub(super) fn clothe(mesh: &mut Mesh, material: u32, repeats: f64) {
    for triangle in &mut mesh.triangles {
        let corners = triangle.corners.map(|v| mesh.positions[v as usize]);
        triangle.uv = Some(box_projection(corners.map(|p| p * repeats)));
        triangle.material = material;
    }
}

pub(super) fn mesh_of(surface: Surface) -> Mesh {
    Mesh {
        positions: surface.positions,
        triangles: surface
            .triangles
            .into_iter()
            .map(|corners| MeshTriangle {
                corners,
                uv: None,
                material: 0,
            })
            .collect(),
        ..Mesh::default()
    }
}

/// The box around the corners of the triangles; a vertex that no triangle uses must not move what is seen.
fn bounds(mesh: &Mesh) -> (DVec3, DVec3) {
    mesh.triangles
        .iter()
        .flat_map(|t| t.corners)
        .map(|v| mesh.positions[v as usize])
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        })
}
