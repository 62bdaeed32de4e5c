//! Elements: the scene's triangles with all data that transport needs.
//!
//! Inside, lengths are in *internal units*: the scene moved to its middle and divided by a power of
//! two, so that every coordinate lies in −1..1. A scene scaled by a power of two is the same scene
//! to the bit, and f32 keeps the shape of one far from the origin. Radiosity does not depend on the
//! unit.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::meso::{Relief, Response};
use crate::scene::{Scene, Texture};

/// Steps of an internal coordinate in a unit: finer than f32, and coarser than the precision of f64
/// at an offset of 10⁶ units, so that a scene far from the origin is ordered and grouped as the
/// same scene at the origin.
const STEPS: f64 = (1u64 << 26) as f64;

fn snapped(v: DVec3) -> DVec3 {
    (v * STEPS).round() / STEPS
}

/// Height of a triangle in steps below which snapping may rotate its normal by more than 10⁻³ or
/// make it zero.
const LEAST_STEPS: f64 = 1024.0;

/// Normal times twice the area of a triangle with snapped corners; of its `own` corners if it is
/// too small or too thin for the steps.
fn cross(snapped: [DVec3; 3], own: impl Fn() -> [DVec3; 3]) -> DVec3 {
    let of = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let [a, b, c] = snapped;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let found = of(snapped);
    match found.length() >= LEAST_STEPS / STEPS * longest && longest > 0.0 {
        true => found,
        false => of(own()),
    }
}

/// Structure of arrays, `[element]`, in internal order (see [`Elements::permute`]) and internal
/// units.
#[derive(Debug, Clone, Default)]
pub struct Elements {
    /// Scene position of the internal origin.
    pub origin: DVec3,
    /// Scene units of one internal unit; a power of two.
    pub unit: f64,
    /// Corner positions, shared between elements.
    pub vertices: Vec<DVec3>,
    pub corners: Vec<[u32; 3]>,
    pub centroid: Vec<DVec3>,
    pub normal: Vec<DVec3>,
    pub area: Vec<f64>,
    /// Reflectance ρ, RGB; the mean of the texture over the element.
    pub reflectance: Vec<Vec3>,
    /// Radiosity from emission πLe, W·m⁻², RGB.
    pub emitted: Vec<Vec3>,
    pub material: Vec<u32>,
    /// Index of the element in the scene's list of triangles.
    pub input_index: Vec<u32>,
    /// Textured emission; None where no material has a texture of it.
    pub glow: Option<Glow>,
    /// The relief of the elements that have one; None where no element has.
    pub relief: Option<Relief>,
}

/// Emission by textures.
#[derive(Debug, Clone)]
pub struct Glow {
    /// Mean of the texture over the element, `[element]`, RGB; 1 without one.
    pub share: Vec<Vec3>,
    /// Emitted radiosity of each material before its texture, `[material]`, W·m⁻², RGB.
    by_material: Vec<Vec3>,
}

impl Glow {
    fn new(scene: &Scene) -> Option<Self> {
        let has_map = scene.materials.iter().any(|m| m.map_ke.is_some());
        has_map.then(|| Self {
            share: (scene.triangles.par_iter())
                .map(|t| {
                    let map = scene.materials[t.material as usize].map_ke.as_ref();
                    map.map_or(Vec3::ONE, |map| {
                        map.mean_over_triangle(&t.uv_of_emission()).into()
                    })
                })
                .collect(),
            by_material: by_material(scene),
        })
    }
}

/// Emitted radiosity of each material before its texture.
fn by_material(scene: &Scene) -> Vec<Vec3> {
    let materials = scene.materials.iter();
    materials
        .map(|m| Vec3::from_array(m.ke) * PI as f32)
        .collect()
}

/// The mean of a texture over a triangle of texture coordinates.
type Mean = fn(&Texture, &[[f32; 2]; 3]) -> [f32; 3];

impl Elements {
    pub fn new(scene: &Scene) -> Self {
        Self::by(scene, Texture::mean_over_triangle)
    }

    /// The same with reflectances by a few samples of their textures.
    #[cfg(feature = "window")]
    pub(crate) fn about(scene: &Scene) -> Self {
        Self::by(scene, Texture::about_over_triangle)
    }

    fn by(scene: &Scene, mean: Mean) -> Self {
        let (origin, unit) = scene.local_frame();
        let vertices: Vec<_> = scene
            .vertices
            .iter()
            .map(|v| snapped((*v - origin) / unit))
            .collect();
        let shapes: Vec<_> = scene
            .triangles
            .par_iter()
            .map(|t| {
                let [a, b, c] = t.vertices.map(|v| vertices[v as usize]);
                let own = || scene.corners(t).map(|v| (v - origin) / unit);
                let cross = cross([a, b, c], own);
                let material = &scene.materials[t.material as usize];
                let map = material.map_kd.as_ref();
                let texture = map.map_or([1.0; 3], |map| mean(map, &t.uv));
                (
                    (a + b + c) / 3.0,
                    cross.normalize(),
                    0.5 * cross.length(),
                    Vec3::from_array(material.kd) * Vec3::from_array(texture),
                )
            })
            .collect();
        let glow = Glow::new(scene);
        let emitted = (scene.triangles.iter().enumerate())
            .map(|(e, t)| {
                let whole = Vec3::from_array(scene.materials[t.material as usize].ke) * PI as f32;
                glow.as_ref().map_or(whole, |glow| whole * glow.share[e])
            })
            .collect();
        Self {
            origin,
            unit,
            corners: scene.triangles.iter().map(|t| t.vertices).collect(),
            centroid: shapes.iter().map(|s| s.0).collect(),
            normal: shapes.iter().map(|s| s.1).collect(),
            area: shapes.iter().map(|s| s.2).collect(),
            reflectance: shapes.iter().map(|s| s.3).collect(),
            emitted,
            glow,
            material: scene.triangles.iter().map(|t| t.material).collect(),
            input_index: (0..scene.triangles.len() as u32).collect(),
            vertices,
            relief: None,
        }
    }

    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Emitted radiosity of each material, `[material]`, W·m⁻², RGB, if it were flat and before its
    /// texture; 0 of one that no element has, unless there are textures.
    pub fn emitted_by_material(&self) -> Vec<Vec3> {
        if let Some(glow) = &self.glow {
            return glow.by_material.clone();
        }
        let count = self.material.iter().max().map_or(0, |&last| last + 1);
        let mut by_material = vec![Vec3::ZERO; count as usize];
        for (e, &material) in self.material.iter().enumerate() {
            by_material[material as usize] = match self.response(e) {
                Some(response) => self.emitted[e] / response.mean_emission,
                None => self.emitted[e],
            };
        }
        by_material
    }

    /// Sets the emission to that of [`Self::emitted_by_material`].
    pub fn set_emitted(&mut self, by_material: &[Vec3]) {
        for e in 0..self.len() {
            let share = self.glow.as_ref().map_or(Vec3::ONE, |glow| glow.share[e]);
            let emitted = by_material[self.material[e] as usize] * share;
            self.emitted[e] = match self.response(e) {
                Some(response) => emitted * response.mean_emission,
                None => emitted,
            };
        }
        if let Some(glow) = &mut self.glow {
            glow.by_material = by_material.to_vec();
        }
    }

    /// Sets the emission to that of `scene`, which is otherwise the scene of these elements.
    pub fn set_emission(&mut self, scene: &Scene) {
        self.set_emitted(&by_material(scene));
    }

    /// Of an element with a relief.
    fn response(&self, element: usize) -> Option<&Response> {
        let relief = self.relief.as_ref()?;
        relief.is_meso(element).then(|| relief.response(element))
    }

    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Corner positions of an element.
    pub fn triangle(&self, element: usize) -> [DVec3; 3] {
        self.corners[element].map(|v| self.vertices[v as usize])
    }

    /// Reorders the elements by `order[new] = old`: neighbours together, so that sources and
    /// meshlets are ranges.
    pub fn permute(&mut self, order: &[u32]) {
        fn apply<T: Copy>(values: &mut Vec<T>, order: &[u32]) {
            *values = order.iter().map(|&i| values[i as usize]).collect();
        }
        apply(&mut self.corners, order);
        apply(&mut self.centroid, order);
        apply(&mut self.normal, order);
        apply(&mut self.area, order);
        apply(&mut self.reflectance, order);
        apply(&mut self.emitted, order);
        apply(&mut self.material, order);
        apply(&mut self.input_index, order);
        if let Some(glow) = &mut self.glow {
            apply(&mut glow.share, order);
        }
        if let Some(relief) = &mut self.relief {
            relief.permute(order);
        }
    }

    /// Values in internal order, reordered to the order of the input.
    pub fn to_input_order<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let mut out = vec![T::default(); values.len()];
        for (value, &input) in values.iter().zip(&self.input_index) {
            out[input as usize] = *value;
        }
        out
    }

    /// Radius of the ball about an element's centroid that holds it.
    pub fn radius(&self, element: usize) -> f64 {
        let centre = self.centroid[element];
        self.triangle(element)
            .into_iter()
            .map(|v| v.distance(centre))
            .fold(0.0, f64::max)
    }

    /// The axis along which the centroids of some elements lie furthest apart.
    pub fn longest_axis(&self, elements: &[u32]) -> usize {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &e in elements {
            low = low.min(self.centroid[e as usize]);
            high = high.max(self.centroid[e as usize]);
        }
        let extent = high - low;
        (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best })
    }

    /// Largest reflectance of any element and colour; of an element with a relief, the largest
    /// share of light from any direction that is reflected.
    pub fn max_reflectance(&self) -> f32 {
        let plain = (0..self.len())
            .filter(|&e| !self.is_meso(e))
            .map(|e| self.reflectance[e].max_element())
            .fold(0.0, f32::max);
        let relief = self
            .relief
            .as_ref()
            .map_or(0.0, |relief| relief.highest_albedo);
        plain.max(relief)
    }

    /// Reflectance; of an element with a relief, the share of a uniform sky's light that leaves it.
    pub fn even_reflectance(&self) -> Vec<Vec3> {
        let Some(relief) = &self.relief else {
            return self.reflectance.clone();
        };
        let responses = relief.responses.iter();
        let even: Vec<Vec3> = responses.map(|response| response.mean_albedo()).collect();
        (0..self.len())
            .map(|e| match relief.is_meso(e) {
                true => even[relief.class[e] as usize] * relief.scale[e],
                false => self.reflectance[e],
            })
            .collect()
    }

    /// Whether an element has a relief.
    pub fn is_meso(&self, element: usize) -> bool {
        self.relief
            .as_ref()
            .is_some_and(|relief| relief.is_meso(element))
    }

    /// Elements without relief: in a solver's order they come first.
    pub fn plain_count(&self) -> usize {
        self.len() - self.relief.as_ref().map_or(0, Relief::count)
    }

    /// Sets the elements' relief. Their emission becomes the mean of the light that leaves the
    /// tile.
    pub fn set_relief(&mut self, relief: Option<Relief>) {
        if let Some(relief) = &relief {
            for (e, emitted) in self.emitted.iter_mut().enumerate() {
                if relief.is_meso(e) {
                    *emitted *= relief.response(e).mean_emission;
                }
            }
        }
        self.relief = relief;
    }
}
