//! Cuts charts into groups of elements, each of which becomes a source.

use glam::DVec3;

use super::Grouping;
use super::group::{Shape, bisect};
use super::lit::Lit;
use crate::mesh::charts::{Connections, charts, morton_order};
use crate::mesh::elements::Elements;

/// Of the most area of a source: what is smaller is not cut for its uneven light.
const LEAST_UNEVEN: f64 = 1.0 / 16.0;

/// Of the most power of a source: what its members may emit more or less than their mean.
const PATCHY: f64 = 1.0 / 8.0;

/// A scene's limits of area and power of one source.
pub(super) struct Limits<'a> {
    pub grouping: &'a Grouping,
    pub total_area: f64,
    pub total_power: f64,
}

impl<'a> Limits<'a> {
    pub fn new(elements: &Elements, grouping: &'a Grouping) -> Self {
        Self {
            grouping,
            total_area: elements.area.iter().sum(),
            total_power: (0..elements.len()).map(|e| power(elements, e)).sum(),
        }
    }

    /// Whether a source of this area and emitted power is to be cut.
    pub fn too_much(&self, area: f64, emitted: f64) -> bool {
        area > self.grouping.max_area * self.total_area
            || (emitted > 0.0 && emitted > self.grouping.max_power * self.total_power)
    }

    /// Whether members of a source emit so differently that it is to be cut; never without textures
    /// of emission.
    pub fn too_patchy(&self, elements: &Elements, members: &[u32], area: f64) -> bool {
        if elements.glow.is_none() {
            return false;
        }
        let emitted = |e: u32| elements.emitted[e as usize].as_dvec3();
        let own = |e: u32| elements.area[e as usize];
        let mean = members.iter().map(|&e| own(e) * emitted(e)).sum::<DVec3>() / area;
        let off = |e: u32| own(e) * (emitted(e) - mean).abs().element_sum();
        let all: f64 = members.iter().map(|&e| off(e)).sum();
        all > PATCHY * self.grouping.max_power * self.total_power
    }

    /// Whether a source of this area is to be cut that is so unevenly lit, see [`Lit::unevenness`].
    pub fn too_uneven(&self, area: f64, unevenness: impl FnOnce() -> f64) -> bool {
        let share = area / (self.grouping.max_area * self.total_area);
        share > LEAST_UNEVEN && share * unevenness() > self.grouping.max_unevenness
    }
}

/// Power that an element emits, summed over the colours, internal units.
fn power(elements: &Elements, e: usize) -> f64 {
    elements.area[e] * f64::from(elements.emitted[e].element_sum())
}

/// Elements in groups.
pub(super) struct Groups {
    /// For [`Elements::permute`]; elements with a relief come last.
    pub order: Vec<u32>,
    /// Of the new order, `[group]`.
    pub ranges: Vec<std::ops::Range<usize>>,
    /// Chart of each element in the new order.
    pub chart: Vec<u32>,
}

/// Cuts the charts in two until no part is over the limits.
pub(super) fn cut(
    elements: &Elements,
    connections: &Connections,
    limits: &Limits<'_>,
    lit: Option<&Lit>,
) -> Groups {
    let grouping = limits.grouping;
    let is_flat = |members: &[u32]| {
        let members = members.iter().map(|&e| e as usize);
        Shape::new(elements, members).flat
    };
    let mut charts = charts(elements, connections, &morton_order(elements));
    charts.sort_by_key(|chart| elements.is_meso(chart[0] as usize));
    let is_curved = |chart: &&Vec<u32>| !elements.is_meso(chart[0] as usize) && !is_flat(chart);
    let curved: usize = charts.iter().filter(is_curved).map(Vec::len).sum();
    let most_curved = grouping.most_curved(curved);
    let mut groups = Groups {
        order: Vec::with_capacity(elements.len()),
        ranges: Vec::new(),
        chart: Vec::with_capacity(elements.len()),
    };
    for (c, chart) in (0_u32..).zip(charts) {
        let mut stack = vec![chart];
        while let Some(mut members) = stack.pop() {
            let area = members.iter().map(|&e| elements.area[e as usize]).sum();
            let emitted = members.iter().map(|&e| power(elements, e as usize)).sum();
            // The outline of a plane group stands for any number of members.
            let relief = elements.is_meso(members[0] as usize);
            let plane = !relief && is_flat(&members);
            let most = if relief {
                grouping.max_elements
            } else {
                most_curved
            };
            let many = members.len() > most && !plane;
            let uneven = || {
                lit.filter(|_| !relief)
                    .is_some_and(|lit| limits.too_uneven(area, || lit.unevenness(&members)))
            };
            let large = many
                || grouping.alone
                || limits.too_much(area, emitted)
                || limits.too_patchy(elements, &members, area);
            if members.len() > 1 && (large || uneven()) {
                let at = bisect(elements, &mut members);
                stack.push(members.split_off(at));
                stack.push(members);
            } else {
                let first = groups.order.len();
                groups.ranges.push(first..first + members.len());
                groups.chart.extend(std::iter::repeat_n(c, members.len()));
                groups.order.extend(members);
            }
        }
    }
    groups
}
