// Couples the drawn sources of a batch to all sources: what a source's row brings to the members of
// each target, as a mean by weights w_j, of which those of a target sum to its area A_t. A target
// of one reflectance has one word, Σ w_j F_js / A_t, which the host multiplies by the reflectance;
// any other has three, Σ ρ_j w_j F_js / A_t. One invocation a target, whose elements are all of
// this row, and slot. src/reference/couple.rs is the same in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Targets { CouplingTarget targets[]; };
layout(scalar, binding = 2) readonly buffer Reflectances { vec3 reflectance[]; };
layout(scalar, binding = 3) readonly buffer Weights { float weights[]; };
// [slot][element], of elements without and with relief.
layout(scalar, binding = 4) readonly buffer Fresh { float fresh[]; };
layout(scalar, binding = 5) readonly buffer FreshMeso { vec3 fresh_meso[]; };
// 1 where any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 6) readonly buffer Occupied { uint occupied[]; };
// [slot][word]
layout(scalar, binding = 7) writeonly buffer Coupling { float coupling[]; };

layout(push_constant, scalar) uniform Parameters {
    uint target_count;
    uint word_count;
    uint plain_count;
    uint plain_blocks;
    uint meso_count;
    uint block_count;
    // The first elements of the row of each kind; NONE of a row without relief.
    uint first_plain;
    uint first_meso;
};

void main() {
    uint slot = gl_WorkGroupID.y;
    if (gl_GlobalInvocationID.x >= target_count || slots[slot].source == NONE) {
        return;
    }
    CouplingTarget target = targets[gl_GlobalInvocationID.x];
    bool meso = target.first_element >= first_meso;
    uint begin = target.first_element - (meso ? first_meso : first_plain);
    uint end = begin + target.element_count;
    uint first_block = slot * block_count + (meso ? plain_blocks : 0);
    uint first_factor = slot * (meso ? meso_count : plain_count);
    uint base = target.first_element - begin;
    float even = 0.0;
    vec3 coloured = vec3(0.0);
    uint i = begin;
    while (i < end) {
        // Blocks that see nothing of the source are passed over.
        uint block_end = min(end, (i / GROUP + 1) * GROUP);
        if (occupied[first_block + i / GROUP] == 0) {
            i = block_end;
        }
        for (; i < block_end; i++) {
            float f = meso ? fresh_meso[first_factor + i].z : fresh[first_factor + i];
            float weighted = f * weights[base + i];
            even += weighted;
            if (target.word_count == 3) {
                coloured += weighted * reflectance[base + i];
            }
        }
    }
    uint at = slot * word_count + target.first_word;
    if (target.word_count == 1) {
        coupling[at] = even * target.inverse_area;
    } else {
        coupling[at] = coloured.r * target.inverse_area;
        coupling[at + 1] = coloured.g * target.inverse_area;
        coupling[at + 2] = coloured.b * target.inverse_area;
    }
}
