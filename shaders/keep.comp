// Keeps the form factors of the batch's fresh sources in the rows that allocate.comp found for them. One workgroup a block of
// GROUP elements and slot.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "shared/types.glsl"
#include "shared/kept.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer KeptRows { KeptRow kept_rows[]; };
layout(scalar, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
// [slot][element], of elements without and with relief.
layout(scalar, binding = 3) readonly buffer Fresh { float fresh[]; };
layout(scalar, binding = 4) readonly buffer FreshMeso { vec3 fresh_meso[]; };

layout(push_constant, scalar) uniform Parameters {
    uint plain_count;
    uint plain_blocks;
    uint meso_count;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Words { uint word[]; };

uint code_at(uint slot, uint i) {
    return i < plain_count ? factor_code(fresh[slot * plain_count + i]) : 0;
}

uint meso_code_at(uint slot, uint i) {
    return i < meso_count ? factor_code(length(fresh_meso[slot * meso_count + i])) : 0;
}

void main() {
    uint slot = gl_WorkGroupID.y;
    uint source = slots[slot].source;
    if (source == NONE || kept_rows[source].chunk == NONE) {
        return;
    }
    KeptRow row = kept_rows[source];
    Words words = Words(chunks[row.chunk]);
    uint block = gl_WorkGroupID.x;
    uint first = words.word[row.first + block];
    if (first == 0) {
        return;
    }
    first += row.first;
    uint lane = gl_LocalInvocationID.x;
    if (block < plain_blocks) {
        uint i = GROUP * block + 2 * lane;
        if (lane < GROUP / 2) {
            words.word[first + lane] = code_at(slot, i) | code_at(slot, i + 1) << 16;
        }
        return;
    }
    uint i = GROUP * (block - plain_blocks) + 2 * lane;
    if (lane < GROUP / 2) {
        words.word[first + lane] = meso_code_at(slot, i) | meso_code_at(slot, i + 1) << 16;
    }
    i = GROUP * (block - plain_blocks) + lane;
    vec3 f = i < meso_count ? fresh_meso[slot * meso_count + i] : vec3(0.0);
    words.word[first + GROUP / 2 + lane] = f == vec3(0.0) ? 0 : direction_code(f * inversesqrt(dot(f, f)));
}
