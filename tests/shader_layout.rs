//! The structs that Rust and GLSL share: the GLSL text's members against Rust's by name and offset, and the compiled
//! SPIR-V (which keeps no names) against both by its offsets and array strides.

use std::collections::{BTreeMap, BTreeSet};
use std::mem::{offset_of, size_of};

use mesolux::passes::{shaders, types};

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
const OP_TYPE_RUNTIME_ARRAY: u32 = 29;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const ARRAY_STRIDE: u32 = 6;
const OFFSET: u32 = 35;

/// Offsets of the members and the stride of every struct that a module holds an array of.
fn spirv() -> BTreeSet<Vec<u32>> {
    let mut found = BTreeSet::new();
    for words in [
        shaders::CULL_COMP,
        shaders::COUPLE_COMP,
        shaders::MEASURE_COMP,
        shaders::FORM_FACTORS_COMP,
        shaders::GATHER_TO_RELIEF_COMP,
        shaders::PIXELS_TO_RELIEF_COMP,
        shaders::ITEM_BUFFER_VERT,
        shaders::RELIEF_FRAG,
        shaders::RELIEF_RAYS_COMP,
        shaders::SHADE_FRAG,
        shaders::SHADOW_RAYS_COMP,
    ] {
        let mut offsets: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
        let mut strides = BTreeMap::new();
        let mut rest = &words[5..];
        while let Some(&first) = rest.first() {
            let (operation, count) = (first & 0xffff, (first >> 16) as usize);
            match (operation, &rest[1..count]) {
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
            rest = &rest[count..];
        }
    }
    found
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
    // These are loaded word by word: their order is told by the forms of load_triangle and met.
    check!(false, Triangle: a area b height c unused_c normal unused);
    check!(false, ShadowOccluder: a component b closed c height normal unused);
    check!(true, CouplingTarget: first_element element_count first_word word_count inverse_area);
    // KeptState stands alone in its buffer, not in an array.
    check!(false, KeptState: chunk used rows);
}
