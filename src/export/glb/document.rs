//! The JSON and the bytes of a glTF file while it is written.

use std::borrow::Cow;
use std::collections::BTreeSet;

use gltf::binary::{Glb, Header};
use serde_json::{Value, json};

/// Constants of the format.
pub const FLOAT: u32 = 5126;
pub const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;
const CLAMP_TO_EDGE: u32 = 33071;

#[derive(Default)]
pub struct Document {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    pub materials: Vec<Value>,
    meshes: Vec<Value>,
    lights: Vec<Value>,
    cameras: Vec<Value>,
    nodes: Vec<Value>,
    pub extensions: BTreeSet<&'static str>,
}

fn push(list: &mut Vec<Value>, value: Value) -> usize {
    list.push(value);
    list.len() - 1
}

impl Document {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        // Each view begins at a multiple of four.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(),
        });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        push(&mut self.views, view)
    }

    /// Vectors of so many components; `bounds` are needed of positions.
    pub fn vectors(&mut self, values: &[f32], components: usize, bounds: bool) -> usize {
        let view = self.view(bytemuck::cast_slice(values), Some(ARRAY_BUFFER));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][components - 1];
        let count = values.len() / components;
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": count, "type": kind,
        });
        if bounds {
            let vectors = || values.chunks_exact(components);
            let of = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..components)
                    .map(|k| vectors().fold(start, |x, v| pick(x, v[k])))
                    .collect()
            };
            accessor["min"] = json!(of(f32::INFINITY, f32::min));
            accessor["max"] = json!(of(f32::NEG_INFINITY, f32::max));
        }
        push(&mut self.accessors, accessor)
    }

    pub fn indices(&mut self, indices: &[u32]) -> usize {
        let view = self.view(bytemuck::cast_slice(indices), Some(ELEMENT_ARRAY_BUFFER));
        let accessor = json!({
            "bufferView": view,
            "componentType": UNSIGNED_INT,
            "count": indices.len(),
            "type": "SCALAR",
        });
        push(&mut self.accessors, accessor)
    }

    /// A PNG.
    pub fn image(&mut self, name: &str, png: &[u8]) -> usize {
        let view = self.view(png, None);
        let image = json!({ "name": name, "bufferView": view, "mimeType": "image/png" });
        push(&mut self.images, image)
    }

    pub fn clamped_sampler(&mut self) -> usize {
        let (wrap, linear) = (CLAMP_TO_EDGE, LINEAR);
        self.sampler(json!({
            "wrapS": wrap, "wrapT": wrap, "magFilter": linear, "minFilter": linear,
        }))
    }

    pub fn repeating_sampler(&mut self) -> usize {
        self.sampler(json!({ "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR }))
    }

    fn sampler(&mut self, sampler: Value) -> usize {
        match self.samplers.iter().position(|known| *known == sampler) {
            Some(known) => known,
            None => push(&mut self.samplers, sampler),
        }
    }

    pub fn texture(&mut self, image: usize, sampler: usize) -> usize {
        push(
            &mut self.textures,
            json!({ "source": image, "sampler": sampler }),
        )
    }

    pub fn mesh(&mut self, name: &str, primitives: Vec<Value>, translation: [f64; 3]) {
        let mesh = json!({ "name": name, "primitives": primitives });
        let mesh = push(&mut self.meshes, mesh);
        let mut node = json!({ "name": name, "mesh": mesh });
        if translation != [0.0; 3] {
            node["translation"] = json!(translation);
        }
        self.nodes.push(node);
    }

    pub fn light(&mut self, light: Value, mut node: Value) {
        let index = push(&mut self.lights, light);
        node["extensions"]["KHR_lights_punctual"] = json!({ "light": index });
        self.nodes.push(node);
    }

    pub fn camera(&mut self, camera: Value, mut node: Value) {
        node["camera"] = json!(push(&mut self.cameras, camera));
        self.nodes.push(node);
    }

    /// The file.
    pub fn into_bytes(mut self, name: &str) -> Result<Vec<u8>, String> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let version = env!("CARGO_PKG_VERSION");
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let mut root = json!({
            "asset": { "version": "2.0", "generator": format!("Mesolux {version}") },
            "scene": 0,
            "scenes": [{ "name": name, "nodes": nodes }],
            "buffers": [{ "byteLength": self.bytes.len() }],
        });
        if !self.lights.is_empty() {
            let extension = "KHR_lights_punctual";
            root["extensions"][extension] = json!({ "lights": self.lights });
            self.extensions.insert(extension);
        }
        // Lists may not be empty.
        for (key, list) in [
            ("bufferViews", self.views),
            ("accessors", self.accessors),
            ("images", self.images),
            ("samplers", self.samplers),
            ("textures", self.textures),
            ("materials", self.materials),
            ("meshes", self.meshes),
            ("cameras", self.cameras),
            ("nodes", self.nodes),
            (
                "extensionsUsed",
                self.extensions.iter().map(|name| json!(name)).collect(),
            ),
        ] {
            if !list.is_empty() {
                root[key] = Value::Array(list);
            }
        }
        let json = serde_json::to_vec(&root).map_err(|e| e.to_string())?;
        let glb = Glb {
            header: Header {
                magic: *b"glTF",
                version: 2,
                // The writer finds it.
                length: 0,
            },
            json: Cow::Owned(json),
            bin: Some(Cow::Owned(self.bytes)),
        };
        glb.to_vec().map_err(|e| e.to_string())
    }
}
