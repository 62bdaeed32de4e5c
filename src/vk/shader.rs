//! What shaders read, by the names of their GLSL. The build writes the shaders and the types that
//! implement these traits.

use super::{Bind, Binding};

/// A binding of a shader; its number is its place in the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShaderBinding {
    pub name: &'static str,
    pub kind: Binding,
}

/// A push constant of a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShaderParameter {
    pub name: &'static str,
    /// Bytes.
    pub offset: u32,
}

/// What a shader binds.
pub trait ShaderBindings {
    /// `[binding]`
    const BINDINGS: &'static [ShaderBinding];

    /// `[binding]`
    fn binds(&self) -> Vec<Bind<'_>>;
}

/// Push constants of a shader.
pub trait ShaderParameters: bytemuck::Pod {
    const FIELDS: &'static [ShaderParameter];
}

impl ShaderParameters for () {
    const FIELDS: &'static [ShaderParameter] = &[];
}

/// What the shaders of a pipeline read.
#[derive(Debug, Clone, Copy)]
pub struct Interface {
    pub bindings: &'static [ShaderBinding],
    pub parameters: &'static [ShaderParameter],
    pub parameter_bytes: usize,
}

impl Interface {
    pub const fn of<B: ShaderBindings, P: ShaderParameters>() -> Self {
        Self {
            bindings: B::BINDINGS,
            parameters: P::FIELDS,
            parameter_bytes: size_of::<P>(),
        }
    }
}

/// A compute module with the entry point `main`.
#[derive(Debug, Clone, Copy)]
pub struct ComputeShader<'a> {
    pub spirv: &'a [u32],
    pub interface: Interface,
}

/// The two modules of a graphics pipeline, each with the entry point `main`.
#[derive(Debug, Clone, Copy)]
pub struct GraphicsShaders<'a> {
    pub vertex: &'a [u32],
    pub fragment: &'a [u32],
    pub interface: Interface,
}
