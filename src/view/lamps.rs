//! The lights of a scene as the user edits them.

use std::collections::HashMap;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::scene::Scene;

/// A point light, or a material that emits.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    pub name: String,
    place: Place,
    /// The strongest channel is 1.
    pub colour: [f32; 3],
    /// Value of the strongest channel: W·sr⁻¹ of a point light, W·m⁻²·sr⁻¹ of a material.
    pub strength: f32,
    /// Scene units; of emitters, the middle of their surfaces. None of those that have none.
    pub position: Option<DVec3>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Point(usize),
    Material(usize),
}

/// All lights of a scene: point lights, then materials.
pub fn lamps(scene: &Scene) -> Vec<Lamp> {
    let lamp = |name: &str, place, light: [f32; 3], position| {
        let strength = light.into_iter().fold(0.0, f32::max);
        let of = |c: f32| if strength > 0.0 { c / strength } else { 1.0 };
        Lamp {
            name: name.to_owned(),
            place,
            colour: light.map(of),
            strength,
            position,
        }
    };
    let points = scene.lights.points.iter().enumerate();
    let points = points.map(|(i, l)| {
        let number = format!("point light {}", i + 1);
        let name = if l.name.is_empty() { &number } else { &l.name };
        lamp(name, Place::Point(i), l.intensity, Some(l.position))
    });
    let materials = scene.materials.iter().enumerate();
    let materials = materials
        .filter(|(_, m)| m.emits())
        .map(|(i, m)| lamp(&m.name, Place::Material(i), m.ke, middle(scene, i)));
    points.chain(materials).collect()
}

/// The middle of an emitter's surfaces, if it has any.
fn middle(scene: &Scene, material: usize) -> Option<DVec3> {
    let own = scene
        .triangles
        .iter()
        .filter(|t| t.material as usize == material);
    let corners = own.flat_map(|t| scene.corners(t));
    let (low, high) = corners.fold((DVec3::MAX, DVec3::MIN), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    low.cmple(high).all().then(|| (low + high) / 2.0)
}

/// Moves the triangles of a material, away from others that share corners with them.
fn shift(scene: &mut Scene, material: usize, by: DVec3) {
    let Scene {
        vertices,
        triangles,
        ..
    } = scene;
    let (own, others): (Vec<_>, Vec<_>) = triangles
        .iter_mut()
        .partition(|t| t.material as usize == material);
    let mut shared = vec![false; vertices.len()];
    for v in others.iter().flat_map(|t| t.vertices) {
        shared[v as usize] = true;
    }
    // Where each corner has gone.
    let mut gone: HashMap<u32, u32> = HashMap::new();
    for v in own.into_iter().flat_map(|t| &mut t.vertices) {
        *v = *gone.entry(*v).or_insert_with_key(|&v| {
            let to = vertices[v as usize] + by;
            match shared[v as usize] {
                true => {
                    vertices.push(to);
                    vertices.len() as u32 - 1
                }
                false => {
                    vertices[v as usize] = to;
                    v
                }
            }
        });
    }
}

impl Lamp {
    fn light(&self) -> [f32; 3] {
        self.colour.map(|c| c * self.strength)
    }

    /// Sets a property as a script names it: `colour R G B`, `strength S`, `position X Y Z`.
    ///
    /// # Errors
    /// An unknown property, or values out of range.
    pub fn set(&mut self, property: &str, values: &[String]) -> Result<()> {
        let numbers: Vec<f64> = values.iter().filter_map(|v| v.parse().ok()).collect();
        let wrong = || {
            let values = values.join(" ");
            Error::Usage(format!(
                "light {}: {property} {values}: cannot be",
                self.name
            ))
        };
        if numbers.len() != values.len() || numbers.iter().any(|n| !n.is_finite()) {
            return Err(wrong());
        }
        match (property, &numbers[..]) {
            ("colour", &[r, g, b]) if r.min(g).min(b) >= 0.0 => {
                self.colour = [r as f32, g as f32, b as f32];
            }
            ("strength", &[s]) if s >= 0.0 => self.strength = s as f32,
            ("position", &[x, y, z]) if self.position.is_some() => {
                self.position = Some(DVec3::new(x, y, z));
            }
            _ => return Err(wrong()),
        }
        Ok(())
    }
}

/// The scene with its lights replaced by `lamps`, which were `home` in `base`: a scene of the same
/// triangles, as it was read. An emitter back home has its vertices to the bit.
pub fn lit(scene: &Scene, (base, home): (&Scene, &[Lamp]), lamps: &[Lamp]) -> Scene {
    let mut scene = scene.clone();
    scene.vertices.clone_from(&base.vertices);
    scene.triangles.clone_from(&base.triangles);
    for (lamp, home) in lamps.iter().zip(home) {
        if let (Place::Material(i), Some(from), Some(to)) =
            (lamp.place, home.position, lamp.position)
            && from != to
        {
            shift(&mut scene, i, to - from);
        }
    }
    for lamp in lamps {
        match lamp.place {
            Place::Point(i) => {
                scene.lights.points[i].intensity = lamp.light();
                if let Some(position) = lamp.position {
                    scene.lights.points[i].position = position;
                }
            }
            Place::Material(i) => scene.materials[i].ke = lamp.light(),
        }
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Lights, Material, PointLight, Triangle};

    #[test]
    fn lamps_are_the_lights_and_light_the_scene() {
        let scene = Scene {
            materials: vec![
                Material::default(),
                Material {
                    name: "lamp".into(),
                    ke: [4.0, 2.0, 0.0],
                    ..Material::default()
                },
            ],
            lights: Lights::from(PointLight {
                name: "bulb".into(),
                position: DVec3::ONE,
                intensity: [3.0; 3],
                beam: None,
            }),
            ..Scene::default()
        };
        let mut all = lamps(&scene);
        let names: Vec<_> = all.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["bulb", "lamp"]);
        let home = all.clone();
        let same = lit(&scene, (&scene, &home), &all);
        assert_eq!(same.lights.points, scene.lights.points);
        assert_eq!(same.materials[1].ke, [4.0, 2.0, 0.0]);
        let words = |values: &str| -> Vec<String> { values.split(' ').map(Into::into).collect() };
        all[0]
            .set("position", &words("1 2 3"))
            .expect("a point light moves");
        all[1].set("strength", &words("8")).expect("a strength");
        all[1]
            .set("position", &words("1 2 3"))
            .expect_err("an emitter without surfaces stays");
        all[1]
            .set("strength", &words("-1"))
            .expect_err("no light is negative");
        let other = lit(&scene, (&scene, &home), &all);
        assert_eq!(other.lights.points[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(other.materials[1].ke, [8.0, 4.0, 0.0]);
    }

    /// A square lamp moves with its corners, and comes back to the bit; what shares one stays.
    #[test]
    fn an_emitter_moves_by_its_surfaces() {
        let triangle = |vertices, material| Triangle {
            vertices,
            uv: [[0.0; 2]; 3],
            emission_uv: None,
            light_uv: None,
            material,
        };
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let mut scene = Scene {
            vertices: vec![
                at(0.0, 0.0, 0.0),
                at(9.0, 0.0, 0.0),
                at(0.0, 0.0, 9.0),
                at(1.1, 2.0, 1.0),
                at(1.7, 2.0, 1.0),
                at(1.1, 2.0, 1.4),
                at(1.7, 2.0, 1.4),
            ],
            triangles: vec![
                triangle([0, 1, 2], 0),
                triangle([3, 4, 5], 1),
                triangle([5, 4, 6], 1),
            ],
            materials: vec![
                Material::default(),
                Material {
                    ke: [1.0; 3],
                    ..Material::default()
                },
            ],
            ..Scene::default()
        };
        let home = lamps(&scene);
        assert!((home[0].position.expect("it moves") - at(1.4, 2.0, 1.2)).length() < 1e-12);
        let mut moved = home.clone();
        moved[0].position = Some(at(2.4, 1.5, 1.2));
        let there = lit(&scene, (&scene, &home), &moved);
        let by = at(1.0, -0.5, 0.0);
        for (v, (now, before)) in there.vertices.iter().zip(&scene.vertices).enumerate() {
            let expected = if v < 3 { *before } else { *before + by };
            assert!((*now - expected).length() < 1e-12, "vertex {v}: {now}");
        }
        let back = lit(&there, (&scene, &home), &home);
        assert_eq!(back.vertices, scene.vertices);
        scene.triangles[0].vertices[2] = 3;
        let there = lit(&scene, (&scene, &home), &moved);
        let [floor, lamp] = [0, 1].map(|t| there.corners(&there.triangles[t]));
        assert_eq!(floor, scene.corners(&scene.triangles[0]));
        for (now, before) in lamp.iter().zip(scene.corners(&scene.triangles[1])) {
            assert!((*now - before - by).length() < 1e-12, "{now}");
        }
        let back = lit(&there, (&scene, &home), &home);
        assert!((back.vertices, back.triangles) == (scene.vertices, scene.triangles));
    }
}
