//! Small scenes made of squares, boxes and spheres.

use std::sync::Arc;

use glam::DVec3;

use super::{HeightMap, Material, PointLight, Scene, Triangle};

/// A scene made piece by piece. Material 0 reflects half and emits nothing.
#[derive(Debug, Clone)]
pub struct Shapes {
    pub scene: Scene,
}

impl Default for Shapes {
    fn default() -> Self {
        Self::new()
    }
}

impl Shapes {
    pub fn new() -> Self {
        let mut shapes = Self {
            scene: Scene {
                name: "test".into(),
                ..Scene::default()
            },
        };
        shapes.material(0.5, 0.0);
        shapes
    }

    /// A grey material: reflectance and emitted radiance. Returns its index.
    pub fn material(&mut self, kd: f32, ke: f32) -> u32 {
        self.scene.materials.push(Material {
            name: format!("m{}", self.scene.materials.len()),
            kd: [kd; 3],
            ke: [ke; 3],
            ..Material::default()
        });
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a triangle without texture coordinates.
    pub fn triangle(&mut self, corners: [u32; 3], material: u32) {
        self.scene.triangles.push(Triangle {
            vertices: corners,
            uv: [[0.0; 2]; 3],
            emission_uv: None,
            light_uv: None,
            material,
        });
    }

    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, v: DVec3) -> u32 {
        self.scene.vertices.push(v);
        self.scene.vertices.len() as u32 - 1
    }

    /// A parallelogram of n × m cells, two triangles each, facing `u` × `v`. Returns its range of
    /// triangles.
    pub fn quad(
        &mut self,
        origin: DVec3,
        u: DVec3,
        v: DVec3,
        (n, m): (u32, u32),
        material: u32,
    ) -> std::ops::Range<usize> {
        let first = self.scene.triangles.len();
        let base = self.scene.vertices.len() as u32;
        for j in 0..=m {
            for i in 0..=n {
                self.vertex(
                    origin + u * (f64::from(i) / f64::from(n)) + v * (f64::from(j) / f64::from(m)),
                );
            }
        }
        for j in 0..m {
            for i in 0..n {
                let a = base + j * (n + 1) + i;
                let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
                // Diagonals alternate, so that the grid has no grain.
                if (i + j) % 2 == 0 {
                    self.triangle([a, b, c], material);
                    self.triangle([a, c, d], material);
                } else {
                    self.triangle([a, b, d], material);
                    self.triangle([b, c, d], material);
                }
            }
        }
        first..self.scene.triangles.len()
    }

    /// The six inner sides of a box; the ranges are floor (y low), ceiling, x low, x high, z low, z
    /// high.
    pub fn room(
        &mut self,
        low: DVec3,
        size: DVec3,
        n: u32,
        material: u32,
    ) -> [std::ops::Range<usize>; 6] {
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        let sides = [
            self.quad(low, z, x, (n, n), material),
            self.quad(low + y, x, z, (n, n), material),
            self.quad(low, y, z, (n, n), material),
            self.quad(low + x, z, y, (n, n), material),
            self.quad(low, x, y, (n, n), material),
            self.quad(low + z, y, x, (n, n), material),
        ];
        self.weld();
        sides
    }

    /// The six outer sides of a box, in the order of [`Shapes::room`].
    pub fn solid(
        &mut self,
        low: DVec3,
        size: DVec3,
        n: u32,
        material: u32,
    ) -> [std::ops::Range<usize>; 6] {
        let sides = self.room(low, size, n, material);
        for t in &mut self.scene.triangles[sides[0].start..sides[5].end] {
            t.vertices.swap(1, 2);
        }
        sides
    }

    /// A sphere of 20 · 4^levels triangles; `outward` or facing its centre.
    pub fn sphere(
        &mut self,
        centre: DVec3,
        radius: f64,
        levels: u32,
        outward: bool,
        material: u32,
    ) -> std::ops::Range<usize> {
        let first = self.scene.triangles.len();
        let g = 0.5 * (1.0 + 5f64.sqrt());
        let ico = [
            [-1., g, 0.],
            [1., g, 0.],
            [-1., -g, 0.],
            [1., -g, 0.],
            [0., -1., g],
            [0., 1., g],
            [0., -1., -g],
            [0., 1., -g],
            [g, 0., -1.],
            [g, 0., 1.],
            [-g, 0., -1.],
            [-g, 0., 1.],
        ]
        .map(|v| DVec3::from_array(v).normalize());
        let faces = [
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ];
        let mut triangles: Vec<[DVec3; 3]> =
            faces.iter().map(|f| f.map(|i: usize| ico[i])).collect();
        for _ in 0..levels {
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let m = |p: DVec3, q: DVec3| (p + q).normalize();
                    let (ab, bc, ca) = (m(a, b), m(b, c), m(c, a));
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        for [a, b, c] in triangles {
            let [a, b, c] = [a, b, c].map(|v| self.vertex(centre + radius * v));
            let corners = if outward { [a, b, c] } else { [a, c, b] };
            self.triangle(corners, material);
        }
        self.weld();
        first..self.scene.triangles.len()
    }

    /// Gives a material a relief of `size` texels a side: `height` over 0..1 × 0..1, in scene
    /// units.
    pub fn relief(&mut self, material: u32, size: u32, height: impl Fn(f64, f64) -> f64) {
        self.relief_of(material, (size, size), height);
    }

    /// As [`Shapes::relief`], with `width` texels across and `rows` down.
    pub fn relief_of(
        &mut self,
        material: u32,
        (width, rows): (u32, u32),
        height: impl Fn(f64, f64) -> f64,
    ) {
        let centre = |i: u32, of: u32| (f64::from(i) + 0.5) / f64::from(of);
        let values = (0..rows)
            .flat_map(|row| (0..width).map(move |column| (column, rows - 1 - row)))
            .map(|(i, j)| height(centre(i, width), centre(j, rows)) as f32)
            .collect();
        self.scene.materials[material as usize].map_height = Some(Arc::new(HeightMap {
            path: "test".into(),
            width,
            height: rows,
            values,
        }));
    }

    /// Texture coordinates along two directions, one repeat for the length of each.
    pub fn uv(&mut self, triangles: std::ops::Range<usize>, u: DVec3, v: DVec3) {
        for t in &mut self.scene.triangles[triangles] {
            t.uv = t.vertices.map(|i| {
                let p = self.scene.vertices[i as usize];
                [p.dot(u) / u.length_squared(), p.dot(v) / v.length_squared()].map(|x| x as f32)
            });
        }
    }

    /// Joins equal positions, as reading a file does.
    pub fn weld(&mut self) {
        let mut places = std::collections::HashMap::new();
        let mut vertices = Vec::new();
        for t in &mut self.scene.triangles {
            for v in &mut t.vertices {
                let p = self.scene.vertices[*v as usize];
                *v = *places
                    .entry(p.to_array().map(f64::to_bits))
                    .or_insert_with(|| {
                        vertices.push(p);
                        vertices.len() as u32 - 1
                    });
            }
        }
        self.scene.vertices = vertices;
    }

    /// Adds a grey point light, W·sr⁻¹.
    pub fn point_light(&mut self, position: DVec3, intensity: f32) {
        self.scene.lights.points.push(PointLight {
            name: "lamp".into(),
            position,
            intensity: [intensity; 3],
            beam: None,
        });
    }
}
