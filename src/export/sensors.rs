//! Light at sensors: points with a normal, in the files of Radiance's users.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use glam::{DVec3, Vec3};

use super::text_points::{Row, read_rows};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::even_light::luminance;
use crate::solver::{LightAt, Place};

/// Lumens of a watt as Radiance counts them (its `WHTEFFICACY`).
pub const RADIANCE_EFFICACY: f64 = 179.0;

/// How irradiance is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorFile {
    /// A header; position, normal, lux, W·m⁻² by colour; direct and indirect.
    Csv,
    /// Red, green and blue irradiance, W·m⁻², a line each, as `rtrace -I -h` writes them.
    Dat,
    /// Illuminance, lux, a line each, as in a matrix of one time.
    Ill,
}

impl SensorFile {
    /// By the extension of a file's name.
    ///
    /// # Errors
    /// Another extension.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "dat" => Ok(Self::Dat),
            "ill" => Ok(Self::Ill),
            _ => Err(Error::Usage(format!(
                "{}: light at sensors is written as .csv, .dat or .ill",
                path.display()
            ))),
        }
    }
}

/// Reads Radiance's points: `x y z nx ny nz` a line, scene units. Empty lines and those that begin
/// with `#` are skipped; normals may have any length.
///
/// # Errors
/// A file that cannot be read or has no point; a line that is not six finite numbers; a normal of
/// no length.
pub fn read_points(path: &Path) -> Result<Vec<Place>> {
    let place = |row: Row<'_>| {
        let &[x, y, z, nx, ny, nz] = row.numbers else {
            return Err(row.wrong("is not six numbers: x y z nx ny nz"));
        };
        let normal = DVec3::new(nx, ny, nz).try_normalize();
        Ok(Place {
            position: DVec3::new(x, y, z),
            normal: normal.ok_or_else(|| row.wrong("has a normal of no length"))?,
        })
    };
    read_rows(path, "x y z nx ny nz", place)
}

/// A grid of sensors on the surfaces of one name.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorGrid {
    /// Of a mesh or a material.
    pub name: String,
    /// From one sensor to the next, scene units.
    pub spacing: f64,
    /// Above the surface, scene units.
    pub height: f64,
}

/// Places of a grid: those of a lattice along the two axes that a triangle faces least, above each
/// triangle of that name.
///
/// # Errors
/// A name that is of no mesh and no material; a grid without a sensor, or with more than `most`.
pub fn on_grid(scene: &Scene, grid: &SensorGrid, most: usize) -> Result<Vec<Place>> {
    let on_input = scene.on_input();
    let is_named = |t: usize| {
        let material = scene.triangles[t].material as usize;
        scene.materials[material].name == grid.name
            || scene.mesh_name(on_input[t].triangle) == Some(&grid.name)
    };
    let named: Vec<usize> = (0..scene.triangles.len())
        .filter(|&t| is_named(t))
        .collect();
    if named.is_empty() {
        return Err(Error::Usage(format!(
            "scene {} has no mesh and no material \"{}\"",
            scene.name, grid.name
        )));
    }
    let mut places = Vec::new();
    for t in named {
        let corners = scene.corners(&scene.triangles[t]);
        let (low, high) = (corners[1].min(corners[2]), corners[1].max(corners[2]));
        let size = (corners[0].max(high) - corners[0].min(low)) / grid.spacing;
        // A triangle fills half of its box at most where that is plane, and little of it aslant.
        let lattice = size.max_element() * (size.element_sum() - size.max_element());
        if lattice <= LATTICE * most as f64 {
            on_triangle(corners, grid, &mut places);
        }
        if lattice > LATTICE * most as f64 || places.len() > most {
            return Err(Error::Usage(format!(
                "a grid of {} on \"{}\" has more than {most} sensors",
                grid.spacing, grid.name
            )));
        }
    }
    match places.is_empty() {
        false => Ok(places),
        true => Err(Error::Usage(format!(
            "\"{}\" is too small for a grid of {}",
            grid.name, grid.spacing
        ))),
    }
}

/// Places of a lattice that are looked through for a triangle, over the most sensors.
const LATTICE: f64 = 16.0;

fn on_triangle([a, b, c]: [DVec3; 3], grid: &SensorGrid, places: &mut Vec<Place>) {
    let Some(normal) = (b - a).cross(c - a).try_normalize() else {
        return;
    };
    let facing = normal.abs();
    let across = match facing.max_element() {
        most if facing.y == most => [2, 0],
        most if facing.x == most => [1, 2],
        _ => [0, 1],
    };
    let flat = |p: DVec3| across.map(|axis| p[axis]);
    let [pa, pb, pc] = [a, b, c].map(flat);
    let area = cross(pa, pb, pc);
    let [low, high] = [f64::min, f64::max]
        .map(|of| [0, 1].map(|k| of(of(pa[k], pb[k]), pc[k]) / grid.spacing - 0.5));
    for i in low[0].ceil() as i64..=high[0].floor() as i64 {
        for j in low[1].ceil() as i64..=high[1].floor() as i64 {
            let p = [i, j].map(|k| (k as f64 + 0.5) * grid.spacing);
            let weights = [cross(p, pb, pc), cross(pa, p, pc), cross(pa, pb, p)].map(|w| w / area);
            // A place on an edge belongs to one triangle: to that of positive area by a fixed rule.
            let edges = [[pb, pc], [pc, pa], [pa, pb]];
            let inside = weights.iter().zip(edges).all(|(&weight, [from, to])| {
                weight > 0.0 || weight == 0.0 && (from[1], from[0]) < (to[1], to[0])
            });
            if inside {
                let [wa, wb, wc] = weights;
                places.push(Place {
                    position: wa * a + wb * b + wc * c + grid.height * normal,
                    normal,
                });
            }
        }
    }
}

/// Twice the area of a triangle in a plane.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Illuminance, lux, of an irradiance of Rec. 709 colours.
pub fn lux(irradiance: Vec3, lumens_per_watt: f64) -> f64 {
    lumens_per_watt * luminance(irradiance.to_array())
}

/// Writes light at sensors, in their order.
///
/// # Errors
/// A file that cannot be written.
pub fn write_light(
    path: &Path,
    places: &[Place],
    light: &[LightAt],
    lumens_per_watt: f64,
) -> Result<()> {
    let kind = SensorFile::of(path)?;
    write_atomically(path, |out| {
        if kind == SensorFile::Csv {
            out.write_all(HEADER.as_bytes())?;
        }
        for (place, light) in places.iter().zip(light) {
            line(out, kind, place, light, lumens_per_watt)?;
        }
        Ok(())
    })
}

/// Lux, then W·m⁻².
const HEADER: &str = "x,y,z,nx,ny,nz,lux,lux_direct,lux_indirect,\
    red,green,blue,red_direct,green_direct,blue_direct\n";

fn line(
    out: &mut dyn Write,
    kind: SensorFile,
    place: &Place,
    light: &LightAt,
    lumens_per_watt: f64,
) -> io::Result<()> {
    let all = light.direct + light.indirect;
    let [whole, direct, indirect] =
        [all, light.direct, light.indirect].map(|part| lux(part, lumens_per_watt));
    match kind {
        SensorFile::Csv => {
            let mut text = String::new();
            for value in [place.position, place.normal]
                .map(|v| v.to_array())
                .as_flattened()
            {
                let _ = write!(text, "{value},");
            }
            let colours = [all, light.direct].map(|c| c.to_array());
            let colours: Vec<String> = colours
                .as_flattened()
                .iter()
                .map(|c| c.to_string())
                .collect();
            let colours = colours.join(",");
            writeln!(out, "{text}{whole:.6},{direct:.6},{indirect:.6},{colours}")
        }
        SensorFile::Dat => {
            let [r, g, b] = all.to_array();
            writeln!(out, "{r:.6e}\t{g:.6e}\t{b:.6e}")
        }
        SensorFile::Ill => writeln!(out, "{whole:.6}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Shapes;

    #[test]
    fn points_are_read_or_refused_by_their_line() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("room.pts");
        std::fs::write(&path, "# desk\n1 2 3  0 0 2\n\n-1,0.5,1e-3,0,1,0\n").expect("written");
        let places = read_points(&path).expect("two points");
        assert_eq!(places.len(), 2);
        assert_eq!(places[0].normal, DVec3::Z);
        assert_eq!(places[1].position, DVec3::new(-1.0, 0.5, 1e-3));
        for wrong in [
            "1 2 3",
            "1 2 3 0 0 0",
            "1 2 3 0 0 nan",
            "a b c d e f",
            "1 2 3 0 0 1 7",
        ] {
            std::fs::write(&path, format!("0 0 0 0 1 0\n{wrong}\n")).expect("written");
            let error = read_points(&path).expect_err("a bad line").to_string();
            assert!(error.contains("room.pts:2"), "{error}");
        }
        std::fs::write(&path, "# none\n").expect("written");
        assert!(read_points(&path).is_err());
    }

    /// A square of two triangles whose diagonal runs through sensors: none is lost or doubled.
    #[test]
    fn grids_cover_a_surface_once() {
        for (u, v, side) in [
            (DVec3::X, DVec3::Y, DVec3::Z),
            (DVec3::Z, DVec3::X, DVec3::Y),
            (DVec3::Y, DVec3::Z, DVec3::X),
            (DVec3::Y, DVec3::X, -DVec3::Z),
        ] {
            let mut shapes = Shapes::new();
            shapes.quad(DVec3::ZERO, 2.0 * u, 2.0 * v, (3, 3), 0);
            shapes.weld();
            let mut scene = shapes.scene;
            scene.materials[0].name = "floor".into();
            let grid = SensorGrid {
                name: "floor".into(),
                spacing: 0.25,
                height: 0.1,
            };
            let places = on_grid(&scene, &grid, 1000).expect("a grid");
            assert_eq!(places.len(), 64, "{side}");
            assert!(places.iter().all(|p| p.normal.dot(side) > 0.999));
            assert!(
                places
                    .iter()
                    .all(|p| (p.position.dot(side) - 0.1).abs() < 1e-12)
            );
            assert!(on_grid(&scene, &grid, 60).is_err());
            let endless = SensorGrid {
                spacing: 1e-12,
                ..grid
            };
            assert!(on_grid(&scene, &endless, 1000).is_err());
        }
    }
}
