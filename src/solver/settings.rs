//! What a bake is asked for.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::Checkpoints;
use crate::constants::SOURCE_EYES;
use crate::error::{Error, Result};
use crate::mesh::near::Nearness;
use crate::mesh::sources::Grouping;
use crate::meso;
use crate::passes::PART_PAIRS;
use crate::passes::cull::Culling;
use crate::passes::kept_rows::CHUNK_BYTES;

/// How form factors are taken from the item buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Estimator {
    /// Lambert's formula for each receiver, visibility from the item buffer.
    #[default]
    Receiver,
    /// The paper's equations (1) and (2): the sum of the pixels' form factors.
    Pixel,
    /// The paper's whole method, equations (1) to (4): each element shoots from its own hemicube
    /// what it has not sent, and each pixel adds what it brings. Its relief is of
    /// [`meso::Transport::Paper`].
    Paper,
}

/// How it is found what sources see that emit strongly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EmitterShadows {
    /// A ray to each sample of each element.
    Rays,
    /// Hemicubes of so many pixels a side.
    Hemicubes(u32),
}

impl EmitterShadows {
    /// Pixels a side of the hemicubes, if it is by those.
    pub fn face(self) -> Option<u32> {
        match self {
            Self::Rays => None,
            Self::Hemicubes(face) => Some(face),
        }
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Settings {
    pub estimator: Estimator,
    /// Pixels a side of a hemicube's face; even.
    pub hemicube: u32,
    /// The same for sources that emit strongly; `hemicube` or more, even. None: see
    /// [`Self::emitter_shadows`].
    pub emitter_hemicube: Option<u32>,
    /// Places on a strong emitter from which rays find the share of it that is seen where something
    /// may cut it; divides [`crate::constants::SOURCE_EYES`].
    pub emitter_places: u32,
    /// The same of a source with a hemicube. 0: no rays are followed; where the pixels about an
    /// element do not agree, it sees the share of the source that they show.
    pub places: u32,
    /// Stops when the error bound is no more than this.
    pub residual: f64,
    /// Stops after this time; that of [`crate::bake::solve_by`] begins with the set-up.
    pub budget: Option<Duration>,
    /// Stops after this many shots.
    pub shots: Option<u32>,
    pub seed: u64,
    pub grouping: Grouping,
    /// Which sources an element takes part by part.
    pub nearness: Nearness,
    /// Whether rays find what an element sees of a source that a silhouette may cut.
    pub silhouettes: bool,
    /// Whether form factors in enclosed scenes are scaled so that all that is sent arrives.
    pub normalise: bool,
    /// Whether the sources beside those that are not drawn send the light of these; without it that
    /// light is missing.
    pub carries: bool,
    pub culling: Culling,
    /// Draws connected elements of one plane as few triangles; see [`crate::mesh::occluders`]. The
    /// `pixel` estimator asks for every element and does without.
    pub merging: bool,
    /// Sources of a batch that are drawn, at most.
    pub batch: u32,
    /// Triangles that are listed at once for a face of a hemicube, at most; what is left is drawn
    /// after them. None: as many as fit the device's largest buffer. The light is the same.
    pub list_room: Option<u32>,
    /// Elements times sources of a part of a submission, at most, by about how long that takes: see
    /// [`crate::passes::PART_PAIRS`].
    pub part_pairs: u64,
    /// Bytes on the device for the rows of sources that have been drawn. Sources whose rows find no
    /// room are drawn once more. None: [`VISIBILITY_MEMORY`], or a third of the device's memory if
    /// that is less.
    pub visibility_memory: Option<u64>,
    /// Bytes of each buffer of such rows, at most. The light is the same.
    pub chunk_bytes: u64,
    /// Bytes in the host's memory for the coupling between sources. What the sources beyond it send
    /// is found by gathering and measuring, again and again.
    pub coupling_memory: u64,
    /// How relief takes part; see [`crate::bake::elements`].
    pub relief: meso::Options,
    /// Where a long bake keeps its rows while it runs; see [`crate::bake::solve_by`].
    pub checkpoints: Option<Checkpoints>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            estimator: Estimator::default(),
            hemicube: 128,
            emitter_hemicube: None,
            emitter_places: SOURCE_EYES,
            places: 4,
            residual: 1e-3,
            budget: None,
            shots: None,
            seed: 0,
            grouping: Grouping::default(),
            nearness: Nearness::default(),
            silhouettes: true,
            normalise: true,
            carries: true,
            culling: Culling::default(),
            merging: true,
            batch: 32,
            list_room: None,
            part_pairs: PART_PAIRS,
            visibility_memory: None,
            chunk_bytes: CHUNK_BYTES,
            coupling_memory: COUPLING_MEMORY,
            relief: meso::Options::default(),
            checkpoints: None,
        }
    }
}

/// Bytes for the coupling between sources, unless asked otherwise: that of 10,000 and more.
pub const COUPLING_MEMORY: u64 = 256 << 20;

/// Bytes for kept rows, unless asked otherwise.
pub const VISIBILITY_MEMORY: u64 = 768 << 20;

/// Smallest and largest hemicube.
pub const HEMICUBE_RANGE: std::ops::RangeInclusive<u32> = 8..=2048;

/// With the `pixel` estimator the side of the faces of strong emitters over that of all others,
/// unless set otherwise, and up to which size: a hemicube of 1024 takes four times as long as one
/// of 512, and lowers the error hardly more.
pub const EMITTER_SCALE: u32 = 4;
const FINEST: u32 = 1024;

impl Settings {
    /// How it is found what strong emitters see: unless [`Self::emitter_hemicube`] is given, by
    /// rays, or, with the `pixel` estimator, which takes form factors from pixels, by hemicubes
    /// [`EMITTER_SCALE`] times as fine as all others, of 1024 pixels at most.
    pub fn emitter_shadows(&self) -> EmitterShadows {
        match (self.emitter_hemicube, self.estimator) {
            (Some(face), _) => EmitterShadows::Hemicubes(face),
            (None, Estimator::Receiver) => EmitterShadows::Rays,
            (None, Estimator::Paper) => EmitterShadows::Hemicubes(self.hemicube),
            (None, Estimator::Pixel) => {
                let finer = (EMITTER_SCALE * self.hemicube).min(FINEST.max(self.hemicube));
                EmitterShadows::Hemicubes(finer)
            }
        }
    }

    /// All that a whole result depends on, as text: equal texts, equal results.
    pub fn key(&self) -> String {
        let Self {
            estimator,
            hemicube,
            emitter_hemicube: _,
            emitter_places,
            places,
            residual,
            // A bake that this stopped is not whole.
            budget: _,
            shots,
            seed,
            grouping,
            nearness,
            silhouettes,
            normalise,
            carries,
            culling,
            merging,
            batch,
            // These do not affect the result.
            list_room: _,
            part_pairs: _,
            chunk_bytes: _,
            checkpoints: _,
            visibility_memory,
            coupling_memory,
            relief,
        } = self;
        let emitter_shadows = self.emitter_shadows();
        let (transport, directions) = (relief.transport, relief.directions);
        format!(
            "{estimator:?} {hemicube} {emitter_shadows:?} {emitter_places} {places} {residual:?} \
             {shots:?} {seed} {grouping:?} {nearness:?} {silhouettes} {normalise} {carries} \
             {culling:?} {merging} {batch} {visibility_memory:?} {coupling_memory} \
             {transport:?} {directions:?}"
        )
    }

    /// Refuses numbers that make no sense.
    pub fn check(&self) -> Result<()> {
        if !HEMICUBE_RANGE.contains(&self.hemicube) || !self.hemicube.is_multiple_of(2) {
            return Err(Error::Usage(format!(
                "--hemicube {}: must be even and in {} to {}",
                self.hemicube,
                HEMICUBE_RANGE.start(),
                HEMICUBE_RANGE.end()
            )));
        }
        let finer = self.hemicube..=*HEMICUBE_RANGE.end();
        if let Some(face) = self.emitter_hemicube
            && !(finer.contains(&face) && face.is_multiple_of(2))
        {
            return Err(Error::Usage(format!(
                "--emitter-hemicube {face}: must be even and in {} (that of --hemicube) to {}",
                finer.start(),
                finer.end()
            )));
        }
        // Places on other sources may be none.
        for places in [self.emitter_places, self.places.max(1)] {
            if places == 0 || !SOURCE_EYES.is_multiple_of(places) {
                return Err(Error::Usage(format!(
                    "places on a source: {places} does not divide {SOURCE_EYES}"
                )));
            }
        }
        if !(self.residual.is_finite() && self.residual > 0.0) {
            return Err(Error::Usage(format!(
                "--residual {}: must be above 0",
                self.residual
            )));
        }
        Ok(())
    }
}
