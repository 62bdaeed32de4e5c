//! Options of how a scene is solved, of all commands that solve one.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use serde::Serialize;

use mesolux::bake::quality::{self, Quality};
use mesolux::error::{Error, Result};
use mesolux::math::directions::Directions;
use mesolux::mesh::sources::Grouping;
use mesolux::meso::{self, Transport};
use mesolux::solver::{Estimator, Settings};

/// How the scene is solved.
#[derive(Args, Clone, Serialize)]
pub struct SolveOptions {
    /// The paper's method to the letter, in place of ours: each element shoots from its own
    /// hemicube, and pixels bring light by the paper's equations; --residual is 0.05 unless given
    #[arg(
        long,
        value_enum,
        conflicts_with_all = [
            "estimator", "quality", "transport", "emitter_hemicube", "source_elements",
            "source_area", "source_power", "no_normalise", "no_carry", "visibility_memory",
        ],
    )]
    preset: Option<PresetName>,
    /// Form factors by Lambert's formula for each receiver, or by the pixels' sums as in the paper
    #[arg(long, value_enum, default_value = "receiver")]
    estimator: EstimatorName,
    /// Sets --hemicube, --residual and the sizes of the sources where they are not given, and how
    /// closely shadows of emitters and light beside surfaces are looked at; `bench pareto` measures
    /// what each gains. From high on it sets --fineness too
    #[arg(long, value_enum, default_value = "normal")]
    quality: QualityName,
    /// Pixels a side of a hemicube face [default: that of --quality, 128 for normal]
    #[arg(long, value_name = "N")]
    hemicube: Option<u32>,
    /// The same for sources that emit strongly, whose shadows are the sharpest, in place of shadow
    /// rays; as --hemicube draws them as all others [default: none, but with --estimator pixel four
    /// times --hemicube, at most 1024]
    #[arg(long, value_name = "N")]
    emitter_hemicube: Option<u32>,
    /// Stop when the error bound, as a share of the emitted power, is no more than this [default:
    /// that of --quality, 0.001 for normal]
    #[arg(long, value_name = "X")]
    residual: Option<f64>,
    /// Most elements of a relief that shoot together from one hemicube, and half as many as of a
    /// curved surface [default: that of --quality, 48 for normal]
    #[arg(long, value_name = "N")]
    source_elements: Option<usize>,
    /// Most area that shoots together, as a share of the scene's, less where it is lit unevenly;
    /// larger elements are cut [default: that of --quality, 1/256 for normal]
    #[arg(long, value_name = "X")]
    source_area: Option<f64>,
    /// Most emitted power that shoots together, as a share of the scene's [default: that of
    /// --quality, 1/32 for normal]
    #[arg(long, value_name = "X")]
    source_power: Option<f64>,
    /// Leave the form factors of closed rooms as they were found, in place of scaling them so that
    /// all light arrives; the report gives their sums either way
    #[arg(long)]
    no_normalise: bool,
    /// Leave the light of sources that are not drawn missing, in place of letting those beside them
    /// send it
    #[arg(long)]
    no_carry: bool,
    /// Stop after this many seconds
    #[arg(long, value_name = "SECONDS")]
    budget: Option<f64>,
    /// Stop after drawing this many sources
    #[arg(long, value_name = "N")]
    shots: Option<u32>,
    /// MiB on the device for the form factors of sources that have been drawn, which then need no
    /// drawing for their further shots; 0 draws for every shot [default: 768, or a third of the
    /// device's memory]
    #[arg(long, value_name = "MIB")]
    visibility_memory: Option<u64>,
    /// Turns the hemicubes about their axes: another seed, other aliasing
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Directions in which relief sends light: 16, 32, 64, 128 or 256; with --preset paper up to 64
    #[arg(long, value_name = "K", default_value_t = 64)]
    directions: u32,
    /// How relief takes part: keeping energy, by the paper's equations, or not at all
    #[arg(long, value_enum, default_value = "physical")]
    transport: TransportName,
    /// Folder that keeps the visibility of reliefs from run to run, and bakes that `render` makes
    /// of scenes, the 16 used last and 1 GiB at most [default: mesolux in the user's cache folder]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Neither read nor write the cache
    #[arg(long, conflicts_with = "cache")]
    no_cache: bool,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PresetName {
    Paper,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum TransportName {
    /// Masking, shadowing and bounces inside the relief
    Physical,
    /// By equation (3) of the paper, all else as by default; loses energy
    Paper,
    /// Every element flat: no directions
    Lambert,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum QualityName {
    Preview,
    Draft,
    Normal,
    High,
    Reference,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum EstimatorName {
    Receiver,
    Pixel,
}

/// Shares of the scene that a source may have at most: a smaller one would cut a scene into
/// millions of sources.
const SOURCE_SHARES: std::ops::RangeInclusive<f64> = 1e-6..=1.0;

impl SolveOptions {
    pub fn budget(&self) -> Result<Option<Duration>> {
        match self.budget {
            None => Ok(None),
            Some(seconds) if (0.0..=1e9).contains(&seconds) => {
                Ok(Some(Duration::from_secs_f64(seconds)))
            }
            Some(seconds) => Err(Error::Usage(format!(
                "--budget {seconds}: must be seconds, 0 or more"
            ))),
        }
    }

    /// The same with what the window may change: the directions, and whether it is by the paper.
    #[cfg(feature = "window")]
    pub fn solved_by(&self, settings: &Settings) -> Self {
        let paper = settings.estimator == Estimator::Paper;
        Self {
            directions: settings.relief.directions.count() as u32,
            preset: paper.then_some(PresetName::Paper),
            ..self.clone()
        }
    }

    /// The same with nothing left to the preset, to be kept beside the result.
    pub fn filled(&self) -> Result<Self> {
        let settings = self.settings()?;
        if self.preset.is_some() {
            // It leaves no choice of the others.
            return Ok(Self {
                hemicube: Some(settings.hemicube),
                residual: Some(settings.residual),
                ..self.clone()
            });
        }
        Ok(Self {
            hemicube: Some(settings.hemicube),
            emitter_hemicube: settings.emitter_shadows().face(),
            residual: Some(settings.residual),
            source_elements: Some(settings.grouping.max_elements),
            source_area: Some(settings.grouping.max_area),
            source_power: Some(settings.grouping.max_power),
            ..self.clone()
        })
    }

    fn grouping(&self, preset: Grouping) -> Result<Grouping> {
        let share = |name: &str, value: Option<f64>, preset| match value {
            None => Ok(preset),
            Some(share) if SOURCE_SHARES.contains(&share) => Ok(share),
            Some(share) => Err(Error::Usage(format!(
                "{name} {share}: must be in {} to {}",
                SOURCE_SHARES.start(),
                SOURCE_SHARES.end()
            ))),
        };
        if self.source_elements == Some(0) {
            return Err(Error::Usage(
                "--source-elements 0: must be at least 1".into(),
            ));
        }
        Ok(Grouping {
            max_elements: self.source_elements.unwrap_or(preset.max_elements),
            max_area: share("--source-area", self.source_area, preset.max_area)?,
            max_power: share("--source-power", self.source_power, preset.max_power)?,
            ..preset
        })
    }

    pub fn quality(&self) -> Quality {
        match self.quality {
            QualityName::Preview => Quality::Preview,
            QualityName::Draft => Quality::Draft,
            QualityName::Normal => Quality::Normal,
            QualityName::High => Quality::High,
            QualityName::Reference => Quality::Reference,
        }
    }

    pub fn settings(&self) -> Result<Settings> {
        if self.preset.is_some() {
            let preset = quality::paper(self.directions)?;
            return Ok(Settings {
                hemicube: self.hemicube.unwrap_or(preset.hemicube),
                residual: self.residual.unwrap_or(preset.residual),
                budget: self.budget()?,
                shots: self.shots,
                seed: self.seed,
                ..preset
            });
        }
        let preset = self.quality().settings();
        Ok(Settings {
            estimator: match self.estimator {
                EstimatorName::Receiver => Estimator::Receiver,
                EstimatorName::Pixel => Estimator::Pixel,
            },
            hemicube: self.hemicube.unwrap_or(preset.hemicube),
            emitter_hemicube: self.emitter_hemicube.or(preset.emitter_hemicube),
            residual: self.residual.unwrap_or(preset.residual),
            grouping: self.grouping(preset.grouping)?,
            normalise: !self.no_normalise,
            carries: !self.no_carry,
            budget: self.budget()?,
            shots: self.shots,
            seed: self.seed,
            visibility_memory: match self.visibility_memory {
                Some(mib) => Some(mib.checked_mul(1 << 20).ok_or_else(|| {
                    Error::Usage(format!("--visibility-memory {mib}: too large"))
                })?),
                None => None,
            },
            relief: meso::Options {
                transport: match self.transport {
                    TransportName::Physical => Transport::Physical,
                    TransportName::Paper => Transport::Paper,
                    TransportName::Lambert => Transport::Lambert,
                },
                directions: Directions::new(self.directions)?,
                cache: match &self.cache {
                    Some(dir) => Some(dir.clone()),
                    None if self.no_cache => None,
                    None => cache_folder(),
                },
            },
            ..preset
        })
    }
}

/// Where programs of this user keep what they can make again.
pub fn cache_folder() -> Option<PathBuf> {
    let absolute = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|p| p.is_absolute())
    };
    let folder = absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("LOCALAPPDATA"))
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")));
    folder.map(|folder| folder.join("mesolux"))
}
