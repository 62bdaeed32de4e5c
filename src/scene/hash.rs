//! A hash that identifies a scene's bake.

use sha2::{Digest, Sha256};

use glam::DVec3;

use super::sky::{Dome, Form, Sky};
use super::{Beam, Material, Scene, Sun};

impl Scene {
    /// SHA-256 in hexadecimal over everything that a bake depends on: vertices, triangles,
    /// materials with their texels, lights. Names, paths and cameras do not count.
    pub fn hash(&self) -> String {
        let mut hash = Sha256::new();
        // Each list begins with its length, so that no two scenes give the same bytes.
        length(&mut hash, self.vertices.len());
        self.vertices.iter().for_each(|&v| vector(&mut hash, v));
        length(&mut hash, self.triangles.len());
        for triangle in &self.triangles {
            triangle
                .vertices
                .iter()
                .for_each(|v| hash.update(v.to_le_bytes()));
            triangle.uv.iter().for_each(|uv| floats(&mut hash, uv));
            if let Some(uv) = &triangle.emission_uv {
                hash.update(b"emission elsewhere");
                uv.iter().for_each(|uv| floats(&mut hash, uv));
            }
            hash.update(triangle.material.to_le_bytes());
        }
        length(&mut hash, self.materials.len());
        self.materials.iter().for_each(|m| material(&mut hash, m));
        length(&mut hash, self.lights.points.len());
        for light in &self.lights.points {
            vector(&mut hash, light.position);
            floats(&mut hash, &light.intensity);
            light.beam.iter().for_each(|b| beam(&mut hash, b));
        }
        // What a scene has none of adds nothing, so that bakes of earlier versions stay valid.
        self.lights.suns.iter().for_each(|s| sun(&mut hash, s));
        self.lights.sky.iter().for_each(|s| sky(&mut hash, s));
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
    // As below: without one, the bytes are those of earlier versions.
    if let Some(map) = &material.map_ke {
        hash.update(b"emission");
        hash.update(map.width.to_le_bytes());
        map.texels.iter().for_each(|texel| floats(hash, texel));
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

fn beam(hash: &mut Sha256, beam: &Beam) {
    hash.update(b"beam");
    vector(hash, beam.axis);
    vector(hash, beam.zero);
    hash.update(beam.web.rows.to_le_bytes());
    hash.update(beam.web.columns.to_le_bytes());
    floats(hash, &beam.web.shares);
}

fn sun(hash: &mut Sha256, sun: &Sun) {
    hash.update(b"sun");
    vector(hash, sun.towards);
    floats(hash, &sun.irradiance);
    hash.update(sun.angle.to_le_bytes());
}

fn sky(hash: &mut Sha256, sky: &Sky) {
    hash.update(b"sky");
    vector(hash, sky.up);
    vector(hash, sky.north);
    floats(hash, &sky.scale);
    match &sky.dome {
        Dome::Uniform => hash.update(b"uniform"),
        Dome::TraditionalOvercast => hash.update(b"traditional"),
        Dome::Gradation(gradation) => {
            hash.update(match gradation.form() {
                Form::Cie => b"cie  ",
                Form::Perez => b"perez",
            });
            let coefficients = gradation.coefficients();
            coefficients
                .iter()
                .for_each(|c| hash.update(c.to_le_bytes()));
            vector(hash, gradation.sun());
        }
        Dome::Picture(picture) => {
            hash.update(b"picture");
            hash.update(picture.width.to_le_bytes());
            hash.update(picture.height.to_le_bytes());
            picture.texels.iter().for_each(|texel| floats(hash, texel));
        }
    }
}

fn vector(hash: &mut Sha256, vector: DVec3) {
    vector
        .to_array()
        .iter()
        .for_each(|c| hash.update(c.to_le_bytes()));
}

fn floats(hash: &mut Sha256, values: &[f32]) {
    values
        .iter()
        .for_each(|value| hash.update(value.to_le_bytes()));
}

fn length(hash: &mut Sha256, length: usize) {
    hash.update((length as u64).to_le_bytes());
}
