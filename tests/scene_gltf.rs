//! glTF 2.0: what is read of it, and what is refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use mesolux::error::Result;
use mesolux::scene::{
    HeightMap, ImportOptions, LoadOptions, Refinement, Scene, Triangle, displace, load,
};
use serde_json::{Value, json};
use tempfile::TempDir;

fn read(path: &Path) -> Result<Scene> {
    // Sides as in the file, so that each can be looked at.
    let options = LoadOptions {
        import: ImportOptions {
            sides_as_given: true,
            ..ImportOptions::default()
        },
        ..LoadOptions::default()
    };
    load(path.to_str().unwrap(), &options)
}

/// A square of 2 × 2 in the plane z = 0 that faces +z, with coordinates from the upper left corner.
const POSITIONS: [[f32; 3]; 4] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
];
const UV: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

/// Its data: positions, texture coordinates, indices.
fn data() -> Vec<u8> {
    let floats = POSITIONS.as_flattened().iter().chain(UV.as_flattened());
    let mut bytes: Vec<u8> = floats.flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend(INDICES.iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

/// The square as a file, which emits.
fn square() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": [
            "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_texture_transform"
        ],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "mode": 4,
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0
        }]}],
        "materials": [{
            "name": "paint",
            "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 1.0], "metallicFactor": 0},
            "emissiveFactor": [0.5, 0.25, 1.0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}}
        }],
        "buffers": [{"uri": "a.bin", "byteLength": 92}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 12}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ]
    })
}

fn write(dir: &TempDir, file: &Value) -> PathBuf {
    fs::write(dir.path().join("a.bin"), data()).unwrap();
    let path = dir.path().join("a.gltf");
    fs::write(&path, file.to_string()).unwrap();
    path
}

fn read_changed(change: impl Fn(&mut Value)) -> Result<Scene> {
    let dir = tempfile::tempdir().unwrap();
    let mut file = square();
    change(&mut file);
    read(&write(&dir, &file))
}

fn normal(scene: &Scene, t: usize) -> DVec3 {
    let [a, b, c] = scene.corners(&scene.triangles[t]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn a_square_is_read_as_it_is() {
    let scene = read_changed(|_| {}).unwrap();
    assert_eq!(scene.triangles.len(), 2);
    let material = &scene.materials[0];
    assert_eq!(material.name, "paint");
    assert_eq!(material.kd, [0.25, 0.5, 0.75]);
    assert_eq!(material.ke, [2.0, 1.0, 4.0]);
    assert_eq!(scene.materials.len(), 1);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let corners = scene.corners(&scene.triangles[0]);
    assert_eq!(corners[2], DVec3::new(1.0, 1.0, 0.0));
    // v up.
    assert_eq!(scene.triangles[0].uv, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
    assert!(normal(&scene, 0).z > 0.99);
}

#[test]
fn the_binary_form_holds_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let text = read(&write(&dir, &square())).unwrap();
    let mut file = square();
    file["buffers"][0].as_object_mut().unwrap().remove("uri");
    let mut json = file.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = data();
    let mut glb = b"glTF".to_vec();
    let length = 12 + 8 + json.len() + 8 + binary.len();
    glb.extend(
        [2, length as u32, json.len() as u32]
            .iter()
            .flat_map(|w| w.to_le_bytes()),
    );
    glb.extend(b"JSON");
    glb.extend(&json);
    glb.extend((binary.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(&binary);
    let path = dir.path().join("a.glb");
    fs::write(&path, &glb).unwrap();
    assert_eq!(read(&path).unwrap().hash(), text.hash());
    // Cut anywhere, it is refused.
    for length in 0..glb.len() {
        fs::write(&path, &glb[..length]).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains("a.glb") && !error.contains('\n'), "{error}");
    }
}

#[test]
fn nodes_place_meshes_lights_and_cameras() {
    let scene = read_changed(|file| {
        file["extensions"] = json!({"KHR_lights_punctual": {"lights": [
            {"type": "point", "color": [1.0, 0.5, 0.25], "intensity": 683.0},
            {"type": "spot", "name": "beam", "spot": {}}, {"type": "directional"}
        ]}});
        file["cameras"] =
            json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]);
        let light = |k: u32| json!({"KHR_lights_punctual": {"light": k}});
        file["nodes"] = json!([
            {"translation": [0, 0, 5], "scale": [2, 1, 1], "children": [1, 2, 3, 4]},
            {"mesh": 0, "rotation": [0, 0.707_106_77, 0, 0.707_106_77]},
            {"name": "bulb", "translation": [1, 2, 3], "extensions": light(0)},
            {"extensions": light(1), "children": [5]},
            {"extensions": light(2)},
            {"camera": 0, "name": "eye"}
        ]);
    })
    .unwrap();
    // Turned by 90° about y, it faces +x; twice as long along x is as it was along z.
    assert!(normal(&scene, 0).x > 0.99);
    let [low, high] = [scene.bounds().0, scene.bounds().1];
    assert!(low.distance(DVec3::new(0.0, -1.0, 4.0)) < 1e-6, "{low}");
    assert!(high.distance(DVec3::new(0.0, 1.0, 6.0)) < 1e-6, "{high}");
    let light = &scene.lights.points[0];
    assert_eq!(
        (light.name.as_str(), light.intensity),
        ("bulb", [1.0, 0.5, 0.25])
    );
    assert!(light.position.distance(DVec3::new(2.0, 2.0, 8.0)) < 1e-6);
    let camera = &scene.cameras[0];
    assert_eq!(
        (camera.name.as_str(), camera.position),
        ("eye", DVec3::new(0.0, 0.0, 5.0))
    );
    assert!(
        (camera.look_at - camera.position)
            .normalize()
            .distance(-DVec3::Z)
            < 1e-6
    );
    assert!((camera.fov_y - 0.5_f64.to_degrees()).abs() < 1e-5);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // Lights shine along −z of their nodes; the spot's cone is 45° wide where nothing is said.
    let spot = &scene.lights.points[1];
    assert_eq!(spot.name, "beam");
    assert!(spot.share(-DVec3::Z) > 0.999 && spot.share(DVec3::new(1.1, 0.0, -1.0)) == 0.0);
    // Measured: 1e-5.
    let half = spot.share(DVec3::new(0.5, 0.0, -1.0));
    let cosine = 1.0 / 1.25_f64.sqrt();
    let edge = 0.5_f64.sqrt();
    assert!(
        (half - ((cosine - edge) / (1.0 - edge)).powi(2)).abs() < 1e-3,
        "{half}"
    );
    let sun = &scene.lights.suns[0];
    assert_eq!((sun.towards, sun.angle), (DVec3::Z, 0.0));
    assert!((sun.irradiance[0] * 683.0 - 1.0).abs() < 1e-6);

    let mirrored = read_changed(|file| file["nodes"][0] = json!({"mesh": 0, "scale": [-1, 1, 1]}));
    assert!(normal(&mirrored.unwrap(), 0).z > 0.99);
}

#[test]
fn strips_and_fans_face_the_same_way() {
    for (mode, indices) in [(5, [0_u16, 1, 3, 2]), (6, [0, 1, 2, 3])] {
        let dir = tempfile::tempdir().unwrap();
        let mut file = square();
        file["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        file["accessors"][2]["count"] = json!(4);
        let path = write(&dir, &file);
        let mut bytes = data();
        bytes.truncate(80);
        bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        bytes.extend([0; 4]);
        fs::write(dir.path().join("a.bin"), bytes).unwrap();
        let scene = read(&path).unwrap();
        assert_eq!(scene.triangles.len(), 2);
        assert!((0..2).all(|t| normal(&scene, t).z > 0.99), "mode {mode}");
    }
}

/// The square with two sides and no emission, and point lights at these heights before it.
fn two_sided(file: &mut Value, heights: &[f32]) {
    file["materials"][0]["doubleSided"] = json!(true);
    file["materials"][0]["emissiveFactor"] = json!([0, 0, 0]);
    file["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 683.0}]}});
    let light = json!({"KHR_lights_punctual": {"light": 0}});
    let lights = heights.iter();
    let lights = lights.map(|z| json!({"translation": [0, 0, z], "extensions": light}));
    file["nodes"].as_array_mut().unwrap().extend(lights);
    let nodes = file["nodes"].as_array().unwrap().len();
    file["scenes"][0]["nodes"] = json!((0..nodes).collect::<Vec<_>>());
}

#[test]
fn a_surface_of_two_sides_has_a_back_unless_it_is_closed() {
    let scene = read_changed(|file| two_sided(file, &[1.0])).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    assert!(normal(&scene, 0).z > 0.99 && normal(&scene, 2).z < -0.99);
    // Two squares back to back with all edges in common enclose nothing, and are closed.
    let closed = read_changed(|file| {
        file["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "rotation": [0, 1, 0, 0]}]);
        two_sided(file, &[1.0]);
    });
    assert_eq!(closed.unwrap().triangles.len(), 4);
    // A lamp is a front.
    let lamp = read_changed(|file| file["materials"][0]["doubleSided"] = json!(true));
    assert_eq!(lamp.unwrap().triangles.len(), 2);
}

/// Where sides are found, a side that no light falls on is left out.
#[test]
fn a_surface_of_two_sides_has_those_that_are_lit() {
    for (heights, normals) in [
        (&[1.0][..], &[1.0][..]),
        (&[-1.0], &[-1.0]),
        (&[1.0, -0.5], &[1.0, -1.0]),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let mut file = square();
        two_sided(&mut file, heights);
        let path = write(&dir, &file);
        let scene = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), 2 * normals.len(), "{heights:?}");
        for (t, &z) in normals.iter().enumerate() {
            assert!(normal(&scene, 2 * t).z * z > 0.99, "{heights:?}");
        }
    }
}

fn with_texture(dir: &TempDir) -> Value {
    let picture =
        image::ImageBuffer::from_fn(4, 2, |x, y| image::Rgb([60 * x as u8, 200, 90 * y as u8]));
    image::DynamicImage::from(picture)
        .save(dir.path().join("a.png"))
        .unwrap();
    let mut file = square();
    file["images"] = json!([{"uri": "a.png"}]);
    file["textures"] = json!([{"source": 0}]);
    file["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    file
}

#[test]
fn textures_and_their_transforms() {
    let dir = tempfile::tempdir().unwrap();
    let mut file = with_texture(&dir);
    let scene = read(&write(&dir, &file)).unwrap();
    let texture = scene.materials[0].map_kd.as_ref().unwrap();
    assert_eq!((texture.width, texture.height), (4, 2));
    assert!(texture.path.ends_with("a.png"));

    let by = json!({"offset": [0.25, 0.5], "scale": [2.0, 3.0], "rotation": 0.5});
    file["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": by});
    let moved = read(&write(&dir, &file)).unwrap();
    // The corner of u = v = 1 in glTF, scaled, turned counter-clockwise as seen, moved; v up.
    let (sin, cos) = 0.5_f32.sin_cos();
    let (u, v) = (2.0 * cos + 3.0 * sin + 0.25, -2.0 * sin + 3.0 * cos + 0.5);
    let found = moved.triangles[0].uv[1];
    assert!(
        (found[0] - u).abs() < 1e-6 && (found[1] - (1.0 - v)).abs() < 1e-6,
        "{found:?}"
    );

    file["materials"][0]["emissiveTexture"] = json!({"index": 0});
    let scene = read(&write(&dir, &file)).unwrap();
    assert!(scene.materials[0].map_ke.is_some());
    let mean = scene.materials[0].mean_emission()[1];
    assert!((mean - 0.577_58).abs() < 1e-4, "{mean}");
}

/// Colours and a mask on one set of coordinates, emission on another with a transform: each follows
/// the surface through all that cuts it, and what the colours' set says is not what the emission
/// does.
#[test]
fn the_emission_has_a_set_of_its_own() {
    let dir = tempfile::tempdir().unwrap();
    let mut file = with_texture(&dir);
    let half = |x: u32, _| image::Rgba([255, 255, 255, if x < 8 { 100 } else { 200 }]);
    let image = image::RgbaImage::from_fn(16, 16, half);
    image.save(dir.path().join("a.png")).unwrap();
    let glow = image::RgbImage::from_fn(8, 8, |x, y| image::Rgb([30 * x as u8, 30 * y as u8, 9]));
    glow.save(dir.path().join("e.png")).unwrap();
    file["images"]
        .as_array_mut()
        .unwrap()
        .push(json!({"uri": "e.png"}));
    file["textures"]
        .as_array_mut()
        .unwrap()
        .push(json!({"source": 1}));
    // Positions serve as coordinates too: the first two of each three floats.
    file["bufferViews"].as_array_mut().unwrap().push(json!(
        {"buffer": 0, "byteOffset": 0, "byteLength": 48, "byteStride": 12}
    ));
    file["accessors"].as_array_mut().unwrap().push(json!(
        {"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC2"}
    ));
    file["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(3);
    let material = &mut file["materials"][0];
    material["alphaMode"] = json!("MASK");
    let moved = json!({"offset": [0.25, 0.125], "scale": [0.5, -0.25], "texCoord": 1});
    material["emissiveTexture"] =
        json!({"index": 1, "extensions": {"KHR_texture_transform": moved}});
    let path = write(&dir, &file);
    let check = |scene: &Scene, what: &str| {
        assert!(scene.warnings.is_empty(), "{what}: {:?}", scene.warnings);
        let mut worst = 0.0_f64;
        for t in &scene.triangles {
            let own = t.emission_uv.unwrap();
            for (k, p) in scene.corners(t).into_iter().enumerate() {
                let colours = [(p.x + 1.0) / 2.0, (p.y + 1.0) / 2.0];
                let emission = [0.25 + 0.5 * p.x, 1.0 - (0.125 - 0.25 * p.y)];
                for i in 0..2 {
                    worst = worst.max((f64::from(t.uv[k][i]) - colours[i]).abs());
                    worst = worst.max((f64::from(own[k][i]) - emission[i]).abs());
                }
            }
        }
        println!(
            "{what}: {} triangles, {worst:.1e} off",
            scene.triangles.len()
        );
        assert!(worst < 1e-6, "{what}: {worst}");
    };
    let scene = read(&path).unwrap();
    check(&scene, "masked");
    let cut = scene.refined(&Refinement::default());
    assert!(cut.triangles.len() > 2 * scene.triangles.len());
    check(&cut, "cut");
    // The first and the last of a row are equal but for what the other set says.
    let dark = |t: &Triangle| scene.materials[0].emitted_over(&t.uv_of_emission())[0] < 0.3;
    assert!(cut.triangles.iter().any(dark) && !cut.triangles.iter().all(dark));

    // A mirrored node, whose corners are in the other order.
    file["nodes"][0]["scale"] = json!([1, 1, -1]);
    check(&read(&write(&dir, &file)).unwrap(), "mirrored");
    file["nodes"][0] = json!({"mesh": 0});
    let relief = |scene: &Scene| {
        let mut scene = scene.clone();
        let values: Vec<f32> = (0..64).map(|i| f32::from(i as u8 % 8)).collect();
        scene.materials[0].map_height = Some(Arc::new(HeightMap {
            path: "h".into(),
            width: 8,
            height: 8,
            values,
        }));
        scene.materials[0].height_scale = 1e-9;
        scene
    };
    check(&displace(&relief(&scene)).unwrap(), "displaced");
}

/// A texture whose left half is transparent, and a factor that makes all of it so.
#[test]
fn an_alpha_mask_is_cut_out() {
    let dir = tempfile::tempdir().unwrap();
    let mut file = with_texture(&dir);
    let half = |x: u32, _| image::Rgba([255, 255, 255, if x < 8 { 100 } else { 200 }]);
    let image = image::RgbaImage::from_fn(16, 16, half);
    image.save(dir.path().join("a.png")).unwrap();
    let area = |scene: &Scene| -> f64 {
        let triangles = scene.triangles.iter().map(|t| scene.corners(t));
        triangles
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z)
            .sum()
    };
    let material = &mut file["materials"][0];
    material["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.5, 0.5, 1.0]);
    material["alphaMode"] = json!("MASK");
    let scene = read(&write(&dir, &file)).unwrap();
    // From 100 to 200 alpha passes 127.5 after 0.275 of a texel, and on the way back, to the next
    // repeat, after 0.725.
    let exact = 4.0 * (0.5 + 0.45 / 16.0);
    let found = area(&scene);
    println!("{found} {exact}");
    assert!((found - exact).abs() < 1e-6 && scene.warnings.is_empty());
    file["materials"][0]["alphaCutoff"] = json!(0.3);
    assert!((area(&read(&write(&dir, &file)).unwrap()) - 4.0).abs() < 1e-12);
    file["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.5, 0.5, 0.3]);
    assert!(read(&write(&dir, &file)).is_err(), "nothing is left of it");
}

#[test]
fn a_normal_texture_makes_a_relief() {
    let dir = tempfile::tempdir().unwrap();
    let mut file = with_texture(&dir);
    let slope = |x: u32| (std::f64::consts::TAU * f64::from(x) / 16.0).cos();
    let normals = image::ImageBuffer::from_fn(16, 16, |x, _| {
        let n = DVec3::new(-0.3 * slope(x), 0.0, 1.0).normalize();
        image::Rgb([n.x, n.y, n.z].map(|c| ((c + 1.0) / 2.0 * 255.0).round() as u8))
    });
    image::DynamicImage::from(normals)
        .save(dir.path().join("n.png"))
        .unwrap();
    file["images"] = json!([{"uri": "a.png"}, {"uri": "n.png"}]);
    file["textures"] = json!([{"source": 0}, {"source": 1}]);
    file["materials"][0]["normalTexture"] = json!({"index": 1, "scale": 0.5});
    let scene = read(&write(&dir, &file)).unwrap();
    let material = &scene.materials[0];
    assert!(material.has_relief() && material.map_normal.is_some());
    // Slopes of 0.15 cos over a repeat of 2: heights of 0.3 / 2π to either side.
    let height = 2.0 * 0.15 * 2.0 / std::f64::consts::TAU;
    let off = f64::from(material.height_scale) / height - 1.0;
    assert!(off.abs() < 0.02, "{off}");
    // The base colour lies elsewhere.
    file["materials"][0]["normalTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"scale": [2.0, 2.0]}});
    let scene = read(&write(&dir, &file)).unwrap();
    assert!(
        scene.warnings.iter().any(|w| w.contains("lies elsewhere")),
        "{:?}",
        scene.warnings
    );
    assert_eq!(scene.triangles[0].uv[1], [2.0, -1.0]);
}

/// A change, and words of the one line that refuses it.
type Wrong<'a> = (&'a str, Value, &'a str);

#[test]
fn wrong_files_are_refused_in_one_line() {
    let mut wrong = Vec::new();
    let mut check = |at: &str, words: &str, read: Result<Scene>| match read {
        Ok(_) => wrong.push(format!("{at}: is read")),
        Err(error) => {
            let error = error.to_string();
            if error.contains('\n') || !error.contains("a.gltf") || !error.contains(words) {
                wrong.push(format!("{at}: {error}"));
            }
        }
    };
    let set: [Wrong; 28] = [
        ("/accessors/0/type", json!("VEC2"), "accessor 0"),
        ("/accessors/0/componentType", json!(5123), "accessor 0"),
        ("/accessors/1/type", json!("SCALAR"), "accessor 1"),
        (
            "/nodes/0",
            json!({"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}),
            "light",
        ),
        ("/asset/version", json!("1.0"), "glTF"),
        ("/asset", json!(null), "glTF"),
        ("/scenes", json!([]), ""),
        ("/scene", json!(7), "glTF"),
        ("/scenes/0/nodes/0", json!(5), "glTF"),
        ("/nodes/0/mesh", json!(5), "glTF"),
        ("/nodes/0", json!({}), "no triangle"),
        (
            "/nodes/0",
            json!({"mesh": 0, "children": [0]}),
            "within itself",
        ),
        (
            "/nodes/0",
            json!({"mesh": 0, "translation": [1e39, 0, 0]}),
            "",
        ),
        ("/nodes/0", json!({"mesh": 0, "scale": "big"}), "glTF"),
        (
            "/meshes/0/primitives/0/attributes",
            json!({"TEXCOORD_0": 1}),
            "POSITION",
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(9),
            "glTF",
        ),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(2), ""),
        ("/meshes/0/primitives/0/indices", json!(9), "glTF"),
        ("/meshes/0/primitives/0/material", json!(9), "glTF"),
        ("/meshes/0/primitives/0/mode", json!(1), "no triangle"),
        ("/materials/0/emissiveFactor", json!([-1, 0, 0]), "Ke"),
        (
            "/materials/0/pbrMetallicRoughness/baseColorFactor",
            json!([2, 0, 0, 1]),
            "Kd",
        ),
        ("/buffers/0/uri", json!("gone.bin"), "buffer"),
        ("/buffers/0/uri", json!("data:;base64,!!!"), "buffer"),
        ("/buffers/0/byteLength", json!(900), "buffer"),
        ("/bufferViews/0/byteLength", json!(4000), "view"),
        ("/accessors/0/count", json!(4000), "accessor 0"),
        ("/accessors/2/count", json!(4_000_000_000_u32), "accessor 2"),
    ];
    for (at, value, words) in set {
        let change = |file: &mut Value| {
            *file.pointer_mut(at).unwrap_or_else(|| panic!("{at}")) = value.clone();
        };
        check(at, words, read_changed(change));
    }
    let added: [Wrong; 8] = [
        ("images", json!([{"name": "nothing"}]), "image 0"),
        ("images", json!([{"bufferView": 0}]), "image 0"),
        (
            "extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            "KHR_draco",
        ),
        (
            "extensionsRequired",
            json!(["EXT_meshopt_compression"]),
            "EXT_meshopt",
        ),
        ("textures", json!([{"source": 3}]), "glTF"),
        ("images", json!([{"uri": 3}]), "glTF"),
        ("skins", json!([{"joints": [44]}]), "glTF"),
        ("animations", json!([{"channels": 1}]), "glTF"),
    ];
    for (key, value, words) in added {
        check(key, words, read_changed(|file| file[key] = value.clone()));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let dir = tempfile::tempdir().unwrap();
    for (name, content) in [("a.gltf", "no json"), ("a.glb", "no glTF"), ("b.gltf", "")] {
        fs::write(dir.path().join(name), content).unwrap();
        let error = read(&dir.path().join(name)).unwrap_err().to_string();
        assert!(error.contains(name) && !error.contains('\n'), "{error}");
    }
    let mut file = with_texture(&dir);
    fs::write(dir.path().join("a.png"), "no picture").unwrap();
    let error = read(&write(&dir, &file)).unwrap_err().to_string();
    assert!(error.contains("image 0"), "{error}");
    file["images"][0] = json!({"bufferView": 0, "mimeType": "image/png"});
    let error = read(&write(&dir, &file)).unwrap_err().to_string();
    assert!(error.contains("image 0"), "{error}");
}

#[test]
fn nodes_name_meshes() {
    let scene = read_changed(|file| {
        file["meshes"][0]["name"] = json!("square");
        file["nodes"] = json!([
            {"mesh": 0, "children": [1, 2]},
            {"mesh": 0, "name": "wall", "translation": [0, 0, 1]},
            {"mesh": 0, "translation": [0, 0, 2]}
        ]);
    })
    .unwrap();
    let names: Vec<_> = scene.meshes.iter().map(|mesh| &mesh.name).collect();
    assert_eq!(names, ["square", "wall", "square.2"]);
    assert!(scene.meshes.iter().all(|mesh| mesh.count == 2));
}
