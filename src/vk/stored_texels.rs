//! Shaders for devices whose texel buffers are small: what they read as texels they then read from
//! storage, 16 bytes a texel. SwiftShader's texel buffers hold 65,536 texels.

use std::collections::BTreeMap;

// Of the SPIR-V specification.
/// With the next, and those between them, all that declare a type.
const OP_TYPE_VOID: u16 = 19;
const OP_TYPE_FORWARD_POINTER: u16 = 39;
const OP_TYPE_INT: u16 = 21;
const OP_TYPE_IMAGE: u16 = 25;
const OP_TYPE_SAMPLED_IMAGE: u16 = 27;
const OP_TYPE_RUNTIME_ARRAY: u16 = 29;
const OP_TYPE_STRUCT: u16 = 30;
const OP_TYPE_POINTER: u16 = 32;
const OP_CONSTANT: u16 = 43;
const OP_FUNCTION: u16 = 54;
const OP_VARIABLE: u16 = 59;
const OP_LOAD: u16 = 61;
const OP_ACCESS_CHAIN: u16 = 65;
const OP_DECORATE: u16 = 71;
const OP_MEMBER_DECORATE: u16 = 72;
const OP_IMAGE_FETCH: u16 = 95;
const OP_IMAGE: u16 = 100;
const DIM_BUFFER: u32 = 5;
const STORAGE_BUFFER: u32 = 12;
const BLOCK: u32 = 2;
const ARRAY_STRIDE: u32 = 6;
const NON_WRITABLE: u32 = 24;
const OFFSET: u32 = 35;

const HEADER_WORDS: usize = 5;
/// Of the header: one more than the largest id.
const BOUND: usize = 3;

/// A module with storage buffers of texels, four words each, in the place of its texel buffers, at
/// the same bindings. One without texel buffers stays as it is.
pub fn stored_texels(words: &[u32]) -> Vec<u32> {
    let texels = Texels::of(words);
    let (Some(uint), Some(texel)) = (texels.uint, texels.texel) else {
        return words.to_vec();
    };
    let mut bound = words[BOUND];
    let mut id = || {
        bound += 1;
        bound - 1
    };
    let [array, block, to_block, to_texel, zero] = std::array::from_fn(|_| id());
    let mut out = Module(words[..HEADER_WORDS].to_vec());
    let (mut are_decorated, mut are_declared) = (false, false);
    for (operation, operands) in instructions(words) {
        if !are_decorated && (OP_TYPE_VOID..=OP_TYPE_FORWARD_POINTER).contains(&operation) {
            are_decorated = true;
            out.push(OP_DECORATE, &[array, ARRAY_STRIDE, 16]);
            out.push(OP_DECORATE, &[block, BLOCK]);
            out.push(OP_MEMBER_DECORATE, &[block, 0, OFFSET, 0]);
            out.push(OP_MEMBER_DECORATE, &[block, 0, NON_WRITABLE]);
        }
        // By now every type is declared.
        if !are_declared && operation == OP_FUNCTION {
            are_declared = true;
            out.push(OP_TYPE_RUNTIME_ARRAY, &[array, texel]);
            out.push(OP_TYPE_STRUCT, &[block, array]);
            out.push(OP_TYPE_POINTER, &[to_block, STORAGE_BUFFER, block]);
            out.push(OP_TYPE_POINTER, &[to_texel, STORAGE_BUFFER, texel]);
            out.push(OP_CONSTANT, &[uint, zero, 0]);
            for variable in &texels.variables {
                out.push(OP_VARIABLE, &[to_block, *variable, STORAGE_BUFFER]);
            }
        }
        match (operation, operands) {
            (OP_VARIABLE, [_, variable, ..]) if texels.variables.contains(variable) => {}
            (OP_LOAD | OP_IMAGE, [_, result, ..]) if texels.images.contains_key(result) => {}
            (OP_IMAGE_FETCH, [of, result, image, at, ..]) if texels.images.contains_key(image) => {
                let place = id();
                let variable = texels.images[image];
                out.push(OP_ACCESS_CHAIN, &[to_texel, place, variable, zero, *at]);
                out.push(OP_LOAD, &[*of, *result, place]);
            }
            _ => out.push(operation, operands),
        }
    }
    out.0[BOUND] = bound;
    out.0
}

/// The texel buffers of a module.
#[derive(Default)]
struct Texels {
    /// The type of 32-bit words.
    uint: Option<u32>,
    /// The type of what is fetched.
    texel: Option<u32>,
    variables: Vec<u32>,
    /// Loaded image → variable.
    images: BTreeMap<u32, u32>,
}

impl Texels {
    fn of(words: &[u32]) -> Self {
        let mut found = Self::default();
        // Types of texel buffers: images, with samplers, pointers to these.
        let mut types = Vec::new();
        for (operation, operands) in instructions(words) {
            match (operation, operands) {
                (OP_TYPE_INT, &[id, 32, 0]) => found.uint = Some(id),
                (OP_TYPE_IMAGE, &[id, _, DIM_BUFFER, ..]) => types.push(id),
                (OP_TYPE_SAMPLED_IMAGE, &[id, of]) | (OP_TYPE_POINTER, &[id, _, of])
                    if types.contains(&of) =>
                {
                    types.push(id);
                }
                (OP_VARIABLE, &[of, id, ..]) if types.contains(&of) => found.variables.push(id),
                (OP_LOAD, &[_, id, from, ..]) if found.variables.contains(&from) => {
                    found.images.insert(id, from);
                }
                (OP_IMAGE, &[_, id, from]) => {
                    if let Some(&variable) = found.images.get(&from) {
                        found.images.insert(id, variable);
                    }
                }
                (OP_IMAGE_FETCH, &[of, _, image, ..]) if found.images.contains_key(&image) => {
                    found.texel = Some(of);
                }
                _ => {}
            }
        }
        found
    }
}

/// A module that is written.
struct Module(Vec<u32>);

impl Module {
    fn push(&mut self, operation: u16, operands: &[u32]) {
        let words = 1 + operands.len() as u32;
        self.0.push(words << 16 | u32::from(operation));
        self.0.extend_from_slice(operands);
    }
}

/// Operations and their operands.
fn instructions(words: &[u32]) -> impl Iterator<Item = (u16, &[u32])> {
    let mut rest = &words[HEADER_WORDS..];
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        Some((first as u16, &instruction[1..]))
    })
}
