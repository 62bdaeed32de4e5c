//! Where a picture is taken from.

use clap::Args;
use glam::DVec3;

use mesolux::error::{Error, Result};
use mesolux::scene::{Camera, Scene};

#[derive(Args, Default)]
pub struct CameraOptions {
    /// A camera of the scene, by name; the first one if not given
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Where the camera stands, scene units
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    look_from: Option<DVec3>,
    /// The point in the middle of the picture, scene units
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    look_at: Option<DVec3>,
    /// Vertical field of view, degrees
    #[arg(long, value_name = "DEGREES", value_parser = angle)]
    fov: Option<f64>,
}

fn place(text: &str) -> std::result::Result<DVec3, String> {
    let wrong = || "must be like 0.5,1,-2".to_owned();
    let numbers: Vec<f64> = text
        .split(',')
        .map(|n| n.trim().parse().map_err(|_| wrong()))
        .collect::<std::result::Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if DVec3::new(x, y, z).is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err(wrong()),
    }
}

fn angle(text: &str) -> std::result::Result<f64, String> {
    let degrees: f64 = text.parse().map_err(|_| "must be degrees".to_owned())?;
    match degrees > 0.0 && degrees < 180.0 {
        true => Ok(degrees),
        false => Err("must be between 0 and 180".into()),
    }
}

impl CameraOptions {
    /// The scene's camera, or the one described.
    pub fn of(&self, scene: &Scene) -> Result<Camera> {
        let found = match &self.camera {
            None => scene.cameras.first(),
            Some(name) => scene.cameras.iter().find(|c| c.name == *name),
        };
        let found = found.ok_or_else(|| {
            let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
            Error::Usage(format!(
                "scene {} has no camera \"{}\"; it has {}",
                scene.name,
                self.camera.as_deref().unwrap_or("default"),
                names.join(", ")
            ))
        })?;
        let moved = [
            ("--look-from", self.look_from.is_some()),
            ("--look-at", self.look_at.is_some()),
            ("--fov", self.fov.is_some()),
        ];
        let by: Vec<_> = moved.iter().filter(|m| m.1).map(|m| m.0).collect();
        Ok(Camera {
            name: match by.is_empty() {
                true => found.name.clone(),
                false => format!("{} with {}", found.name, by.join(", ")),
            },
            position: self.look_from.unwrap_or(found.position),
            look_at: self.look_at.unwrap_or(found.look_at),
            fov_y: self.fov.unwrap_or(found.fov_y),
            ..found.clone()
        })
    }
}
