//! Triangles as meshes of a glTF file.

use std::collections::HashMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::document::Document;
use crate::export::surface::Surface;
use crate::scene::MeshRange;

/// Set of texture coordinates of emission that lies elsewhere than the other maps.
pub const EMISSION_SET: u32 = 2;

/// Runs of one material in a mesh, at most, before its triangles are sorted by material.
const MOST_RUNS: usize = 64;

/// Adds the meshes of a scene, each about its own middle; `material` makes that of a primitive by
/// the scene's material and the page of its light map.
pub fn add(
    document: &mut Document,
    surface: &Surface,
    material: impl Fn(u32, Option<u32>) -> Value,
) {
    let scene = &surface.scene;
    let all = [MeshRange {
        name: scene.name.clone(),
        first: 0,
        count: scene.triangles.len() as u32,
    }];
    let meshes = match scene.meshes.is_empty() {
        true => &all[..],
        false => &scene.meshes,
    };
    let mut known: HashMap<(u32, Option<u32>), usize> = HashMap::new();
    for mesh in meshes {
        let triangles = mesh.first as usize..(mesh.first + mesh.count) as usize;
        let middle = middle(surface, triangles.clone());
        let primitives = runs(surface, triangles).into_iter().map(|run| {
            let key = of(surface, run[0]);
            let index = *known.entry(key).or_insert_with(|| {
                document.materials.push(material(key.0, key.1));
                document.materials.len() - 1
            });
            primitive(document, surface, &run, middle, index)
        });
        let primitives = primitives.collect();
        document.mesh(&mesh.name, primitives, middle.to_array());
    }
}

fn of(surface: &Surface, t: usize) -> (u32, Option<u32>) {
    (surface.scene.triangles[t].material, surface.page[t])
}

/// Triangles of one material and one page that follow each other.
fn runs(surface: &Surface, triangles: std::ops::Range<usize>) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = triangles.collect();
    let alike = |a: &usize, b: &usize| of(surface, *a) == of(surface, *b);
    if order.chunk_by(alike).count() > MOST_RUNS {
        order.sort_by_key(|&t| of(surface, t));
    }
    order.chunk_by(alike).map(<[usize]>::to_vec).collect()
}

/// The middle of a mesh, rounded to what an f32 holds.
fn middle(surface: &Surface, triangles: std::ops::Range<usize>) -> DVec3 {
    let corners = triangles.flat_map(|t| surface.scene.corners(&surface.scene.triangles[t]));
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let offset = 0.5 * (low + high);
    // Near the origin positions need none.
    match offset.length() > 16.0 * (high - low).length() {
        true => offset.as_vec3().as_dvec3(),
        false => DVec3::ZERO,
    }
}

fn primitive(
    document: &mut Document,
    surface: &Surface,
    triangles: &[usize],
    middle: DVec3,
    material: usize,
) -> Value {
    let scene = &surface.scene;
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let (mut uvs, mut light_uvs, mut emission_uvs) = (Vec::new(), Vec::new(), Vec::new());
    let mut indices = Vec::with_capacity(3 * triangles.len());
    let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
    for &t in triangles {
        let triangle = &scene.triangles[t];
        for k in 0..3 {
            let position = scene.vertices[triangle.vertices[k] as usize] - middle;
            let position = position.as_vec3().to_array();
            let normal = surface.normals[t][k].as_vec3().normalize().to_array();
            // glTF's v points down.
            let flip = |[u, v]: [f32; 2]| [u, 1.0 - v];
            let uv = flip(triangle.uv[k]);
            let emission = flip(triangle.uv_of_emission()[k]);
            let light = surface.uv[t][k].as_vec2().to_array();
            let key: Vec<u32> = (position.iter().chain(&normal))
                .chain(&uv)
                .chain(&emission)
                .chain(&light)
                .map(|value| value.to_bits())
                .collect();
            let next = positions.len() as u32;
            let index = *known.entry(key).or_insert(next);
            if index == next {
                positions.push(position);
                normals.push(normal);
                uvs.push(uv);
                light_uvs.push(light);
                emission_uvs.push(emission);
            }
            indices.push(index);
        }
    }
    let mut attributes = json!({
        "POSITION": document.vectors(&positions, true),
        "NORMAL": document.vectors(&normals, false),
        "TEXCOORD_0": document.vectors(&uvs, false),
        "TEXCOORD_1": document.vectors(&light_uvs, false),
    });
    let emits = scene.materials[scene.triangles[triangles[0]].material as usize]
        .map_ke
        .is_some();
    if emits {
        let set = format!("TEXCOORD_{EMISSION_SET}");
        attributes[set] = json!(document.vectors(&emission_uvs, false));
    }
    json!({
        "attributes": attributes,
        "indices": document.indices(&indices),
        "material": material,
    })
}
