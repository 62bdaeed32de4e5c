//! Twin of the culling pass: the items that a hemicube's item buffer shows. The pass must not cull
//! them.

use std::collections::BTreeSet;

use crate::constants::NONE;
use crate::math::hemicube::{Pixel, face_rectangle};
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;
use crate::mesh::sources::Source;

/// Elements as which the pixels of a face are drawn.
pub fn shown(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    face: u32,
    n: u32,
) -> BTreeSet<u32> {
    let [x0, y0, width, height] = face_rectangle(face, n);
    let items = super::item_buffer::item_buffer(elements, connections, occluders, source, n);
    (y0..y0 + height)
        .flat_map(|row| (x0..x0 + width).map(move |column| Pixel { column, row }))
        .map(|p| items[(p.row * n + p.column) as usize])
        .filter(|&item| item != NONE)
        .collect()
}
