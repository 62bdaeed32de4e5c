//! GPU timestamps.

use std::sync::Arc;

use ash::vk;

use super::Device;
use crate::error::Result;

/// A pool of timestamps.
pub struct Timestamps {
    pub(super) raw: vk::QueryPool,
    pub(super) count: u32,
    device: Arc<Device>,
}

impl Timestamps {
    pub fn new(device: &Arc<Device>, name: &str, count: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(count);
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_query_pool(&info, None) }
            .map_err(device.error("creating a query pool"))?;
        device.set_name(raw, name);
        Ok(Self {
            raw,
            count,
            device: Arc::clone(device),
        })
    }

    /// Seconds between each timestamp and the next, `count - 1` of them; the submission must be done.
    pub fn intervals(&self) -> Result<Vec<f64>> {
        let mut ticks = vec![0u64; self.count as usize];
        // SAFETY: the pool holds as many results as the slice.
        unsafe {
            self.device.raw.get_query_pool_results(
                self.raw,
                0,
                &mut ticks,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .map_err(self.device.error("reading timestamps"))?;
        let period = self.device.limits().timestamp_period * 1e-9;
        Ok(ticks
            .windows(2)
            .map(|t| t[1].saturating_sub(t[0]) as f64 * period)
            .collect())
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the pool waits for the submission before dropping it.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}
