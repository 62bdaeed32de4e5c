//! Tables of lights: units, places, skies.

use std::f64::consts::PI;
use std::fs;

use glam::DVec3;
use image::{ImageBuffer, Rgb};
use mesolux::scene::{LoadOptions, PointLight, Sun, load};
use tempfile::TempDir;

use super::{good, luminance, near, read_in, wide};

fn point(keys: &str) -> PointLight {
    let table = format!("[[point_light]]\nposition = [0, 2, 0]\n{keys}");
    good(&table).lights.points.remove(0)
}

fn sun(keys: &str) -> Sun {
    good(&format!("[[sun]]\n{keys}")).lights.suns.remove(0)
}

fn sky(keys: &str) -> mesolux::scene::sky::Sky {
    good(&format!("[sky]\n{keys}")).lights.sky.unwrap()
}

/// Rounding of f32.
const EXACT: f64 = 1e-6;

#[test]
fn points_in_every_unit() {
    assert_eq!(point("intensity = [1, 2, 3]").intensity, [1.0, 2.0, 3.0]);
    assert_eq!(point("intensity = 2.5").intensity, [2.5; 3]);
    near(f64::from(point("candela = 683").intensity[2]), 1.0, EXACT);
    near(
        f64::from(point("lumens = 683").intensity[0]),
        1.0 / (4.0 * PI),
        EXACT,
    );
    near(
        f64::from(point("watts = 10").intensity[1]),
        10.0 / (4.0 * PI),
        EXACT,
    );
    // A colour keeps the luminous flux.
    let red = point("lumens = 800\ncolor = [2, 0, 0]").intensity;
    assert_eq!((red[1], red[2]), (0.0, 0.0));
    let white = point("lumens = 800").intensity;
    near(luminance(wide(red)), luminance(wide(white)), EXACT);
    let warm = point("lumens = 800\nkelvin = 2700").intensity;
    near(luminance(wide(warm)), luminance(wide(white)), EXACT);
    assert!(
        warm[0] > warm[1] && warm[1] > warm[2] && warm[2] > 0.0,
        "{warm:?}"
    );
}

#[test]
fn spots_shine_along_their_axis() {
    let spot = point("candela = 683\nspot = { inner = 20, outer = 30 }\naxis = [0, 0, -2]");
    near(spot.share(DVec3::new(0.0, 0.3, -1.0)), 1.0, EXACT);
    assert_eq!(spot.share(DVec3::new(0.0, 0.6, -1.0)), 0.0);
    let share = spot.share(DVec3::new(0.0, 25_f64.to_radians().tan(), -1.0));
    let (a, b) = (20_f64.to_radians().cos(), 30_f64.to_radians().cos());
    let exact = ((25_f64.to_radians().cos() - b) / (a - b)).powi(2);
    // At a row of the web.
    near(share, exact, EXACT);
    let watts = point("watts = 7\nspot = { outer = 60 }");
    near(
        f64::from(watts.intensity[0]) * watts.solid_angle(),
        7.0,
        EXACT,
    );
    assert_eq!(watts.beam.unwrap().axis, -DVec3::Y);
}

#[test]
fn suns_by_direction_angles_and_time() {
    let by_direction = sun("towards = [0, 2, 0]\nirradiance = [3, 2, 1]");
    assert_eq!(
        (
            by_direction.towards,
            by_direction.irradiance,
            by_direction.angle
        ),
        (DVec3::Y, [3.0, 2.0, 1.0], 0.53)
    );
    // East is x where −z is north.
    let by_angles = sun("elevation = 30\nazimuth = 90\nlux = 68300\nangle = 0");
    let exact = DVec3::new(30_f64.to_radians().cos(), 0.5, 0.0);
    assert!(by_angles.towards.distance(exact) < 1e-12);
    near(f64::from(by_angles.irradiance[1]), 100.0, EXACT);
    assert_eq!(by_angles.angle, 0.0);
    let z_up = sun("elevation = 0\nazimuth = 0\nlux = 1\nup = [0, 0, 1]\nnorth = [0, 1, 0]");
    assert!(z_up.towards.distance(DVec3::Y) < 1e-12);
    // The example of the report on NREL's algorithm.
    let by_time = sun(
        "latitude = 39.742476\nlongitude = -105.1786\ntime = 2003-10-17T12:30:30-07:00\nlux = 1",
    );
    let height = by_time.towards.y.asin().to_degrees();
    let azimuth = f64::atan2(by_time.towards.x, -by_time.towards.z).to_degrees();
    // Measured: 0.0003° and 0.0012°.
    assert!((height - 39.872_046).abs() < 0.003, "{height}");
    assert!(
        (azimuth.rem_euclid(360.0) - 194.340_24).abs() < 0.003,
        "{azimuth}"
    );
}

#[test]
fn skies_have_the_light_that_is_asked_for() {
    for (model, sun) in [
        ("'uniform'", ""),
        ("'cie overcast'", ""),
        ("'traditional overcast'", ""),
        (
            "'cie intermediate'",
            "sun = { elevation = 35, azimuth = 140 }",
        ),
        ("'cie clear'", "sun = { elevation = 35, azimuth = 140 }"),
        ("15", "sun = { towards = [1, 0.2, 0] }"),
        ("16", ""),
    ] {
        let lit = sky(&format!("model = {model}\nlux = 6830\n{sun}"));
        // By its own quadrature, which the unit tests check in other coordinates.
        near(lit.horizontal()[0], 10.0, EXACT);
        let zenith = sky(&format!("model = {model}\nradiance = [1, 2, 3]\n{sun}"));
        assert!(
            zenith
                .radiance(DVec3::Y)
                .distance(DVec3::new(1.0, 2.0, 3.0))
                < 1e-6
        );
        let zenith = sky(&format!("model = {model}\nluminance = 1366\n{sun}"));
        assert!(zenith.radiance(DVec3::Y).distance(DVec3::splat(2.0)) < 1e-6);
        assert_eq!(zenith.radiance(DVec3::new(0.6, -0.8, 0.0)), DVec3::ZERO);
    }
    let blue = sky("model = 'uniform'\nirradiance = 5\nkelvin = 12000");
    near(luminance(blue.horizontal()), 5.0, EXACT);
    assert!(blue.scale[2] > blue.scale[0]);
}

#[test]
fn a_sun_goes_with_a_clear_sky_and_with_perez() {
    let scene = good(
        "[sky]\nmodel = 'cie clear'\nlux = 12000\nup = [0, 0, 1]\nnorth = [0, 1, 0]\n\
         sun = { elevation = 90, azimuth = 0, lux = 68300, angle = 1 }",
    );
    let [sun] = scene.lights.suns.as_slice() else {
        panic!("one sun")
    };
    assert_eq!((sun.name.as_str(), sun.angle), ("sun", 1.0));
    assert!(sun.towards.distance(DVec3::Z) < 1e-12);
    near(f64::from(sun.irradiance[0]), 100.0, EXACT);
    let scene = good(
        "[sky]\nmodel = 'perez'\ndirect = 700\ndiffuse = 90\n\
         sun = { elevation = 40, azimuth = 200 }\n[[sun]]\ntowards = [0, 1, 0]\nlux = 1",
    );
    let sky = scene.lights.sky.unwrap();
    near(sky.horizontal()[1], 90.0, EXACT);
    let names: Vec<_> = scene
        .lights
        .suns
        .iter()
        .map(|sun| sun.name.as_str())
        .collect();
    assert_eq!(names, ["sun", "sun 1"]);
    assert_eq!(scene.lights.suns[0].irradiance, [700.0; 3]);
    // Brightest towards the sun.
    let towards = scene.lights.suns[0].towards;
    assert!(sky.radiance(towards).x > 3.0 * sky.radiance(DVec3::Y).x);
}

#[test]
fn pictures_stand_as_in_blender() {
    let dir = TempDir::new().unwrap();
    // Above the horizon red to the left of the middle, green in the middle, blue to the right.
    let texel = |x: u32, y: u32| match (x / 8, y < 16) {
        (1 | 2, true) => Rgb([1.0_f32, 0.0, 0.0]),
        (3 | 4, true) => Rgb([0.0, 2.0, 0.0]),
        (5 | 6, true) => Rgb([0.0, 0.0, 4.0]),
        _ => Rgb([0.25, 0.25, 0.25]),
    };
    let picture = ImageBuffer::from_fn(64, 32, texel);
    for ending in ["hdr", "exr"] {
        picture
            .save(dir.path().join(format!("sky.{ending}")))
            .unwrap();
        let table = format!("[sky]\npicture = 'sky.{ending}'\n");
        let sky = read_in(dir.path(), &table).unwrap().lights.sky.unwrap();
        // The middle is at x; seen from within, what lies right of x is z, where y is up.
        let up = |x: f64, z: f64| sky.radiance(DVec3::new(x, 0.5, z).normalize());
        assert!(
            up(1.0, 0.0).distance(DVec3::new(0.0, 2.0, 0.0)) < 0.01,
            "{}",
            up(1.0, 0.0)
        );
        assert!(up(0.0, 1.0).distance(DVec3::new(0.0, 0.0, 4.0)) < 0.03);
        assert!(up(0.0, -1.0).distance(DVec3::new(1.0, 0.0, 0.0)) < 0.01);
        assert!(sky.radiance(-DVec3::Y).distance(DVec3::splat(0.25)) < 0.01);
        let turned = format!("{table}azimuth = 180\nscale = 2\n");
        let turned = read_in(dir.path(), &turned).unwrap().lights.sky.unwrap();
        let south = turned.radiance(DVec3::new(0.0, 0.5, 1.0).normalize());
        assert!(south.distance(DVec3::new(0.0, 4.0, 0.0)) < 0.02, "{south}");
        let lit = format!("{table}lux = 683\n");
        let lit = read_in(dir.path(), &lit).unwrap().lights.sky.unwrap();
        near(luminance(lit.horizontal()), 1.0, EXACT);
    }
}

#[test]
fn lamps_of_surface_have_their_power() {
    let scene = good(
        "[[sphere_lamp]]\nname = 'globe'\nposition = [0, 2, 0]\nradius = 0.1\nlumens = 800\n\
         kelvin = 2700\n[[disk_lamp]]\nposition = [2, 2, 0]\nradius = 0.3\nwatts = 5\n\
         axis = [0, 0, 1]\n[[disk_lamp]]\nposition = [0, 3, 1]\nradius = 0.2\nradiance = [1, 2, 3]\n",
    );
    let flux = |name: &str| {
        let material = scene.materials.iter().position(|m| m.name == name).unwrap();
        let ke = wide(scene.materials[material].ke);
        let own = scene
            .triangles
            .iter()
            .filter(|t| t.material as usize == material);
        let normals: Vec<DVec3> = own
            .map(|t| {
                let [a, b, c] = scene.corners(t);
                0.5 * (b - a).cross(c - a)
            })
            .collect();
        let area: f64 = normals.iter().map(|n| n.length()).sum();
        (ke.map(|c| PI * area * c), area, normals)
    };
    let (globe, area, normals) = flux("globe");
    near(luminance(globe), 800.0 / 683.0, EXACT);
    assert!(globe[0] > globe[2] && normals.len() == 320);
    near(area, 4.0 * PI * 0.01, 0.03);
    let (disk, area, normals) = flux("disk lamp 1");
    near(disk[1], 5.0, EXACT);
    near(area, PI * 0.09, 0.01);
    assert!(normals.iter().all(|n| n.z > 0.0), "it faces its axis");
    assert_eq!(normals.len(), 108);
    let (_, _, down) = flux("disk lamp 2");
    assert!(down.iter().all(|n| n.y < 0.0));
    assert_eq!(scene.materials.last().unwrap().ke, [1.0, 2.0, 3.0]);
    assert_eq!(scene.dropped_degenerate + scene.dropped_duplicates, 0);
}

/// A triangle that faces up, with a spot and a sun that shine along −z of the file.
const GLTF: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
    "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": {"KHR_lights_punctual": {"lights": [
        {"type": "spot", "intensity": 683.0, "spot": {}}, {"type": "directional"}
    ]}},
    "nodes": [
        {"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 1, 0]},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}}
    ],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "buffers": [{"byteLength": 36, "uri": "a.bin"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 0, 1]}]
}"#;

#[test]
fn placements_turn_the_lights_of_a_file_and_not_those_of_the_scene() {
    let dir = TempDir::new().unwrap();
    let corners = [[0.0_f32, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    let bytes: Vec<u8> = (corners.as_flattened().iter())
        .flat_map(|c| c.to_le_bytes())
        .collect();
    fs::write(dir.path().join("a.bin"), bytes).unwrap();
    fs::write(dir.path().join("a.gltf"), GLTF).unwrap();
    let of = |placement: &str| {
        let table = format!(
            "[[mesh]]\nfile = 'a.gltf'\nsides = 'as given'\n{placement}\n\
             [[point_light]]\nname = 'own'\nposition = [0, 2, 0]\nspot = {{ outer = 30 }}\ncandela = 1\n"
        );
        read_in(dir.path(), &table).unwrap().lights
    };
    // By 90° about y, z becomes x; a mirror of x changes nothing of z.
    for (placement, back) in [
        ("", DVec3::Z),
        ("rotate = [0, 90, 0]\nscale = 2", DVec3::X),
        ("scale = [-1, 1, 1]", DVec3::Z),
        ("scale = [1, 1, -3]", -DVec3::Z),
    ] {
        let lights = of(placement);
        let [spot, own] = lights.points.as_slice() else {
            panic!("two lights")
        };
        let axis = spot.beam.as_ref().unwrap().axis;
        assert!(axis.distance(-back) < 1e-9, "{placement}: {axis}");
        let towards = lights.suns[0].towards;
        assert!(towards.distance(back) < 1e-9, "{placement}: {towards}");
        assert_eq!(own.position, DVec3::new(0.0, 2.0, 0.0));
        assert_eq!(own.beam.as_ref().unwrap().axis, -DVec3::Y);
    }
}

#[test]
fn sides_are_found_by_suns_skies_and_beams() {
    let dir = TempDir::new().unwrap();
    let floor = "v -4 0 -4\nv -4 0 4\nv 4 0 4\nv 4 0 -4\nf 4 3 2 1\n";
    fs::write(dir.path().join("under.obj"), floor).unwrap();
    for (light, is_lit_from_above) in [
        ("[[sun]]\nelevation = 40\nazimuth = 10\nlux = 1000", true),
        ("[[sun]]\nelevation = -40\nazimuth = 10\nlux = 1000", false),
        ("[sky]\nmodel = 'cie overcast'\nlux = 1000", true),
        (
            "[[point_light]]\nposition = [0, 2, 0]\ncandela = 1\nspot = { outer = 20 }",
            true,
        ),
        // It shines up, away from the square.
        (
            "[[point_light]]\nposition = [0, 2, 0]\ncandela = 1\nspot = { outer = 20 }\n\
             axis = [0, 1, 0]",
            false,
        ),
    ] {
        let path = dir.path().join("b.toml");
        fs::write(&path, format!("[[mesh]]\nfile = 'under.obj'\n{light}\n")).unwrap();
        let scene = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
        let [a, b, c] = scene.corners(&scene.triangles[0]);
        let faces_up = (b - a).cross(c - a).y > 0.0;
        assert_eq!(faces_up, is_lit_from_above, "{light}: {:?}", scene.notes);
    }
}
