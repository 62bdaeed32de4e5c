//! A court in the evening sun: raking light on a brick wall, an arched door, a bench, jars.

mod entrance;
mod masonry;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use self::entrance::OPENING;
use self::masonry::{BASES, EAST, PLINTH, TOP};
use super::masonry_maps::{self, BRICKWORK, Maps, PAVING, PLANKS, PLASTERING, STONE};
use super::stage::{self, diffuse, even_share};
use super::{solid, splitting};
use crate::error::{Error, Result};
use crate::scene::assemble::{Assembly, Mesh};
use crate::scene::sky::{Dome, Gradation, Sky, SunAngles};
use crate::scene::{Camera, Lights, LoadOptions, Material, Scene, Sun, check};

const NAME: &str = "brick-court";
const PATCHES: usize = 60_000;
/// With fewer the jars lose their shape.
const LEAST_PATCHES: usize = 6_000;
/// Of the large jar, and of the small one.
const JAR_SHARES: [f64; 2] = [0.06, 0.04];

// The materials. Those that are pictured have the size of their tiles in `TILES`.
const BRICK: u32 = 0;
const PAVEMENT: u32 = 1;
const LIMESTONE: u32 = 2;
const PLASTER: u32 = 3;
const DOOR: u32 = 4;
const TERRACOTTA: u32 = 5;
const TILES: [DVec2; 6] = [BRICKWORK, PAVING, STONE, PLASTERING, PLANKS, DVec2::ONE];

/// Degrees: the sun's height, and its angle with the brick wall, seen from above.
const SUN_HEIGHT: f64 = 24.0;
const RAKING: f64 = 14.0;
/// W·m⁻²: of a surface that faces the sun, and of the open ground by the sky.
const SUNLIGHT: [f32; 3] = [60.0, 48.0, 34.0];
const SKYLIGHT: [f64; 3] = [6.4, 8.4, 12.2];
/// Number of the clear sky in CIE S 011.
const CLEAR: u32 = 12;

/// Builds the court in exactly as many elements as asked for.
///
/// # Errors
/// Too few patches; a statue, which this scene has no place for.
pub(super) fn build(options: &LoadOptions) -> Result<Scene> {
    if options.statue.is_some() {
        return Err(Error::Usage(format!(
            "{NAME}: there is no statue in it to replace"
        )));
    }
    let patches = stage::planned(NAME, options, PATCHES, LEAST_PATCHES)?;
    let mut jars =
        JAR_SHARES.map(|share| solid::revolve(&jar_profile(), even_share(patches, share)));
    let mut left = patches;
    for (jar, ((at, _, height), size)) in jars.iter_mut().zip(BASES.into_iter().zip([0.92, 0.50])) {
        for p in &mut jar.positions {
            *p *= size;
        }
        stage::stand(jar, DVec3::new(at.x, height + 1e-3, at.y));
        stage::cover(jar, TERRACOTTA, 1.0);
        left -= stage::count(jar);
    }
    let mut court = masonry::mesh();
    let creases = Creases::of(&court);
    splitting::split(&mut court, left, |p| creases.size(p));
    lay_maps(&mut court);

    let mut assembly = Assembly::new(NAME.into(), None);
    let materials = assembly.add_materials(&materials()?);
    assembly.add_mesh(&court.named("court"), &materials)?;
    for jar in jars {
        assembly.add_mesh(&jar.named("jar"), &materials)?;
    }
    let scene = &mut assembly.scene;
    scene.lights = lights();
    scene.cameras.push(Camera {
        name: "front".into(),
        position: DVec3::new(-1.40, 1.25, 4.35),
        look_at: DVec3::new(0.38, 1.20, 0.0),
        up: DVec3::Y,
        fov_y: 40.0,
    });
    assert_eq!(
        scene.triangles.len(),
        patches,
        "every patch is there, and no other"
    );
    check::finish(assembly.into_scene(), &options.import)
}

fn materials() -> Result<Vec<Material>> {
    let pictured = |name: &str, maps: Maps| Material {
        map_kd: Some(Arc::new(maps.colours)),
        map_height: Some(Arc::new(maps.heights)),
        height_scale: maps.height_scale,
        ..diffuse(name, [1.0; 3])
    };
    let stone = Arc::new(masonry_maps::stone()?);
    Ok(vec![
        pictured("brick", masonry_maps::brickwork([1024, 512])?),
        pictured("paving", masonry_maps::paving()?),
        Material {
            map_kd: Some(stone),
            ..diffuse("limestone", [0.64, 0.58, 0.48])
        },
        Material {
            map_kd: Some(Arc::new(masonry_maps::plaster()?)),
            ..diffuse("plaster", [0.60, 0.50, 0.38])
        },
        pictured("door", masonry_maps::planks()?),
        diffuse("terracotta", [0.50, 0.22, 0.12]),
    ])
}

/// A low sun from the left, and a clear sky.
fn lights() -> Lights {
    let north = DVec3::NEG_Z;
    let angles = SunAngles {
        height: SUN_HEIGHT,
        azimuth: 270.0 - RAKING,
    };
    let towards = angles.direction(DVec3::Y, north);
    let Some(gradation) = Gradation::cie(CLEAR, DVec3::Y, towards) else {
        unreachable!("the clear sky is finite");
    };
    let mut sky = Sky {
        up: DVec3::Y,
        north,
        scale: [1.0; 3],
        dome: Dome::Gradation(gradation),
    };
    let unscaled = sky.horizontal();
    sky.scale = std::array::from_fn(|c| (SKYLIGHT[c] / unscaled[c]) as f32);
    Lights {
        points: Vec::new(),
        suns: vec![Sun {
            name: "sun".into(),
            towards,
            irradiance: SUNLIGHT,
            angle: 0.53,
        }],
        sky: Some(sky),
    }
}

/// An oil jar of one metre, (radius, height): foot, belly, shoulder, neck and lip, then down
/// inside.
fn jar_profile() -> Vec<DVec2> {
    let outside = [
        [0.0, 0.0],
        [0.150, 0.0],
        [0.160, 0.012],
        [0.158, 0.035],
        [0.170, 0.080],
        [0.205, 0.180],
        [0.240, 0.300],
        [0.264, 0.420],
        [0.275, 0.540],
        [0.272, 0.640],
        [0.255, 0.730],
        [0.222, 0.805],
        [0.185, 0.855],
        [0.163, 0.885],
        [0.158, 0.910],
        [0.164, 0.935],
        [0.188, 0.955],
        [0.196, 0.972],
        [0.192, 0.990],
        [0.178, 1.0],
        [0.160, 0.992],
        [0.142, 0.960],
        [0.136, 0.900],
        [0.175, 0.840],
        [0.225, 0.760],
        [0.250, 0.640],
        [0.240, 0.440],
        [0.180, 0.200],
        [0.120, 0.060],
        [0.0, 0.050],
    ];
    outside.map(DVec2::from).to_vec()
}

/// The edges at which surfaces end or meet at an angle: there light changes fast.
struct Creases {
    ends: Vec<[DVec3; 2]>,
}

impl Creases {
    fn of(mesh: &Mesh) -> Self {
        let normal = |t: usize| {
            let [a, b, c] = mesh.triangles[t]
                .corners
                .map(|v| mesh.positions[v as usize]);
            (b - a).cross(c - a).normalize()
        };
        let mut beside = std::collections::BTreeMap::new();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.corners;
            for edge in [[a, b], [b, c], [c, a]] {
                beside.insert(edge, index);
            }
        }
        let is_crease = |&[a, b]: &[u32; 2], t: usize| match beside.get(&[b, a]) {
            Some(&other) => a < b && normal(t).dot(normal(other)) < 0.9,
            None => true,
        };
        let edges = beside.iter().filter(|(edge, t)| is_crease(edge, **t));
        let ends = edges.map(|(edge, _)| edge.map(|v| mesh.positions[v as usize]));
        Self {
            ends: ends.collect(),
        }
    }

    /// How long edges about a place are, beside those of other places: short at creases, long
    /// where nobody looks.
    fn size(&self, p: DVec3) -> f64 {
        let distance = |[a, b]: &[DVec3; 2]| {
            let along = *b - *a;
            let t = (p - *a).dot(along) / along.length_squared();
            p.distance_squared(*a + t.clamp(0.0, 1.0) * along)
        };
        let nearest = self.ends.iter().map(distance).fold(f64::INFINITY, f64::min);
        let seen = [DVec3::new(-2.9, 0.0, -0.3), DVec3::new(EAST, TOP, 2.0)];
        let away = p.distance(p.clamp(seen[0], seen[1]));
        let at_crease = (0.35 + nearest.sqrt() / 0.5).min(1.0);
        at_crease * (1.0 + 4.0 * away)
    }
}

/// Texture coordinates of what is plane. Rows of tiles are shifted against each other by whole
/// bricks, so that no pattern shows.
fn lay_maps(court: &mut Mesh) {
    for triangle in &mut court.triangles {
        let corners = triangle.corners.map(|v| court.positions[v as usize]);
        let tile = TILES[triangle.material as usize];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let size = normal.abs();
        let place = |p: DVec3| {
            let across = if size.y >= size.x.max(size.z) {
                DVec2::new(p.x, -p.z)
            } else if size.x >= size.z {
                DVec2::new(-normal.x.signum() * p.z, p.y)
            } else {
                DVec2::new(normal.z.signum() * p.x, p.y)
            };
            let start = match triangle.material {
                BRICK => DVec2::new(0.0, PLINTH),
                DOOR => DVec2::new(OPENING.centre.x - OPENING.radius, 0.0),
                _ => DVec2::ZERO,
            };
            (across - start) / tile
        };
        let mut uv = corners.map(place);
        let middle = (uv[0] + uv[1] + uv[2]) / 3.0;
        let row = middle.y.floor();
        let shift = match triangle.material {
            BRICK => 0.375 * row,
            PAVEMENT => 0.25 * row,
            _ => 0.0,
        };
        let whole = uv[0].min(uv[1]).min(uv[2]) + DVec2::X * shift;
        for corner in &mut uv {
            *corner += DVec2::X * shift - whole.floor();
        }
        triangle.uv = Some(uv.map(|uv| uv.as_vec2().to_array()));
    }
}
