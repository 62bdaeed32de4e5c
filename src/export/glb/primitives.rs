//! Triangles as meshes of a glTF file.

use std::collections::HashMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::document::Document;
use crate::export::baked_colours::CornerColours;
use crate::export::surface::Surface;
use crate::scene::MeshRange;

/// Set of texture coordinates of emission that lies elsewhere than the other maps.
pub const EMISSION_SET: u32 = 2;

/// Attribute of the irradiance at vertices, W·m⁻², RGB. Names of attributes that are not glTF's
/// begin so.
const IRRADIANCE: &str = "_IRRADIANCE";

/// Runs of one material in a mesh, at most, before its triangles are sorted by material.
const MOST_RUNS: usize = 64;

/// Adds the meshes of a scene, each about its own middle; `material` makes that of a primitive by
/// the scene's material and the page of its light map.
pub fn add(
    document: &mut Document,
    surface: &Surface,
    colours: Option<&CornerColours>,
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
            primitive(document, surface, colours, &run, middle, index)
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

/// Name and number of components of each attribute that a primitive has.
fn attributes(
    surface: &Surface,
    colours: Option<&CornerColours>,
    emits: bool,
) -> Vec<(String, usize)> {
    let mut names = vec![("POSITION", 3), ("NORMAL", 3), ("TEXCOORD_0", 2)];
    if surface.pages.count > 0 {
        names.push(("TEXCOORD_1", 2));
    }
    if colours.is_some() {
        names.extend([("COLOR_0", 3), (IRRADIANCE, 3)]);
    }
    let mut names: Vec<(String, usize)> = (names.into_iter())
        .map(|(name, components)| (name.to_owned(), components))
        .collect();
    if emits {
        names.push((format!("TEXCOORD_{EMISSION_SET}"), 2));
    }
    names
}

fn primitive(
    document: &mut Document,
    surface: &Surface,
    colours: Option<&CornerColours>,
    triangles: &[usize],
    middle: DVec3,
    material: usize,
) -> Value {
    let scene = &surface.scene;
    let emits = scene.materials[scene.triangles[triangles[0]].material as usize]
        .map_ke
        .is_some();
    let names = attributes(surface, colours, emits);
    // The values of a corner, one attribute after another.
    let corner = |t: usize, k: usize| -> Vec<f32> {
        let triangle = &scene.triangles[t];
        let position = scene.vertices[triangle.vertices[k] as usize] - middle;
        let normal = surface.normals[t][k].as_vec3().normalize().to_array();
        // glTF's v points down.
        let flip = |[u, v]: [f32; 2]| [u, 1.0 - v];
        let mut values = [position.as_vec3().to_array(), normal].concat();
        values.extend(flip(triangle.uv[k]));
        if surface.pages.count > 0 {
            values.extend(surface.uv[t][k].as_vec2().to_array());
        }
        if let Some(of) = colours {
            values.extend([of.colours[t][k], of.irradiance[t][k]].concat());
        }
        if emits {
            values.extend(flip(triangle.uv_of_emission()[k]));
        }
        values
    };
    let mut vertices: Vec<Vec<f32>> = Vec::new();
    let mut indices = Vec::with_capacity(3 * triangles.len());
    let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
    for &t in triangles {
        for k in 0..3 {
            let values = corner(t, k);
            let key = values.iter().map(|value| value.to_bits()).collect();
            let next = vertices.len() as u32;
            let index = *known.entry(key).or_insert(next);
            if index == next {
                vertices.push(values);
            }
            indices.push(index);
        }
    }
    let mut attributes = json!({});
    let mut first = 0;
    for (name, components) in names {
        let range = first..first + components;
        let values: Vec<f32> = (vertices.iter())
            .flat_map(|vertex| vertex[range.clone()].iter().copied())
            .collect();
        let is_position = name == "POSITION";
        attributes[name] = json!(document.vectors(&values, components, is_position));
        first = range.end;
    }
    json!({
        "attributes": attributes,
        "indices": document.indices(&indices),
        "material": material,
    })
}
