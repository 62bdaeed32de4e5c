pub mod atomic_file;
pub mod error;
pub mod scene;
