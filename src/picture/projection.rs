//! From scene units to a tile of the picture.

use glam::{DVec3, Vec3};

use super::View;
use crate::error::{Error, Result};
use crate::scene::Scene;

/// Distance of the near plane, internal units.
pub const NEAR: f32 = 1e-6;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    pub column: u32,
    pub row: u32,
    pub width: u32,
    pub height: u32,
}

impl Tile {
    /// The tiles of a picture, of `side` pixels a side at most.
    pub fn of((width, height): (u32, u32), side: u32) -> impl Iterator<Item = Self> {
        let step = side as usize;
        let places = (0..height).step_by(step).flat_map(move |row| {
            let columns = (0..width).step_by(step);
            columns.map(move |column| (row, column))
        });
        places.map(move |(row, column)| Self {
            column,
            row,
            width: side.min(width - column),
            height: side.min(height - row),
        })
    }

    /// The sample in its top left corner, counted over the whole picture; `samples` are along a
    /// pixel's side.
    pub fn corner(self, samples: u32) -> [u32; 2] {
        [samples * self.column, samples * self.row]
    }
}

/// A camera with its picture's shape.
pub struct Projection {
    /// Position of the eye, scene units.
    pub eye: DVec3,
    /// Scene units of one internal unit, a power of two: the scene's greatest half extent is at
    /// most one.
    pub unit: f64,
    /// Rows x, y and w over the whole picture: clip coordinates of a place seen from the eye; y is
    /// down.
    rows: [DVec3; 3],
    /// Pixels.
    size: [f64; 2],
}

impl Projection {
    /// # Errors
    /// A camera without a direction, or with one along its up.
    pub fn new(scene: &Scene, view: &View<'_>) -> Result<Self> {
        let camera = view.camera;
        let forward = (camera.look_at - camera.position).normalize_or_zero();
        let right = forward.cross(camera.up).normalize_or_zero();
        let half_angle = camera.fov_y.to_radians() / 2.0;
        let open = half_angle > 0.0 && half_angle.tan() > 0.0;
        if right == DVec3::ZERO || !camera.position.is_finite() || !open {
            return Err(Error::Usage(format!(
                "camera \"{}\": it must look somewhere, not along its up, with a field of view between 0 and 180 degrees",
                camera.name
            )));
        }
        let up = right.cross(forward);
        let size = [f64::from(view.width), f64::from(view.height)];
        let scale = 1.0 / half_angle.tan();
        Ok(Self {
            eye: camera.position,
            unit: scene.local_frame().1,
            rows: [right * (scale * size[1] / size[0]), -up * scale, forward],
            size,
        })
    }

    /// The direction, a unit vector, of a place in the picture; pixels from the top left corner.
    pub fn ray(&self, column: f64, row: f64) -> DVec3 {
        let [x, y, w] = self.rows;
        let across = 2.0 * column / self.size[0] - 1.0;
        let down = 2.0 * row / self.size[1] - 1.0;
        (w + x * (across / x.length_squared()) + y * (down / y.length_squared())).normalize()
    }

    /// Column and row, pixels from the top left corner, of a place that is so far from the eye,
    /// internal units; none behind the near plane.
    pub fn place(&self, from_eye: Vec3) -> Option<[f64; 2]> {
        let [x, y, w] = self.rows.map(|row| row.dot(from_eye.as_dvec3()));
        // Half, since a device rounds.
        let is_before = w >= 0.5 * f64::from(NEAR);
        is_before.then(|| {
            [
                0.5 * (x / w + 1.0) * self.size[0],
                0.5 * (y / w + 1.0) * self.size[1],
            ]
        })
    }

    /// Angle of one of `samples` samples along a pixel's side in the picture's middle, radians.
    pub fn sample_angle(&self, samples: u32) -> f32 {
        // Half of the picture's height is 1 / |y| at a distance of 1.
        (2.0 / (self.rows[1].length() * self.size[1] * f64::from(samples))) as f32
    }

    /// Whether the hull of some places, scene units, lies outside the picture for certain.
    pub fn misses(&self, places: &[DVec3]) -> bool {
        let [x, y, w] = self.rows;
        // By a little more than the rows and the places are rounded by.
        const WIDER: f64 = 1.0 + 1e-4;
        let outside = |row: DVec3, sign: f64| {
            let beyond = |p: &DVec3| {
                let way = *p - self.eye;
                sign * row.dot(way) > WIDER * w.dot(way)
            };
            places.iter().all(beyond)
        };
        [x, y]
            .into_iter()
            .any(|row| outside(row, 1.0) || outside(row, -1.0))
    }

    /// Rows x, y and w over one tile.
    pub fn rows(&self, tile: Tile) -> [Vec3; 3] {
        let [x, y, w] = self.rows;
        // Maps the tile's ends, as places in −1..1 of the whole, to −1 and 1.
        let onto = |row: DVec3, whole: f64, first: u32, length: u32| {
            let (first, length) = (f64::from(first), f64::from(length));
            row * (whole / length) + w * ((whole - 2.0 * first - length) / length)
        };
        [
            onto(x, self.size[0], tile.column, tile.width).as_vec3(),
            onto(y, self.size[1], tile.row, tile.height).as_vec3(),
            w.as_vec3(),
        ]
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::math::sampling::Random;
    use crate::scene::Camera;

    /// An oblique view past the origin, 40° high.
    pub fn seen_from(position: DVec3, (width, height): (u32, u32)) -> Projection {
        let camera = Camera {
            name: "test".into(),
            position,
            look_at: DVec3::new(-0.2, 0.1, 0.0),
            up: DVec3::Y,
            fov_y: 40.0,
        };
        let view = View {
            camera: &camera,
            width,
            height,
        };
        Projection::new(&Scene::default(), &view).expect("a view")
    }

    /// Every place that the picture shows is in no hull that misses it; of hulls all about, most
    /// miss it.
    #[test]
    fn what_misses_the_picture_shows_nowhere() {
        let (width, height) = (160, 90);
        let projection = seen_from(DVec3::new(0.3, 0.2, 2.0), (width, height));
        let rows = projection.rows(Tile {
            column: 0,
            row: 0,
            width,
            height,
        });
        let [x, y, w] = rows.map(Vec3::as_dvec3);
        let (mut missing, mut shown) = (0, 0);
        let mut random = Random::new(1, 0, 0);
        let mut next = || random.unit() - 0.5;
        for _ in 0..2000 {
            let middle = 6.0 * DVec3::new(next(), next(), next());
            let corners = [(); 4].map(|()| middle + DVec3::new(next(), next(), next()));
            let misses = projection.misses(&corners);
            missing += usize::from(misses);
            for _ in 0..20 {
                let shares = [(); 4].map(|()| next() + 0.5);
                let sum: f64 = shares.iter().sum();
                let place: DVec3 = corners
                    .iter()
                    .zip(shares)
                    .map(|(c, s)| *c * (s / sum))
                    .sum();
                let way = place - projection.eye;
                let (x, y, w) = (x.dot(way), y.dot(way), w.dot(way));
                let is_shown = w > 0.0 && x.abs() <= w && y.abs() <= w;
                shown += usize::from(is_shown);
                assert!(!(is_shown && misses));
            }
        }
        assert!(missing > 1000 && shown > 1000, "{missing}; {shown}");
    }
}
