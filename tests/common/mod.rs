//! Small scenes and the device for the tests. Validation is on: one message fails the test that saw
//! it.
#![allow(dead_code)]

pub mod random;
pub mod sheet;

use std::f64::consts::PI;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use mesolux::bake::lit_scene::LitScene;
use mesolux::bake::quality::Quality;
use mesolux::bake::solution::Origin;
use mesolux::bench::relief_room::{REPEAT, TEXELS};
use mesolux::mesh::elements::Elements;
use mesolux::render::{Picture, side_by_side};
use mesolux::scene::shapes::Shapes;
use mesolux::scene::{Lights, Scene};
use mesolux::solver::ReliefLight;
use mesolux::solver::{Light, Report, Settings, Solver, open_device};
use mesolux::vk::{Device, validation_log};

/// The device that the program itself would take, watched by the validation layer, one for each
/// test: its pipelines are made once. No device is a failure.
pub fn device() -> Arc<Device> {
    thread_local!(static DEVICE: Arc<Device> = own_device());
    DEVICE.with(Arc::clone)
}

/// A device that nobody else has.
pub fn own_device() -> Arc<Device> {
    open_device(std::env::var("MESOLUX_TEST_DEVICE").ok().as_deref(), true).expect(
        "the tests need a Vulkan device (Debian: mesa-vulkan-drivers, vulkan-validationlayers)",
    )
}

/// Fails on any validation message so far.
pub fn assert_silent() {
    let log = validation_log();
    assert!(
        log.is_empty(),
        "validation layers must stay silent: {log:#?}"
    );
}

/// Writes a picture beside its reference to be looked at, where MESOLUX_TEST_PICTURES names a
/// folder.
pub fn show(name: &str, ours: &Picture, reference: &Picture) {
    if let Some(folder) = std::env::var_os("MESOLUX_TEST_PICTURES") {
        let path = Path::new(&folder).join(format!("{name}.png"));
        side_by_side(ours, reference)
            .and_then(|picture| picture.write(&path, None))
            .expect("a picture file");
    }
}

/// A scene made piece by piece.
#[derive(Default)]
pub struct Build(pub Shapes);

impl std::ops::Deref for Build {
    type Target = Shapes;

    fn deref(&self) -> &Shapes {
        &self.0
    }
}

impl std::ops::DerefMut for Build {
    fn deref_mut(&mut self) -> &mut Shapes {
        &mut self.0
    }
}

impl Build {
    pub fn new() -> Self {
        Self::default()
    }

    /// A closed room with a lamp, a point light and a ball, of which floor and ball may have a
    /// relief.
    pub fn room_with_ball(relief: bool) -> Self {
        let mut build = Self::new();
        let material = build.material(0.7, 0.0);
        let lamp = build.material(0.2, 3.0);
        if relief {
            let wave = |a: f64| (2.0 * PI * a).sin();
            build.relief(material, 8, |x, y| 0.03 * wave(x) * wave(y));
        }
        let sides = build.room(DVec3::ZERO, DVec3::ONE, 3, 0);
        build.paint(sides[0].clone(), material);
        build.uv(sides[0].clone(), 0.25 * DVec3::X, 0.25 * DVec3::Z);
        let ball = build.sphere(DVec3::new(0.5, 0.4, 0.5), 0.2, 1, true, material);
        build.uv(ball, DVec3::new(0.2, 0.05, 0.0), DVec3::new(0.0, 0.1, 0.2));
        let [x, z] = [0.4 * DVec3::X, 0.4 * DVec3::Z];
        build.quad(DVec3::new(0.3, 0.95, 0.3), x, z, (2, 2), lamp);
        build.point_light(DVec3::new(0.2, 0.7, 0.8), 0.3);
        build
    }

    pub fn of(scene: Scene) -> Self {
        Self(Shapes { scene })
    }

    /// Gives triangles another material.
    pub fn paint(&mut self, triangles: Range<usize>, material: u32) {
        for t in &mut self.scene.triangles[triangles] {
            t.material = material;
        }
    }

    /// Gives triangles a material and texture coordinates, one repeat each [`REPEAT`] along two
    /// directions.
    ///
    /// Corners of the texture's repeats lie in the middle of texels, so that `displace` cuts along
    /// the cells of the bilinear map.
    pub fn cover(&mut self, triangles: Range<usize>, material: u32, (u, v): (DVec3, DVec3)) {
        self.uv(triangles.clone(), u * REPEAT, v * REPEAT);
        for t in &mut self.scene.triangles[triangles.clone()] {
            for uv in &mut t.uv {
                *uv = uv.map(|x| x + 0.5 / TEXELS as f32);
            }
        }
        self.paint(triangles, material);
    }

    /// A ball made of a cube of n × n cells a side, facing outward, one repeat of the texture a
    /// side.
    pub fn cube_sphere(&mut self, centre: DVec3, radius: f64, n: u32, material: u32) {
        let first = self.scene.vertices.len();
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        for [u, v] in [[x, y], [y, x], [y, z], [z, y], [z, x], [x, z]] {
            let side = self.quad(0.5 * (u.cross(v) - u - v), u, v, (n, n), material);
            self.uv(side.clone(), u, v);
            for t in &mut self.scene.triangles[side] {
                t.uv = t.uv.map(|uv| uv.map(|a| a + 0.5));
            }
        }
        for place in &mut self.scene.vertices[first..] {
            // Cells of equal angles.
            let even = place.to_array().map(|a| (0.5 * PI * a).tan());
            *place = centre + radius * DVec3::from_array(even).normalize();
        }
        self.weld();
    }

    pub fn solve(&self, settings: &Settings) -> Solved {
        let device = device();
        let elements = mesolux::bake::elements(&device, &self.scene, settings)
            .expect("the relief fits the device");
        solve(elements, &self.scene.lights, settings)
    }
}

/// A solution in the order of the input.
pub struct Solved {
    pub area: Vec<f64>,
    pub irradiance: Vec<Vec3>,
    pub direct: Vec<Vec3>,
    pub radiosity: Vec<Vec3>,
    /// In internal order.
    pub relief: Option<ReliefLight>,
    pub report: Report,
}

impl Solved {
    /// Area-weighted mean of a value over a range of triangles.
    pub fn mean(&self, values: &[Vec3], range: Range<usize>) -> f64 {
        let area: f64 = range.clone().map(|e| self.area[e]).sum();
        range
            .map(|e| self.area[e] * f64::from(values[e].x))
            .sum::<f64>()
            / area
    }
}

pub fn solve(elements: Elements, lights: &Lights, settings: &Settings) -> Solved {
    let mut solver =
        Solver::new(&device(), elements, lights, settings).expect("the scene fits the device");
    solver.run(|_| true).expect("the device solves the scene");
    let Light {
        irradiance_direct,
        irradiance,
        radiosity,
        relief,
    } = solver.light().expect("the device gives the solution");
    let e = &solver.problem.elements;
    let solved = Solved {
        area: e.to_input_order(&e.area),
        irradiance: e.to_input_order(&irradiance),
        direct: e.to_input_order(&irradiance_direct),
        radiosity: e.to_input_order(&radiosity),
        relief,
        report: solver.report().clone(),
    };
    assert_silent();
    solved
}

/// Middles of n² equal parts of a triangle, as shares of its edges from the first corner.
#[allow(dead_code)]
pub fn thirds(n: u32) -> Vec<[f64; 2]> {
    let mut places = Vec::new();
    for i in 0..n {
        for j in 0..n - i {
            let at = |i: u32, third: f64| (f64::from(i) + third) / f64::from(n);
            places.push([at(i, 1.0 / 3.0), at(j, 1.0 / 3.0)]);
            if i + j + 1 < n {
                places.push([at(i, 2.0 / 3.0), at(j, 2.0 / 3.0)]);
            }
        }
    }
    places
}

/// A scene with the light of a bake.
pub fn lit(scene: &Scene, quality: Quality) -> LitScene {
    let settings = quality.settings();
    let solution =
        mesolux::bake::bake(&device(), scene, &settings, |_| true).expect("the scene is baked");
    let bake = solution.into_bake(Origin::default());
    LitScene::new(scene, &bake).expect("a lit scene")
}
