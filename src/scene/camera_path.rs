//! Paths of a camera through a series of pictures.

use glam::{DQuat, DVec3};

use super::Camera;
use crate::error::{Error, Result};

/// Most pictures of a series: what nine digits can number.
pub const MOST_FRAMES: u32 = 999_999_999;

/// `frames` cameras about `camera.look_at`, turned about its up. Over 360° the first is `camera`
/// itself and the last is one step before it, so that the series can be repeated; over less,
/// `camera` is in the middle.
///
/// # Errors
/// No frames, or too many; degrees not in −360..=360.
pub fn turntable(camera: &Camera, degrees: f64, frames: u32) -> Result<Vec<Camera>> {
    check(frames)?;
    if !(-360.0..=360.0).contains(&degrees) {
        return Err(Error::Usage(format!(
            "--turn {degrees}: must be in -360 to 360 degrees"
        )));
    }
    let axis = camera.up.normalize_or_zero();
    let whole = degrees.abs() == 360.0;
    let angle = |i: u32| match (whole, frames) {
        (true, _) => degrees * f64::from(i) / f64::from(frames),
        (false, 1) => 0.0,
        (false, _) => degrees * (f64::from(i) / f64::from(frames - 1) - 0.5),
    };
    Ok((0..frames)
        .map(|i| {
            let turn = DQuat::from_axis_angle(axis, angle(i).to_radians());
            Camera {
                name: format!("frame {}", i + 1),
                // Exactly the camera itself where nothing is turned.
                position: match angle(i) {
                    0.0 => camera.position,
                    _ => camera.look_at + turn * (camera.position - camera.look_at),
                },
                ..camera.clone()
            }
        })
        .collect())
}

/// `frames` cameras on a smooth path through all of `cameras` in their order, from the first to the
/// last: uniform Catmull–Rom splines (Catmull and Rom 1974) of eye, target, up and field of view.
/// Beyond its ends the path is extended linearly.
///
/// # Errors
/// Fewer than two cameras; no frames, or too many.
pub fn through(cameras: &[Camera], frames: u32) -> Result<Vec<Camera>> {
    check(frames)?;
    if cameras.len() < 2 {
        return Err(Error::Usage(format!(
            "--path cameras: the scene has {} camera{}, a path needs two",
            cameras.len(),
            if cameras.len() == 1 { "" } else { "s" }
        )));
    }
    let legs = (cameras.len() - 1) as f64;
    Ok((0..frames)
        .map(|i| {
            let at = legs * f64::from(i) / f64::from((frames - 1).max(1));
            let leg = (at.floor()).min(legs - 1.0);
            let spline = Spline {
                cameras,
                leg: leg as usize,
                t: at - leg,
            };
            Camera {
                name: format!("frame {}", i + 1),
                position: spline.at(|c| c.position),
                look_at: spline.at(|c| c.look_at),
                up: spline.at(|c| c.up.normalize_or_zero()).normalize_or_zero(),
                // A spline may overshoot the values that it goes through.
                fov_y: spline.at(|c| DVec3::splat(c.fov_y)).x.clamp(1.0, 179.0),
            }
        })
        .collect())
}

fn check(frames: u32) -> Result<()> {
    match (1..=MOST_FRAMES).contains(&frames) {
        true => Ok(()),
        false => Err(Error::Usage(format!(
            "--frames {frames}: must be in 1 to {MOST_FRAMES}"
        ))),
    }
}

/// A point on the path, between camera `leg` and the next.
struct Spline<'a> {
    cameras: &'a [Camera],
    leg: usize,
    /// 0..=1.
    t: f64,
}

impl Spline<'_> {
    fn at(&self, value: impl Fn(&Camera) -> DVec3) -> DVec3 {
        let (i, t) = (self.leg, self.t);
        let place = |i: usize| value(&self.cameras[i]);
        let (b, c) = (place(i), place(i + 1));
        let a = if i > 0 { place(i - 1) } else { 2.0 * b - c };
        let d = match self.cameras.get(i + 2) {
            Some(next) => value(next),
            None => 2.0 * c - b,
        };
        let (from, to) = ((c - a) / 2.0, (d - b) / 2.0);
        let (t2, t3) = (t * t, t * t * t);
        b * (2.0 * t3 - 3.0 * t2 + 1.0)
            + from * (t3 - 2.0 * t2 + t)
            + c * (3.0 * t2 - 2.0 * t3)
            + to * (t3 - t2)
    }
}
