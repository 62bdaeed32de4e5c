//! GPU timestamps.

use std::sync::Arc;

use ash::vk;

use super::{Buffer, BufferUse, Device};
use crate::error::Result;

/// A pool of timestamps. A clone is another handle to the same pool.
///
/// Commands that record it keep it alive.
#[derive(Clone)]
pub struct Timestamps {
    pub(super) owner: Arc<TimestampsOwner>,
    /// Where they are read: lavapipe waits for all that was submitted when a pool is asked.
    pub(super) readback: Buffer,
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
        let owner = Arc::new(TimestampsOwner {
            raw,
            count,
            device: Arc::clone(device),
        });
        let bytes = u64::from(count) * size_of::<u64>() as u64;
        Ok(Self {
            owner,
            readback: Buffer::new(device, name, bytes, BufferUse::Readback)?,
        })
    }

    /// Seconds at which each timestamp was written, since a time that is the device's own; a
    /// submission that reads them back must be done.
    pub fn seconds(&self) -> Vec<f64> {
        let TimestampsOwner { count, device, .. } = &*self.owner;
        let ticks: Vec<u64> = self.readback.read(0, *count as usize);
        let period = device.limits().timestamp_period * 1e-9;
        ticks.iter().map(|&t| t as f64 * period).collect()
    }

    /// Seconds between each timestamp and the next, `count - 1` of them, as [`Self::seconds`].
    pub fn intervals(&self) -> Vec<f64> {
        let seconds = self.seconds();
        seconds.windows(2).map(|t| (t[1] - t[0]).max(0.0)).collect()
    }
}

impl Drop for TimestampsOwner {
    fn drop(&mut self) {
        // SAFETY: commands that record the pool hold its owner, so none is left.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}
