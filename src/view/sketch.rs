//! Light of point lights that have just been changed: what they bring to the middle of each
//! triangle, by rays on the CPU, in place of what they brought before. It is there before a frame
//! is drawn, and shown until the baker has solved the same lights.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::corner_light::{CornerLight, Slant, Slanted, at_corners, slant};
use super::snapshot::Snapshot;
use super::worker::{self, Worker};
use super::{Wake, foreground};
use crate::bake::solution::DirectionalLight;
use crate::error::{Error, Result};
use crate::mesh::corners::{Corners, Joined};
use crate::scene::geometry::{ABOVE, Geometry};
use crate::scene::{PointLight, Scene};

/// Lights to be sketched.
pub struct Wanted {
    /// The last light that was solved, of other lights on the same triangles.
    pub base: Arc<Snapshot>,
    /// The scene with its lights as they are now.
    pub scene: Arc<Scene>,
    pub epoch: u64,
    /// When they were changed.
    pub since: Instant,
}

/// Light of the lights of `epoch`.
pub struct Sketch {
    pub epoch: u64,
    /// When they were changed.
    pub since: Instant,
    pub light: CornerLight,
}

/// The window's end of the thread.
pub type Sketcher = Worker<Wanted, Sketch>;

/// A thread of the window's own priority: it works for the next frame.
pub fn sketcher(wake: Wake) -> Sketcher {
    Worker::new(|work| foreground("sketch", work), wake, run)
}

fn run(desk: &worker::Desk<Wanted, Sketch>) {
    let mut rays: Option<(ThreadPool, Rays)> = None;
    while let Some((wanted, _)) = desk.next() {
        let (pool, rays) = match &mut rays {
            Some(ready) => ready,
            none => match ready(&wanted.scene) {
                Ok(ready) => none.insert(ready),
                Err(error) => {
                    desk.fail(error);
                    continue;
                }
            },
        };
        let changes = changes(&wanted);
        if changes.is_empty() {
            pool.install(|| rays.prepare(&wanted.base));
            continue;
        }
        let light = pool.install(|| rays.sketch(&wanted.base, &changes));
        desk.give(Sketch {
            epoch: wanted.epoch,
            since: wanted.since,
            light,
        });
    }
}

/// Threads of the priority of this one, and the triangles that they ask.
fn ready(scene: &Scene) -> Result<(ThreadPool, Rays)> {
    let pool = ThreadPoolBuilder::new().build();
    let pool = pool.map_err(|error| Error::Usage(format!("threads for the window: {error}")))?;
    let rays = pool.install(|| Rays::new(scene))?;
    Ok((pool, rays))
}

/// A light as it was and as it is.
type Change<'a> = [&'a PointLight; 2];

/// Whether the lights of two scenes of the same triangles differ by no more than point lights.
pub fn is_possible(base: &Scene, scene: &Scene) -> bool {
    let [before, now] = [base, scene].map(|scene| scene.materials.iter().map(|m| m.ke));
    let [points, points_now] = [base, scene].map(|scene| scene.lights.points.len());
    before.eq(now) && points == points_now && points > 0
}

/// The point lights that are others now.
fn changes(wanted: &Wanted) -> Vec<Change<'_>> {
    let [before, now] = [&wanted.base.scene, &wanted.scene].map(|scene| &scene.lights.points);
    let both = before.iter().zip(now);
    let changed = both.filter(|(before, now)| before != now);
    changed.map(|(before, now)| [before, now]).collect()
}

/// What a light of intensity 1 W·sr⁻¹ brings to the middle of each triangle, W·m⁻², as vectors
/// towards it whose part along a normal is the irradiance there; zero in its shadow.
type Brought = Arc<[Vec3]>;

/// Bytes of what is remembered of lights where they were.
const REMEMBERED: usize = 64 << 20;

/// The triangles as rays see them.
struct Rays {
    geometry: Geometry,
    /// Of the last lights that were asked for.
    known: VecDeque<(PointLight, Brought)>,
}

impl Rays {
    fn new(scene: &Scene) -> Result<Self> {
        Ok(Self {
            geometry: Geometry::new(scene)?,
            known: VecDeque::new(),
        })
    }

    /// Finds what the next sketch will take away.
    fn prepare(&mut self, base: &Snapshot) {
        for light in &base.scene.lights.points {
            self.brought(&base.about, light);
        }
    }

    fn sketch(&mut self, base: &Snapshot, changes: &[Change<'_>]) -> CornerLight {
        let about = &base.about;
        let terms: Vec<(Brought, Vec3)> = (changes.iter())
            .flat_map(|&[before, now]| [(before, -1.0), (now, 1.0)])
            .map(|(light, sign)| {
                let intensity = Vec3::from(light.intensity) * sign;
                (self.brought(about, light), intensity)
            })
            .collect();
        let direct: Vec<Vec3> = (base.direct.par_iter().zip(&about.normals).enumerate())
            .map(|(e, (before, normal))| {
                let normal = normal.as_vec3();
                let lit =
                    |(brought, intensity): &(Brought, Vec3)| normal.dot(brought[e]) * *intensity;
                // What rounding leaves below none is none.
                (*before + terms.iter().map(lit).sum::<Vec3>()).max(Vec3::ZERO)
            })
            .collect();
        let before = &base.at_corners;
        let direct = about.irradiance(&direct, Joined::Smooth);
        let all = (before.all.par_iter())
            .zip(before.direct.par_iter().zip(&direct))
            .map(|(all, (before, now))| {
                std::array::from_fn(|k| (all[k] + now[k] - before[k]).max(Vec3::ZERO))
            });
        let by_direction = before.slanted.as_ref().zip(base.relief.as_ref());
        CornerLight {
            all: all.collect(),
            slanted: by_direction.map(|(before, of)| slanted(about, before, of, &terms)),
            direct,
        }
    }

    fn brought(&mut self, about: &Corners, light: &PointLight) -> Brought {
        let same =
            |known: &PointLight| known.position == light.position && known.beam == light.beam;
        if let Some((_, brought)) = self.known.iter().find(|(known, _)| same(known)) {
            return Arc::clone(brought);
        }
        let brought: Brought = brought(&self.geometry, about, light).into();
        let room = (REMEMBERED / size_of_val(&*brought).max(1)).max(2);
        self.known.truncate(room - 1);
        self.known.push_front((light.clone(), Arc::clone(&brought)));
        brought
    }
}

/// As [`Brought`]. A triangle is taken for a disc, so that a light that touches it brings as much
/// as it sends to that side.
fn brought(geometry: &Geometry, about: &Corners, light: &PointLight) -> Vec<Vec3> {
    let at = geometry.inside(light.position);
    let square = geometry.unit * geometry.unit;
    let to_triangle = |(e, normal): (usize, &DVec3)| {
        let [a, b, c] = geometry.corners(e);
        let middle = (a + b + c) / 3.0;
        let way = at - middle;
        if normal.dot(way) <= 0.0 {
            return Vec3::ZERO;
        }
        let share = light.share(-way);
        if share == 0.0 || !geometry.sees(middle + ABOVE * *normal, at) {
            return Vec3::ZERO;
        }
        let area = 0.5 * (b - a).cross(c - a).length();
        let spread = (way.length_squared() + area / std::f64::consts::TAU) * square;
        (way.normalize() * (share / spread)).as_vec3()
    };
    about
        .normals
        .par_iter()
        .enumerate()
        .map(to_triangle)
        .collect()
}

/// How light depends on the slopes of `relief` after these lights were added, those before with
/// the sign −.
fn slanted(
    about: &Corners,
    before: &Slanted,
    relief: &DirectionalLight,
    terms: &[(Brought, Vec3)],
) -> Slanted {
    let added = (relief.elements.par_iter().zip(&relief.frames)).map(|(&e, frame)| {
        let mut sum: Slant = [Vec3::ZERO; 4];
        for (brought, intensity) in terms {
            let brought = brought[e as usize];
            let inward = Vec3::from_array(frame.map(|axis| axis.dot(brought)));
            let of_light = slant(&[intensity.abs().to_array().map(|i| inward * i)], frame);
            let sign = intensity.min_element().signum();
            for (sum, of_light) in sum.iter_mut().zip(of_light) {
                *sum += of_light * sign;
            }
        }
        sum
    });
    let added = at_corners(about, &relief.elements, added.collect());
    let with = |before: &[[Slant; 3]]| {
        let both = before.par_iter().zip(&added);
        let sum = |(before, added): (&[Slant; 3], &[Slant; 3])| {
            std::array::from_fn(|k| std::array::from_fn(|i| before[k][i] + added[k][i]))
        };
        both.map(sum).collect()
    };
    Slanted {
        all: with(&before.all),
        direct: with(&before.direct),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Lights, Material, Triangle};

    /// A floor of 32 × 32 squares from −1 to 1, with y up.
    const SIDE: u32 = 32;

    /// The floor beneath a card of 0.4 × 0.4 whose corner is above the middle, at 0.5; a lamp at 1.
    fn room(lamp: PointLight) -> Scene {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let step = 2.0 / f64::from(SIDE);
        let along = |i: u32| f64::from(i) * step - 1.0;
        let mut scene = Scene {
            materials: vec![Material::default()],
            lights: Lights::from(lamp),
            ..Scene::default()
        };
        let row = SIDE + 1;
        for z in 0..row {
            scene
                .vertices
                .extend((0..row).map(|x| at(along(x), 0.0, along(z))));
        }
        let mut square = |corners: [u32; 4]| {
            let [a, b, c, d] = corners;
            for vertices in [[a, c, b], [b, c, d]] {
                scene.triangles.push(Triangle {
                    vertices,
                    uv: [[0.0; 2]; 3],
                    emission_uv: None,
                    light_uv: None,
                    material: 0,
                });
            }
        };
        for z in 0..SIDE {
            for x in 0..SIDE {
                let first = z * row + x;
                square([first, first + 1, first + row, first + row + 1]);
            }
        }
        let first = row * row;
        square([first, first + 1, first + 2, first + 3]);
        let card = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.4, 0.4]];
        scene.vertices.extend(card.map(|[x, z]| at(x, 0.5, z)));
        scene
    }

    /// A lamp that is moved, from a light without it: I cos θ / d² of its new place at the corners,
    /// the light there was before in the shadow of the card, and nothing of its old place.
    #[test]
    fn a_lamp_lights_what_it_sees_from_where_it_is() {
        let lamp = |x: f64, intensity: f32| PointLight {
            name: "lamp".into(),
            position: DVec3::new(x, 1.0, 0.2),
            intensity: [intensity, 0.0, 2.0 * intensity],
            beam: None,
        };
        let [before, now] = [(0.2, 0.0), (-0.2, 3.0)].map(|(x, i)| Arc::new(room(lamp(x, i))));
        let wanted = Wanted {
            base: Arc::new(Snapshot::unlit(&before)),
            scene: Arc::clone(&now),
            epoch: 1,
            since: Instant::now(),
        };
        assert!(is_possible(&before, &now));
        let mut rays = Rays::new(&now).expect("a good scene");
        let light = rays.sketch(&wanted.base, &changes(&wanted));
        let place = now.lights.points[0].position;
        let (mut lit, mut dark, mut worst) = (0, 0, 0.0_f64);
        for (e, triangle) in now
            .triangles
            .iter()
            .enumerate()
            .take((2 * SIDE * SIDE) as usize)
        {
            for (k, at) in now.corners(triangle).into_iter().enumerate() {
                // Where the way to the lamp passes the height of the card.
                let crossing = at + (place - at) * 0.5;
                let [x, z] = [crossing.x, crossing.z];
                let beside = [x, z].map(|c| (c - 0.2).abs() - 0.2);
                let beside = beside[0].max(beside[1]);
                // Light at corners is of the squares about them, and of those about these: twice as
                // far away as here. On an edge of the floor it goes on as within the squares.
                let edge = at.x.abs().max(at.z.abs()) > 0.9;
                if edge || beside.abs() < 3.0 / f64::from(SIDE) {
                    continue;
                }
                let before = wanted.base.at_corners.direct[e][k];
                let added = (light.direct[e][k] - before).as_dvec3();
                let all = (light.all[e][k] - wanted.base.at_corners.all[e][k]).as_dvec3();
                assert!((all - added).length() < 1e-5, "{all} and {added}");
                let way = place - at;
                let exact = match beside < 0.0 {
                    true => 0.0,
                    false => 3.0 * way.y / way.length().powi(3),
                };
                let expected = DVec3::new(exact, 0.0, 2.0 * exact);
                let off = (added - expected).length() / (3.0 * 5.0_f64.sqrt());
                worst = worst.max(off);
                match beside < 0.0 {
                    true => dark += 1,
                    false => lit += 1,
                }
            }
        }
        println!("{lit} lit and {dark} dark corners, {worst:.1e} of the most off");
        assert!(lit > 3000 && dark > 200, "{lit} and {dark}");
        assert!(worst < 0.005, "{worst}");
        // What has not changed is not sketched.
        let same = Wanted {
            scene: Arc::clone(&before),
            ..wanted
        };
        assert!(changes(&same).is_empty());
    }
}
