//! What is solved: a scene on the host, and on the device that holds its light.

use glam::{DVec3, Vec3};

use super::devices::Crew;
use super::messages::MemberData;
use super::{Estimator, Settings, Visibility};
use crate::constants::{LISTED_BITS, SOURCE_EYES};
use crate::error::{Error, Result};
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::near::NearPairs;
use crate::mesh::occluders::Occluders;
use crate::mesh::open_eyes::{Wanted, open_eyes};
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::{self, LitBy, Source, Sources, far_power};
use crate::meso::{Relief, Transport};
use crate::passes::batch::Hemicubes;
use crate::passes::near_to_relief::NearParts;
use crate::passes::occluder_tree::TreeData;
use crate::passes::relief_buffers::ReliefData;
use crate::passes::scene_data::SceneData;
use crate::passes::types::ShadowOccluder;
use crate::scene::even_light::far_lights;
use crate::scene::sky::Sky;
use crate::scene::{Lights, PointLight, Scene};

/// The light by which elements were grouped.
#[derive(Debug, Clone)]
pub(super) struct GroupedBy {
    /// See [`Elements::emitted_by_material`].
    pub emitted: Vec<Vec3>,
    pub points: Vec<PointLight>,
    /// Of suns and the sky, see [`far_lights`].
    pub far: Vec<(DVec3, f64)>,
}

/// A scene to be lit.
pub struct Problem {
    pub settings: Settings,
    pub elements: Elements,
    pub sources: Sources,
    pub connections: Connections,
    pub occluders: Occluders,
    /// Of the occluders; of the `receiver` estimator alone.
    pub(super) occluder_tree: ShadowTree<ShadowOccluder>,
    pub near: NearPairs,
    pub(super) meshlet_count: u32,
    /// Sources of a batch.
    pub(super) slots: u32,
    pub(super) grouped_by: GroupedBy,
    pub(super) sky: Option<Sky>,
}

impl Problem {
    /// With the scene as lists for devices.
    pub(super) fn new(
        crew: &Crew,
        mut elements: Elements,
        lights: &Lights,
        settings: &Settings,
        kept: Option<&Visibility>,
    ) -> Result<(Self, SceneData)> {
        if elements.len() > 1 << LISTED_BITS {
            let (count, most) = (elements.len(), 1 << LISTED_BITS);
            let what = format!("{count} elements, more than the {most} that can be solved");
            return Err(Error::Usage(what));
        }
        let grouped_by = match kept {
            Some(kept) => kept.grouped_by(),
            None => GroupedBy {
                emitted: elements.emitted_by_material(),
                points: lights.points.clone(),
                far: far_lights(lights),
            },
        };
        let (mut sources, connections) = match kept {
            Some(_) => group(&mut elements, lights, settings, &grouped_by)?,
            None => sources::build(&mut elements, lights, &settings.grouping, settings.seed),
        };
        let surfaces = sources.list.iter().filter(|s| s.is_surface()).count();
        if kept.is_some_and(|kept| kept.surfaces() != surfaces) {
            let what = "kept form factors are of other sources: bake again with --keep-visibility";
            return Err(Error::Usage(what.into()));
        }
        if let Some(what) = refused(settings, elements.relief.as_ref()) {
            return Err(Error::Usage(what.into()));
        }
        let occluders = match settings.estimator {
            Estimator::Receiver if settings.merging => Occluders::merged(&elements, &connections),
            _ => Occluders::elements(&elements),
        };
        let (occluder_tree, near) = match settings.estimator {
            Estimator::Receiver => {
                let tree = ShadowTree::new(occluders.casters(&elements, &connections));
                let wanted = wanted_places(&sources.list, settings);
                let list = &mut sources.list;
                far_power(&elements, list, &tree);
                let near = match kept {
                    Some(kept) => {
                        open_eyes(&elements, &mut *list, &tree, &wanted);
                        kept.near(&elements, list)?
                    }
                    None => crew.look(&elements, list, &tree, &wanted, &settings.nearness)?,
                };
                (tree, near)
            }
            Estimator::Pixel | Estimator::Paper => {
                if sources.list.iter().any(Source::is_far) {
                    let what = "suns, skies, spots and IES files need the `receiver` estimator";
                    return Err(Error::Usage(what.into()));
                }
                let none = NearPairs::none(&elements, sources.list.len());
                (ShadowTree::default(), none)
            }
        };
        let scene = SceneData::new(&elements, &sources, &connections, &occluders, &near);
        let wanted = settings.batch.clamp(1, scene.source_count.max(1));
        let counts = (scene.element_count, scene.occluder_count);
        let device = crew.first()?;
        let slots = Hemicubes::fitting_slots(device, counts, settings.hemicube, wanted);
        let problem = Self {
            settings: settings.clone(),
            elements,
            sources,
            connections,
            occluders,
            occluder_tree,
            near,
            meshlet_count: scene.meshlet_count,
            slots,
            grouped_by,
            sky: lights.sky.clone(),
        };
        Ok((problem, scene))
    }

    /// Whether elements receive and send by direction.
    pub(super) fn has_relief(&self) -> bool {
        self.elements.relief.is_some() && self.settings.estimator != Estimator::Paper
    }

    /// What the members of a team are made from, with the scene as [`Self::new`] gave it.
    pub(super) fn member_data(&self, scene: SceneData) -> MemberData {
        let relief = self.elements.relief.as_ref().filter(|_| self.has_relief());
        let is_receiver = self.settings.estimator == Estimator::Receiver;
        let mut settings = self.settings.clone();
        // Files are the first member's.
        (settings.checkpoints, settings.relief.cache) = (None, None);
        MemberData {
            settings,
            relief: relief.map(|relief| ReliefData::new(&self.elements, relief, &self.sources)),
            near: relief.map(|_| NearParts::new(&self.near)),
            tree: is_receiver.then(|| TreeData::new(&self.occluder_tree)),
            slots: self.slots,
            scene,
        }
    }

    /// Takes the emission and the point lights of `scene`, which is otherwise this one.
    ///
    /// # Errors
    /// Emission of elements that neither emitted nor reflected; another number of point lights. The
    /// problem is then as it was.
    pub(super) fn relight(&mut self, scene: &Scene) -> Result<Relit> {
        if scene.materials.len() < self.grouped_by.emitted.len() {
            return Err(Error::Usage("another scene: bake again".into()));
        }
        let before = self.elements.emitted.clone();
        self.elements.set_emission(scene);
        let mut sources = self.sources.clone();
        let relit = sources.relight(&self.elements, &scene.lights, self.settings.seed);
        far_power(&self.elements, &mut sources.list, &self.occluder_tree);
        let shares = |sources: &Sources| -> usize {
            let webs = sources.list.iter().filter_map(|source| source.web.as_ref());
            webs.map(|web| web.shares.len()).sum()
        };
        let alike = sources.list.len() == self.sources.list.len()
            && shares(&sources) == shares(&self.sources);
        if relit.is_err() || !alike {
            self.elements.emitted = before;
            let other = || {
                Error::Usage("another number of lights, or of parts of the sky: bake again".into())
            };
            return Err(relit.err().unwrap_or_else(other));
        }
        let places = sources.list.iter().zip(&self.sources.list);
        let moved = places.map(|(now, before)| now.eye != before.eye || now.is_far());
        let moved = moved.collect();
        let wanted = wanted_places(&sources.list, &self.settings);
        let lacks = |(source, wanted): (&Source, &Wanted)| {
            source.is_surface() && source.places.len() < wanted.places as usize
        };
        let is_receiver = self.settings.estimator == Estimator::Receiver;
        let more_eyes = is_receiver && sources.list.iter().zip(&wanted).any(lacks);
        if more_eyes {
            open_eyes(
                &self.elements,
                &mut sources.list,
                &self.occluder_tree,
                &wanted,
            );
        }
        self.sources = sources;
        self.sky = scene.lights.sky.clone();
        Ok(Relit { moved, more_eyes })
    }

    /// Whether a source emits so strongly that it is looked at with more care, `[source]`.
    pub(super) fn strong(&self) -> Vec<bool> {
        strong(&self.sources.list, &self.settings)
    }
}

/// What has changed with the light of a problem.
pub(super) struct Relit {
    /// Lights that have moved, `[source]`.
    pub moved: Vec<bool>,
    /// Sources are looked at with more care than before: what was made to draw them cannot.
    pub more_eyes: bool,
}

fn strong(list: &[Source], settings: &Settings) -> Vec<bool> {
    let least = sources::least_strong(list, &settings.grouping);
    let strong =
        |source: &Source| !source.is_far() && least > 0.0 && source.emitted_power() >= least;
    list.iter().map(strong).collect()
}

/// Places from which each source is looked at where a silhouette may cut it, `[source]`.
fn wanted_places(list: &[Source], settings: &Settings) -> Vec<Wanted> {
    let wanted = |(turn, is_strong)| Wanted {
        turn,
        places: match is_strong {
            true => SOURCE_EYES,
            false => settings.places,
        },
    };
    (0..).zip(strong(list, settings)).map(wanted).collect()
}

/// What settings ask of relief and cannot be.
fn refused(settings: &Settings, relief: Option<&Relief>) -> Option<&'static str> {
    let transport = relief?.transport;
    match settings.estimator {
        Estimator::Pixel => Some(
            "--estimator pixel sums light without its direction: in scenes with relief use \
             --preset paper, or --transport lambert",
        ),
        Estimator::Paper if transport != Transport::Paper => {
            Some("the paper's method needs the paper's transport")
        }
        _ => None,
    }
}

/// Groups the elements into sources by this light, and lights these.
fn group(
    elements: &mut Elements,
    lights: &Lights,
    settings: &Settings,
    by: &GroupedBy,
) -> Result<(Sources, Connections)> {
    // By triangle of the input, since grouping orders the elements.
    let mut now = vec![Vec3::ZERO; elements.len()];
    for (&input, &emitted) in elements.input_index.iter().zip(&elements.emitted) {
        now[input as usize] = emitted;
    }
    elements.set_emitted(&by.emitted);
    let (grouping, seed) = (&settings.grouping, settings.seed);
    let lit_by = LitBy {
        points: &by.points,
        far: &by.far,
    };
    let (mut sources, connections) = sources::group_by(elements, lit_by, grouping, seed);
    for (&input, emitted) in elements.input_index.iter().zip(&mut elements.emitted) {
        *emitted = now[input as usize];
    }
    sources.relight(elements, lights, seed)?;
    Ok((sources, connections))
}
