//! GPU timestamps.

use std::sync::Arc;

use ash::vk;

use super::Device;
use crate::error::Result;

/// A pool of timestamps. A clone is another handle to the same pool.
///
/// Commands that record it keep it alive.
#[derive(Clone)]
pub struct Timestamps {
    pub(super) owner: Arc<TimestampsOwner>,
}

pub(super) struct TimestampsOwner {
    pub(super) raw: vk::QueryPool,
    pub(super) count: u32,
    device: Arc<Device>,
}

impl Timestamps {
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, name: &str, count: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(count);
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_query_pool(&info, None) }
            .map_err(device.error("creating a query pool"))?;
        device.set_name(raw, name);
        Ok(Self {
            owner: Arc::new(TimestampsOwner {
                raw,
                count,
                device: Arc::clone(device),
            }),
        })
    }

    /// Seconds at which each timestamp was written, since a time that is the device's own; the
    /// submission must be done.
    ///
    /// # Errors
    /// A device that fails.
    pub fn seconds(&self) -> Result<Vec<f64>> {
        let TimestampsOwner { raw, count, device } = &*self.owner;
        let mut ticks = vec![0u64; *count as usize];
        // SAFETY: the pool holds as many results as the slice.
        unsafe {
            device.raw.get_query_pool_results(
                *raw,
                0,
                &mut ticks,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .map_err(device.error("reading timestamps"))?;
        let period = device.limits().timestamp_period * 1e-9;
        Ok(ticks.iter().map(|&t| t as f64 * period).collect())
    }

    /// Seconds between each timestamp and the next, `count - 1` of them; the submission must be
    /// done.
    ///
    /// # Errors
    /// A device that fails.
    pub fn intervals(&self) -> Result<Vec<f64>> {
        let seconds = self.seconds()?;
        Ok(seconds.windows(2).map(|t| (t[1] - t[0]).max(0.0)).collect())
    }
}

impl Drop for TimestampsOwner {
    fn drop(&mut self) {
        // SAFETY: commands that record the pool hold its owner, so none is left.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}
