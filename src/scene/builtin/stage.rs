//! What the built-in scenes share: rooms, statues from files, and placement.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DMat3, DVec2, DVec3, swizzles::Vec3Swizzles};

use super::grid::{self, Part, Room};
use crate::error::{Error, Result};
use crate::scene::assemble::{Assembly, Mesh, MeshTriangle, is_degenerate};
use crate::scene::material::TextureCache;
use crate::scene::uv::box_projection;
use crate::scene::{Camera, Lights, LoadOptions, Material, Scene, check, obj};

/// A scene of solids in a room, complete except for the number of elements.
pub(super) struct Stage {
    pub name: &'static str,
    /// The default number of elements.
    pub patches: usize,
    pub room: Room,
    /// Index into `materials` for each part of the room.
    pub material_of: fn(Part) -> u32,
    pub materials: Vec<Material>,
    /// With texture coordinates and materials.
    pub solids: Vec<Mesh>,
    pub lights: Lights,
    pub camera: Camera,
}

impl Stage {
    /// The scene in exactly `options.patches` elements: the room takes what the solids leave.
    ///
    /// # Errors
    /// Fewer patches than solids and coarsest room need.
    pub fn build(self, options: &LoadOptions) -> Result<Scene> {
        let solids: usize = self.solids.iter().map(count).sum();
        let least = solids + grid::least_triangles();
        let patches = match options.patches {
            // Only a statue given by the user may need more than the default number of patches.
            None if options.statue.is_some() => self.patches.max(2 * solids),
            None => self.patches,
            Some(patches) => patches,
        };
        if patches < least {
            return Err(Error::Usage(format!(
                "{}: {patches} patches are too few: the solids take {solids}, and with the coarsest room it is {least}",
                self.name
            )));
        }
        let mut assembly = Assembly::new(self.name.into(), None);
        let materials = assembly.add_materials(&self.materials);
        let room = room(&self.room, patches - solids, self.material_of);
        assembly.add_mesh(&room, &materials)?;
        for solid in self.solids {
            assembly.add_mesh(&solid, &materials)?;
            assembly.scene.notes.extend(solid.said.notes);
        }
        let scene = &mut assembly.scene;
        scene.lights = self.lights;
        scene.cameras.push(self.camera);
        assert_eq!(
            scene.triangles.len(),
            patches,
            "every patch is there, and no other"
        );
        check::finish(assembly.into_scene(), &options.import)
    }
}

/// The patches to plan for.
///
/// # Errors
/// Fewer than `least`: the figures would lose their shape.
pub(super) fn planned(
    name: &str,
    options: &LoadOptions,
    default: usize,
    least: usize,
) -> Result<usize> {
    let patches = options.patches.unwrap_or(default);
    if patches < least {
        return Err(Error::Usage(format!(
            "{name}: {patches} patches are too few: the least is {least}"
        )));
    }
    Ok(patches)
}

/// The nearest even number to a share of the patches: a closed mesh has an even number of
/// triangles.
pub(super) fn even_share(patches: usize, share: f64) -> usize {
    2 * (share * patches as f64 / 2.0).round() as usize
}

/// A material that only reflects.
pub(super) fn diffuse(name: &str, kd: [f32; 3]) -> Material {
    Material {
        name: name.into(),
        kd,
        ..Material::default()
    }
}

/// The triangles that have an area.
pub(super) fn count(mesh: &Mesh) -> usize {
    mesh.triangles
        .iter()
        .filter(|t| !is_degenerate(t.corners.map(|v| mesh.positions[v as usize])))
        .count()
}

/// A room in exactly `count` triangles.
pub(super) fn room(room: &Room, count: usize, material_of: fn(Part) -> u32) -> Mesh {
    let mut mesh = Mesh::default();
    for grid::Piece { corners, part } in grid::triangles(room, count) {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push(MeshTriangle {
            corners: [first, first + 1, first + 2],
            uv: Some(box_projection(corners)),
            emission_uv: None,
            light_uv: None,
            material: material_of(part),
        });
    }
    mesh.named("room")
}

/// Gives every triangle a material, and texture coordinates with the given repeats per metre.
pub(super) fn cover(mesh: &mut Mesh, material: u32, repeats: f64) {
    for triangle in &mut mesh.triangles {
        let corners = triangle
            .corners
            .map(|v| mesh.positions[v as usize] * repeats);
        triangle.uv = Some(box_projection(corners));
        triangle.material = material;
    }
}

/// A mesh in place of the statue made by code, in the scene's material.
pub(super) fn read_statue(path: &Path) -> Result<Mesh> {
    let mut mesh = obj::read(path, &mut TextureCache::default())?;
    if mesh.materials.iter().any(|m| m.name != "default") {
        mesh.said.notes.push(format!(
            "{}: the statue has the material of the scene, not its own",
            path.display()
        ));
    }
    let (low, high) = bounds(&mesh);
    let extent = (high - low).max_element();
    // Placement divides by the extent.
    if !(extent.is_finite() && extent > f64::MIN_POSITIVE * 1e9) {
        return Err(Error::file(path, "the statue has no extent to scale by"));
    }
    Ok(mesh)
}

/// Scales a statue to its greatest extent, turns it about y (degrees) and stands it on `foot`, its
/// lowest vertex at exactly that height.
pub(super) fn place(mesh: &mut Mesh, extent: f64, turn: f64, foot: DVec3) {
    let (low, high) = bounds(mesh);
    let scale = extent / (high - low).max_element();
    let centre = (low + high) / 2.0;
    let turn = DMat3::from_rotation_y(turn.to_radians());
    for position in &mut mesh.positions {
        *position = turn * ((*position - centre) * scale);
    }
    stand(mesh, foot);
}

/// Moves a mesh so that the middle of its underside lies at `foot`.
pub(super) fn stand(mesh: &mut Mesh, foot: DVec3) {
    let (low, high) = bounds(mesh);
    let under = DVec3::new((low.x + high.x) / 2.0, low.y, (low.z + high.z) / 2.0);
    for position in &mut mesh.positions {
        *position = *position - under + foot;
    }
}

/// The lowest height over the middle of a mesh where something of that radius can stand, as exact
/// as the mesh is fine.
pub(super) fn top(mesh: &Mesh, radius: f64) -> DVec3 {
    let (low, high) = bounds(mesh);
    let middle = (low + high) / 2.0;
    let around = (0..8).map(|i| radius * DVec2::from_angle(TAU * f64::from(i) / 8.0));
    let feet: Vec<DVec2> = around.chain([DVec2::ZERO]).collect();
    let mut y = low.y;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle
            .corners
            .map(|v| mesh.positions[v as usize] - middle);
        for foot in &feet {
            // Barycentric coordinates seen from above.
            let across = |p: DVec3, q: DVec3| {
                let (p, q) = (p.xz() - *foot, q.xz() - *foot);
                p.perp_dot(q)
            };
            let weights = DVec3::new(across(b, c), across(c, a), across(a, b));
            let sum = weights.element_sum();
            if sum != 0.0 && (weights / sum).min_element() >= 0.0 {
                y = y.max(middle.y + weights.dot(DVec3::new(a.y, b.y, c.y)) / sum);
            }
        }
    }
    DVec3::new(middle.x, y, middle.z)
}

/// The box around the corners of the triangles; a vertex that no triangle uses must not move the
/// camera.
fn bounds(mesh: &Mesh) -> (DVec3, DVec3) {
    mesh.triangles
        .iter()
        .flat_map(|t| t.corners)
        .map(|v| mesh.positions[v as usize])
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        })
}
