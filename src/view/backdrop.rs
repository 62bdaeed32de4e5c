//! The sky behind the surfaces of a view.

use egui::Color32;

use super::camera::Eye;
use super::overlay::code;
use crate::scene::Camera;
use crate::scene::sky::Sky;

/// What a picture of the sky depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    pub camera: Camera,
    /// Pixels of the view.
    pub size: (u32, u32),
    /// Stops.
    pub exposure: f32,
}

/// Pixels along each side of the view that are one of the sky, which is smooth.
const COARSE: u32 = 4;

impl Subject {
    /// The sky as the camera, that of `eye`, sees it: pixels across and down, sRGB.
    pub fn drawn(&self, sky: &Sky, eye: &Eye) -> ((u32, u32), Vec<Color32>) {
        let size = (self.size.0.div_ceil(COARSE), self.size.1.div_ceil(COARSE));
        let exposure = self.exposure.exp2();
        let pixel = |i: u32| {
            let at = |place: u32| f64::from(place) + 0.5;
            let way = eye.ray((at(i % size.0), at(i / size.0)), size);
            code(sky.radiance(way).as_vec3().to_array().map(|c| c * exposure))
        };
        // The threads that all share may have seconds of a bake's work before them.
        let codes = (0..size.0 * size.1).map(pixel);
        (size, codes.collect())
    }
}
