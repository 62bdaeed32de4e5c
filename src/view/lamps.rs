//! The lights of a scene as the user edits them.

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
    /// Scene units; None for emitters, which cannot move, since their form factors are kept.
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
        .map(|(i, m)| lamp(&m.name, Place::Material(i), m.ke, None));
    points.chain(materials).collect()
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

/// The scene with its lights replaced by `lamps`.
pub fn lit(scene: &Scene, lamps: &[Lamp]) -> Scene {
    let mut scene = scene.clone();
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
    use crate::scene::{Lights, Material, PointLight};

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
        let same = lit(&scene, &all);
        assert_eq!(same.lights.points, scene.lights.points);
        assert_eq!(same.materials[1].ke, [4.0, 2.0, 0.0]);
        let words = |values: &str| -> Vec<String> { values.split(' ').map(Into::into).collect() };
        all[0]
            .set("position", &words("1 2 3"))
            .expect("a point light moves");
        all[1].set("strength", &words("8")).expect("a strength");
        all[1]
            .set("position", &words("1 2 3"))
            .expect_err("an emitter stays");
        all[1]
            .set("strength", &words("-1"))
            .expect_err("no light is negative");
        let other = lit(&scene, &all);
        assert_eq!(other.lights.points[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(other.materials[1].ke, [8.0, 4.0, 0.0]);
    }
}
