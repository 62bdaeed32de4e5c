//! A hash that identifies a scene's bake.

use sha2::{Digest, Sha256};

use super::{Material, Scene};

impl Scene {
    /// SHA-256 in hexadecimal over everything that a bake depends on: vertices, triangles,
    /// materials with their texels, point lights. Names, paths and cameras do not count.
    pub fn hash(&self) -> String {
        let mut hash = Sha256::new();
        // Each list begins with its length, so that no two scenes give the same bytes.
        length(&mut hash, self.vertices.len());
        for vertex in &self.vertices {
            vertex
                .to_array()
                .iter()
                .for_each(|c| hash.update(c.to_le_bytes()));
        }
        length(&mut hash, self.triangles.len());
        for triangle in &self.triangles {
            triangle
                .vertices
                .iter()
                .for_each(|v| hash.update(v.to_le_bytes()));
            triangle.uv.iter().for_each(|uv| floats(&mut hash, uv));
            hash.update(triangle.material.to_le_bytes());
        }
        length(&mut hash, self.materials.len());
        self.materials.iter().for_each(|m| material(&mut hash, m));
        length(&mut hash, self.lights.points.len());
        for light in &self.lights.points {
            light
                .position
                .to_array()
                .iter()
                .for_each(|c| hash.update(c.to_le_bytes()));
            floats(&mut hash, &light.intensity);
        }
        hash.finalize()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }
}

fn material(hash: &mut Sha256, material: &Material) {
    floats(hash, &material.kd);
    floats(hash, &material.ke);
    match &material.map_kd {
        None => length(hash, 0),
        Some(texture) => {
            length(hash, texture.texels.len());
            hash.update(texture.width.to_le_bytes());
            texture.texels.iter().for_each(|texel| floats(hash, texel));
        }
    }
    relief(hash, material);
}

fn relief(hash: &mut Sha256, material: &Material) {
    // A material without relief is hashed without relief fields, so that bakes of earlier versions
    // stay valid.
    if let Some(map) = &material.map_height {
        hash.update(b"height");
        hash.update(map.width.to_le_bytes());
        floats(hash, &map.values);
        floats(hash, &[material.height_scale]);
    }
    if let Some(map) = &material.map_normal {
        hash.update(b"normal");
        hash.update(map.width.to_le_bytes());
        map.normals.iter().for_each(|n| floats(hash, n));
    }
}

fn floats(hash: &mut Sha256, values: &[f32]) {
    values
        .iter()
        .for_each(|value| hash.update(value.to_le_bytes()));
}

fn length(hash: &mut Sha256, length: usize) {
    hash.update((length as u64).to_le_bytes());
}
