//! What the scenes on a table have in common: the table with its walls, and triangles shared out exactly.

use glam::{DVec2, DVec3};

use super::panels::{self, Panel};
use super::placing::mesh_of;
use super::surface_nets::Surface;
use super::{exact, lathe};
use crate::error::{Error, Result};
use crate::scene::assemble::{Assembly, Mesh, MeshTriangle};
use crate::scene::uv::box_projection;

/// Height of the edge of the table.
const EDGE: f64 = 0.05;

/// Materials of the panels, in the order that the scenes give them.
pub(super) const TABLE: u32 = 0;
pub(super) const BACK: u32 = 1;
pub(super) const LEFT: u32 = 2;
pub(super) const RIGHT: u32 = 3;

/// A table with its top at y = 0, `wide` along x and `deep` along z, its front towards −z, with walls on the other three
/// sides. The first of them starts at a free side.
pub(super) fn table(wide: f64, deep: f64, high: f64) -> Vec<Panel> {
    let low = DVec3::new(-wide / 2.0, 0.0, -deep / 2.0);
    let top = DVec3::new(wide / 2.0, high, deep / 2.0);
    let panel = |low: DVec3, high: DVec3, facing: DVec3, material: u32| Panel {
        low,
        high,
        facing,
        material,
    };
    vec![
        panel(
            low.with_y(-EDGE),
            DVec3::new(top.x, 0.0, low.z),
            DVec3::NEG_Z,
            TABLE,
        ),
        panel(low, top.with_y(0.0), DVec3::Y, TABLE),
        panel(low.with_z(top.z), top, DVec3::NEG_Z, BACK),
        // Seen from the front, +x is on the left.
        panel(low.with_x(top.x), top, DVec3::NEG_X, LEFT),
        panel(low, top.with_x(low.x), DVec3::X, RIGHT),
    ]
}

/// The even number nearest to `share` of `patches`.
pub(super) fn even_share(patches: usize, share: f64) -> usize {
    2 * (patches as f64 * share / 2.0).round() as usize
}

/// A sculpted thing in exactly so many triangles.
///
/// # Errors
/// Too few triangles to show it.
pub(super) fn sculpted(
    scene: &str,
    thing: &str,
    distance: impl Fn(DVec3) -> f64,
    [low, high]: [DVec3; 2],
    triangles: usize,
) -> Result<Mesh> {
    found(
        scene,
        thing,
        exact::sculpt(distance, low, high, triangles),
        triangles,
    )
}

/// A turned thing in exactly so many triangles.
///
/// # Errors
/// Too few triangles to show it.
pub(super) fn turned(
    scene: &str,
    thing: &str,
    profile: &[DVec2],
    triangles: usize,
) -> Result<Mesh> {
    found(scene, thing, lathe::turn(profile, triangles), triangles)
}

fn found(scene: &str, thing: &str, surface: Option<Surface>, triangles: usize) -> Result<Mesh> {
    let surface = surface.ok_or_else(|| {
        Error::Usage(format!(
            "{scene}: too few patches: {triangles} triangles do not show the {thing}"
        ))
    })?;
    assert_eq!(surface.triangles.len(), triangles, "exact");
    Ok(mesh_of(surface))
}

/// Adds the panels in as many triangles as are left of `patches`.
///
/// # Errors
/// Fewer patches than the things and the coarsest panels need.
pub(super) fn add_panels(
    assembly: &mut Assembly,
    panels: &[Panel],
    materials: &[u32],
    patches: usize,
) -> Result<()> {
    let things = assembly.scene.triangles.len();
    let least = things + panels::least_triangles(panels);
    if patches < least {
        return Err(Error::Usage(format!(
            "{}: {patches} patches are too few: the things take {things}, and with the coarsest table it is {least}",
            assembly.scene.name
        )));
    }
    let mut mesh = Mesh::default();
    for (corners, material) in panels::triangles(panels, patches - things) {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push(MeshTriangle {
            corners: [first, first + 1, first + 2],
            uv: Some(box_projection(corners)),
            material,
        });
    }
    assembly.add_mesh(&mesh, materials)?;
    assert_eq!(
        assembly.scene.triangles.len(),
        patches,
        "every patch is there, and no other"
    );
    Ok(())
}
