//! Light at the corners of a scene's triangles, as the window's surfaces show it.

use glam::Vec3;
use rayon::prelude::*;

use crate::bake::solution::DirectionalLight;
use crate::mesh::corners::{Corners, Joined};

/// Light at the corners, `[triangle][corner]` in the order of the input, W·m⁻², smoothed over each
/// surface.
pub struct CornerLight {
    pub all: Vec<[Vec3; 3]>,
    pub direct: Vec<[Vec3; 3]>,
    /// Where there is light by direction.
    pub slanted: Option<Slanted>,
}

impl CornerLight {
    /// Of all and of direct light, `[triangle]`, and of light by direction.
    pub fn new(about: &Corners, light: [&[Vec3]; 2], relief: Option<&DirectionalLight>) -> Self {
        let [all, direct] = light.map(|light| about.irradiance(light, Joined::Smooth));
        Self {
            all,
            direct,
            slanted: relief.map(|light| Slanted::new(about, light)),
        }
    }
}

/// How light on relief depends on its slope, at the corners, `[triangle][corner]`, smoothed as
/// [`Corners::means`] does; zero on triangles without relief.
///
/// On a normal n that is no unit vector, F(n) = Σ max(0, n · m) over the moments m of the slots; a
/// normal tilted by a slope s along the surface is n = N + s, and its irradiance F(n) / |n|.
pub struct Slanted {
    pub all: Vec<[Slant; 3]>,
    pub direct: Vec<[Slant; 3]>,
}

/// Of each colour the vector t (scene axes) for which F(N + s) − F(N − s) is 2 s · t for tilts of
/// [`TILT`]; and, per colour, how much the mean of F over such tilts is above F(N). W·m⁻².
pub type Slant = [Vec3; 4];

/// Slope at which light on slopes is found; `TILT` of `shared/view_mesh.glsl`.
const TILT: f32 = 0.7;

impl Slanted {
    fn new(about: &Corners, light: &DirectionalLight) -> Self {
        let slots = light.directions.len();
        let corners = |moments: &[[Vec3; 3]]| {
            let found = (moments.par_chunks_exact(slots).zip(&light.frames))
                .map(|(moments, frame)| slant(moments, frame));
            at_corners(about, &light.elements, found.collect())
        };
        Self {
            all: corners(&light.incident_moment),
            direct: corners(&light.incident_moment_direct),
        }
    }
}

/// How light on some elements depends on their slopes, `[element]`, at all corners.
pub fn at_corners(about: &Corners, elements: &[u32], found: Vec<Slant>) -> Vec<[Slant; 3]> {
    let mut slants = vec![[Vec3::ZERO; 4]; about.normals.len()];
    for (found, &e) in found.into_iter().zip(elements) {
        slants[e as usize] = found;
    }
    about.means(&slants)
}

/// Of one element by its moments, `[slot][colour]`, in its frame.
pub fn slant(moments: &[[Vec3; 3]], frame: &[Vec3; 3]) -> Slant {
    let lit = |normal: Vec3| {
        let slots = moments.iter();
        let sum = slots.map(|m| Vec3::from_array(m.map(|m| normal.dot(m).max(0.0))));
        sum.sum::<Vec3>()
    };
    let level = lit(Vec3::Z);
    let mut slant = [Vec3::ZERO; 4];
    for (axis, along) in [Vec3::X, Vec3::Y].into_iter().zip(frame) {
        let [ahead, behind] = [TILT, -TILT].map(|tilt| lit(Vec3::Z + tilt * axis));
        for (of_colour, change) in slant.iter_mut().zip((ahead - behind).to_array()) {
            *of_colour += *along * (change / (2.0 * TILT));
        }
        slant[3] += (ahead + behind) / 4.0 - level / 2.0;
    }
    slant
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One slot: as steep as its light falls, and dark where it turns away.
    #[test]
    fn a_slope_receives_what_faces_it() {
        let frame = [Vec3::Y, Vec3::Z, Vec3::X];
        // Light from 63° off the normal, along the first axis: behind a slope of TILT away from it.
        let from = Vec3::new(2.0, 0.0, 1.0);
        let [r, g, b, lift] = slant(&[[from, Vec3::ZERO, from]], &frame);
        let ahead = 1.0 + 2.0 * TILT;
        assert!((r - Vec3::Y * ahead / (2.0 * TILT)).length() < 1e-6, "{r}");
        assert_eq!((g, b), (Vec3::ZERO, r));
        let expected = (ahead + 0.0 + 1.0 + 1.0) / 4.0 - 1.0;
        assert!(
            (lift - Vec3::new(expected, 0.0, expected)).length() < 1e-6,
            "{lift}"
        );
    }
}
