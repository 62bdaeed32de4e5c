// Every element adds up what kept rows bring it: form factor times radiosity, the paper's equation
// (2) by reciprocity. Subgroups take blocks of GROUP elements, sources in slot order: no atomics,
// the same bits every run and for every size of subgroup. FROM_RELIEF: some sources send by
// direction. TO_RELIEF: the elements of this dispatch receive by direction.
//
// A dispatch takes emitted or reflected light. Few sources emit, so that its other half mostly need
// not run; and a software device pays for both sides of every branch, but a loop over the slots of
// one kind costs what there are of them.
//
// This is what the shaders have in common; gather_even.glsl and gather_to_relief.comp go on.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#include "shared/types.glsl"
#include "shared/kept.glsl"
#include "shared/lanes.glsl"
#include "shared/texels.glsl"
#ifdef FROM_RELIEF
#include "shared/directions.glsl"
#endif
#ifdef TO_RELIEF
#include "shared/disc.glsl"
#endif

// The workgroup is one subgroup.
const uint FACTORS = 8;
layout(constant_id = 0) const uint LANES = GROUP / FACTORS;
layout(local_size_x_id = 0) in;
const uint TEXELS = GROUP / FACTORS;

// What each row's source sends, times the scale of its form factors, and the first word of the row,
// [slot][emitted, reflected].
layout(binding = 0) uniform usamplerBuffer lit_rows;
// Of emitted or of reflected light.
layout(scalar, binding = 1) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 2) buffer IrradianceError { vec3 irradiance_error[]; };
// Words of the chunk that holds the rows.
layout(binding = 3) uniform usamplerBuffer words;
// Sums of what the elements of the dispatch have received so far, [element]; to relief
// [element][irradiance and RELIEF_RANK coefficients].
layout(scalar, binding = 4) buffer Partial { vec3 partial_sums[]; };
#ifdef FROM_RELIEF
layout(scalar, binding = 5) readonly buffer Slots { Slot slots[]; };
// Light that the sources with a relief send by direction,
// [slot from first_exit on][emitted, reflected][direction].
layout(binding = 6) uniform usamplerBuffer exits;
// SOURCE_TEXELS a source.
layout(binding = 7) uniform usamplerBuffer sources;
layout(scalar, binding = 8) readonly buffer Balls { vec4 balls[]; };
#endif
#ifdef TO_RELIEF
layout(scalar, binding = 9) readonly buffer MesoElements { MesoElement meso_elements[]; };
// Radiosity for each coefficient, [response][rank].
layout(binding = 10) uniform usamplerBuffer albedos;
// Moments ∫ L ω dω of the light that arrives, in the element's frame, [meso
// element][direction][colour].
layout(scalar, binding = 11) buffer Moments { vec3 moments[]; };
layout(scalar, binding = 12) buffer MesoReflected { Reflected meso_reflected[]; };
layout(binding = 13) uniform usamplerBuffer bases;
layout(scalar, binding = 14) buffer Coefficients { vec4 coefficients[]; };
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint first_slot;
    uint end_slot;
    uint first_exit;          // the slot whose light by direction comes first
    uint first_block;
    uint reflected;           // 0: light that is emitted, 1: that is reflected
    // With relief:
    uint first_relief_source;
    uint relief_source_count;
    uvec2 cells;              // of the directions' square
    uvec2 kept_cells;         // of the square of the slots that elements with a relief keep
    // Rows that are added up together may lie in several chunks, a dispatch each. 1: it goes on
    // from the sums of the dispatch before; 1: it leaves them to the next.
    uint continues;
    uint is_continued;
    uint first_meso;          // of the elements with a relief, the first of the dispatch
};

#include "shared/accumulate.glsl"
#ifdef FROM_RELIEF
#include "shared/sent.glsl"
#endif
#ifdef TO_RELIEF
#include "shared/receive_relief.glsl"
#endif

// What a slot sends, and the texel where this block's factors start; 0: the block sees nothing of
// it.
struct Sent {
    vec3 light;
    uint block;
};

uint word_at(uint at) {
    return fetch_words(words, at / 4)[at % 4];
}

#ifdef FROM_RELIEF
// Place and frame of a source that sends by direction.
struct Sender {
    vec3 tangent;
    vec3 bitangent;
    vec3 normal;
    vec3 middle;
};

// All lanes want the same one.
Sender sender(uint source) {
    uint at = SOURCE_TEXELS * source;
    return Sender(fetch(sources, at + 2).xyz, fetch(sources, at + 3).xyz,
                  fetch(sources, at + 1).xyz, fetch(sources, at + 6).yzw);
}

vec3 sent_to(uint slot, Sender s, vec3 middle) {
    vec3 d = middle - s.middle;
    vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal));
    return sent_towards(slot - first_exit, reflected, local * inversesqrt(max(dot(d, d), 1e-38)));
}

bool by_direction(uint source) {
    return source - first_relief_source < relief_source_count;
}
#endif

// This lane's slot, for all lanes to share.
Sent look_up(uint slot) {
    Sent sent = Sent(vec3(0.0), 0);
    if (slot < end_slot) {
        uvec4 lit = fetch_words(lit_rows, 2 * slot + reflected);
        sent.light = uintBitsToFloat(lit.xyz);
        bool sends = sent.light != vec3(0.0);
#ifdef FROM_RELIEF
        // What leaves by direction may sum to nothing.
        sends = sends || reflected == 1 && by_direction(slots[slot].source);
#endif
        if (sends) {
            uint at = word_at(lit.w + first_block + gl_WorkGroupID.x);
            sent.block = at == 0 ? 0 : (lit.w + at) / 4;
        }
    }
    return sent;
}
