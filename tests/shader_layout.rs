//! What Rust and GLSL share. Structs: the GLSL text's members against Rust's by name and offset,
//! and the compiled SPIR-V (which keeps no names) against both by its offsets and array strides.
//! Bindings and push constants: what the build wrote from the GLSL text against the SPIR-V.

use std::collections::{BTreeMap, BTreeSet};
use std::mem::{offset_of, size_of};

use mesolux::passes::{shaders, types};
use mesolux::vk::Binding;

/// Struct name → members with their offsets in scalar layout, in order, and the size.
fn glsl() -> BTreeMap<String, Vec<(String, u32)>> {
    let text = include_str!("../shaders/shared/types.glsl");
    let mut structs = BTreeMap::new();
    type Members = Vec<(String, u32)>;
    let mut current: Option<(String, Members, u32)> = None;
    for line in text.lines() {
        let words: Vec<_> = line.split([' ', ';']).filter(|w| !w.is_empty()).collect();
        match (&mut current, &words[..]) {
            (None, ["struct", name, "{"]) => current = Some(((*name).to_owned(), Vec::new(), 0)),
            (Some(_), ["}", ..] | []) => {
                let (name, members, size) = current.take().expect("a struct is open");
                structs.insert(name, [members, vec![("size".to_owned(), size)]].concat());
            }
            (Some((_, members, offset)), [kind, name, ..]) => {
                members.push(((*name).to_owned(), *offset));
                *offset += match *kind {
                    "vec3" => 12,
                    "vec2" => 8,
                    "float" | "uint" | "int" => 4,
                    other => panic!("types.glsl: {other} has no size here"),
                };
            }
            _ => {}
        }
    }
    structs
}

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

macro_rules! check {
    ($in_array:expr, $name:ident: $($field:ident)*) => {{
        let rust = vec![
            $((stringify!($field).to_owned(), offset_of!(types::$name, $field) as u32),)*
            ("size".to_owned(), size_of::<types::$name>() as u32),
        ];
        assert_eq!(glsl()[stringify!($name)], rust, "{}: GLSL left, Rust right", stringify!($name));
        let offsets: Vec<u32> = rust.iter().map(|m| m.1).collect();
        if $in_array {
            assert!(spirv().contains(&offsets), "{}: not in the SPIR-V", stringify!($name));
        }
    }};
}

#[test]
fn rust_and_glsl_agree() {
    check!(true, Source: eye area normal radius tangent cone_sin bitangent cone_cos emitted kind
        first_element element_count first_contour contour_count component middle facing part_radius first_part part_count);
    check!(true, Meshlet: centre radius axis cutoff first count component);
    check!(true, ReceiverBlock: centre radius axis half_height cone_sin cone_cos largest);
    check!(true, Component: low closed high);
    check!(true, Slot: emitted source reflected scale);
    check!(true, View: eye x y w);
    check!(true, Draw: index_count instance_count first_index vertex_offset first_instance);
    check!(true, KeptRow: chunk first scale);
    check!(true, ReceiverList: groups_x groups_y groups_z count);
    check!(true, MesoElement: tangent response bitangent scale);
    check!(true, Reflected: sum error);
    check!(true, MesoTexel: uv_a uv_b uv_c first columns rows);
    check!(true, TextureFacet: reflectance above_low above_high);
    check!(true, Prism: low_a low_b low_c high_a high_b high_c uv_a uv_b uv_c light_a light_b light_c surface
        tangent texel bitangent normal first_cluster cluster_count slots);
    check!(true, ParallelLight: towards fluence_a fluence_b fluence_c);
    check!(true, LightPoint: position kind normal area strength);
    check!(true, ShadowNode: low skip high leaf);
    check!(true, ShadowTriangle: a b c relief);
    check!(true, ShadowRay: from clear to);
    check!(true, LitTriangle: a b c normal_a normal_b normal_c plane above open);
    check!(true, ReliefSurface: lowest top mean columns rows rank first_factor slope);
    check!(true, HeightTile: first width height top highest);
    check!(true, HeightRay: from tile to);
    check!(true, HeightHit: t cell local height gradient steps);
    // These are loaded word by word, in the order that load_triangle and met expect.
    check!(false, Triangle: a area b height c unused_c normal unused);
    check!(false, ShadowOccluder: a component b closed c height normal unused);
    check!(true, CouplingTarget: first_element element_count first_word word_count inverse_area);
    // KeptState stands alone in its buffer, not in an array.
    check!(false, KeptState: chunk used rows);
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
