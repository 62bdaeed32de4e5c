//! Recording and submitting.

mod compute;
mod copy;
mod draw;

use std::cell::RefCell;
use std::slice;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use ash::vk;

use super::held::Held;
use super::{Device, Stage, Timestamps};
use crate::error::{Error, Result};

/// Commands, recorded once and submitted any number of times, with the fence of their last
/// submission.
///
/// They keep alive what they record. Dropping them waits for the last submission.
pub struct Commands {
    /// In their order; the last one is being recorded. Each is a batch of its own in a submission.
    parts: RefCell<Vec<vk::CommandBuffer>>,
    name: String,
    /// Why a part could not end.
    failed: RefCell<Option<Error>>,
    pool: vk::CommandPool,
    fence: vk::Fence,
    under_way: bool,
    held: RefCell<Held>,
    /// What buffers are to hold, brought by the last submission.
    uploads: Option<Box<Commands>>,
    device: Arc<Device>,
}

impl Commands {
    /// Calls `record`, which records the commands.
    ///
    /// # Errors
    /// An error of `record`; a device that fails.
    pub fn record(
        device: &Arc<Device>,
        name: &str,
        record: impl FnOnce(&Self) -> Result<()>,
    ) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.family);
        // SAFETY: the family is the device's own.
        let pool = unsafe { device.raw.create_command_pool(&info, None) }
            .map_err(device.error("creating a command pool"))?;
        let mut commands = Self {
            parts: RefCell::default(),
            name: name.to_owned(),
            failed: RefCell::default(),
            pool,
            fence: vk::Fence::null(),
            under_way: false,
            held: RefCell::default(),
            uploads: None,
            device: Arc::clone(device),
        };
        // SAFETY: a plain creation on a live device.
        commands.fence = unsafe {
            device
                .raw
                .create_fence(&vk::FenceCreateInfo::default(), None)
        }
        .map_err(device.error("creating a fence"))?;
        device.set_name(commands.fence, name);
        let first = commands.begin()?;
        commands.parts.get_mut().push(first);
        record(&commands)?;
        if let Some(error) = commands.failed.take() {
            return Err(error);
        }
        commands.end()?;
        Ok(commands)
    }

    /// Ends a part here, outside a render pass: drivers that end what takes too long measure each
    /// by itself. Barriers reach across. Where no other can begin, this one goes on.
    pub fn part(&self) {
        let Ok(next) = self.begin() else {
            return;
        };
        if let Err(error) = self.end() {
            self.failed.borrow_mut().get_or_insert(error);
        }
        self.parts.borrow_mut().push(next);
    }

    fn begin(&self) -> Result<vk::CommandBuffer> {
        let device = &self.device;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is this object's own.
        let buffers = unsafe { device.raw.allocate_command_buffers(&info) }
            .map_err(device.error("allocating a command buffer"))?;
        device.set_name(buffers[0], &self.name);
        let info = vk::CommandBufferBeginInfo::default();
        // SAFETY: the buffer is new, and recorded by this object alone.
        unsafe { device.raw.begin_command_buffer(buffers[0], &info) }
            .map_err(device.error("recording"))?;
        Ok(buffers[0])
    }

    fn end(&self) -> Result<()> {
        // SAFETY: `begin` has begun its recording, which is ended once.
        unsafe { self.device.raw.end_command_buffer(self.raw()) }
            .map_err(self.device.error("recording"))
    }

    /// What is recorded now.
    pub(super) fn raw(&self) -> vk::CommandBuffer {
        *self.parts.borrow().last().expect("recording has begun")
    }

    /// Records, submits and waits.
    ///
    /// # Errors
    /// As [`Self::record`].
    pub fn run(
        device: &Arc<Device>,
        name: &str,
        record: impl FnOnce(&Self) -> Result<()>,
    ) -> Result<()> {
        let mut commands = Self::record(device, name, record)?;
        commands.submit()?;
        commands.wait()
    }

    /// Submits; the last submission must have been waited for.
    ///
    /// # Errors
    /// A device that fails.
    pub fn submit(&mut self) -> Result<()> {
        self.submit_between(&[], &[])
    }

    /// Submits between semaphores: copies wait for those of `after`, and those of `before` are
    /// signalled when everything is done.
    pub(super) fn submit_between(
        &mut self,
        after: &[vk::Semaphore],
        before: &[vk::Semaphore],
    ) -> Result<()> {
        assert!(!self.under_way, "commands are submitted once at a time");
        // The queue is locked from here on: nobody else submits what needs these uploads before
        // they come.
        let queue = self.device.queue();
        let uploads = Self::of_uploads(&self.device)?;
        let parts = self.parts.borrow();
        let of_uploads = uploads.as_ref().map(|uploads| uploads.parts.borrow());
        let buffers = of_uploads
            .iter()
            .flat_map(|parts| parts.iter())
            .chain(parts.iter());
        let infos: Vec<_> = buffers
            .map(|&buffer| [vk::CommandBufferSubmitInfo::default().command_buffer(buffer)])
            .collect();
        drop(of_uploads);
        let at = |stage| {
            move |&semaphore: &vk::Semaphore| {
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(semaphore)
                    .stage_mask(stage)
            }
        };
        let copies = at(vk::PipelineStageFlags2::ALL_TRANSFER);
        let waits: Vec<_> = after.iter().map(copies).collect();
        let all = at(vk::PipelineStageFlags2::ALL_COMMANDS);
        let signals: Vec<_> = before.iter().map(all).collect();
        let mut submits: Vec<_> = infos
            .iter()
            .map(|infos| vk::SubmitInfo2::default().command_buffer_infos(infos))
            .collect();
        let (first, last) = (0, submits.len() - 1);
        submits[first] = submits[first].wait_semaphore_infos(&waits);
        submits[last] = submits[last].signal_semaphore_infos(&signals);
        let raw = &self.device.raw;
        // SAFETY: the fence is unsignalled and free, the queue is locked, and the recording has
        // ended.
        let submit = |submits: &[_], fence| unsafe { raw.queue_submit2(*queue, submits, fence) };
        let submitted = match self.device.times_parts() {
            false => submit(&submits, self.fence),
            true => submits.iter().enumerate().try_for_each(|(i, part)| {
                let start = Instant::now();
                let fence = if i == last {
                    self.fence
                } else {
                    vk::Fence::null()
                };
                submit(slice::from_ref(part), fence)?;
                // SAFETY: the queue is locked.
                unsafe { raw.queue_wait_idle(*queue) }?;
                self.device.add_part(&self.name, start.elapsed());
                Ok(())
            }),
        };
        submitted.map_err(self.device.error("submitting"))?;
        drop(queue);
        drop(parts);
        self.device.submissions.fetch_add(1, Ordering::Relaxed);
        self.uploads = uploads.map(Box::new);
        self.under_way = true;
        Ok(())
    }

    /// Waits until the device has done the last submission, if there is one.
    ///
    /// # Errors
    /// A device that fails.
    pub fn wait(&mut self) -> Result<()> {
        self.wait_for_fence()
            .map_err(self.device.error("waiting for a submission"))
    }

    fn wait_for_fence(&mut self) -> ash::prelude::VkResult<()> {
        if !self.under_way {
            return Ok(());
        }
        let raw = &self.device.raw;
        // SAFETY: only this object waits for the fence or resets it.
        unsafe {
            raw.wait_for_fences(&[self.fence], true, u64::MAX)?;
            self.under_way = false;
            raw.reset_fences(&[self.fence])?;
        }
        self.uploads = None;
        Ok(())
    }

    /// Keeps an owner alive until these commands are dropped.
    pub(super) fn hold<T: Send + Sync + 'static>(&self, owner: &Arc<T>) {
        self.held.borrow_mut().hold(owner);
    }

    /// Everything of the kinds `before` is done and visible before anything of the kinds `after`
    /// starts.
    pub fn barrier(&self, before: &[Stage], after: &[Stage]) {
        let join = |stages: &[Stage]| {
            stages.iter().fold(
                (vk::PipelineStageFlags2::empty(), vk::AccessFlags2::empty()),
                |(s, a), stage| (s | stage.masks().0, a | stage.masks().1),
            )
        };
        let (src_stage, src_access) = join(before);
        let (dst_stage, dst_access) = join(after);
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(src_stage)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stage)
            .dst_access_mask(dst_access)];
        let info = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: a plain barrier, which the passes record outside render passes.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.raw(), &info) };
    }

    /// Writes timestamp `index` when everything before it is done.
    pub fn timestamp(&self, timestamps: &Timestamps, index: u32) {
        assert!(index < timestamps.owner.count, "a timestamp of the pool");
        self.hold(&timestamps.owner);
        // SAFETY: the index lies within the pool, which `reset_timestamps` has reset.
        unsafe {
            self.device.raw.cmd_write_timestamp2(
                self.raw(),
                vk::PipelineStageFlags2::ALL_COMMANDS,
                timestamps.owner.raw,
                index,
            );
        }
    }

    pub fn reset_timestamps(&self, timestamps: &Timestamps) {
        let pool = &timestamps.owner;
        self.hold(pool);
        // SAFETY: the range is the whole pool.
        unsafe {
            self.device
                .raw
                .cmd_reset_query_pool(self.raw(), pool.raw, 0, pool.count);
        }
    }

    /// Brings timestamps to the host. All of them must have been written.
    pub fn read_back_timestamps(&self, timestamps: &Timestamps) {
        let (pool, to) = (&timestamps.owner, &timestamps.readback);
        self.hold(pool);
        self.hold(&to.owner);
        let stride = size_of::<u64>() as u64;
        // SAFETY: the buffer has room for the whole pool, whose results this waits for.
        unsafe {
            self.device.raw.cmd_copy_query_pool_results(
                self.raw(),
                pool.raw,
                0,
                pool.count,
                to.owner.raw,
                0,
                stride,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            );
        }
        self.barrier(&[Stage::Transfer], &[Stage::Host]);
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        // The fence and not the device: waiting for the device would lock the queue, and so block
        // every other thread that submits.
        let waited = self.wait_for_fence();
        if self.under_way && waited != Err(vk::Result::ERROR_DEVICE_LOST) {
            // The device may still execute these commands: what they use is leaked, not freed.
            let device = Arc::clone(&self.device);
            std::mem::forget((self.held.take(), self.uploads.take(), device));
            return;
        }
        // SAFETY: the device executes none of these commands, or is lost.
        unsafe {
            self.device.raw.destroy_fence(self.fence, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}
