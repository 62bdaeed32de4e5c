//! Light maps by direction as files: our own layouts, and those that engines read.

use std::f32::consts::PI;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use exr::image::{AnyChannel, AnyChannels, FlatSamples, Image};
use exr::prelude::{SmallVec, WritableImage, f16};
use glam::{DVec3, Vec3};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::moments::ratios;
use super::{Basis, Directional, Frame, L1, Limits, irradiance_of_moments};
use crate::atomic_file::{with_ending, write_atomically};
use crate::error::Result;
use crate::export::light_map::LightMap;
use crate::export::map_files::{MapFile, Page};
use crate::export::surface::Surface;
use crate::math::directions::Directions;

/// How a light map says from where the light comes. Directions are in the axes of the scene, as in
/// the glTF of `export`: right-handed, y up. Engines multiply what they read by the albedo: their
/// files hold E/π.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// One OpenEXR with the layers L0, L1x, L1y, L1z: E(n) = L0 + n · L1.
    L1,
    /// One OpenEXR: RGB irradiance E, and layer `direction` with X, Y, Z, the unit dominant
    /// direction d, and `ratio` r: E(n) = E (1 + r n·d) / (1 + r N·d), N the surface's normal.
    Dominant,
    /// One OpenEXR with a layer for each slot: E(n) = Σ s_k max(0, n · ω_k). ω_k are the middles of
    /// [`Directions`], about the surface's normal and the direction in which u of the map grows.
    Slots(Directions),
    /// Unity's directional light map: irradiance as OpenEXR, and `_dir.png`: D/2 + 1/2 and alpha
    /// (1 + N·D)/2. E(n) = E (n · (rgb − ½) + ½) / a.
    Unity,
    /// Bakery's SH: `_L0.exr`, and `_L1x.png`, `_L1y.png`, `_L1z.png`: L1/(4 L0) + ½.
    /// E(n) = L0 + n · (2 L0 (2 rgb − 1)).
    Bakery,
    /// Godot's LightmapGI: one OpenEXR of four images below each other: L0, and L1/(8 L0) + ½ along
    /// y, z and x. E(n) = L0 + n · (4 L0 (2 rgb − 1)).
    Godot,
    /// Frostbite's: `_L0.exr`, and `_R.png`, `_G.png`, `_B.png`: the first moment of the light of
    /// each colour over its mean, r/2 + ½. E(n) = L0 times [`irradiance_of_moments`].
    Frostbite,
}

/// |L1| ≤ 2 L0 in Bakery's files; light that comes from all sides has no more.
const BAKERY: Limits = Limits { ratio: 2.0 };

/// In Godot's.
const GODOT: Limits = Limits { ratio: 4.0 };

/// A channel of an OpenEXR, `[row][column]`.
type Channel = (String, Vec<f16>);

impl Encoding {
    /// What it keeps of each texel.
    pub fn basis(self) -> Basis {
        match self {
            Self::Slots(directions) => Basis::Slots(directions),
            Self::Frostbite => Basis::Moments,
            _ => Basis::L1,
        }
    }

    /// Files of a page, given the path of its `.exr`.
    pub fn paths(self, page: &Path) -> Vec<PathBuf> {
        let beside = |ending: &str| with_ending(page, ending);
        match self {
            Self::Unity => vec![page.to_owned(), beside("_dir.png")],
            Self::Bakery => ["_L0.exr", "_L1x.png", "_L1y.png", "_L1z.png"]
                .map(beside)
                .to_vec(),
            Self::Frostbite => ["_L0.exr", "_R.png", "_G.png", "_B.png"]
                .map(beside)
                .to_vec(),
            _ => vec![page.to_owned()],
        }
    }

    /// Writes the pages of a light map; `path` is that of an `.exr`. Returns the paths of the
    /// files.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        self,
        path: &Path,
        surface: &Surface,
        map: &LightMap,
        light: &Directional,
    ) -> Result<Vec<PathBuf>> {
        let of = Pages {
            surface,
            map,
            light,
        };
        let mut written = Vec::new();
        for (page, path) in (0..).zip(map.paths(path)) {
            let paths = self.paths(&path);
            for (path, bytes) in paths.iter().zip(of.encoded(page, self)) {
                write_atomically(path, |out| out.write_all(&bytes?))?;
            }
            written.extend(paths);
        }
        Ok(written)
    }
}

struct Pages<'a> {
    surface: &'a Surface,
    map: &'a LightMap,
    light: &'a Directional,
}

impl Pages<'_> {
    /// The bytes of each file of a page.
    fn encoded(&self, page: u32, encoding: Encoding) -> Vec<io::Result<Vec<u8>>> {
        let size = (self.map.pages.width, self.map.pages.height);
        match encoding {
            Encoding::L1 => {
                let layers = ["L0", "L1x", "L1y", "L1z"].into_iter().enumerate();
                let each = layers.flat_map(|(k, name)| {
                    let values = self.page(page, |t| self.light.of(t)[k]);
                    colours(Some(name), &values)
                });
                vec![layered(size, each.collect())]
            }
            Encoding::Slots(directions) => {
                let each = (0..directions.count()).flat_map(|k| {
                    let values = self.page(page, |t| self.light.of(t)[k]);
                    colours(Some(&format!("slot{k:02}")), &values)
                });
                vec![layered(size, each.collect())]
            }
            Encoding::Dominant => {
                let mut all = colours(None, &self.page(page, |t| self.facing(t)));
                let towards = self.page(page, |t| self.dominant(t));
                let unit: Vec<Vec3> = towards.iter().map(|d| d.normalize_or_zero()).collect();
                for (k, name) in ["X", "Y", "Z"].into_iter().enumerate() {
                    let values = unit.iter().map(|d| f16::from_f32(d[k])).collect();
                    all.push((format!("direction.{name}"), values));
                }
                let ratios = towards.iter().map(|d| f16::from_f32(d.length()));
                all.push(("direction.ratio".into(), ratios.collect()));
                vec![layered(size, all)]
            }
            Encoding::Unity => {
                let map = self.page_of(page, |t| self.facing(t) / PI);
                let towards = self.page(page, |t| self.dominant(t));
                let heights = self.page(page, |t| {
                    let height = self.dominant(t).dot(self.normal(t).as_vec3());
                    Vec3::splat(height)
                });
                let codes = towards.iter().zip(&heights).flat_map(|(d, height)| {
                    let [x, y, z] = d.to_array();
                    [x, y, z, height.x].map(signed)
                });
                let codes: Vec<u8> = codes.collect();
                vec![
                    map.encoded(MapFile::Exr, 1.0),
                    png(size, &codes, ExtendedColorType::Rgba8),
                ]
            }
            Encoding::Bakery => {
                let l0 = self.page_of(page, |t| self.limited(t, BAKERY).l0 / PI);
                let mut all = vec![l0.encoded(MapFile::Exr, 1.0)];
                for k in 0..3 {
                    let shares = self.page(page, |t| share(&self.limited(t, BAKERY), k, BAKERY));
                    let codes: Vec<u8> = (shares.iter())
                        .flat_map(|share| share.to_array())
                        .map(code)
                        .collect();
                    all.push(png(size, &codes, ExtendedColorType::Rgb8));
                }
                all
            }
            Encoding::Godot => {
                let mut all = self.page(page, |t| self.limited(t, GODOT).l0 / PI);
                for k in [1, 2, 0] {
                    all.extend(self.page(page, |t| share(&self.limited(t, GODOT), k, GODOT)));
                }
                let page = Page {
                    width: size.0,
                    height: 4 * size.1,
                    irradiance: all,
                };
                vec![page.encoded(MapFile::Exr, 1.0)]
            }
            Encoding::Frostbite => {
                let l0 = self.page_of(page, |t| self.mean(t) / PI);
                let mut all = vec![l0.encoded(MapFile::Exr, 1.0)];
                for c in 0..3 {
                    let ratios = self.page(page, |t| ratios(self.light.of(t))[c]);
                    let codes = ratios.iter().flat_map(|ratio| ratio.to_array().map(signed));
                    let codes: Vec<u8> = codes.collect();
                    all.push(png(size, &codes, ExtendedColorType::Rgb8));
                }
                all
            }
        }
    }

    fn page_of(&self, page: u32, value: impl Fn(usize) -> Vec3) -> Page {
        self.map.page_of(page, value)
    }

    fn page(&self, page: u32, value: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        self.page_of(page, value).irradiance
    }

    fn normal(&self, t: usize) -> DVec3 {
        let texel = &self.map.map.texels[t];
        Frame::of(self.surface, texel.triangle, texel.weights)
            .place
            .normal
    }

    fn l1(&self, t: usize) -> L1 {
        L1::from_values(self.light.of(t))
    }

    /// Irradiance of the surface.
    fn facing(&self, t: usize) -> Vec3 {
        self.l1(t).at(self.normal(t))
    }

    fn dominant(&self, t: usize) -> Vec3 {
        self.l1(t).dominant(self.normal(t))
    }

    /// What of the codes of the first moments gives the irradiance of the surface.
    fn mean(&self, t: usize) -> Vec3 {
        let values = self.light.of(t);
        let facing = values[values.len() - 1];
        let normal = self.normal(t).as_vec3();
        let over = ratios(values).map(|ratio| {
            let read = ratio
                .to_array()
                .map(|value| f32::from(signed(value)) / 127.5 - 1.0);
            irradiance_of_moments(Vec3::from_array(read), normal)
        });
        facing / Vec3::from_array(over).max(Vec3::splat(f32::MIN_POSITIVE))
    }

    fn limited(&self, t: usize, limits: Limits) -> L1 {
        self.l1(t).limited(self.normal(t), limits)
    }
}

/// L1 along an axis over what a file can hold of it, 0 to 1; ½ where there is none.
fn share(of: &L1, axis: usize, limits: Limits) -> Vec3 {
    let most = (limits.ratio * of.l0).max(Vec3::splat(f32::MIN_POSITIVE));
    (0.5 + 0.5 * of.l1[axis] / most).clamp(Vec3::ZERO, Vec3::ONE)
}

fn code(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

/// Of −1 to 1.
fn signed(value: f32) -> u8 {
    code(0.5 + 0.5 * value)
}

/// The channels R, G, B of a layer.
fn colours(layer: Option<&str>, values: &[Vec3]) -> Vec<Channel> {
    let name = |channel: &str| match layer {
        Some(layer) => format!("{layer}.{channel}"),
        None => channel.to_owned(),
    };
    let of = |k: usize| values.iter().map(move |v| f16::from_f32(v[k].min(65504.0)));
    (["R", "G", "B"].into_iter().enumerate())
        .map(|(k, channel)| (name(channel), of(k).collect()))
        .collect()
}

/// An OpenEXR of half floats with these channels.
fn layered((width, height): (u32, u32), channels: Vec<Channel>) -> io::Result<Vec<u8>> {
    let list: SmallVec<_> = (channels.into_iter())
        .map(|(name, values)| AnyChannel::new(name.as_str(), FlatSamples::F16(values)))
        .collect();
    let size = (width as usize, height as usize);
    let mut out = Cursor::new(Vec::new());
    Image::from_channels(size, AnyChannels::sort(list))
        .write()
        .to_buffered(&mut out)
        .map_err(io::Error::other)?;
    Ok(out.into_inner())
}

fn png((width, height): (u32, u32), codes: &[u8], kind: ExtendedColorType) -> io::Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    PngEncoder::new(&mut out)
        .write_image(codes, width, height, kind)
        .map_err(io::Error::other)?;
    Ok(out.into_inner())
}
