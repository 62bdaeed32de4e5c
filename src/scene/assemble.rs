//! Merges meshes into one scene: welds, drops triangles without area and duplicates, makes up
//! texture coordinates.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use glam::DVec3;

use super::material::MadeUp;
use super::mesh_file::MeshFile;
use super::meshes::{self, Names, Part};
use super::said::Said;
use super::sides::{self, Choice, Sides};
use super::uv::{OnSurface, box_projection};
use super::{ImportOptions, Material, Scene, Triangle, masks};
use crate::error::{Error, Result};

/// A mesh before it is added to a scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<MeshTriangle>,
    pub materials: Vec<Material>,
    /// Materials for which a reflectance was made up.
    pub made_up: Vec<MadeUp>,
    /// Where the maps of each material lie, `[material]`; of those made up, as the mesh says.
    pub on_surface: Vec<OnSurface>,
    /// Ascending, from the first triangle on; equal names are one mesh.
    pub parts: Vec<Part>,
    pub said: Said,
}

impl Mesh {
    /// The same as one mesh of a name.
    pub fn named(mut self, name: &str) -> Self {
        self.parts = vec![Part {
            name: name.to_owned(),
            first: 0,
        }];
        self
    }

    /// Turns a mesh whose z axis points up, so that y does.
    pub fn turn_z_up(&mut self) {
        for p in &mut self.positions {
            *p = DVec3::new(p.x, p.z, -p.y);
        }
    }

    /// Triangles of one material, without texture coordinates.
    pub fn bare(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            positions,
            triangles: triangles
                .into_iter()
                .map(|corners| MeshTriangle {
                    corners,
                    uv: None,
                    emission_uv: None,
                    light_uv: None,
                    material: 0,
                })
                .collect(),
            ..Self::default()
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct MeshTriangle {
    /// Indices into [`Mesh::positions`].
    pub corners: [u32; 3],
    pub uv: Option<[[f32; 2]; 3]>,
    /// As [`Triangle::emission_uv`].
    pub emission_uv: Option<[[f32; 2]; 3]>,
    /// As [`Triangle::light_uv`].
    pub light_uv: Option<[[f32; 2]; 3]>,
    /// Index into [`Mesh::materials`].
    pub material: u32,
}

/// Height over longest edge below which the direction of the normal is only rounding error.
const LEAST_HEIGHT: f64 = 1e-10;

/// A scene while meshes are added to it.
pub(super) struct Assembly {
    pub scene: Scene,
    welded: HashMap<[u64; 3], u32>,
    /// Corners of each triangle in their order, the least first.
    known: HashSet<[u32; 3]>,
    projected: usize,
    /// Of meshes.
    names: Names,
    /// Index of each material by its name.
    materials: HashMap<String, u32>,
    /// The next number for materials of a name that is taken.
    numbers: HashMap<String, u32>,
    /// What is left to be found of the sides of each triangle, `[triangle]`.
    choices: Vec<Choice>,
}

impl Assembly {
    pub fn new(name: String, path: Option<&Path>) -> Self {
        Self {
            scene: Scene {
                name,
                path: path.map(Path::to_owned),
                ..Scene::default()
            },
            welded: HashMap::new(),
            known: HashSet::new(),
            projected: 0,
            names: Names::default(),
            materials: HashMap::new(),
            numbers: HashMap::new(),
            choices: Vec::new(),
        }
    }

    /// Adds materials and returns their indices in the scene. An equal one is shared; one whose
    /// name is taken by another material gets a number.
    pub fn add_materials(&mut self, materials: &[Material]) -> Vec<u32> {
        materials.iter().map(|m| self.add_material(m)).collect()
    }

    fn add_material(&mut self, material: &Material) -> u32 {
        let known = &mut self.scene.materials;
        let same = self.materials.get(&material.name);
        if let Some(&index) = same.filter(|&&index| known[index as usize] == *material) {
            return index;
        }
        let mut material = material.clone();
        let name = material.name.clone();
        if same.is_some() {
            let number = self.numbers.entry(name.clone()).or_insert(2);
            while self.materials.contains_key(&material.name) {
                material.name = format!("{name}.{number}");
                *number += 1;
            }
        }
        if material.name != name {
            self.scene.notes.push(format!(
                "two meshes have different materials \"{name}\": the later one is \"{}\"",
                material.name
            ));
        }
        let index = known.len() as u32;
        self.materials.insert(material.name.clone(), index);
        known.push(material);
        index
    }

    /// Adds the triangles of a mesh in their order; `materials` gives the scene's index for each of
    /// the mesh's.
    ///
    /// # Errors
    /// A position that is not finite.
    pub fn add_mesh(&mut self, mesh: &Mesh, materials: &[u32]) -> Result<()> {
        let mut known: HashMap<&str, String> = HashMap::new();
        let mut names = Vec::with_capacity(mesh.parts.len());
        for part in &mesh.parts {
            let new = || self.names.free(&part.name);
            names.push(known.entry(&part.name).or_insert_with(new).clone());
        }
        let mut part = 0;
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            while mesh
                .parts
                .get(part + 1)
                .is_some_and(|next| next.first <= index)
            {
                part += 1;
            }
            let corners = triangle.corners.map(|v| mesh.positions[v as usize]);
            if let Some(bad) = corners.iter().find(|p| !p.is_finite()) {
                return Err(Error::Scene {
                    scene: self.scene.name.clone(),
                    what: format!("a vertex lies at ({}, {}, {})", bad.x, bad.y, bad.z),
                });
            }
            if is_degenerate(corners) {
                self.scene.dropped_degenerate += 1;
                continue;
            }
            let vertices = corners.map(|p| self.weld(p));
            // Two triangles in one place would both reflect the light that falls there: each bounce
            // would double it.
            if !self.known.insert(least_first(vertices)) {
                self.scene.dropped_duplicates += 1;
                continue;
            }
            let uv = triangle.uv.unwrap_or_else(|| {
                self.projected += 1;
                box_projection(corners)
            });
            self.scene.triangles.push(Triangle {
                vertices,
                uv,
                emission_uv: triangle.emission_uv,
                light_uv: triangle.light_uv,
                material: materials[triangle.material as usize],
            });
            let name = names.get(part).unwrap_or(&self.scene.name);
            meshes::add(&mut self.scene.meshes, name);
        }
        Ok(())
    }

    /// Adds a file's mesh with all that it says, its lights and its cameras. Names of lights and
    /// cameras that are taken get a number.
    ///
    /// # Errors
    /// A position that is not finite.
    pub fn add(&mut self, file: MeshFile, sides: Option<Sides>) -> Result<()> {
        let MeshFile {
            mesh,
            two_sided,
            lights,
            cameras,
        } = file;
        let materials = self.add_materials(&mesh.materials);
        let first = self.scene.triangles.len();
        self.add_mesh(&mesh, &materials)?;
        match sides {
            None if two_sided.contains(&true) => {
                let of_scene = (materials.iter().zip(&two_sided)).filter(|(_, two)| **two);
                let two_sided: HashSet<u32> = of_scene.map(|(&material, _)| material).collect();
                let of = |t: &Triangle| match two_sided.contains(&t.material) {
                    true => Choice::Two,
                    false => Choice::One,
                };
                let new = self.scene.triangles[first..].iter();
                self.choices.extend(new.map(of));
            }
            _ => self.give_sides(first, sides),
        }
        let scene = &mut self.scene;
        let known = &mut scene.lights;
        for mut light in lights.points {
            light.name = free_name(light.name, known.points.iter().map(|l| &l.name));
            known.points.push(light);
        }
        for mut sun in lights.suns {
            sun.name = free_name(sun.name, known.suns.iter().map(|l| &l.name));
            known.suns.push(sun);
        }
        for mut camera in cameras {
            camera.name = free_name(camera.name, scene.cameras.iter().map(|c| &c.name));
            scene.cameras.push(camera);
        }
        scene.warnings.extend(mesh.said.warnings);
        let made_up = mesh.made_up.iter().map(MadeUp::to_string);
        for note in mesh.said.notes.into_iter().chain(made_up) {
            if !scene.notes.contains(&note) {
                scene.notes.push(note);
            }
        }
        Ok(())
    }

    /// Gives the triangles from `first` on the sides that are asked for; those of none are found.
    pub fn give_sides(&mut self, first: usize, sides: Option<Sides>) {
        match sides {
            None | Some(Sides::AsGiven) => {}
            Some(Sides::Outward) => sides::face(&mut self.scene, first, true),
            Some(Sides::Inward) => sides::face(&mut self.scene, first, false),
            Some(Sides::Both) => {
                for t in first..self.scene.triangles.len() {
                    self.add_back(t);
                }
            }
        }
        let choice = match sides {
            None => Choice::One,
            Some(_) => Choice::None,
        };
        self.choices.resize(self.scene.triangles.len(), choice);
    }

    /// Adds a lamp that is a surface; it emits from its fronts.
    ///
    /// # Errors
    /// A position that is not finite.
    #[cfg(feature = "formats")]
    pub fn add_lamp(&mut self, mesh: &Mesh) -> Result<()> {
        let first = self.scene.triangles.len();
        let materials = self.add_materials(&mesh.materials);
        self.add_mesh(mesh, &materials)?;
        self.give_sides(first, Some(Sides::AsGiven));
        Ok(())
    }

    /// Adds the back of a triangle, to its mesh.
    fn add_back(&mut self, t: usize) {
        let scene = &mut self.scene;
        // Light maps have no room for both sides in one place.
        let back = Triangle {
            light_uv: None,
            ..sides::turned(&scene.triangles[t])
        };
        if self.known.insert(least_first(back.vertices)) {
            scene.triangles.push(back);
            let name = meshes::name(&scene.meshes, t as u32).unwrap_or(&scene.name);
            let name = name.to_owned();
            meshes::add(&mut scene.meshes, &name);
        }
    }

    fn weld(&mut self, position: DVec3) -> u32 {
        // Adding zero turns −0 into 0: the same position with other bits.
        let position = position + DVec3::ZERO;
        let vertices = &mut self.scene.vertices;
        *self
            .welded
            .entry(position.to_array().map(f64::to_bits))
            .or_insert_with(|| {
                vertices.push(position);
                vertices.len() as u32 - 1
            })
    }

    /// The scene, its masks cut out and the sides found that were not given, unless `import` leaves
    /// them.
    ///
    /// # Errors
    /// See [`Scene::cut_masks`].
    pub fn into_imported(mut self, import: &ImportOptions) -> Result<Scene> {
        self.cut_masks()?;
        let backs = match import.sides_as_given {
            true => sides::of_sheets(&self.scene, &self.choices),
            false => sides::turn_dark(&mut self.scene, &self.choices),
        };
        for t in backs {
            self.add_back(t);
        }
        Ok(self.into_scene())
    }

    fn cut_masks(&mut self) -> Result<()> {
        let Some(cut) = masks::cut(&mut self.scene)? else {
            return Ok(());
        };
        self.choices = cut.from.iter().map(|&t| self.choices[t as usize]).collect();
        self.known = (cut.triangles.iter())
            .map(|t| least_first(t.vertices))
            .collect();
        let scene = &mut self.scene;
        scene.meshes = meshes::of_cut(&scene.meshes, &cut.from);
        (scene.vertices, scene.triangles) = (cut.vertices, cut.triangles);
        Ok(())
    }

    pub fn into_scene(mut self) -> Scene {
        if self.projected > 0 {
            self.scene.notes.push(format!(
                "{} triangles have no texture coordinates: box projection was used, one repeat per scene unit",
                self.projected
            ));
        }
        self.scene
    }
}

/// A name that no other has: with a number if it is taken.
pub(super) fn free_name<'a>(
    name: String,
    taken: impl Iterator<Item = &'a String> + Clone,
) -> String {
    let numbered = |number: usize| match number {
        1 => name.clone(),
        _ => format!("{name}.{number}"),
    };
    let is_free = |name: &String| !taken.clone().any(|other| other == name);
    (1..).map(numbered).find(is_free).unwrap_or_default()
}

/// Corners in their order, the least first.
fn least_first(vertices: [u32; 3]) -> [u32; 3] {
    let least = (0..3).fold(0, |l, i| if vertices[i] < vertices[l] { i } else { l });
    [0, 1, 2].map(|i| vertices[(least + i) % 3])
}

/// Whether a triangle has practically no area: height over longest edge below [`LEAST_HEIGHT`].
pub(super) fn is_degenerate([a, b, c]: [DVec3; 3]) -> bool {
    let edges = [b - a, c - b, a - c];
    let size = edges
        .iter()
        .map(|e| e.abs().max_element())
        .fold(0.0, f64::max);
    // Lengths that overflow f64 are rejected later, by the check of the whole scene.
    if size == 0.0 || size.is_infinite() {
        return size == 0.0;
    }
    // Scaled first, so that no square overflows.
    let [ab, bc, ca] = edges.map(|e| e / size);
    let longest = ab
        .length_squared()
        .max(bc.length_squared())
        .max(ca.length_squared());
    ab.cross(ca).length() < LEAST_HEIGHT * longest
}
