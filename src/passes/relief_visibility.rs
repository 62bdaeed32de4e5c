//! Visibility of one tile of relief, computed once for a height map: horizons (which directions each facet sees) and
//! exchange (where the rays land that the relief blocks). Shaders: `relief_horizon.comp`, `relief_exchange.comp`; twin:
//! [`crate::reference::relief_visibility`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{download, upload};
use super::{groups, shaders};
use crate::constants::{AZIMUTHS, RAY_STRATA};
use crate::error::Result;
use crate::meso::{HeightField, Visibility};
use crate::vk::{Bind, Binding, Buffer, BufferUse, Commands, ComputePipeline, Device};

pub struct ReliefVisibility {
    horizon: ComputePipeline,
    exchange: ComputePipeline,
    device: Arc<Device>,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    columns: u32,
    rows: u32,
    aspect: f32,
    highest: f32,
    first: u32,
    count: u32,
}

/// Lines marched in a submission: far from any driver's time limit.
const SUBMISSION: u32 = 1 << 20;

impl ReliefVisibility {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let pipeline = |name, spirv| {
            ComputePipeline::new(
                device,
                name,
                spirv,
                &[Binding::Storage; 2],
                size_of::<Parameters>(),
                &[],
                false,
            )
        };
        Ok(Self {
            horizon: pipeline("relief horizon", shaders::RELIEF_HORIZON_COMP)?,
            exchange: pipeline("relief exchange", shaders::RELIEF_EXCHANGE_COMP)?,
            device: Arc::clone(device),
        })
    }

    pub fn run(&self, field: &HeightField) -> Result<Visibility> {
        let heights = upload(&self.device, "heights", &field.heights, BufferUse::Storage)?;
        let facets = field.facet_count() as u32;
        let march = |pipeline: &ComputePipeline, name, lines: u32| -> Result<Buffer> {
            let out = Buffer::new(&self.device, name, 4 * u64::from(lines), BufferUse::Storage)?;
            let set = pipeline.bind(name, &[Bind::Buffer(&heights), Bind::Buffer(&out)])?;
            for first in (0..lines).step_by(SUBMISSION as usize) {
                let parameters = Parameters {
                    columns: field.columns,
                    rows: field.rows,
                    aspect: field.aspect as f32,
                    highest: field.highest() as f32,
                    first,
                    count: SUBMISSION.min(lines - first),
                };
                Commands::run(&self.device, name, |cmd| {
                    cmd.dispatch(
                        pipeline,
                        &set,
                        &parameters,
                        [groups(parameters.count), 1, 1],
                    );
                    Ok(())
                })?;
            }
            Ok(out)
        };
        let horizons = march(&self.horizon, "horizons", facets * AZIMUTHS)?;
        let hits = march(&self.exchange, "hits", facets * RAY_STRATA * RAY_STRATA)?;
        Ok(Visibility {
            horizons: download(&self.device, &horizons, (facets * AZIMUTHS) as usize)?,
            hits: download(
                &self.device,
                &hits,
                (facets * RAY_STRATA * RAY_STRATA) as usize,
            )?,
        })
    }
}
