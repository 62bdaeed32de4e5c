//! `scene.toml`: meshes with their placement, changes to materials, lights, cameras.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::assemble::{Assembly, Mesh};
use super::lamps::{DiskLampTable, SphereLampTable};
use super::light_tables::{self, PointLightTable, SkyTable, SunTable};
use super::masks::{AlphaMask, DEFAULT_CUTOFF};
use super::material::{Asked, DEFAULT_KD, MadeUp, TextureCache};
use super::placement::{Placement, Scale};
use super::sides::Sides;
use super::stem::stem;
use super::{Camera, ImportOptions, Material, Scene, check, mesh_file};
use crate::error::{Error, Result};
use crate::input_file::read_text;

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    #[serde(default = "yes", skip_serializing_if = "Clone::clone")]
    pub heights_from_normals: bool,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mesh: Vec<Spanned<MeshTable>>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub material: BTreeMap<String, Spanned<MaterialTable>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point_light: Vec<Spanned<PointLightTable>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sun: Vec<Spanned<SunTable>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky: Option<Spanned<SkyTable>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sphere_lamp: Vec<Spanned<SphereLampTable>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub disk_lamp: Vec<Spanned<DiskLampTable>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub camera: Vec<Spanned<CameraTable>>,
}

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshTable {
    pub file: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<Scale>,
    /// Degrees about x, then y, then z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotate: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translate: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reverse: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub z_up: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sides: Option<Sides>,
}

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialTable {
    kd: Option<[f32; 3]>,
    ke: Option<[f32; 3]>,
    map_kd: Option<String>,
    map_ke: Option<String>,
    height_map: Option<String>,
    /// Scene units for a value of 1.
    height_scale: Option<f32>,
    normal_map: Option<String>,
    alpha_mask: Option<String>,
    alpha_cutoff: Option<f32>,
}

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraTable {
    pub name: Option<String>,
    pub position: [f64; 3],
    pub look_at: [f64; 3],
    #[serde(default = "y_up")]
    pub up: [f64; 3],
    pub fov: f64,
}

fn yes() -> bool {
    true
}

fn y_up() -> [f64; 3] {
    DVec3::Y.to_array()
}

/// Reads a scene file and all that it names; paths are relative to it.
///
/// # Errors
/// Errors of the files it names; any error in its own text, with the line of the table.
pub(super) fn load(path: &Path, import: &ImportOptions) -> Result<Scene> {
    let text = read_text(path)?;
    let lines = Lines { path, text: &text };
    let file: SceneFile = toml::from_str(&text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        lines.error(at, error.message().replace('\n', "; "))
    })?;

    let mut assembly = Assembly::new(file.name.clone().unwrap_or_else(|| stem(path)), Some(path));
    let mut textures = TextureCache::default();
    let mut used = Vec::new();
    for table in &file.mesh {
        add_mesh(
            table,
            &file,
            import,
            &lines,
            &mut textures,
            &mut assembly,
            &mut used,
        )?;
    }
    if let Some((name, table)) = file.material.iter().find(|(name, _)| !used.contains(name)) {
        let what = format!("material \"{name}\" is in no mesh and no mesh asks for it");
        return Err(lines.error(table.span().start, what));
    }

    light_tables::add(&file, &lines, &mut assembly)?;
    let scene = &mut assembly.scene;
    for (index, table) in file.camera.iter().enumerate() {
        let camera = camera(table.get_ref(), index);
        let problem = camera
            .check()
            .err()
            .or_else(|| taken(&camera.name, scene.cameras.iter().map(|c| &c.name)));
        if let Some(what) = problem {
            let what = format!("camera \"{}\": {what}", camera.name);
            return Err(lines.error(table.span().start, what));
        }
        scene.cameras.push(camera);
    }
    let import = ImportOptions {
        heights_from_normals: import.heights_from_normals && file.heights_from_normals,
        ..import.clone()
    };
    check::finish(assembly.into_imported(&import)?, &import)
}

/// The line of a byte of the file.
pub(super) struct Lines<'a> {
    pub path: &'a Path,
    text: &'a str,
}

impl Lines<'_> {
    pub fn error(&self, at: usize, what: String) -> Error {
        let before = &self.text.as_bytes()[..at.min(self.text.len())];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Error::line(self.path, line, what)
    }
}

fn add_mesh(
    spanned: &Spanned<MeshTable>,
    file: &SceneFile,
    import: &ImportOptions,
    lines: &Lines,
    textures: &mut TextureCache,
    assembly: &mut Assembly,
    used: &mut Vec<String>,
) -> Result<()> {
    let table = spanned.get_ref();
    let refuse = |what: String| {
        lines.error(
            spanned.span().start,
            format!("mesh \"{}\": {what}", table.file),
        )
    };
    let placement = Placement::new(table.scale, table.rotate, table.translate).map_err(refuse)?;
    let path = lines.path.with_file_name(&table.file);
    let mut read = mesh_file::read(&path, table.z_up || import.z_up, textures)?;
    let mesh = &mut read.mesh;

    for (name, changes) in &file.material {
        let wanted = table.material.as_ref() == Some(name);
        if wanted || mesh.materials.iter().any(|m| m.name == *name) {
            change_material(name, changes, lines, textures, mesh)?;
            used.push(name.clone());
        }
    }
    if let Some(name) = &table.material {
        let Some(index) = mesh.materials.iter().position(|m| m.name == *name) else {
            return Err(refuse(format!(
                "material \"{name}\" is neither in this file nor in the mesh"
            )));
        };
        // No triangle uses the others any more.
        mesh.materials = vec![mesh.materials.swap_remove(index)];
        mesh.made_up.retain(|made_up| made_up.material == *name);
        mesh.triangles.iter_mut().for_each(|t| t.material = 0);
        read.two_sided = read.two_sided.get(index).copied().into_iter().collect();
    }
    placement.apply(&mut read, table.reverse).map_err(refuse)?;

    assembly.add(read, table.sides)
}

/// Applies `[material.name]` to a mesh that has such a material or is assigned it.
fn change_material(
    name: &str,
    spanned: &Spanned<MaterialTable>,
    lines: &Lines,
    textures: &mut TextureCache,
    mesh: &mut Mesh,
) -> Result<()> {
    let refuse =
        |what: String| lines.error(spanned.span().start, format!("material \"{name}\": {what}"));
    if name.trim() != name || name.is_empty() || name.contains(char::is_control) {
        return Err(refuse("the name cannot stand in a material file".into()));
    }
    let changes = spanned.get_ref();
    let index = match mesh.materials.iter().position(|m| m.name == name) {
        Some(index) => index,
        None => {
            let kd = if changes.map_kd.is_some() {
                1.0
            } else {
                DEFAULT_KD
            };
            mesh.materials.push(Material {
                name: name.to_owned(),
                kd: [kd; 3],
                ..Material::default()
            });
            mesh.made_up.push(MadeUp {
                material: name.to_owned(),
                kd,
            });
            mesh.materials.len() - 1
        }
    };
    let material = &mut mesh.materials[index];
    if let Some(kd) = changes.kd {
        material.kd = kd;
        mesh.made_up.retain(|made_up| made_up.material != name);
    }
    if let Some(ke) = changes.ke {
        material.ke = ke;
    }
    let asked = |keyword| Asked {
        file: lines.path,
        material: name,
        keyword,
    };
    if let Some(file) = &changes.map_kd {
        material.map_kd = Some(textures.texture(asked("map_kd"), file)?);
    }
    if let Some(file) = &changes.map_ke {
        material.map_ke = Some(textures.texture(asked("map_ke"), file)?);
        // A texture without a factor is the emission itself.
        if changes.ke.is_none() && !material.emits() {
            material.ke = [1.0; 3];
        }
    }
    if let Some(file) = &changes.height_map {
        material.map_height = Some(textures.heights(asked("height_map"), file, None)?);
    }
    if let Some(scale) = changes.height_scale {
        if material.map_height.is_none() {
            return Err(refuse("height_scale needs a height_map".into()));
        }
        material.height_scale = scale;
    }
    if let Some(file) = &changes.normal_map {
        material.map_normal = Some(textures.normals(asked("normal_map"), file)?);
    }
    if let Some(file) = &changes.alpha_mask {
        material.alpha_mask = Some(AlphaMask {
            map: textures.alpha(asked("alpha_mask"), file, None, false)?,
            factor: 1.0,
            cutoff: DEFAULT_CUTOFF,
        });
    }
    match (changes.alpha_cutoff, &mut material.alpha_mask) {
        (Some(cutoff), Some(mask)) => mask.cutoff = cutoff,
        (Some(_), None) => return Err(refuse("alpha_cutoff needs an alpha_mask".into())),
        (None, _) => {}
    }
    mesh.said.notes.append(&mut textures.notes);
    material.check().map_err(refuse)
}

fn camera(table: &CameraTable, index: usize) -> Camera {
    Camera {
        name: table
            .name
            .clone()
            .unwrap_or_else(|| format!("camera {}", index + 1)),
        position: DVec3::from(table.position),
        look_at: DVec3::from(table.look_at),
        up: DVec3::from(table.up),
        fov_y: table.fov,
    }
}

/// What is wrong with a name that is in use, one clause.
pub(super) fn taken<'a>(name: &str, mut names: impl Iterator<Item = &'a String>) -> Option<String> {
    names
        .any(|known| known == name)
        .then(|| "an earlier one has this name".into())
}
