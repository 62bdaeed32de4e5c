//! Light maps that say from where the light comes, for surfaces with normal maps of their own.
//!
//! ```text
//! light at a place by the way it arrives ─► response ─► scaled to the light map ─► files
//! ```

mod facets;
pub mod files;
mod l1;
mod moments;
mod slots;

use glam::{DVec3, Vec3};

use super::lattice::{Lattice, Value, too_early};
use super::light_map::LightMap;
use super::map_files::Part;
use super::surface::{Pages, Surface};
use super::texels::quarters;
use crate::error::{Error, Result};
use crate::math::directions::Directions;
use crate::solver::{LightAt, Lit, Place};

pub use l1::{L1, Limits};
pub use moments::irradiance_of_moments;
pub use slots::irradiance as irradiance_of_slots;

/// What a texel holds of the directions from which its light comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// E(n) = L0 + n · L1, in the axes of the scene; see [`L1`].
    L1,
    /// Mean and first moment of the light, and the irradiance of the surface; see
    /// [`irradiance_of_moments`].
    Moments,
    /// Light from each slot of the hemisphere about the surface; see [`irradiance_of_slots`].
    Slots(Directions),
}

/// Light by direction at the texels of a light map. For the surface's own normal it is that of the
/// light map.
pub struct Directional {
    pub basis: Basis,
    /// Values of a texel.
    pub count: usize,
    /// W·m⁻², RGB, `[texel][value]`: L0 and L1 along x, y and z; the mean, the first
    /// moment and the irradiance of the surface; or the slots.
    pub values: Vec<Vec3>,
}

/// A difference from what was expected counts from this share of the light at a texel, and this
/// share of the mean light, on.
const UNEXPECTED: [f32; 2] = [0.01, 0.002];

/// Most values of all texels.
const MOST_VALUES: u64 = 1 << 27;

/// Places that are looked at between two calls of `go_on`.
const AT_ONCE: usize = 2048;

/// A place and the axes in which its light is kept.
#[derive(Clone, Copy)]
pub struct Frame {
    pub place: Place,
    /// Direction on the surface in which u of the light map grows; with the normal and
    /// `normal × tangent` right-handed.
    pub tangent: DVec3,
}

impl Frame {
    pub fn of(surface: &Surface, triangle: u32, weights: [f64; 3]) -> Self {
        let place = surface.place(triangle as usize, weights);
        let corners = (surface.scene).corners(&surface.scene.triangles[triangle as usize]);
        let uv = surface.uv[triangle as usize];
        let [p, q] = [1, 2].map(|k| corners[k] - corners[0]);
        let [s, t] = [1, 2].map(|k| uv[k] - uv[0]);
        let along = (p * t.y - q * s.y) * s.perp_dot(t).signum();
        let flat = along - place.normal * along.dot(place.normal);
        let tangent = flat.try_normalize();
        Self {
            place,
            tangent: tangent.unwrap_or_else(|| place.normal.any_orthonormal_vector()),
        }
    }

    /// Tangent, bitangent and normal.
    pub fn axes(&self) -> [DVec3; 3] {
        let normal = self.place.normal;
        [self.tangent, normal.cross(self.tangent), normal]
    }
}

impl Basis {
    fn count(self) -> usize {
        match self {
            Self::L1 => 4,
            Self::Moments => moments::MOMENTS,
            Self::Slots(directions) => directions.count(),
        }
    }

    /// Whether the texels of these pages are few enough.
    ///
    /// # Errors
    /// They are not.
    pub fn check(self, pages: &Pages) -> Result<()> {
        let texels = u64::from(pages.count) * u64::from(pages.width) * u64::from(pages.height);
        let count = self.count();
        if texels * count as u64 > MOST_VALUES {
            return Err(Error::Usage(format!(
                "light of {texels} texels in {count} values each is more than {MOST_VALUES} \
                 values; use a smaller --page, or fewer --texels-per-unit"
            )));
        }
        Ok(())
    }

    /// Direct or indirect light at places, `[place][value]`.
    pub fn look(self, lit: &Lit<'_>, frames: &[Frame], direct: bool) -> Result<Vec<Vec<Vec3>>> {
        let places: Vec<Place> = frames.iter().map(|frame| frame.place).collect();
        match self {
            Self::L1 => l1::look(lit, frames, &places, direct),
            Self::Moments => moments::look(lit, frames, &places, direct),
            Self::Slots(directions) => {
                slots::Fit::new(directions).look(lit, frames, &places, direct)
            }
        }
    }

    /// Irradiance that values have for the surface's own normal.
    fn facing(self, frame: &Frame, values: &[Vec3]) -> Vec3 {
        match self {
            Self::L1 => L1::from_values(values).at(frame.place.normal),
            Self::Moments => values[moments::MOMENTS - 1],
            Self::Slots(directions) => slots::irradiance(directions, values, DVec3::Z),
        }
    }

    /// Values of light that is known for the surface's own normal alone: as if it came along that.
    fn straight(self, frame: &Frame, light: Vec3) -> Vec<Vec3> {
        match self {
            Self::L1 => L1::straight(frame.place.normal, light).values().to_vec(),
            Self::Moments => moments::straight(frame.place.normal, light),
            Self::Slots(directions) => slots::straight(directions, light),
        }
    }

    /// Scaled so that they have this irradiance for the surface's own normal.
    fn scaled(self, frame: &Frame, values: &[Vec3], wanted: Vec3) -> Vec<Vec3> {
        let has = self.facing(frame, values);
        let is_dark = has.cmple(Vec3::splat(f32::MIN_POSITIVE));
        let scale = Vec3::select(is_dark, Vec3::ZERO, wanted / has);
        let missing = Vec3::select(is_dark, wanted, Vec3::ZERO);
        let straight = self.straight(frame, missing);
        (values.iter().zip(straight))
            .map(|(&value, straight)| value * scale + straight)
            .collect()
    }
}

impl Directional {
    /// Of the light that `part` names. `go_on` is called with how many places have been looked at;
    /// false stops.
    ///
    /// # Errors
    /// Those of [`Basis::check`]; stopped.
    pub fn new(
        surface: &Surface,
        map: &LightMap,
        lit: &Lit<'_>,
        basis: Basis,
        part: Part,
        go_on: &dyn Fn(usize) -> bool,
    ) -> Result<Self> {
        basis.check(&surface.pages)?;
        let mut look = Look {
            surface,
            map,
            lit,
            basis,
            go_on,
            looked_at: 0,
        };
        let count = basis.count();
        let texels = map.map.texels.len();
        let of = |light: &LightAt, direct: bool| match (part, direct) {
            (Part::Indirect, true) | (Part::Direct, false) => Vec3::ZERO,
            (_, true) => light.direct,
            (_, false) => light.indirect,
        };
        let indirect = match part {
            Part::Direct => None,
            Part::Global | Part::Indirect => Some(look.indirect()?),
        };
        let none = vec![Vec3::ZERO; count];
        let mut values = vec![Vec3::ZERO; texels * count];
        let all: Vec<usize> = (0..texels).collect();
        for some in all.chunks(AT_ONCE) {
            let direct = match part {
                Part::Indirect => None,
                Part::Global | Part::Direct => Some(look.direct(some)?),
            };
            for (i, &t) in some.iter().enumerate() {
                let frame = look.frame(t);
                let mut add = |found: &[Vec3], light: Vec3| {
                    let scaled = basis.scaled(&frame, found, light);
                    let texel = &mut values[t * count..][..count];
                    texel.iter_mut().zip(scaled).for_each(|(sum, v)| *sum += v);
                };
                if let Some(direct) = &direct {
                    add(&direct[i], of(&map.light[t], true));
                }
                if let Some(indirect) = &indirect {
                    let found = indirect[t].as_ref().map_or(&none, |found| &found.values);
                    add(found, of(&map.light[t], false));
                }
            }
        }
        Ok(Self {
            basis,
            count,
            values,
        })
    }

    /// Values of a texel.
    pub fn of(&self, texel: usize) -> &[Vec3] {
        &self.values[texel * self.count..][..self.count]
    }
}

struct Look<'a> {
    surface: &'a Surface,
    map: &'a LightMap,
    lit: &'a Lit<'a>,
    basis: Basis,
    go_on: &'a dyn Fn(usize) -> bool,
    looked_at: usize,
}

impl Look<'_> {
    fn frame(&self, t: usize) -> Frame {
        let texel = &self.map.map.texels[t];
        Frame::of(self.surface, texel.triangle, texel.weights)
    }

    fn at(&mut self, frames: &[Frame], direct: bool) -> Result<Vec<Vec<Vec3>>> {
        let mut found = Vec::with_capacity(frames.len());
        for some in frames.chunks(AT_ONCE) {
            found.extend(self.basis.look(self.lit, some, direct)?);
            self.looked_at += some.len();
            if !(self.go_on)(self.looked_at) {
                return Err(too_early());
            }
        }
        Ok(found)
    }

    /// Direct light at the middles of texels; where these are dark but the texel is not, at the
    /// quarters.
    fn direct(&mut self, texels: &[usize]) -> Result<Vec<Vec<Vec3>>> {
        let frames: Vec<Frame> = texels.iter().map(|&t| self.frame(t)).collect();
        let mut found = self.at(&frames, true)?;
        let is_dark = |i: &usize| {
            found[*i].iter().all(|value| *value == Vec3::ZERO)
                && self.map.light[texels[*i]].direct != Vec3::ZERO
        };
        let dark: Vec<usize> = (0..texels.len()).filter(is_dark).collect();
        let finer: Vec<Frame> = (dark.iter())
            .flat_map(|&i| {
                let texel = &self.map.map.texels[texels[i]];
                let each = quarters(self.surface, texel);
                each.map(|weights| Frame::of(self.surface, texel.triangle, weights))
            })
            .collect();
        let of_quarters = self.at(&finer, true)?;
        for (&i, four) in dark.iter().zip(of_quarters.chunks_exact(4)) {
            for quarter in four {
                let sums = found[i].iter_mut().zip(quarter);
                sums.for_each(|(sum, value)| *sum += *value);
            }
        }
        Ok(found)
    }

    /// Indirect light, `[texel]`; none of covered ones.
    fn indirect(&mut self) -> Result<Vec<Option<Found>>> {
        let lattice = Lattice {
            surface: self.surface,
            map: &self.map.map,
            covered: &self.map.covered,
            unexpected: UNEXPECTED,
        };
        let basis = self.basis;
        lattice.values(|texels| {
            let frames: Vec<Frame> = texels.iter().map(|&t| self.frame(t)).collect();
            let found = self.at(&frames, false)?;
            let with_light = found.into_iter().zip(&frames).map(|(values, frame)| Found {
                light: basis.facing(frame, &values),
                values,
            });
            Ok(with_light.collect())
        })
    }
}

/// What has been found at a texel.
#[derive(Clone)]
struct Found {
    values: Vec<Vec3>,
    /// For the surface's own normal.
    light: Vec3,
}

impl Value for Found {
    fn mean(of: &[&Self]) -> Self {
        let share = 1.0 / of.len() as f32;
        let mut values = vec![Vec3::ZERO; of[0].values.len()];
        for one in of {
            let sums = values.iter_mut().zip(&one.values);
            sums.for_each(|(sum, value)| *sum += share * *value);
        }
        Self {
            values,
            light: share * of.iter().map(|one| one.light).sum::<Vec3>(),
        }
    }

    /// By how much facets may differ, all in all.
    fn apart(&self, other: &Self) -> f32 {
        let pairs = self.values.iter().zip(&other.values);
        let apart: Vec3 = pairs.map(|(a, b)| (*a - *b).abs()).sum();
        0.5 * apart.max_element()
    }

    fn size(&self) -> f32 {
        self.light.max_element()
    }
}
