//! What any place sees of all sources, part by part.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::emitters::{Emitter, Looker};
use super::pair::Search;
use super::parts::Part;
use super::rays::{blocked, first_met};
use super::seen::Seen;
use super::sky_seen::sky_seen;
use super::{Nearness, PartTree};
use crate::constants::{KIND_BEAM, KIND_POINT, KIND_SUN};
use crate::mesh::elements::Elements;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::{FAR, Source};
use crate::scene::sky::Sky;
use crate::structs::ShadowOccluder;

/// Of the view of a place: the share that a part fills at most, unless it is one member.
pub const PART: f64 = 1.0 / 192.0;

/// The sources of a scene, to be looked at from places.
pub struct Outlook<'a> {
    search: Search<'a>,
    sources: &'a [Source],
    /// `[source]`; none of a point light.
    seen: Vec<Option<Seen>>,
    /// `[source]`; none of what does not emit.
    emitters: Vec<Option<Emitter>>,
    most_parts: usize,
}

/// Room for the parts of one source after another.
pub struct Looking(Vec<f64>);

impl<'a> Outlook<'a> {
    pub fn new(
        elements: &'a Elements,
        sources: &'a [Source],
        occluders: &'a ShadowTree<ShadowOccluder>,
    ) -> Self {
        let seen = |source: &Source| source.is_surface().then(|| Seen::new(elements, source));
        let seen: Vec<Option<Seen>> = sources.par_iter().map(seen).collect();
        let emitters = (sources.iter().zip(&seen)).map(|(source, seen)| {
            let emits = source.emitted != Vec3::ZERO;
            seen.as_ref()
                .filter(|_| emits)
                .map(|seen| Emitter::new(source, seen))
        });
        let emitters = emitters.collect();
        let counts = seen.iter().flatten().map(|seen| seen.tree.part_count());
        Self {
            search: Search {
                elements,
                occluders,
                nearness: Nearness {
                    source: 0.0,
                    part: PART,
                },
                scattered: true,
            },
            sources,
            emitters,
            most_parts: counts.max().unwrap_or(0),
            seen,
        }
    }

    pub fn looking(&self) -> Looking {
        Looking(vec![0.0; self.most_parts])
    }

    /// The parts of a source, if it is a surface.
    pub fn tree(&self, source: usize) -> Option<&PartTree> {
        self.seen[source].as_ref().map(|seen| &seen.tree)
    }

    /// Each part of a surface that a place with this normal sees any of: source, part and form
    /// factor. Internal units. `cut` says whether a part of a source is too uneven to count as one,
    /// by its form factor as if nothing stood between.
    pub fn parts(
        &self,
        place: DVec3,
        normal: DVec3,
        looking: &mut Looking,
        cut: impl Fn(usize, Part, f64) -> bool,
        mut each: impl FnMut(usize, Part, f64),
    ) {
        for (s, seen) in self.seen.iter().enumerate() {
            if let Some(seen) = seen {
                let factors = &mut looking.0;
                let part = |part: Part, factor: f64| each(s, part, factor);
                let cut = |part: Part, factor: f64| cut(s, part, factor);
                let search = &self.search;
                search.seen_from(place, normal, seen, factors, cut, part);
            }
        }
    }

    /// The form factor to a part as if nothing stood between, as a vector along which its light
    /// comes.
    pub fn towards(&self, source: usize, part: Part, place: DVec3, normal: DVec3) -> DVec3 {
        let seen = self.seen[source].as_ref();
        seen.map_or(DVec3::ZERO, |seen| seen.facing(part, place, normal))
    }

    /// Each part of an emitter that a place with this normal sees any of: source, part, and the
    /// form factor of what is seen of it as a vector, up to the edges of shadows; where it is asked
    /// `by_direction`, in narrow pieces. `uneven` says whether a part of a source emits too
    /// unevenly to count as one, by its whole form factor.
    pub fn emitters(
        &self,
        place: DVec3,
        normal: DVec3,
        by_direction: bool,
        uneven: impl Fn(usize, Part, f64) -> bool,
        mut each: impl FnMut(usize, Part, DVec3),
    ) {
        let looker = Looker {
            occluders: self.search.occluders,
            place,
            normal,
            by_direction,
        };
        for (s, (emitter, seen)) in self.emitters.iter().zip(&self.seen).enumerate() {
            if let (Some(emitter), Some(seen)) = (emitter, seen) {
                let uneven = |part: Part, factor: f64| uneven(s, part, factor);
                looker.look(seen, emitter, uneven, |part, vector| each(s, part, vector));
            }
        }
    }

    /// What a place sees of each sun and beam: source, and form factor as a vector, or of a beam
    /// irradiance for a unit of intensity; of a sun in many pieces.
    pub fn far(&self, place: DVec3, normal: DVec3, mut each: impl FnMut(usize, DVec3)) {
        for (s, source) in self.sources.iter().enumerate() {
            if source.kind != KIND_SUN && source.kind != KIND_BEAM {
                continue;
            }
            let count = source.places.len().max(1);
            for i in 0..count {
                let way = source.way_from(place, i);
                let factor = source.factor_along(way, normal) / count as f64;
                if factor > 0.0 && !blocked(self.search.occluders, place, place + way) {
                    each(s, way * (factor / way.dot(normal)));
                }
            }
        }
    }

    /// Whether a place sees a back first along its normal, as it does within a solid.
    pub fn sees_a_back(&self, place: DVec3, normal: DVec3) -> bool {
        let met = first_met(self.search.occluders, place, FAR * normal);
        met.is_some_and(|(_, is_back)| is_back)
    }

    /// Whether a place lies beneath what stands on its surface: it sees backs along its normal and
    /// at 60° to all sides. Beneath a sheet that has one side, light may come from beside it.
    pub fn is_covered(&self, place: DVec3, normal: DVec3) -> bool {
        let (s, t) = normal.any_orthonormal_pair();
        let aslant = [s, -s, t, -t].map(|side| 0.5 * normal + 0.75_f64.sqrt() * side);
        let mut ways = [normal].into_iter().chain(aslant);
        ways.all(|way| self.sees_a_back(place, way))
    }

    /// Irradiance by each part of a sky that a place sees, and the way to it.
    pub fn sky(&self, sky: &Sky, place: DVec3, normal: DVec3, each: impl FnMut(DVec3, DVec3)) {
        sky_seen(sky, self.search.occluders, place, normal, each);
    }

    /// Each point light that a place sees: source, and irradiance for a unit of intensity as a
    /// vector.
    pub fn points(&self, place: DVec3, normal: DVec3, mut each: impl FnMut(usize, DVec3)) {
        for (s, source) in self.sources.iter().enumerate() {
            let way = source.eye - place;
            let cosine = way.dot(normal);
            let side = -way.dot(source.normal);
            // Each of the two sources of a point light serves its own side; the upper one has the
            // plane between them.
            let is_upper = source.cone == 0.0;
            let serves = side > 0.0 || is_upper && side == 0.0;
            if source.kind == KIND_POINT
                && serves
                && cosine > 0.0
                && !blocked(self.search.occluders, place, source.eye)
            {
                each(s, way / way.length().powi(3));
            }
        }
    }
}
