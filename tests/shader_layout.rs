//! What Rust and GLSL share: structs, bindings and push constants as the build wrote them from the
//! GLSL text, against the compiled SPIR-V, which keeps no names, by offsets and array strides.

use std::collections::{BTreeMap, BTreeSet};

use mesolux::passes::shaders;
use mesolux::structs::{self, Struct};
use mesolux::vk::{Binding, stored_texels};

// Of the SPIR-V specification.
const OP_TYPE_INT: u32 = 21;
const OP_TYPE_FLOAT: u32 = 22;
const OP_TYPE_VECTOR: u32 = 23;
const OP_TYPE_IMAGE: u32 = 25;
const OP_TYPE_SAMPLED_IMAGE: u32 = 27;
const OP_TYPE_RUNTIME_ARRAY: u32 = 29;
const OP_TYPE_STRUCT: u32 = 30;
const OP_TYPE_POINTER: u32 = 32;
const OP_VARIABLE: u32 = 59;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const ARRAY_STRIDE: u32 = 6;
const BINDING: u32 = 33;
const OFFSET: u32 = 35;
const PUSH_CONSTANT: u32 = 9;
const STORAGE_BUFFER: u32 = 12;
const DIM_BUFFER: u32 = 5;

/// Operations and their operands.
fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = &words[5..];
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        Some((first & 0xffff, &instruction[1..]))
    })
}

/// Offsets of the members and the stride of every struct that a module holds an array of.
fn spirv() -> BTreeSet<Vec<u32>> {
    let mut found = BTreeSet::new();
    for words in shaders::ALL.iter().flat_map(|compiled| compiled.stages) {
        let mut offsets: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
        let mut strides = BTreeMap::new();
        for (operation, operands) in instructions(words) {
            match (operation, operands) {
                (OP_MEMBER_DECORATE, [id, member, OFFSET, offset]) => {
                    offsets.entry(*id).or_default().insert(*member, *offset);
                }
                (OP_DECORATE, [id, ARRAY_STRIDE, stride]) => {
                    strides.insert(*id, *stride);
                }
                (OP_TYPE_RUNTIME_ARRAY, [id, of]) => {
                    if let (Some(members), Some(stride)) = (offsets.get(of), strides.get(id)) {
                        found.insert(members.values().copied().chain([*stride]).collect());
                    }
                }
                _ => {}
            }
        }
    }
    found
}

/// What a module reads, by its SPIR-V.
#[derive(Default, Debug)]
struct Read {
    /// By number, without those that no instruction uses.
    bindings: BTreeMap<u32, Binding>,
    /// Offsets of the push constants, and the end of the last.
    push_constants: Option<(Vec<u32>, u32)>,
}

/// Types of a module, by ID.
#[derive(Default)]
struct Types<'a> {
    /// Operation and operands after the ID.
    declared: BTreeMap<u32, (u32, &'a [u32])>,
}

impl Types<'_> {
    fn kind(&self, id: u32) -> Binding {
        match self.declared[&id] {
            (OP_TYPE_STRUCT, _) => Binding::Storage,
            (OP_TYPE_SAMPLED_IMAGE, [image]) => self.kind(*image),
            (OP_TYPE_IMAGE, [_, DIM_BUFFER, ..]) => Binding::Texels,
            (OP_TYPE_IMAGE, _) => Binding::Sampled,
            (operation, _) => panic!("type {operation} of a binding"),
        }
    }

    fn bytes(&self, id: u32) -> u32 {
        match self.declared[&id] {
            (OP_TYPE_INT | OP_TYPE_FLOAT, [bits, ..]) => bits / 8,
            (OP_TYPE_VECTOR, [of, count]) => count * self.bytes(*of),
            (operation, _) => panic!("type {operation} of a push constant"),
        }
    }
}

fn read(words: &[u32]) -> Read {
    let mut types = Types::default();
    let mut offsets: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
    let mut numbers = BTreeMap::new();
    let mut read = Read::default();
    for (operation, operands) in instructions(words) {
        match (operation, operands) {
            (OP_MEMBER_DECORATE, [id, member, OFFSET, offset]) => {
                offsets.entry(*id).or_default().insert(*member, *offset);
            }
            (OP_DECORATE, [id, BINDING, number]) => {
                numbers.insert(*id, *number);
            }
            (OP_TYPE_INT..=OP_TYPE_POINTER, [id, rest @ ..]) => {
                types.declared.insert(*id, (operation, rest));
            }
            (OP_VARIABLE, [pointer, id, storage, ..]) => {
                let (OP_TYPE_POINTER, [_, of]) = types.declared[pointer] else {
                    panic!("a variable is of a pointer type");
                };
                if let Some(number) = numbers.get(id) {
                    read.bindings.insert(*number, types.kind(*of));
                }
                if *storage == PUSH_CONSTANT {
                    let offsets: Vec<u32> = offsets[of].values().copied().collect();
                    let last = types.declared[of].1.last().expect("a member");
                    let end = offsets.last().expect("an offset") + types.bytes(*last);
                    read.push_constants = Some((offsets, end));
                }
            }
            _ => {}
        }
    }
    read
}

/// Loaded as texels of four words, in the order that `load_triangle`, `met` and `bin_shots.comp`
/// expect.
const BY_WORDS: [&str; 11] = [
    "Triangle",
    "ShadowOccluder",
    "ReliefPatch",
    "ReliefTexel",
    "Prism",
    "ReliefSurface",
    "ParallelLight",
    "LightPoint",
    "LightPolygon",
    "LitTriangle",
    "ShadowTriangle",
];

#[test]
fn structs_lie_as_in_the_spirv() {
    let in_spirv = spirv();
    let mut found = 0;
    for Struct {
        name,
        offsets,
        bytes,
    } in structs::ALL
    {
        let words = offsets.iter().chain([bytes]).map(|&at| at as u32);
        let there = in_spirv.contains(&words.collect::<Vec<_>>());
        assert!(
            there || BY_WORDS.contains(name),
            "{name}: offsets {offsets:?}, {bytes} bytes"
        );
        found += usize::from(there);
    }
    assert!(found >= 23, "{found} structs in arrays");
}

#[test]
fn bindings_and_push_constants_are_those_of_the_spirv() {
    for compiled in shaders::ALL {
        let (name, interface) = (compiled.name, compiled.interface);
        let stages: Vec<Read> = compiled.stages.iter().map(|words| read(words)).collect();
        let in_spirv: BTreeMap<_, _> = stages.iter().flat_map(|s| s.bindings.clone()).collect();
        let generated: BTreeMap<_, _> = (0..)
            .zip(interface.bindings)
            .map(|(number, binding)| (number, binding.kind))
            .collect();
        // What a variant declares and does not use, the optimiser leaves out.
        for (number, kind) in &in_spirv {
            assert_eq!(
                generated.get(number),
                Some(kind),
                "binding {number} of {name}: Rust left, SPIR-V right"
            );
        }
        assert!(
            in_spirv.len() + 1 >= generated.len(),
            "{name} declares bindings for nothing"
        );
        let offsets: Vec<u32> = interface.parameters.iter().map(|p| p.offset).collect();
        let mut longest = 0;
        for (in_spirv, end) in stages.iter().filter_map(|s| s.push_constants.as_ref()) {
            let known = &offsets[..in_spirv.len().min(offsets.len())];
            assert_eq!(
                known, in_spirv,
                "push constants of {name}: Rust left, SPIR-V right"
            );
            longest = longest.max(*end);
        }
        assert_eq!(
            interface.parameter_bytes as u32, longest,
            "push constants of {name}"
        );
    }
}

/// What devices with small texel buffers load has a storage buffer in the place of each.
#[test]
fn no_texel_buffer_is_left_where_texels_are_stored() {
    let declared = |words: &[u32], class: u32| {
        let of = |&(operation, operands): &(u32, &[u32])| {
            operation == OP_VARIABLE && operands[2] == class
        };
        instructions(words).filter(of).count()
    };
    // A variable of a texel buffer; those of images stay.
    let texel_buffers = |words: &[u32]| {
        let mut types = BTreeSet::new();
        let mut count = 0;
        for (operation, operands) in instructions(words) {
            match (operation, operands) {
                (OP_TYPE_IMAGE, &[id, _, DIM_BUFFER, ..]) => {
                    types.insert(id);
                }
                (OP_TYPE_SAMPLED_IMAGE, &[id, of]) | (OP_TYPE_POINTER, &[id, _, of])
                    if types.contains(&of) =>
                {
                    types.insert(id);
                }
                (OP_VARIABLE, &[of, ..]) if types.contains(&of) => count += 1,
                _ => {}
            }
        }
        count
    };
    let mut all = 0;
    for words in shaders::ALL.iter().flat_map(|compiled| compiled.stages) {
        let (before, stored) = (texel_buffers(words), stored_texels(words));
        assert_eq!(texel_buffers(&stored), 0);
        let [now, then] = [&stored, *words].map(|words| declared(words, STORAGE_BUFFER));
        assert_eq!(now, then + before);
        assert_eq!(before == 0, stored == *words);
        all += before;
    }
    assert!(all > 50, "{all} texel buffers");
}
