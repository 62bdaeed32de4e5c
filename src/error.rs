//! The one error type: everything that a file, a scene, a device or the user can cause.

use std::path::{Path, PathBuf};

pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Errors that the user can cause and fix. The text is one line and names the file, the line or the
/// material.
///
/// Errors that only a bug can cause are an `assert!` with a sentence.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    /// A file whose content cannot be used; `line` counts from 1.
    #[error("{}:{line}: {what}", path.display())]
    Line {
        path: PathBuf,
        line: usize,
        what: String,
    },
    #[error("{}: {what}", path.display())]
    File { path: PathBuf, what: String },
    #[error("{}: material \"{material}\": {what}", path.display())]
    Material {
        path: PathBuf,
        material: String,
        what: String,
    },
    /// A scene that was read correctly but cannot be baked or drawn.
    #[error("scene {scene}: {what}")]
    Scene { scene: String, what: String },
    /// A name or value on the command line.
    #[error("{0}")]
    Usage(String),
    /// No Vulkan device is suitable, or the requested one does not exist.
    #[error("{0}")]
    Device(String),
    /// No window can be opened.
    #[error("{0}; `mesolux render` draws a picture without a window")]
    Display(String),
    /// A Vulkan call failed.
    #[error("Vulkan device {device}: {what}: {source}")]
    Vulkan {
        device: String,
        what: &'static str,
        source: ash::vk::Result,
    },
    #[error("Vulkan device {device}: out of memory for {what} ({bytes} bytes)")]
    DeviceMemory {
        device: String,
        what: String,
        bytes: u64,
    },
}

impl Error {
    pub fn file(path: &Path, what: impl Into<String>) -> Self {
        Self::File {
            path: path.to_owned(),
            what: what.into(),
        }
    }

    pub fn line(path: &Path, line: usize, what: impl Into<String>) -> Self {
        Self::Line {
            path: path.to_owned(),
            line,
            what: what.into(),
        }
    }

    pub fn read(path: &Path, source: std::io::Error) -> Self {
        Self::Read {
            path: path.to_owned(),
            source,
        }
    }

    pub fn write(path: &Path, source: std::io::Error) -> Self {
        Self::Write {
            path: path.to_owned(),
            source,
        }
    }
}
