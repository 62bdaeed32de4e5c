//! The Cornell box as it was built and measured, with its two blocks: the coordinates and the
//! camera of the data that Cornell's Program of Computer Graphics has published, in metres.
//! Reflectances and the light's colour are RGB approximations of the measured spectra.

use glam::DVec3;

use super::cornell;
use crate::error::Result;
use crate::scene::assemble::{Assembly, Mesh, MeshTriangle};
use crate::scene::uv::box_projection;
use crate::scene::{LoadOptions, Scene, check};

const WHITE: u32 = 0;
const RED: u32 = 1;
const GREEN: u32 = 2;
const LIGHT: u32 = 3;

/// Four corners, millimetres, counter-clockwise seen from the front.
type Quad = [[f64; 3]; 4];

/// The published ceiling has the light in its plane: here it is cut about it.
const ROOM: [(Quad, u32); 9] = [
    (
        [
            [552.8, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 559.2],
            [549.6, 0.0, 559.2],
        ],
        WHITE,
    ),
    (
        [
            [343.0, 548.8, 227.0],
            [343.0, 548.8, 332.0],
            [213.0, 548.8, 332.0],
            [213.0, 548.8, 227.0],
        ],
        LIGHT,
    ),
    (
        [
            [556.0, 548.8, 0.0],
            [556.0, 548.8, 559.2],
            [343.0, 548.8, 332.0],
            [343.0, 548.8, 227.0],
        ],
        WHITE,
    ),
    (
        [
            [556.0, 548.8, 559.2],
            [0.0, 548.8, 559.2],
            [213.0, 548.8, 332.0],
            [343.0, 548.8, 332.0],
        ],
        WHITE,
    ),
    (
        [
            [0.0, 548.8, 559.2],
            [0.0, 548.8, 0.0],
            [213.0, 548.8, 227.0],
            [213.0, 548.8, 332.0],
        ],
        WHITE,
    ),
    (
        [
            [0.0, 548.8, 0.0],
            [556.0, 548.8, 0.0],
            [343.0, 548.8, 227.0],
            [213.0, 548.8, 227.0],
        ],
        WHITE,
    ),
    (
        [
            [549.6, 0.0, 559.2],
            [0.0, 0.0, 559.2],
            [0.0, 548.8, 559.2],
            [556.0, 548.8, 559.2],
        ],
        WHITE,
    ),
    (
        [
            [0.0, 0.0, 559.2],
            [0.0, 0.0, 0.0],
            [0.0, 548.8, 0.0],
            [0.0, 548.8, 559.2],
        ],
        GREEN,
    ),
    (
        [
            [552.8, 0.0, 0.0],
            [549.6, 0.0, 559.2],
            [556.0, 548.8, 559.2],
            [556.0, 548.8, 0.0],
        ],
        RED,
    ),
];

const SHORT_BLOCK: [Quad; 5] = [
    [
        [130.0, 165.0, 65.0],
        [82.0, 165.0, 225.0],
        [240.0, 165.0, 272.0],
        [290.0, 165.0, 114.0],
    ],
    [
        [290.0, 0.0, 114.0],
        [290.0, 165.0, 114.0],
        [240.0, 165.0, 272.0],
        [240.0, 0.0, 272.0],
    ],
    [
        [130.0, 0.0, 65.0],
        [130.0, 165.0, 65.0],
        [290.0, 165.0, 114.0],
        [290.0, 0.0, 114.0],
    ],
    [
        [82.0, 0.0, 225.0],
        [82.0, 165.0, 225.0],
        [130.0, 165.0, 65.0],
        [130.0, 0.0, 65.0],
    ],
    [
        [240.0, 0.0, 272.0],
        [240.0, 165.0, 272.0],
        [82.0, 165.0, 225.0],
        [82.0, 0.0, 225.0],
    ],
];

const TALL_BLOCK: [Quad; 5] = [
    [
        [423.0, 330.0, 247.0],
        [265.0, 330.0, 296.0],
        [314.0, 330.0, 456.0],
        [472.0, 330.0, 406.0],
    ],
    [
        [423.0, 0.0, 247.0],
        [423.0, 330.0, 247.0],
        [472.0, 330.0, 406.0],
        [472.0, 0.0, 406.0],
    ],
    [
        [472.0, 0.0, 406.0],
        [472.0, 330.0, 406.0],
        [314.0, 330.0, 456.0],
        [314.0, 0.0, 456.0],
    ],
    [
        [314.0, 0.0, 456.0],
        [314.0, 330.0, 456.0],
        [265.0, 330.0, 296.0],
        [265.0, 0.0, 296.0],
    ],
    [
        [265.0, 0.0, 296.0],
        [265.0, 330.0, 296.0],
        [423.0, 330.0, 247.0],
        [423.0, 0.0, 247.0],
    ],
];

/// Metres a millimetre times ten: the data are of a box of half a metre, and the other scenes of
/// this name are of 5.5.
const UNIT: f64 = 0.01;

/// # Errors
/// None that data made by code can cause.
pub(super) fn build(options: &LoadOptions) -> Result<Scene> {
    let mut assembly = Assembly::new("cornell-box".into(), None);
    let materials = assembly.add_materials(&cornell::materials()[..4]);
    let of_block = |block: &[Quad]| mesh(block.iter().map(|&quad| (quad, WHITE)));
    for (name, of) in [
        ("room", mesh(ROOM.iter().copied())),
        ("short block", of_block(&SHORT_BLOCK)),
        ("tall block", of_block(&TALL_BLOCK)),
    ] {
        assembly.add_mesh(&of.named(name), &materials)?;
    }
    assembly.scene.cameras.push(cornell::camera());
    check::finish(assembly.into_scene(), &options.import)
}

fn mesh(quads: impl Iterator<Item = (Quad, u32)>) -> Mesh {
    let mut mesh = Mesh::default();
    for (quad, material) in quads {
        let first = mesh.positions.len() as u32;
        let corners = quad.map(|corner| UNIT * DVec3::from(corner));
        mesh.positions.extend(corners);
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(MeshTriangle {
                corners: [a, b, c].map(|i| first + i),
                uv: Some(box_projection([a, b, c].map(|i| corners[i as usize]))),
                emission_uv: None,
                light_uv: None,
                material,
            });
        }
    }
    mesh
}
