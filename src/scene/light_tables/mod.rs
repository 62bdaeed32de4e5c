//! The lights of `scene.toml`.

mod point;
mod sky;
mod strength;
mod sun;

use glam::DVec3;

use super::assemble::Assembly;
use super::lamps::{DiskLampTable, SphereLampTable};
use super::scene_file::{Lines, SceneFile, taken};
use crate::error::Result;
pub(super) use point::PointLightTable;
pub(super) use sky::{Model, SkyTable};
pub(super) use strength::{Amount, Power, Strength};
pub(super) use sun::SunTable;

/// Which way is up, and azimuth 0.
#[derive(Clone, Copy)]
pub(super) struct Compass {
    pub up: DVec3,
    pub north: DVec3,
}

/// Adds the lights of the tables to a scene.
///
/// # Errors
/// A table that contradicts itself or is out of range, with its line; files that it names.
pub(super) fn add(file: &SceneFile, lines: &Lines, assembly: &mut Assembly) -> Result<()> {
    for (index, spanned) in file.point_light.iter().enumerate() {
        let table = spanned.get_ref();
        let name = table
            .name
            .clone()
            .unwrap_or_else(|| format!("light {}", index + 1));
        let refuse = |what: String| {
            lines.error(
                spanned.span().start,
                format!("point light \"{name}\": {what}"),
            )
        };
        let (light, warnings) = table
            .light(name.clone(), lines.path)
            .map_err(|e| e.at(refuse))?;
        let scene = &mut assembly.scene;
        if let Some(what) = taken(&name, scene.lights.points.iter().map(|l| &l.name)) {
            return Err(refuse(what));
        }
        scene.warnings.extend(warnings);
        scene.lights.points.push(light);
    }
    let compass = match &file.sky {
        Some(sky) => {
            let refuse = |what: String| lines.error(sky.span().start, format!("sky: {what}"));
            let compass = Compass::of(sky.get_ref().up, sky.get_ref().north).map_err(refuse)?;
            let (made, sun) = (sky.get_ref().sky(compass, lines.path)).map_err(|e| e.at(refuse))?;
            let scene = &mut assembly.scene;
            scene.lights.sky = Some(made);
            if let Some(mut sun) = sun {
                let taken = scene.lights.suns.iter().map(|l| &l.name);
                sun.name = super::assemble::free_name(sun.name, taken);
                scene.lights.suns.push(sun);
            }
            Some(compass)
        }
        None => None,
    };
    for (index, spanned) in file.sun.iter().enumerate() {
        let table = spanned.get_ref();
        let name = table
            .name
            .clone()
            .unwrap_or_else(|| format!("sun {}", index + 1));
        let refuse =
            |what: String| lines.error(spanned.span().start, format!("sun \"{name}\": {what}"));
        let sun = table.sun(name.clone(), compass).map_err(refuse)?;
        let suns = &mut assembly.scene.lights.suns;
        if let Some(what) = taken(&name, suns.iter().map(|l| &l.name)) {
            return Err(refuse(what));
        }
        suns.push(sun);
    }
    add_lamps(file, lines, assembly)
}

/// Adds sphere lamps and disk lamps as triangles.
fn add_lamps(file: &SceneFile, lines: &Lines, assembly: &mut Assembly) -> Result<()> {
    let spheres = file.sphere_lamp.iter().enumerate().map(|(index, spanned)| {
        let lamp: &SphereLampTable = spanned.get_ref();
        (
            "sphere lamp",
            index,
            &lamp.name,
            lamp.mesh(),
            spanned.span(),
        )
    });
    let disks = file.disk_lamp.iter().enumerate().map(|(index, spanned)| {
        let lamp: &DiskLampTable = spanned.get_ref();
        ("disk lamp", index, &lamp.name, lamp.mesh(), spanned.span())
    });
    for (kind, index, name, lamp, span) in spheres.chain(disks) {
        let name = name
            .clone()
            .unwrap_or_else(|| format!("{kind} {}", index + 1));
        let refuse = |what: String| lines.error(span.start, format!("{kind} \"{name}\": {what}"));
        let mut mesh = lamp.map_err(refuse)?;
        if name.trim() != name || name.is_empty() || name.contains(char::is_control) {
            return Err(refuse("the name cannot stand in a material file".into()));
        }
        for material in &mut mesh.materials {
            material.name.clone_from(&name);
            material.check().map_err(refuse)?;
        }
        assembly.add_lamp(&mesh.named(&name))?;
    }
    Ok(())
}

/// What is wrong with a table, or with a file that it names.
pub(super) enum Problem {
    /// One clause.
    Table(String),
    File(crate::error::Error),
}

impl From<String> for Problem {
    fn from(what: String) -> Self {
        Self::Table(what)
    }
}

impl From<crate::error::Error> for Problem {
    fn from(error: crate::error::Error) -> Self {
        Self::File(error)
    }
}

impl Problem {
    fn at(self, refuse: impl Fn(String) -> crate::error::Error) -> crate::error::Error {
        match self {
            Self::Table(what) => refuse(what),
            // Errors of files name the file; the table adds its line.
            Self::File(error) => refuse(error.to_string()),
        }
    }
}

impl Compass {
    /// y is up and −z north where nothing is said.
    pub fn of(up: Option<[f64; 3]>, north: Option<[f64; 3]>) -> Result<Self, String> {
        let up = direction("up", up.map_or(DVec3::Y, DVec3::from))?;
        let wanted = north.map_or(-DVec3::Z, DVec3::from);
        let wanted = direction("north", wanted)?;
        if north.is_some() && wanted.cross(up).length() < 1e-6 {
            return Err("north is parallel to up".into());
        }
        let north = super::lights::across(up, Some(wanted));
        Ok(Self { up, north })
    }
}

/// A vector of length 1.
pub(super) fn direction(what: &str, v: DVec3) -> Result<DVec3, String> {
    let problem = || format!("{what} must be finite and not zero");
    match v.is_finite() {
        true => super::lights::unit(v).ok_or_else(problem),
        false => Err(problem()),
    }
}

/// The one of these keys that is given; two contradict each other.
pub(super) fn one_of<const N: usize>(
    keys: [(&'static str, bool); N],
) -> Result<Option<&'static str>, String> {
    let mut given = keys.iter().filter(|(_, given)| *given).map(|(key, _)| *key);
    let first = given.next();
    match (first, given.next()) {
        (Some(a), Some(b)) => Err(format!(
            "{a} and {b} contradict each other: give one of them"
        )),
        _ => Ok(first),
    }
}
