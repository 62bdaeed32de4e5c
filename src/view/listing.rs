//! What the window shows, as a list that a test reads: controls and texts as a screen reader would
//! find them, and where the view is seen from.

use std::collections::HashMap;
use std::path::Path;

use egui::accesskit::{Node, NodeId, Role, Toggled, TreeUpdate};
use serde::Serialize;

use crate::atomic_file::write_atomically;
use crate::error::Result;
use crate::scene::Camera;

type Nodes<'a> = HashMap<NodeId, &'a Node>;

#[derive(Serialize)]
struct Listing<'a> {
    /// Scene units.
    position: [f64; 3],
    look_at: [f64; 3],
    /// In the order in which they are laid out.
    widgets: Vec<Widget<'a>>,
}

/// A control or a text.
#[derive(Serialize)]
struct Widget<'a> {
    role: String,
    name: &'a str,
    /// The text of a field or of a label.
    text: &'a str,
    number: Option<f64>,
    on: Option<bool>,
    enabled: bool,
    /// Left, top, right, bottom, pixels.
    place: [f64; 4],
}

impl<'a> Widget<'a> {
    /// None of what only holds others, and of the letters of a text.
    fn new(node: &'a Node, nodes: &Nodes<'a>, scale: f64) -> Option<Self> {
        let holds = [
            Role::GenericContainer,
            Role::Pane,
            Role::TextRun,
            Role::Unknown,
        ];
        if holds.contains(&node.role()) {
            return None;
        }
        let place = node.bounds()?;
        let own = node.label().filter(|name| !name.is_empty());
        let beside = node.labelled_by().first().and_then(|id| nodes.get(id));
        let beside = beside.and_then(|label| label.value());
        Some(Self {
            role: format!("{:?}", node.role()),
            name: own.or(beside).unwrap_or_default(),
            text: node.value().unwrap_or_default(),
            number: node.numeric_value(),
            on: node.toggled().map(|toggled| toggled == Toggled::True),
            enabled: !node.is_disabled(),
            place: [place.x0, place.y0, place.x1, place.y1].map(|points| points * scale),
        })
    }
}

/// Writes what a frame shows as JSON, with `scale` pixels per point.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, shown: &TreeUpdate, camera: &Camera, scale: f32) -> Result<()> {
    let nodes: Nodes<'_> = shown.nodes.iter().map(|(id, node)| (*id, node)).collect();
    let listing = Listing {
        position: camera.position.to_array(),
        look_at: camera.look_at.to_array(),
        widgets: ordered(shown, &nodes)
            .into_iter()
            .filter_map(|node| Widget::new(node, &nodes, scale.into()))
            .collect(),
    };
    write_atomically(path, |out| {
        serde_json::to_writer(out, &listing).map_err(std::io::Error::from)
    })
}

/// Nodes in the order of the tree, parents first.
fn ordered<'a>(shown: &TreeUpdate, nodes: &Nodes<'a>) -> Vec<&'a Node> {
    let mut ordered = Vec::with_capacity(nodes.len());
    let mut next: Vec<_> = shown.tree.iter().map(|tree| tree.root).collect();
    while let Some(id) = next.pop() {
        if let Some(node) = nodes.get(&id) {
            ordered.push(*node);
            next.extend(node.children().iter().rev());
        }
    }
    ordered
}
