//! Triangles of a glTF file.

use glam::{DAffine3, DVec3};
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};

use super::Reader;
use super::materials::Place;
use crate::error::{Error, Result};
use crate::scene::assemble::MeshTriangle;
use crate::scene::material::DEFAULT_KD;
use crate::scene::material::MadeUp;

/// Set of texture coordinates that says where a surface lies in its light map.
const LIGHT_SET: u32 = 1;

impl Reader<'_> {
    /// # Errors
    /// An index out of range; attributes of different lengths; a position that is not finite.
    pub fn primitive(&mut self, primitive: &Primitive, placed: DAffine3) -> Result<()> {
        let path = self.path;
        let bad = |what: &str| Error::file(path, format!("a primitive {what}"));
        let refuse = |what: &str| Err(bad(what));
        let reader = primitive.reader(|buffer| {
            let data = self.file.buffers.get(buffer.index())?;
            Some(data.0.as_slice())
        });
        let Some(positions) = reader.read_positions() else {
            return refuse("has no positions");
        };
        let positions: Vec<DVec3> = positions
            .map(|p| placed.transform_point3(DVec3::from(p.map(f64::from))))
            .collect();
        if !positions.iter().all(|p| p.is_finite()) {
            return refuse("has a position that is not finite");
        }
        let count = positions.len() as u32;
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..count).collect(),
        };
        if indices.iter().any(|&i| i >= count) {
            return refuse("has an index out of range");
        }
        let triangles: Vec<[u32; 3]> = match primitive.mode() {
            Mode::Triangles => indices.as_chunks::<3>().0.to_vec(),
            Mode::TriangleStrip => (indices.windows(3).enumerate())
                .map(|(k, of)| match k % 2 {
                    0 => [of[0], of[1], of[2]],
                    _ => [of[1], of[0], of[2]],
                })
                .collect(),
            Mode::TriangleFan => (indices.windows(2).skip(1))
                .map(|of| [of[0], of[1], indices[0]])
                .collect(),
            _ => {
                self.skipped.lines += 1;
                return Ok(());
            }
        };
        self.skipped.morphs += usize::from(primitive.morph_targets().len() > 0);
        let has_colours = primitive.get(&Semantic::Colors(0)).is_some();
        self.skipped.colours += usize::from(has_colours);

        let none = self.materials.list.len() - 1;
        let material = primitive.material().index().unwrap_or(none);
        if material == none && self.materials.made_up.is_empty() {
            self.materials.made_up.push(MadeUp {
                material: self.materials.list[none].name.clone(),
                kd: DEFAULT_KD,
            });
        }
        let coordinates = |place: Place| -> Result<Option<Vec<[f32; 2]>>> {
            let Some(uv) = reader.read_tex_coords(place.set) else {
                return Ok(None);
            };
            let uv: Vec<_> = uv.into_f32().map(|uv| place.apply(uv)).collect();
            if uv.len() < positions.len() {
                return Err(bad("has fewer texture coordinates than positions"));
            }
            if !uv.iter().flatten().all(|c| c.is_finite()) {
                return Err(bad("has a texture coordinate that is not finite"));
            }
            Ok(Some(uv))
        };
        let uv = coordinates(self.materials.places[material])?;
        let emission_uv = match self.materials.emission_places[material] {
            Some(place) => coordinates(place)?,
            None => None,
        };
        // Not where its textures lie: those repeat.
        let own = self.materials.places[material].set != LIGHT_SET
            && self.materials.emission_places[material].is_none_or(|of| of.set != LIGHT_SET);
        let light_uv = match own {
            true => coordinates(Place::of_set(LIGHT_SET))?,
            false => None,
        };
        // A mirrored node shows the other side of what it places.
        let mirrored = placed.matrix3.determinant() < 0.0;
        let mesh = &mut self.found.mesh;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(positions);
        for mut corners in triangles {
            if mirrored {
                corners.swap(1, 2);
            }
            mesh.triangles.push(MeshTriangle {
                corners: corners.map(|v| first + v),
                uv: uv.as_ref().map(|uv| corners.map(|v| uv[v as usize])),
                emission_uv: (emission_uv.as_ref()).map(|uv| corners.map(|v| uv[v as usize])),
                light_uv: (light_uv.as_ref()).map(|uv| corners.map(|v| uv[v as usize])),
                material: material as u32,
            });
        }
        Ok(())
    }
}
