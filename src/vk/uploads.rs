//! What buffers are to hold before they are used.
//!
//! A buffer keeps what it is to hold until something is submitted; the next submission, of whatever
//! it is, brings the contents of all buffers with it. A scene of some fifty buffers so comes in one
//! submission.

use std::sync::{Arc, Weak};

use bytemuck::Pod;

use super::buffer::BufferOwner;
use super::{Buffer, BufferUse, Commands, Device, Stage, lock};
use crate::error::Result;

/// What the beginning, or all, of a buffer is to hold.
pub(super) enum Content {
    Bytes { staging: Buffer, bytes: u64 },
    Words(u32),
}

/// Buffers whose contents wait for a submission.
#[derive(Default)]
pub(super) struct Uploads {
    waiting: Vec<Weak<BufferOwner>>,
    bytes: u64,
}

/// Bytes that wait, at most, and of a part of a submission, but for a buffer that is larger.
const MOST_WAITING: u64 = 64 << 20;

impl Buffer {
    /// The buffer begins with `data` for whatever is submitted from now on.
    ///
    /// # Errors
    /// A device that fails.
    pub fn set<T: Pod>(&self, data: &[T]) -> Result<()> {
        let bytes = size_of_val(data) as u64;
        assert!(bytes <= self.bytes());
        if bytes == 0 {
            return Ok(());
        }
        let device = &self.owner.device;
        let mut staging = Buffer::new(device, "staging", bytes, BufferUse::Upload)?;
        staging.write(0, data);
        self.hold_from_now(Content::Bytes { staging, bytes }, bytes)
    }

    /// The whole buffer repeats `word` for whatever is submitted from now on.
    ///
    /// # Errors
    /// A device that fails.
    pub fn set_all(&self, word: u32) -> Result<()> {
        self.hold_from_now(Content::Words(word), 0)
    }

    fn hold_from_now(&self, content: Content, bytes: u64) -> Result<()> {
        let device = &self.owner.device;
        lock(&self.owner.contents).push(content);
        let waiting = {
            let mut uploads = lock(&device.uploads);
            uploads.waiting.push(Arc::downgrade(&self.owner));
            uploads.bytes += bytes;
            uploads.bytes
        };
        match waiting > MOST_WAITING {
            true => Commands::run(device, "upload", |_| Ok(())),
            false => Ok(()),
        }
    }
}

impl Commands {
    /// Brings what waits; none if nothing does.
    pub(super) fn of_uploads(device: &Arc<Device>) -> Result<Option<Self>> {
        let Uploads { waiting, .. } = std::mem::take(&mut *lock(&device.uploads));
        let buffers: Vec<_> = waiting.iter().filter_map(Weak::upgrade).collect();
        if buffers.is_empty() {
            return Ok(None);
        }
        let commands = Self::record(device, "upload", |cmd| {
            let all = [Stage::Compute, Stage::Draw, Stage::Transfer];
            cmd.barrier(&all, &[Stage::Transfer]);
            let mut bytes = 0;
            for owner in buffers {
                let buffer = Buffer { owner };
                let more = buffer.bytes();
                if bytes > 0 && bytes + more > MOST_WAITING {
                    cmd.part();
                    bytes = 0;
                }
                bytes += more;
                let contents = std::mem::take(&mut *lock(&buffer.owner.contents));
                for (i, content) in contents.iter().enumerate() {
                    if i > 0 {
                        cmd.barrier(&[Stage::Transfer], &[Stage::Transfer]);
                    }
                    match content {
                        Content::Bytes { staging, bytes } => {
                            cmd.copy(staging, 0, &buffer, 0, *bytes);
                        }
                        Content::Words(word) => cmd.fill(&buffer, *word),
                    }
                }
            }
            cmd.barrier(&[Stage::Transfer], &all);
            Ok(())
        })?;
        Ok(Some(commands))
    }
}
