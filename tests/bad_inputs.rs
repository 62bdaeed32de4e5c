//! A wall of bad inputs: glTF, GLB, options of maps in MTL, keys of scene.toml. The program refuses
//! each with exit code 2 and one line that names the file.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use serde_json::{Value, json};

/// Contents by name.
type Files = BTreeMap<&'static str, Vec<u8>>;

/// What is wrong, the scene, the change that makes it so, and words of the line.
type Case = (
    &'static str,
    &'static str,
    Box<dyn Fn(&mut Files)>,
    [&'static str; 2],
);

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl lamp\n\
    f 1/1 2/2 3/3\n";
const MTL: &str = "newmtl lamp\nKd 0.1 0.2 0.3\nKe 1 2 3\nmap_Kd a.png\n";
const TOML: &str = "[[mesh]]\nfile = 'a.obj'\n[[camera]]\nname = 'c'\nposition = [0, 0, 5]\n\
    look_at = [0, 0, 0]\nfov = 40\n";

/// Three corners, texture coordinates, indices.
fn data() -> Vec<u8> {
    let floats: [f32; 15] = [
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0,
    ];
    let mut bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2, 0].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn gltf() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_emissive_strength", "KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 683}]}},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "meshes": [{"primitives": [{
            "mode": 4,
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0
        }]}],
        "materials": [{
            "name": "paint",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.25, 0.5, 0.75, 1.0], "baseColorTexture": {"index": 0}
            },
            "emissiveFactor": [0.5, 0.25, 1.0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}}
        }],
        "textures": [{"source": 0}],
        "images": [{"uri": "a.png"}],
        "buffers": [{"uri": "a.bin", "byteLength": 68}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
            {"buffer": 0, "byteOffset": 60, "byteLength": 8}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"}
        ]
    })
}

/// The same in one file.
fn glb() -> Vec<u8> {
    let mut file = gltf();
    file["buffers"][0] = json!({"byteLength": 68});
    let mut text = file.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = Vec::new();
    let word = |bytes: &mut Vec<u8>, n: usize| bytes.extend((n as u32).to_le_bytes());
    bytes.extend(b"glTF");
    word(&mut bytes, 2);
    word(&mut bytes, 12 + 8 + text.len() + 8 + 68);
    word(&mut bytes, text.len());
    bytes.extend(b"JSON");
    bytes.extend(text);
    word(&mut bytes, 68);
    bytes.extend(b"BIN\0");
    bytes.extend(data());
    bytes
}

/// A picture of one colour, which is no normal.
fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([128, 128, 10]));
    (picture.write_to(&mut bytes, image::ImageFormat::Png)).expect("encoded");
    bytes.into_inner()
}

/// Scenes that are good as they are.
fn good() -> Files {
    Files::from([
        ("a.obj", OBJ.into()),
        ("a.mtl", MTL.into()),
        ("a.toml", TOML.into()),
        ("a.png", png()),
        ("a.gltf", gltf().to_string().into()),
        ("a.bin", data()),
        ("a.glb", glb()),
    ])
}

/// Runs the program and gives its exit code and what it wrote to stderr.
fn run(args: &[&str], files: &Files) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).expect("written");
    }
    let run = Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(args)
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    let text = String::from_utf8_lossy(&run.stderr).into_owned();
    (run.status.code(), text)
}

/// Puts a value in the place of one of `a.gltf`.
fn set(at: &'static str, value: Value) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| {
        let mut file = gltf();
        let (parent, key) = at.rsplit_once('/').expect("a pointer");
        let parent = file.pointer_mut(parent).unwrap_or_else(|| panic!("{at}"));
        match (parent, key.parse::<usize>()) {
            (Value::Array(list), Ok(index)) => list[index] = value.clone(),
            (parent, _) => parent[key] = value.clone(),
        }
        files.insert("a.gltf", file.to_string().into());
    })
}

/// Puts bytes at a place of a file.
fn poke(name: &'static str, at: usize, bytes: &'static [u8]) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| {
        files.get_mut(name).expect("there")[at..at + bytes.len()].copy_from_slice(bytes);
    })
}

/// Leaves the first bytes of a file.
fn cut(name: &'static str, length: usize) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| files.get_mut(name).expect("there").truncate(length))
}

fn remove(name: &'static str) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| drop(files.remove(name)))
}

fn whole(name: &'static str, text: &'static str) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| drop(files.insert(name, text.into())))
}

/// Another statement in the place of `map_Kd a.png`.
fn mtl(statement: &'static str) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| {
        files.insert("a.mtl", MTL.replace("map_Kd a.png", statement).into());
    })
}

/// More keys for the mesh.
fn mesh(keys: &'static str) -> Box<dyn Fn(&mut Files)> {
    Box::new(move |files| {
        let text = TOML.replace("[[camera]]", &format!("{keys}\n[[camera]]"));
        files.insert("a.toml", text.into());
    })
}

fn of_gltf() -> Vec<Case> {
    let gltf =
        |what, at, value, word| -> Case { (what, "a.gltf", set(at, value), ["a.gltf", word]) };
    vec![
        (
            "no JSON",
            "a.gltf",
            whole("a.gltf", "triangles"),
            ["a.gltf", "glTF"],
        ),
        ("empty", "a.gltf", whole("a.gltf", ""), ["a.gltf", "glTF"]),
        (
            "JSON of another kind",
            "a.gltf",
            whole("a.gltf", "[1, 2]"),
            ["a.gltf", "glTF"],
        ),
        ("missing", "a.gltf", remove("a.gltf"), ["a.gltf", "read"]),
        gltf("glTF 1", "/asset/version", json!("1.0"), "not 2.0"),
        gltf("of the future", "/asset/minVersion", json!("3.1"), "3.1"),
        gltf("no asset", "/asset", json!(null), "glTF"),
        gltf(
            "Draco",
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            "KHR_draco",
        ),
        gltf(
            "Basis",
            "/extensionsRequired",
            json!(["KHR_texture_basisu"]),
            "KHR_texture_basisu",
        ),
        gltf("no scene", "/scenes", json!([]), ""),
        gltf("a scene that is not there", "/scene", json!(4), "glTF"),
        gltf(
            "nodes in a circle",
            "/nodes/0/children",
            json!([0]),
            "within itself",
        ),
        gltf(
            "a node at infinity",
            "/nodes/0/translation",
            json!([1e39, 0, 0]),
            "",
        ),
        gltf(
            "a node without a size",
            "/nodes/0/scale",
            json!([0, 0, 0]),
            "area",
        ),
        gltf(
            "a mesh that is not there",
            "/nodes/0/mesh",
            json!(3),
            "glTF",
        ),
        gltf(
            "a light that is not there",
            "/nodes/1/extensions/KHR_lights_punctual/light",
            json!(2),
            "light",
        ),
        gltf(
            "a light below 0",
            "/extensions/KHR_lights_punctual/lights/0/intensity",
            json!(-3),
            "negative",
        ),
        gltf(
            "points",
            "/meshes/0/primitives/0/mode",
            json!(0),
            "no triangle",
        ),
        gltf(
            "no positions",
            "/meshes/0/primitives/0/attributes",
            json!({"TEXCOORD_0": 1}),
            "POSITION",
        ),
        gltf(
            "positions of two numbers",
            "/accessors/0/type",
            json!("VEC2"),
            "accessor 0",
        ),
        gltf(
            "a material that is not there",
            "/meshes/0/primitives/0/material",
            json!(8),
            "glTF",
        ),
        gltf(
            "reflectance above 1",
            "/materials/0/pbrMetallicRoughness/baseColorFactor",
            json!([2, 0, 0, 1]),
            "Kd",
        ),
        gltf(
            "emission below 0",
            "/materials/0/emissiveFactor",
            json!([-1, 0, 0]),
            "Ke",
        ),
        gltf(
            "endless emission",
            "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength",
            json!(1e39),
            "",
        ),
        gltf(
            "an image that is not there",
            "/images/0/uri",
            json!("gone.png"),
            "gone.png",
        ),
        gltf(
            "a name that is not UTF-8",
            "/buffers/0/uri",
            json!("a%FF.bin"),
            "not UTF-8",
        ),
        gltf(
            "an image of no kind",
            "/images/0",
            json!({"bufferView": 0}),
            "image 0",
        ),
        (
            "an image of more texels than its bytes can hold",
            "a.gltf",
            poke("a.png", 16, &[0, 0, 32, 0, 0, 0, 32, 0]),
            ["a.gltf", "a.png"],
        ),
        (
            "a damaged image",
            "a.gltf",
            whole("a.png", "no picture"),
            ["a.gltf", "a.png"],
        ),
        (
            "a buffer that is not there",
            "a.gltf",
            remove("a.bin"),
            ["a.gltf", "buffer"],
        ),
        (
            "a short buffer",
            "a.gltf",
            cut("a.bin", 60),
            ["a.gltf", "buffer"],
        ),
        gltf(
            "a buffer that is no base64",
            "/buffers/0/uri",
            json!("data:;base64,%%%"),
            "buffer",
        ),
        gltf(
            "a view beyond its buffer",
            "/bufferViews/1/byteLength",
            json!(90),
            "view 1",
        ),
        gltf(
            "an accessor beyond its view",
            "/accessors/1/count",
            json!(90),
            "accessor 1",
        ),
        gltf(
            "a sparse accessor beyond its view",
            "/accessors/0/sparse",
            json!({"count": 9, "indices": {"bufferView": 2, "componentType": 5123},
                   "values": {"bufferView": 0}}),
            "accessor 0",
        ),
        (
            "a position that is no number",
            "a.gltf",
            poke("a.bin", 0, &[0, 0, 192, 127]),
            ["a.gltf", "finite"],
        ),
        (
            "an index out of range",
            "a.gltf",
            poke("a.bin", 60, &[9, 0]),
            ["a.gltf", "index"],
        ),
    ]
}

fn of_glb() -> Vec<Case> {
    let glb = |what, change, word| -> Case { (what, "a.glb", change, ["a.glb", word]) };
    vec![
        glb("empty", cut("a.glb", 0), ""),
        glb("its first word", cut("a.glb", 4), ""),
        glb("its header", cut("a.glb", 12), ""),
        glb("the half of it", cut("a.glb", 600), ""),
        glb(
            "all but a byte",
            Box::new(|files| {
                files.get_mut("a.glb").expect("there").pop();
            }),
            "",
        ),
        glb("another magic", poke("a.glb", 0, b"glTX"), ""),
        glb("version 1", poke("a.glb", 4, &[1]), ""),
        glb("a length of 4 GiB", poke("a.glb", 8, &[255; 4]), ""),
        glb(
            "a length within its header",
            poke("a.glb", 8, &[2, 0, 0, 0]),
            "2 bytes",
        ),
        glb("a chunk of 4 GiB", poke("a.glb", 12, &[255; 4]), ""),
        glb(
            "a first chunk that is no JSON",
            poke("a.glb", 16, b"BIN\0"),
            "",
        ),
        glb("JSON that is no text", poke("a.glb", 24, &[255, 254]), ""),
    ]
}

fn of_mtl() -> Vec<Case> {
    let map =
        |what, statement, word| -> Case { (what, "a.obj", mtl(statement), ["a.mtl:4", word]) };
    vec![
        map("no file", "map_Kd", "no file"),
        map("options without a file", "map_Kd -s 1 1 1", "no file"),
        map(
            "an option of another program",
            "map_Bump -strength 2 a.png",
            "-strength",
        ),
        map("a factor that is no number", "map_Bump -bm a.png", "-bm"),
        map("a factor beyond numbers", "map_Bump -bm 1e39 a.png", "-bm"),
        map("an infinite factor", "map_Disp -bm inf a.png", "-bm"),
        map("a gain that is no number", "map_Disp -mm 0 a.png", "-mm"),
        map("a scale of 0", "map_Kd -s 0 1 1 a.png", "-s"),
        map("a scale that is no number", "map_Kd -s nan a.png", "-s"),
        map("an offset that is no number", "map_Kd -o x 1 a.png", "-o"),
        map(
            "a channel that is none",
            "map_Disp -imfchan q a.png",
            "-imfchan",
        ),
        map("no opacity", "d", "d"),
        map("transparency that is no number", "Tr glass", "Tr"),
        (
            "a map that is not there",
            "a.obj",
            remove("a.png"),
            ["a.mtl", "a.png"],
        ),
        (
            "a damaged map",
            "a.obj",
            whole("a.png", "no picture"),
            ["a.mtl", "a.png"],
        ),
        (
            "normals into the surface",
            "a.obj",
            mtl("norm a.png"),
            ["a.mtl", "a.png"],
        ),
    ]
}

fn of_toml() -> Vec<Case> {
    let key = |what, keys, word| -> Case { (what, "a.toml", mesh(keys), ["a.toml", word]) };
    vec![
        key("sides that are none", "sides = 'left'", "left"),
        key("sides of another kind", "sides = 2", ":3:"),
        key("z_up that is a number", "z_up = 1", ":3:"),
        key("reverse that is a text", "reverse = 'yes'", ":3:"),
        key("a key twice", "z_up = true\nz_up = true", ":4:"),
        key("a scale of 0", "scale = 0", "scale"),
        (
            "a mesh of another format",
            "a.toml",
            mesh("[[mesh]]\nfile = 'a.stl'"),
            ["a.stl", "a mesh is"],
        ),
        (
            "a mesh that is not there",
            "a.toml",
            mesh("[[mesh]]\nfile = 'gone.glb'"),
            ["gone.glb", "read"],
        ),
        key(
            "a height scale without heights",
            "[material.lamp]\nheight_scale = 2",
            "lamp",
        ),
        key(
            "a normal map that is none",
            "[material.lamp]\nnormal_map = 'a.png'",
            "lamp",
        ),
        key(
            "a map that is not there",
            "[material.lamp]\nheight_map = 'b.png'",
            "b.png",
        ),
        key(
            "a reflectance of two numbers",
            "[material.lamp]\nkd = [1, 1]",
            ":4:",
        ),
        key(
            "a material that no mesh has",
            "[material.tin]\nkd = [1, 1, 1]",
            "tin",
        ),
        (
            "a switch that is a text",
            "a.toml",
            Box::new(|files| {
                let text = format!("heights_from_normals = 'no'\n{TOML}");
                files.insert("a.toml", text.into());
            }),
            ["a.toml:1:", "bool"],
        ),
    ]
}

/// 76 inputs.
#[test]
fn bad_inputs_are_one_line_and_exit_code_2() {
    let cases = [of_gltf(), of_glb(), of_mtl(), of_toml()];
    let cases: Vec<Case> = cases.into_iter().flatten().collect();
    assert!(cases.len() >= 76, "{} bad inputs", cases.len());
    let mut wrong = Vec::new();
    for (what, scene, change, words) in cases {
        let mut files = good();
        change(&mut files);
        let (code, text) = run(&["bake", scene, "-o", "o.safetensors"], &files);
        let is_right = code == Some(2)
            && text.lines().count() == 1
            && words.iter().all(|word| text.contains(word));
        if !is_right {
            wrong.push(format!("{scene}, {what}: {code:?} {text}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_untouched_inputs_are_good() {
    for scene in ["a.obj", "a.toml", "a.gltf", "a.glb"] {
        let (code, text) = run(&["info", scene, "--no-refine"], &good());
        assert_eq!(code, Some(0), "{scene}: {text}");
    }
}
