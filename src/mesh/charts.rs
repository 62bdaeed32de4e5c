//! The mesh's connections: neighbours over edges, closed parts, and charts (connected, nearly
//! coplanar regions).

use std::collections::VecDeque;

use glam::DVec3;

use crate::math::groups::{Edge, edges, shared};
use crate::mesh::elements::Elements;

/// Elements that touch over an edge, and the connected parts that they form.
pub struct Connections {
    /// Per element and edge (corner i to corner i + 1): the element on the other side, if there is
    /// exactly one and it has the edge in the opposite direction. Of two surfaces that touch along
    /// the edge, the element that continues its own.
    pub neighbours: Vec<[Option<u32>; 3]>,
    /// Connected part of each element.
    pub component: Vec<u32>,
    /// Per part: every edge has a partner, and the enclosed volume is positive (all normals
    /// outward).
    pub closed: Vec<bool>,
    /// One part encloses all others, with its normals inward, and all others are closed and
    /// disjoint: all light that is sent arrives.
    pub enclosed: bool,
}

impl Connections {
    pub fn new(elements: &Elements) -> Self {
        let count = elements.len();
        let mut neighbours = vec![[None; 3]; count];
        for group in shared(&edges(elements.corners.iter().copied())) {
            let normal = |z: &Edge| elements.normal[z.triangle as usize];
            let mut join = |x: &Edge, y: &Edge| {
                neighbours[x.triangle as usize][usize::from(x.side)] = Some(y.triangle);
                neighbours[y.triangle as usize][usize::from(y.side)] = Some(x.triangle);
            };
            match group {
                [x, y] if x.ascends != y.ascends => join(x, y),
                // Two surfaces that touch, such as the sides of a sheet: each continues.
                [_, _, _, _] => {
                    let (on, back): (Vec<&Edge>, Vec<&Edge>) =
                        group.iter().partition(|z| z.ascends == group[0].ascends);
                    let continues = |x: &Edge, y: &Edge| normal(x).dot(normal(y)) > 0.0;
                    if let ([a, b], [c, d]) = (&on[..], &back[..]) {
                        for [c, d] in [[c, d], [d, c]] {
                            let apart = !continues(a, d) && !continues(b, c);
                            if continues(a, c) && continues(b, d) && apart {
                                join(a, c);
                                join(b, d);
                            }
                        }
                    }
                }
                _ => {}
            }
        }
        let mut component = vec![u32::MAX; count];
        let mut closed = Vec::new();
        let mut rooms = Vec::new();
        let mut queue = VecDeque::new();
        for seed in 0..count {
            if component[seed] != u32::MAX {
                continue;
            }
            let id = closed.len() as u32;
            let (mut whole, mut volume) = (true, 0.0);
            // About a point of the part itself, so that the sum does not cancel.
            let about = elements.centroid[seed];
            component[seed] = id;
            queue.push_back(seed);
            while let Some(e) = queue.pop_front() {
                let [a, b, c] = elements.triangle(e).map(|v| v - about);
                volume += a.dot(b.cross(c));
                for neighbour in neighbours[e] {
                    match neighbour {
                        None => whole = false,
                        Some(n) if component[n as usize] == u32::MAX => {
                            component[n as usize] = id;
                            queue.push_back(n as usize);
                        }
                        Some(_) => {}
                    }
                }
            }
            closed.push(whole && volume > 0.0);
            rooms.extend((whole && volume < 0.0).then_some(id as usize));
        }
        let enclosed = rooms.len() == 1
            && closed.iter().filter(|&&closed| !closed).count() == 1
            && apart_within(elements, &component, closed.len(), rooms[0]);
        Self {
            neighbours,
            component,
            closed,
            enclosed,
        }
    }

    /// The same connections for elements reordered by `order[new] = old`.
    pub fn permute(&self, order: &[u32]) -> Self {
        let mut new_place = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            new_place[old as usize] = new as u32;
        }
        let neighbours = order
            .iter()
            .map(|&old| self.neighbours[old as usize].map(|n| n.map(|n| new_place[n as usize])))
            .collect();
        Self {
            neighbours,
            component: order
                .iter()
                .map(|&old| self.component[old as usize])
                .collect(),
            closed: self.closed.clone(),
            enclosed: self.enclosed,
        }
    }
}

/// Whether the boxes about all other parts lie within that of the room and do not overlap. Where
/// bodies intersect, elements that are half inside another count as fully lit, and more light
/// arrives than was sent.
fn apart_within(elements: &Elements, component: &[u32], count: usize, room: usize) -> bool {
    let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); count];
    for (e, &c) in component.iter().enumerate() {
        let (low, high) = &mut boxes[c as usize];
        for v in elements.triangle(e) {
            *low = low.min(v);
            *high = high.max(v);
        }
    }
    let room = boxes.swap_remove(room);
    let inside = |b: &(DVec3, DVec3)| b.0.cmpgt(room.0).all() && b.1.cmplt(room.1).all();
    boxes.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
    boxes.iter().all(inside)
        && boxes.iter().enumerate().all(|(i, a)| {
            let mut after = boxes[i + 1..].iter().take_while(|b| b.0.x <= a.1.x);
            after.all(|b| b.0.cmpgt(a.1).any() || a.0.cmpgt(b.1).any())
        })
}

/// Largest angle of a member's normal to its chart's first normal.
const CHART_ANGLE_COSINE: f64 = 0.93969; // 20°

/// Charts, each a list of elements: grown over edges from the first free element in `order` while
/// the normals stay near the first one's. Elements that emit never share a chart with those that do
/// not, nor with another material; nor do elements with a relief with those without.
pub fn charts(elements: &Elements, connections: &Connections, order: &[u32]) -> Vec<Vec<u32>> {
    let mut taken = vec![false; elements.len()];
    let mut charts = Vec::new();
    for &seed in order {
        if taken[seed as usize] {
            continue;
        }
        let axis: DVec3 = elements.normal[seed as usize];
        let belongs = |e: u32| {
            let (e, s) = (e as usize, seed as usize);
            let emits = |i: usize| elements.emitted[i].max_element() > 0.0;
            elements.normal[e].dot(axis) >= CHART_ANGLE_COSINE
                && elements.is_meso(e) == elements.is_meso(s)
                && emits(e) == emits(s)
                && (!emits(e) || elements.material[e] == elements.material[s])
        };
        taken[seed as usize] = true;
        let mut chart = vec![seed];
        let mut next = 0;
        while next < chart.len() {
            for neighbour in connections.neighbours[chart[next] as usize]
                .into_iter()
                .flatten()
            {
                if !taken[neighbour as usize] && belongs(neighbour) {
                    taken[neighbour as usize] = true;
                    chart.push(neighbour);
                }
            }
            next += 1;
        }
        charts.push(chart);
    }
    charts
}

/// Elements along a Morton curve through their centroids: near in space is near in the list, for
/// any order of the input.
pub fn morton_order(elements: &Elements) -> Vec<u32> {
    let spread = |v: f64| {
        // 21 bits of a coordinate in −1..1, two zeros between each.
        let mut x = ((v * 0.5 + 0.5).clamp(0.0, 1.0) * f64::from((1 << 21) - 1)) as u64;
        x = (x | (x << 32)) & 0x001f_0000_0000_ffff;
        x = (x | (x << 16)) & 0x001f_0000_ff00_00ff;
        x = (x | (x << 8)) & 0x100f_00f0_0f00_f00f;
        x = (x | (x << 4)) & 0x10c3_0c30_c30c_30c3;
        (x | (x << 2)) & 0x1249_2492_4924_9249
    };
    let codes: Vec<u64> = elements
        .centroid
        .iter()
        .map(|c| spread(c.x) | spread(c.y) << 1 | spread(c.z) << 2)
        .collect();
    let mut order: Vec<u32> = (0..elements.len() as u32).collect();
    let key = |e: u32| {
        let c = elements.centroid[e as usize];
        let n = elements.normal[e as usize];
        (codes[e as usize], [c.x, c.y, c.z, n.x, n.y, n.z])
    };
    order.sort_by(|&a, &b| {
        let ((ca, pa), (cb, pb)) = (key(a), key(b));
        ca.cmp(&cb)
            .then_with(|| pa.partial_cmp(&pb).unwrap_or(std::cmp::Ordering::Equal))
    });
    order
}
