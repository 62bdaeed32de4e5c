//! What is in a scene, in names and figures.

use std::collections::{BTreeMap, HashMap};

use serde::{Deserialize, Serialize};

use super::{HeightMap, Material, Scene};

/// What is in a scene as it was read, before it was refined. Lengths are in scene units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contents {
    pub name: String,
    pub vertices: usize,
    pub triangles: usize,
    /// Triangles without area, and repeated ones, that were left out.
    pub left_out: usize,
    /// The least and the greatest corner of the box around all vertices.
    pub bounds: [[f64; 3]; 2],
    pub area: f64,
    pub meshes: Vec<MeshContents>,
    /// In the order of [`Scene::materials`].
    pub materials: Vec<MaterialContents>,
    pub lights: Vec<LightContents>,
    pub cameras: Vec<CameraContents>,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshContents {
    pub name: String,
    /// Runs of triangles: the first one and their number, ascending.
    pub ranges: Vec<[u32; 2]>,
    pub area: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MaterialContents {
    pub name: String,
    pub triangles: usize,
    pub area: f64,
    /// Reflectance, RGB.
    pub kd: [f32; 3],
    /// Emitted radiance, W·m⁻²·sr⁻¹, RGB.
    pub ke: [f32; 3],
    /// Files of its maps, by their keys in `scene.toml`.
    pub maps: BTreeMap<String, String>,
    /// From the lowest to the highest place of its relief, where it has one.
    pub relief: Option<f64>,
}

/// A light that is no surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LightContents {
    pub name: String,
    /// `point`, `beam`, `sun` or `sky`.
    pub kind: String,
    /// RGB. Of a point and a beam the intensity, W·sr⁻¹; of a sun the irradiance, W·m⁻²; of a sky
    /// what its radiance is multiplied by.
    pub strength: [f32; 3],
    /// Where a point or a beam stands; where a sun is, as a direction.
    pub place: Option<[f64; 3]>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraContents {
    pub name: String,
    pub position: [f64; 3],
    pub look_at: [f64; 3],
    /// Vertical, degrees.
    pub fov: f64,
}

/// How many elements belong to what.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ElementCounts {
    pub elements: usize,
    /// As [`Contents::meshes`].
    pub of_meshes: Vec<usize>,
    /// As [`Contents::materials`].
    pub of_materials: Vec<usize>,
}

impl Contents {
    /// Of a scene or, where it was refined, of its input.
    pub fn of(scene: &Scene) -> Self {
        let refined = scene.refined_from.as_ref();
        let input = |t: usize| refined.map_or(t, |from| from.on_input[t].triangle as usize);
        let last = (0..scene.triangles.len()).map(input).max();
        let mut known = vec![false; last.map_or(0, |last| last + 1)];
        let mut meshes = meshes(scene);
        let ranges = Ranges::of(&meshes);
        let mut materials: Vec<MaterialContents> = scene.materials.iter().map(material).collect();
        for (t, triangle) in scene.triangles.iter().enumerate() {
            let [a, b, c] = scene.corners(triangle);
            let area = 0.5 * (b - a).cross(c - a).length();
            let of = &mut materials[triangle.material as usize];
            of.area += area;
            let first = !std::mem::replace(&mut known[input(t)], true);
            of.triangles += usize::from(first);
            if let Some(mesh) = ranges.mesh(input(t) as u32) {
                meshes[mesh].area += area;
            }
        }
        let (low, high) = scene.bounds();
        Self {
            name: scene.name.clone(),
            vertices: refined.map_or(scene.vertices.len(), |from| from.vertices),
            triangles: known.len(),
            left_out: scene.dropped_degenerate + scene.dropped_duplicates,
            bounds: [low.to_array(), high.to_array()],
            area: materials.iter().map(|material| material.area).sum(),
            meshes,
            materials,
            lights: lights(scene),
            cameras: (scene.cameras.iter())
                .map(|camera| CameraContents {
                    name: camera.name.clone(),
                    position: camera.position.to_array(),
                    look_at: camera.look_at.to_array(),
                    fov: camera.fov_y,
                })
                .collect(),
            notes: scene.notes.clone(),
            warnings: scene.warnings.clone(),
        }
    }

    /// Counts elements, of each of which the triangle of the input and the material are given.
    ///
    /// # Errors
    /// A triangle or a material that these contents do not have, in one clause.
    pub fn count(
        &self,
        elements: impl Iterator<Item = (u32, u32)>,
    ) -> Result<ElementCounts, String> {
        let ranges = Ranges::of(&self.meshes);
        let mut counts = ElementCounts {
            elements: 0,
            of_meshes: vec![0; self.meshes.len()],
            of_materials: vec![0; self.materials.len()],
        };
        for (triangle, material) in elements {
            let wrong = || format!("element {} is of no mesh or no material", counts.elements);
            let mesh = ranges.mesh(triangle);
            if mesh.is_none() && !self.meshes.is_empty() {
                return Err(wrong());
            }
            let Some(of_material) = counts.of_materials.get_mut(material as usize) else {
                return Err(wrong());
            };
            *of_material += 1;
            if let Some(mesh) = mesh {
                counts.of_meshes[mesh] += 1;
            }
            counts.elements += 1;
        }
        Ok(counts)
    }
}

/// The ranges of all meshes: first triangle, number, mesh.
struct Ranges(Vec<(u32, u32, usize)>);

impl Ranges {
    fn of(meshes: &[MeshContents]) -> Self {
        let all = meshes.iter().enumerate();
        let mut ranges: Vec<_> = all
            .flat_map(|(m, mesh)| mesh.ranges.iter().map(move |&[first, n]| (first, n, m)))
            .collect();
        ranges.sort_unstable();
        Self(ranges)
    }

    fn mesh(&self, triangle: u32) -> Option<usize> {
        let after = self.0.partition_point(|(first, ..)| *first <= triangle);
        let &(first, count, mesh) = self.0.get(after.checked_sub(1)?)?;
        (triangle - first < count).then_some(mesh)
    }
}

fn meshes(scene: &Scene) -> Vec<MeshContents> {
    let mut known: HashMap<&str, usize> = HashMap::new();
    let mut meshes: Vec<MeshContents> = Vec::new();
    for range in &scene.meshes {
        let index = *known.entry(&range.name).or_insert(meshes.len());
        if index == meshes.len() {
            meshes.push(MeshContents {
                name: range.name.clone(),
                ranges: Vec::new(),
                area: 0.0,
            });
        }
        meshes[index].ranges.push([range.first, range.count]);
    }
    meshes
}

fn material(material: &Material) -> MaterialContents {
    let heights = material.map_height.as_deref();
    let maps = [
        ("map_kd", material.map_kd.as_deref().map(|map| &map.path)),
        ("map_ke", material.map_ke.as_deref().map(|map| &map.path)),
        ("height_map", heights.map(|map| &map.path)),
        (
            "normal_map",
            material.map_normal.as_deref().map(|map| &map.path),
        ),
    ];
    let maps = maps.into_iter().filter_map(|(key, path)| {
        let path = path?.display().to_string();
        Some((key.to_owned(), path))
    });
    let range = |map: &HeightMap| {
        let ends = (f32::INFINITY, f32::NEG_INFINITY);
        let (low, high) = (map.values.iter()).fold(ends, |(l, h), &v| (l.min(v), h.max(v)));
        f64::from(high - low) * f64::from(material.height_scale.abs())
    };
    MaterialContents {
        name: material.name.clone(),
        triangles: 0,
        area: 0.0,
        kd: material.kd,
        ke: material.ke,
        maps: maps.collect(),
        relief: heights.filter(|_| material.has_relief()).map(range),
    }
}

fn lights(scene: &Scene) -> Vec<LightContents> {
    let lights = &scene.lights;
    let points = lights.points.iter().map(|light| LightContents {
        name: light.name.clone(),
        kind: if light.beam.is_some() {
            "beam"
        } else {
            "point"
        }
        .into(),
        strength: light.intensity,
        place: Some(light.position.to_array()),
    });
    let suns = lights.suns.iter().map(|sun| LightContents {
        name: sun.name.clone(),
        kind: "sun".into(),
        strength: sun.irradiance,
        place: Some(sun.towards.to_array()),
    });
    let sky = lights.sky.iter().map(|sky| LightContents {
        name: "sky".into(),
        kind: "sky".into(),
        strength: sky.scale,
        place: None,
    });
    points.chain(suns).chain(sky).collect()
}
