//! Sources under way: what they see, and the rows of form factors and couplings.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Slot {
    pub emitted: Vec3,
    pub source: u32,
    pub reflected: Vec3,
    /// Of all its form factors.
    pub scale: f32,
}

/// The command for a list of receivers, and how many they are.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReceiverList {
    pub groups_x: u32,
    pub groups_y: u32,
    pub groups_z: u32,
    pub count: u32,
}

/// Where the form factors of a source lie: word `first` of a chunk.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct KeptRow {
    pub chunk: u32,
    pub first: u32,
    /// Of all of them.
    pub scale: f32,
}

/// How far the memory for kept form factors is filled.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct KeptState {
    pub chunk: u32,
    pub used: u32,
    pub rows: u32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct View {
    pub eye: Vec3,
    pub x: Vec3,
    pub y: Vec3,
    pub w: Vec3,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Draw {
    pub index_count: u32,
    pub instance_count: u32,
    pub first_index: u32,
    pub vertex_offset: i32,
    pub first_instance: u32,
}

/// A source as it receives: the words of a coupling row that belong to it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct CouplingTarget {
    pub first_element: u32,
    pub element_count: u32,
    pub first_word: u32,
    /// 1 where all members have one reflectance, 3 otherwise.
    pub word_count: u32,
    pub inverse_area: f32,
}
