//! The structs that Rust and GLSL share, in scalar layout: the build writes them from
//! `shaders/shared/types.glsl`, with its names and comments.

/// A struct as it lies in memory, to be checked against the SPIR-V.
pub struct Struct {
    pub name: &'static str,
    /// Of the members, in their order.
    pub offsets: &'static [usize],
    pub bytes: usize,
}

include!(concat!(env!("OUT_DIR"), "/structs.rs"));
