//! Visibility of one tile of relief, computed once for a height map: horizons (which directions
//! each facet sees) and exchange (where the rays land that the relief blocks). Shaders:
//! `relief_horizon.comp`, `relief_exchange.comp`; twin: [`crate::reference::relief_visibility`].

use std::sync::Arc;

use super::buffers::{download, upload};
use super::groups;
use super::shaders::{relief_exchange, relief_horizon};
use crate::constants::{AZIMUTHS, RAY_STRATA};
use crate::error::Result;
use crate::meso::{HeightField, Visibility};
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

pub struct ReliefVisibility {
    horizon: ComputePipeline,
    exchange: ComputePipeline,
    device: Arc<Device>,
}

/// Lines marched in a part of a submission: 0.1 to 0.3 s by lavapipe's two cores.
const PART: u32 = 1 << 17;

impl ReliefVisibility {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let (horizon, exchange) = (&relief_horizon::SHADER, &relief_exchange::SHADER);
        Ok(Self {
            horizon: ComputePipeline::new(device, "relief horizon", horizon)?,
            exchange: ComputePipeline::new(device, "relief exchange", exchange)?,
            device: Arc::clone(device),
        })
    }

    pub fn run(&self, field: &HeightField) -> Result<Visibility> {
        let heights = upload(&self.device, "heights", &field.heights, BufferUse::Storage)?;
        let facets = field.facet_count() as u32;
        let (lines, rays) = (facets * AZIMUTHS, facets * RAY_STRATA * RAY_STRATA);
        let buffer = |name, words: u32| {
            Buffer::new(&self.device, name, 4 * u64::from(words), BufferUse::Storage)
        };
        let (horizons, hits) = (buffer("horizons", lines)?, buffer("hits", rays)?);
        let horizon = self.horizon.bind(&relief_horizon::Bindings {
            heights: &heights,
            horizons: &horizons,
        })?;
        let exchange = self.exchange.bind(&relief_exchange::Bindings {
            heights: &heights,
            hits: &hits,
        })?;
        self.march(&horizon, field, lines)?;
        self.march(&exchange, field, rays)?;
        Ok(Visibility {
            horizons: download(&self.device, &horizons, lines as usize)?,
            hits: download(&self.device, &hits, rays as usize)?,
        })
    }

    /// Marches so many lines.
    fn march(&self, bound: &BoundCompute, field: &HeightField, lines: u32) -> Result<()> {
        Commands::run(&self.device, "relief visibility", |cmd| {
            for first in (0..lines).step_by(PART as usize) {
                // Both shaders have these.
                let parameters = relief_horizon::Parameters {
                    columns: field.columns,
                    rows: field.rows,
                    aspect: field.aspect as f32,
                    highest: field.highest() as f32,
                    first,
                    count: PART.min(lines - first),
                };
                let size = [groups(parameters.count), 1, 1];
                cmd.part();
                cmd.dispatch(bound, &parameters, size);
            }
            Ok(())
        })
    }
}
