// Writes the form factors of a batch to the rows that allocate.comp found for them. One subgroup
// looks after KEEP_BLOCKS blocks of GROUP elements of one slot, most of which may see nothing of
// the source.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "shared/types.glsl"
#include "shared/kept.glsl"
#include "shared/lanes.glsl"

// The workgroup is one subgroup.
layout(constant_id = 0) const uint LANES = GROUP / 2;
layout(local_size_x_id = 0) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// [slot]
layout(scalar, binding = 1) readonly buffer Rows { KeptRow rows[]; };
layout(scalar, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
// [slot][element], of elements without and with relief.
layout(scalar, binding = 3) readonly buffer Fresh { float fresh[]; };
layout(scalar, binding = 4) readonly buffer FreshMeso { vec3 fresh_meso[]; };

layout(push_constant, scalar) uniform Parameters {
    uint plain_count;
    uint plain_blocks;
    uint meso_count;
    uint block_count;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Words { uint word[]; };

uint code_at(uint slot, uint i) {
    return i < plain_count ? factor_code(fresh[slot * plain_count + i]) : 0;
}

uint meso_code_at(uint slot, uint i) {
    return i < meso_count ? factor_code(length(fresh_meso[slot * meso_count + i])) : 0;
}

// `first`: where the block's factors start.
void keep(Words words, uint slot, uint block, uint first) {
    bool plain = block < plain_blocks;
    uint begin = GROUP * (plain ? block : block - plain_blocks);
    for (uint pair = gl_SubgroupInvocationID; pair < GROUP / 2; pair += LANES) {
        uint i = begin + 2 * pair;
        words.word[first + pair] = plain ? code_at(slot, i) | code_at(slot, i + 1) << 16 : meso_code_at(slot, i) | meso_code_at(slot, i + 1) << 16;
    }
    for (uint k = gl_SubgroupInvocationID; k < GROUP && !plain; k += LANES) {
        uint i = begin + k;
        vec3 f = i < meso_count ? fresh_meso[slot * meso_count + i] : vec3(0.0);
        words.word[first + GROUP / 2 + k] = f == vec3(0.0) ? 0 : direction_code(f * inversesqrt(dot(f, f)));
    }
}

void main() {
    uint slot = gl_WorkGroupID.y;
    if (slots[slot].source == NONE) {
        return;
    }
    KeptRow row = rows[slot];
    Words words = Words(chunks[row.chunk]);
    uint next = KEEP_BLOCKS * gl_WorkGroupID.x;
    uint end = min(next + KEEP_BLOCKS, block_count);
    while (next < end) {
        // On to the next blocks of which any sees the source, in a loop of its own: a software
        // device works through what a branch leaves out.
        uint looked_at;
        uint first;
        uvec4 occupied;
        do {
            looked_at = next;
            uint block = looked_at + gl_SubgroupInvocationID;
            first = block < end ? words.word[row.first + block] : 0;
            occupied = subgroupBallot(first != 0);
            next += LANES;
        } while (occupied == uvec4(0) && next < end);
        while (occupied != uvec4(0)) {
            uint lane = next_lane(occupied);
            keep(words, slot, looked_at + lane, row.first + subgroupBroadcast(first, lane));
        }
    }
}
