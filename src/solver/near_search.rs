//! Eyes and near pairs that the processes of a crew find together, each those of some sources.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::mesh::elements::Elements;
use crate::mesh::near::{Nearness, OfSource, PartTree, pairs_of};
use crate::mesh::open_eyes::{Wanted, open_eyes};
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::{Source, SourcePlace};
use crate::meso::Relief;
use crate::passes::types::ShadowOccluder;
use crate::passes::words::Words;

/// What is looked at: see [`Elements`], [`Relief`] and [`ShadowTree`].
#[derive(Serialize, Deserialize)]
pub(super) struct NearSearch {
    vertices: Words,
    corners: Words,
    centroid: Words,
    normal: Words,
    area: Words,
    /// Class, tangent and bitangent of a scene with relief.
    relief: Option<[Words; 3]>,
    /// Surfaces; of each no places.
    sources: Vec<Source>,
    wanted: Vec<Wanted>,
    nodes: Words,
    occluders: Words,
    nearness: Nearness,
}

impl NearSearch {
    pub fn new(
        elements: &Elements,
        sources: &[Source],
        tree: &ShadowTree<ShadowOccluder>,
        wanted: &[Wanted],
        nearness: &Nearness,
    ) -> Self {
        let relief = |of: &Relief| {
            [
                Words::of(&of.class),
                Words::of(&of.tangent),
                Words::of(&of.bitangent),
            ]
        };
        let surfaces = || sources.iter().zip(wanted).filter(|(s, _)| s.is_surface());
        let bare = |(source, _): (&Source, &Wanted)| Source {
            places: Vec::new(),
            parts: Vec::new(),
            ..source.clone()
        };
        Self {
            vertices: Words::of(&elements.vertices),
            corners: Words::of(elements.corners.as_flattened()),
            centroid: Words::of(&elements.centroid),
            normal: Words::of(&elements.normal),
            area: Words::of(&elements.area),
            relief: elements.relief.as_ref().map(relief),
            sources: surfaces().map(bare).collect(),
            wanted: surfaces().map(|(_, wanted)| *wanted).collect(),
            nodes: Words::of(tree.nodes()),
            occluders: Words::of(&tree.triangles),
            nearness: *nearness,
        }
    }

    /// The eyes and pairs of one in so many surfaces, by their order.
    pub fn find(mut self, turn: [usize; 2]) -> Found {
        let relief = self.relief.map(|[class, tangent, bitangent]| {
            let axes = [&tangent, &bitangent].map(|axis| axis.values::<Vec3>().to_vec());
            Relief::of_frames(class.into_words(), axes)
        });
        let elements = Elements {
            vertices: self.vertices.collected(),
            corners: self.corners.collected(),
            centroid: self.centroid.collected(),
            normal: self.normal.collected(),
            area: self.area.collected(),
            relief,
            ..Elements::default()
        };
        let tree = ShadowTree::of_lists(self.nodes.collected(), self.occluders.collected());
        let (mut own, wanted) = own(&mut self.sources, &self.wanted, turn);
        let pairs = looked(&elements, &mut own, &tree, &wanted, &self.nearness);
        Found::new(&own, &pairs)
    }
}

/// The surfaces among some sources, `turn` of so many, and what is wanted of each.
pub(super) fn own<'a>(
    sources: &'a mut [Source],
    wanted: &[Wanted],
    [turn, of]: [usize; 2],
) -> (Vec<&'a mut Source>, Vec<Wanted>) {
    let both = sources.iter_mut().zip(wanted);
    let surfaces = both.filter(|(source, _)| source.is_surface());
    surfaces.skip(turn).step_by(of).unzip()
}

/// Opens the eyes of sources, and finds the pairs of each.
pub(super) fn looked(
    elements: &Elements,
    sources: &mut [&mut Source],
    tree: &ShadowTree<ShadowOccluder>,
    wanted: &[Wanted],
    nearness: &Nearness,
) -> Vec<OfSource> {
    let each = sources.par_iter_mut().map(|source| &mut **source);
    open_eyes(elements, each, tree, wanted);
    let each = sources.par_iter().map(|source| &**source);
    pairs_of(elements, each, tree, nearness)
}

/// What was found of some sources.
#[derive(Serialize, Deserialize)]
pub(super) struct Found {
    /// Eye and places of each source.
    eyes: Vec<(DVec3, Vec<SourcePlace>)>,
    /// Members, pairs and entries of each source.
    counts: Vec<[u32; 3]>,
    rays: Vec<u64>,
    members: Words,
    pairs: Words,
    entries: Words,
}

impl Found {
    fn new(sources: &[&mut Source], found: &[OfSource]) -> Self {
        fn joined<T: bytemuck::Pod>(found: &[OfSource], list: impl Fn(&OfSource) -> &[T]) -> Words {
            Words::of(&found.iter().flat_map(list).copied().collect::<Vec<T>>())
        }
        let counts = |of: &OfSource| {
            [of.tree.members.len(), of.pairs.len(), of.entries.len()].map(|count| count as u32)
        };
        let eyes = sources.iter().map(|of| (of.eye, of.places.clone()));
        Self {
            eyes: eyes.collect(),
            counts: found.iter().map(counts).collect(),
            rays: found.iter().map(|of| of.rays).collect(),
            members: joined(found, |of| &of.tree.members),
            pairs: joined(found, |of| &of.pairs),
            entries: joined(found, |of| &of.entries),
        }
    }

    /// Each source's.
    fn each(&self) -> impl Iterator<Item = OfSource> {
        fn taken<T: bytemuck::Pod>(left: &mut &[T], count: u32) -> Vec<T> {
            let (taken, rest) = left.split_at(count as usize);
            *left = rest;
            taken.to_vec()
        }
        let mut members = self.members.values();
        let mut pairs = self.pairs.values();
        let mut entries = self.entries.values();
        let each = self.counts.iter().zip(&self.rays);
        each.map(move |(&[of_tree, of_pairs, of_entries], &rays)| OfSource {
            tree: PartTree {
                members: taken(&mut members, of_tree),
            },
            pairs: taken(&mut pairs, of_pairs),
            entries: taken(&mut entries, of_entries),
            rays,
        })
    }
}

/// The pairs of all sources, of what each process has found of its own, and their eyes.
pub(super) fn joined(
    sources: &mut [Source],
    own: Vec<OfSource>,
    others: &[Found],
) -> Vec<OfSource> {
    let mut of_first = own.into_iter();
    let mut of_others: Vec<_> = others
        .iter()
        .map(|of| of.eyes.iter().zip(of.each()))
        .collect();
    let members = others.len() + 1;
    let mut surfaces = 0;
    let next = |source: &mut Source| {
        if !source.is_surface() {
            return OfSource::default();
        }
        let turn = surfaces % members;
        surfaces += 1;
        let found = match turn.checked_sub(1) {
            None => of_first.next(),
            Some(other) => of_others[other].next().map(|((eye, places), found)| {
                (source.eye, source.places) = (*eye, places.clone());
                found
            }),
        };
        found.unwrap_or_default()
    };
    sources.iter_mut().map(next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::{NONE, SOURCE_EYES};
    use crate::mesh::occluders::Occluders;
    use crate::mesh::sources;
    use crate::scene::{LoadOptions, load};

    /// Of a scene with frames of relief and a light without a surface, by one and by three; eyes
    /// under the blocks are moved.
    #[test]
    fn eyes_and_pairs_do_not_depend_on_who_finds_them() {
        let options = LoadOptions {
            patches: Some(3000),
            ..LoadOptions::default()
        };
        let scene = load("cornell", &options).expect("it is built in");
        let mut elements = Elements::new(&scene);
        let grouping = sources::Grouping::default();
        let (mut built, connections) = sources::build(&mut elements, &scene.lights, &grouping, 0);
        let count = elements.len();
        let class = (0..count).map(|e| if 2 * e < count { NONE } else { 0 });
        let axis = |axis: Vec3| vec![axis; count];
        let axes = [axis(Vec3::X), axis(Vec3::Y)];
        elements.relief = Some(Relief::of_frames(class.collect(), axes));
        let casters = Occluders::elements(&elements).casters(&elements, &connections);
        let tree = ShadowTree::new(casters);
        let mut light = built.list[0].clone();
        (light.kind, light.element_count) = (crate::constants::KIND_POINT, 0);
        built.list.insert(3, light);
        let (list, nearness) = (built.list, Nearness::default());
        let places = |turn| if turn % 5 == 0 { SOURCE_EYES } else { 4 };
        let wanted: Vec<Wanted> = (0..list.len() as u32)
            .map(|turn| Wanted {
                turn,
                places: places(turn),
            })
            .collect();
        let mut alone = list.clone();
        let moved = open_eyes(&elements, &mut alone, &tree, &wanted);
        // Without places fewer looks are taken, and the eyes are the same.
        let none: Vec<Wanted> = (wanted.iter())
            .map(|wanted| Wanted {
                places: 0,
                ..*wanted
            })
            .collect();
        let mut bare = list.clone();
        assert_eq!(open_eyes(&elements, &mut bare, &tree, &none), moved);
        let pairs = || bare.iter().zip(&alone);
        assert!(pairs().all(|(bare, full)| bare.eye == full.eye && bare.places.is_empty()));
        let of_alone = pairs_of(&elements, &alone, &tree, &nearness);
        let entries: usize = of_alone.iter().map(|of| of.entries.len()).sum();
        assert!(entries > 1000 && moved > 3, "{entries}, {moved}");
        let search = |turn| {
            let search = NearSearch::new(&elements, &list, &tree, &wanted, &nearness);
            let message = postcard::to_stdvec(&search).expect("it is written");
            let read: NearSearch = postcard::from_bytes(&message).expect("it is read");
            let found = postcard::to_stdvec(&read.find([turn, 3])).expect("it is written");
            postcard::from_bytes(&found).expect("it is read")
        };
        let others = [search(1), search(2)];
        let mut shared = list;
        let (mut first, of_first) = own(&mut shared, &wanted, [0, 3]);
        let first = looked(&elements, &mut first, &tree, &of_first, &nearness);
        assert!(joined(&mut shared, first, &others) == of_alone);
        let bytes = |list: &Vec<Source>| postcard::to_stdvec(list).expect("it is written");
        assert!(bytes(&shared) == bytes(&alone));
    }
}
