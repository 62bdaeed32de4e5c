//! The camera of the window: it orbits about a point and flies.

use glam::{DQuat, DVec3, Vec4};

use crate::scene::{Camera, Scene};

/// Radians that a pixel of the mouse turns.
const TURN: f64 = 0.007;
/// Factor of the distance for one step of the wheel.
const STEP: f64 = 0.85;
/// Speed of flying, in sizes of the scene per second.
const SPEED: f64 = 0.25;
/// Sine of the steepest view up or down.
const STEEPEST: f64 = 0.9999;

/// The camera, with the scene's middle and size.
#[derive(Debug, Clone, PartialEq)]
pub struct Eye {
    pub camera: Camera,
    /// Middle of the scene, scene units.
    middle: DVec3,
    size: f64,
}

/// Rows of a projection over (p, 1), p as [`super::surface_mesh::SurfaceMesh`] has it.
#[derive(Debug, Clone, Copy)]
pub struct Rows {
    pub x: Vec4,
    pub y: Vec4,
    pub w: Vec4,
}

impl Eye {
    pub fn new(scene: &Scene, camera: &Camera) -> Self {
        let (low, high) = scene.bounds();
        let mut eye = Self {
            camera: camera.clone(),
            middle: (low + high) / 2.0,
            size: (high - low).length(),
        };
        // Keeps a camera that looks straight up or down from flipping.
        eye.place(camera.position, camera.look_at - camera.position);
        eye
    }

    fn up(&self) -> DVec3 {
        self.camera.up.normalize_or(DVec3::Y)
    }

    fn forward(&self) -> DVec3 {
        (self.camera.look_at - self.camera.position).normalize_or(-DVec3::Z)
    }

    fn right(&self) -> DVec3 {
        self.forward().cross(self.up()).normalize_or(DVec3::X)
    }

    fn distance(&self) -> f64 {
        self.camera.look_at.distance(self.camera.position)
    }

    /// Moves the eye to `position`, looking at the end of `way`. Does nothing if `way` is along the
    /// up vector.
    fn place(&mut self, position: DVec3, way: DVec3) {
        let sine = way.normalize_or_zero().dot(self.up());
        if sine.abs() < STEEPEST && position.is_finite() && way.is_finite() {
            self.camera.position = position;
            self.camera.look_at = position + way;
        }
    }

    fn turned(&self, way: DVec3, across: f64, down: f64) -> DVec3 {
        let about = DQuat::from_axis_angle(self.up(), -across * TURN);
        let tilt = DQuat::from_axis_angle(self.right(), -down * TURN);
        about * (tilt * way)
    }

    /// Orbits about the point looked at, as if the scene were dragged by these pixels.
    pub fn orbit(&mut self, across: f64, down: f64) {
        let way = self.camera.look_at - self.camera.position;
        let turned = self.turned(way, across, down);
        self.place(self.camera.look_at - turned, turned);
    }

    /// Turns the view in place.
    pub fn look(&mut self, across: f64, down: f64) {
        let way = self.camera.look_at - self.camera.position;
        let turned = self.turned(way, across, down);
        self.place(self.camera.position, turned);
    }

    /// Pans so that the point looked at follows a drag of these pixels in a window of this height.
    pub fn pan(&mut self, across: f64, down: f64, height: f64) {
        let half = (self.camera.fov_y / 2.0).to_radians().tan();
        let scale = 2.0 * half * self.distance() / height.max(1.0);
        let up = self.right().cross(self.forward());
        let aside = (up * down - self.right() * across) * scale;
        self.place(
            self.camera.position + aside,
            self.camera.look_at - self.camera.position,
        );
    }

    /// Zooms to the point looked at by steps of a wheel.
    pub fn near(&mut self, steps: f64) {
        let way = self.camera.look_at - self.camera.position;
        let left = way * STEP.powf(steps);
        // Nearer than this the point would be within the near plane.
        if left.length() > 1e-3 * self.size && left.length() < 1e3 * self.size {
            self.place(self.camera.look_at - left, left);
        }
    }

    /// Flies right, up and forward by shares of the speed, for `seconds`.
    pub fn fly(&mut self, way: DVec3, seconds: f64) {
        let by = (self.right() * way.x + self.up() * way.y + self.forward() * way.z)
            * (SPEED * self.size * seconds);
        self.place(
            self.camera.position + by,
            self.camera.look_at - self.camera.position,
        );
    }

    /// Looks along an axis at the current target; the view from the top is slightly tilted.
    pub fn along(&mut self, from: DVec3) {
        let way = -from.normalize_or(DVec3::Z) * self.distance();
        let aside = self
            .forward()
            .reject_from(self.up())
            .normalize_or(-DVec3::Z);
        let way = match way.normalize_or_zero().dot(self.up()).abs() < STEEPEST {
            true => way,
            false => way + aside * (0.02 * way.length()),
        };
        self.place(self.camera.look_at - way, way);
    }

    /// Moves back until the whole scene is in view.
    pub fn see_all(&mut self) {
        let distance = 0.55 * self.size / (self.camera.fov_y / 2.0).to_radians().sin();
        let way = self.forward() * distance;
        self.place(self.middle - way, way);
    }

    /// Direction of a pixel, a unit vector.
    pub fn ray(&self, (column, row): (f64, f64), (width, height): (u32, u32)) -> DVec3 {
        let (width, height) = (f64::from(width), f64::from(height));
        let half = (self.camera.fov_y / 2.0).to_radians().tan();
        let up = self.right().cross(self.forward());
        let across = (2.0 * column / width - 1.0) * half * width / height;
        let down = (2.0 * row / height - 1.0) * half;
        (self.forward() + self.right() * across - up * down).normalize_or_zero()
    }

    /// The pixel of a place; None behind the eye.
    pub fn pixel(&self, place: DVec3, (width, height): (u32, u32)) -> Option<(f64, f64)> {
        let (width, height) = (f64::from(width), f64::from(height));
        let half = (self.camera.fov_y / 2.0).to_radians().tan();
        let way = place - self.camera.position;
        let depth = way.dot(self.forward());
        let up = self.right().cross(self.forward());
        let across = way.dot(self.right()) / (half * width / height);
        let down = -way.dot(up) / half;
        (depth > 0.0).then(|| {
            let at = |side: f64, size: f64| (side / depth + 1.0) / 2.0 * size;
            (at(across, width), at(down, height))
        })
    }

    /// Rows of the projection for a window of this size, of places from `origin` in units.
    pub fn rows(&self, (origin, unit): (DVec3, f64), (width, height): (u32, u32)) -> Rows {
        let eye = (self.camera.position - origin) / unit;
        let scale = 1.0 / (self.camera.fov_y / 2.0).to_radians().tan();
        let up = self.right().cross(self.forward());
        let row = |axis: DVec3| axis.extend(-axis.dot(eye)).as_vec4();
        Rows {
            x: row(self.right() * (scale * f64::from(height) / f64::from(width))),
            y: row(-up * scale),
            w: row(self.forward()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye() -> Eye {
        let camera = Camera {
            name: "test".into(),
            position: DVec3::new(0.0, 0.0, 5.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov_y: 40.0,
        };
        let scene = Scene {
            vertices: vec![DVec3::NEG_ONE, DVec3::ONE],
            ..Scene::default()
        };
        Eye::new(&scene, &camera)
    }

    #[test]
    fn orbiting_keeps_the_distance_and_never_turns_over() {
        let mut eye = eye();
        for _ in 0..500 {
            eye.orbit(13.0, 17.0);
            assert!((eye.distance() - 5.0).abs() < 1e-9);
            assert!(eye.forward().dot(DVec3::Y).abs() < STEEPEST);
        }
        assert!(eye.camera.position.y > 4.9, "dragged down: seen from above");
    }

    #[test]
    fn a_pixel_is_where_its_ray_goes() {
        let mut eye = eye();
        eye.orbit(40.0, -30.0);
        eye.near(2.0);
        let size = (320, 200);
        for at in [(10.0, 20.0), (160.0, 100.0), (300.0, 150.0)] {
            let place = eye.camera.position + eye.ray(at, size) * 3.0;
            let found = eye.pixel(place, size).expect("before the eye");
            assert!((found.0 - at.0).abs() < 1e-9 && (found.1 - at.1).abs() < 1e-9);
        }
        assert!(eye.pixel(eye.camera.position * 2.0, size).is_none());
    }

    /// A dragged point stays under the pointer.
    #[test]
    fn panning_moves_the_point_by_as_many_pixels() {
        let mut eye = eye();
        let before = eye.pixel(DVec3::ZERO, (400, 300)).expect("seen");
        eye.pan(25.0, -10.0, 300.0);
        let after = eye.pixel(DVec3::ZERO, (400, 300)).expect("seen");
        assert!((after.0 - before.0 - 25.0).abs() < 1e-9, "{after:?}");
        assert!((after.1 - before.1 + 10.0).abs() < 1e-9, "{after:?}");
    }

    #[test]
    fn flying_goes_where_it_looks() {
        let mut eye = eye();
        eye.fly(DVec3::Z, 1.0);
        let moved = DVec3::new(0.0, 0.0, 5.0) - eye.camera.position;
        assert!((moved.normalize() - DVec3::Z).length() < 1e-12);
        assert!((moved.length() - SPEED * eye.size).abs() < 1e-12);
    }
}
