//! Light at places in files that other programs read.

pub mod sensors;
