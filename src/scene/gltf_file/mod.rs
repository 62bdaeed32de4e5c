//! glTF 2.0, `.gltf` and `.glb`.

mod document;
mod images;
mod materials;
mod primitives;
mod uri;

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat4, DVec3};
use gltf::khr_lights_punctual::Kind;

use super::assemble::free_name;
use super::light_units::LUMENS_OF_A_WATT;
use super::lights::{across, unit};
use super::mesh_file::MeshFile;
use super::meshes::{Names, Part};
use super::{Beam, Camera, PointLight, Sun, Web};
use crate::error::{Error, Result};
use document::File;
use materials::Materials;

/// Reads the default scene of a file with its lights and cameras; all nodes if there is none.
///
/// # Errors
/// A file that cannot be read or is no valid glTF; an extension that it requires and that is not
/// known; data out of range; no triangle.
pub(super) fn read(path: &Path) -> Result<MeshFile> {
    let file = File::open(path)?;
    let mut into = Reader {
        path,
        materials: Materials::read(&file)?,
        file: &file,
        found: MeshFile::default(),
        names: Names::default(),
        skipped: Skipped::default(),
    };
    let scene = (file.document.default_scene()).or_else(|| file.document.scenes().next());
    match scene {
        Some(scene) => {
            for node in scene.nodes() {
                into.node(&node, DAffine3::IDENTITY, 0)?;
            }
        }
        None => return Err(Error::file(path, "there is no scene in it")),
    }
    into.finish()
}

/// A file while its nodes are walked.
struct Reader<'a> {
    path: &'a Path,
    file: &'a File,
    materials: Materials,
    found: MeshFile,
    /// Of the nodes that have meshes.
    names: Names,
    skipped: Skipped,
}

/// What has no meaning here.
#[derive(Default)]
struct Skipped {
    lines: usize,
    skins: usize,
    colours: usize,
    morphs: usize,
    orthographic: usize,
}

/// Nodes above one another, at most: more are a circle.
const DEEPEST: usize = 1000;

impl Reader<'_> {
    fn node(&mut self, node: &gltf::Node, above: DAffine3, depth: usize) -> Result<()> {
        let refuse =
            |what: String| Error::file(self.path, format!("node {}: {what}", node.index()));
        if depth > DEEPEST {
            return Err(refuse("it lies within itself, or 1,000 nodes deep".into()));
        }
        let matrix = node
            .transform()
            .matrix()
            .map(|column| column.map(f64::from));
        let placed = above * DAffine3::from_mat4(DMat4::from_cols_array_2d(&matrix));
        if !placed.is_finite() {
            return Err(refuse("its place is not finite".into()));
        }
        if let Some(mesh) = node.mesh() {
            self.skipped.skins += usize::from(node.skin().is_some());
            let unnamed = format!("node {}", node.index());
            let name = node.name().or(mesh.name()).unwrap_or(&unnamed);
            self.found.mesh.parts.push(Part {
                name: self.names.free(name),
                first: self.found.mesh.triangles.len(),
            });
            for primitive in mesh.primitives() {
                self.primitive(&primitive, placed)?;
            }
        }
        if let Some(light) = node.light() {
            self.light(&light, node.name(), placed)?;
        }
        if let Some(camera) = node.camera() {
            self.camera(&camera, node.name(), placed);
        }
        for child in node.children() {
            self.node(&child, placed, depth + 1)?;
        }
        Ok(())
    }

    fn light(
        &mut self,
        light: &gltf::khr_lights_punctual::Light,
        node: Option<&str>,
        at: DAffine3,
    ) -> Result<()> {
        let lights = &mut self.found.lights;
        let count = lights.points.len() + lights.suns.len() + 1;
        let name = node.or(light.name());
        let name = name.map_or_else(|| format!("light {count}"), str::to_owned);
        // Candelas and lux; lights shine along −z.
        let strength = light.intensity() / LUMENS_OF_A_WATT as f32;
        let intensity = light.color().map(|c| c * strength);
        let back = unit(at.matrix3 * DVec3::Z).unwrap_or(DVec3::Z);
        let spot = match light.kind() {
            Kind::Directional => {
                lights.suns.push(Sun {
                    name: free_name(name, lights.suns.iter().map(|l| &l.name)),
                    towards: back,
                    irradiance: intensity,
                    angle: 0.0,
                });
                return Ok(());
            }
            Kind::Point => None,
            Kind::Spot {
                inner_cone_angle: inner,
                outer_cone_angle: outer,
            } => Some((f64::from(inner), f64::from(outer))),
        };
        let is_cone = |(inner, outer): &(f64, f64)| 0.0 <= *inner && inner <= outer && *outer < 3.2;
        if spot.is_some_and(|spot| !is_cone(&spot)) {
            let what = format!("light \"{}\": its cone has no angles", name.escape_debug());
            return Err(Error::file(self.path, what));
        }
        lights.points.push(PointLight {
            name: free_name(name, lights.points.iter().map(|l| &l.name)),
            position: at.translation,
            intensity,
            beam: spot.map(|(inner, outer)| Beam {
                axis: -back,
                zero: across(back, None),
                web: Arc::new(Web::spot(inner, outer)),
            }),
        });
        if light.range().is_some() {
            self.found.mesh.said.warnings.push(format!(
                "{}: a point light has a range, which is not used",
                self.path.display()
            ));
        }
        Ok(())
    }

    fn camera(&mut self, camera: &gltf::Camera, node: Option<&str>, at: DAffine3) {
        let gltf::camera::Projection::Perspective(view) = camera.projection() else {
            self.skipped.orthographic += 1;
            return;
        };
        let count = self.found.cameras.len() + 1;
        let name = node.or(camera.name());
        let name = name.map_or_else(|| format!("camera {count}"), str::to_owned);
        self.found.cameras.push(Camera {
            name: free_name(name, self.found.cameras.iter().map(|c| &c.name)),
            position: at.translation,
            look_at: at.transform_point3(-DVec3::Z),
            up: at.transform_vector3(DVec3::Y),
            fov_y: f64::from(view.yfov()).to_degrees(),
        });
    }

    fn finish(mut self) -> Result<MeshFile> {
        if self.found.mesh.triangles.is_empty() {
            return Err(Error::file(self.path, "there is no triangle in it"));
        }
        let path = self.path.display();
        let said = &mut self.found.mesh.said;
        let Skipped {
            lines,
            skins,
            colours,
            morphs,
            orthographic,
        } = self.skipped;
        let say = |list: &mut Vec<String>, count: usize, what: &str| {
            if count > 0 {
                list.push(format!("{path}: {count} {what}"));
            }
        };
        say(
            &mut said.notes,
            lines,
            "primitives of points or lines are not used",
        );
        say(
            &mut said.notes,
            orthographic,
            "orthographic cameras are not used",
        );
        say(
            &mut said.warnings,
            skins,
            "skinned meshes stand as in their file: skins are not used",
        );
        say(
            &mut said.warnings,
            morphs,
            "primitives have morph targets, which are not used",
        );
        say(
            &mut said.warnings,
            colours,
            "primitives have colours at vertices, which are not used",
        );
        let mut used = vec![false; self.materials.list.len()];
        for triangle in &self.found.mesh.triangles {
            used[triangle.material as usize] = true;
        }
        let materials = self.materials;
        for (material, said) in materials.said.into_iter().enumerate() {
            if used[material] {
                self.found.mesh.said.append(said);
            }
        }
        self.found.mesh.materials = materials.list;
        // The one of primitives without any comes last.
        if used.last() == Some(&false) {
            self.found.mesh.materials.pop();
        }
        self.found.mesh.made_up = materials.made_up;
        self.found.two_sided = materials.two_sided;
        // A camera that cannot be used is no reason to refuse the rest.
        self.found.cameras.retain(|camera| camera.check().is_ok());
        Ok(self.found)
    }
}
