// In an enclosed scene all that a source sends arrives. Its form factors were found one by one, from
// samples: what they take together tells by how much they are off. This sums the fresh ones of each
// parcel of elements times their areas; the host adds up the parcels, of all members. One invocation
// a parcel and slot. src/reference/normalise.rs is the whole in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// First element and number of elements of each.
layout(scalar, binding = 1) readonly buffer Parcels { uvec2 parcels[]; };
layout(scalar, binding = 2) readonly buffer Areas { float element_area[]; };
// [slot][element], of elements without and with relief.
layout(scalar, binding = 3) readonly buffer Fresh { float fresh[]; };
layout(scalar, binding = 4) readonly buffer FreshMeso { vec3 fresh_meso[]; };
// 1 where any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 5) readonly buffer Occupied { uint occupied[]; };
// [slot][parcel]
layout(scalar, binding = 6) writeonly buffer Sums { float sums[]; };

layout(push_constant, scalar) uniform Parameters {
    uint parcel_count;
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
    if (gl_GlobalInvocationID.x >= parcel_count || slots[slot].source == NONE) {
        return;
    }
    uvec2 parcel = parcels[gl_GlobalInvocationID.x];
    bool meso = parcel.x >= first_meso;
    uint base = meso ? first_meso : first_plain;
    uint begin = parcel.x - base;
    uint end = begin + parcel.y;
    uint first_block = slot * block_count + (meso ? plain_blocks : 0);
    uint first_factor = slot * (meso ? meso_count : plain_count);
    float sum = 0.0;
    uint i = begin;
    while (i < end) {
        // Blocks that see nothing of the source are passed over.
        uint block_end = min(end, (i / GROUP + 1) * GROUP);
        if (occupied[first_block + i / GROUP] == 0) {
            i = block_end;
        }
        for (; i < block_end; i++) {
            float f = meso ? fresh_meso[first_factor + i].z : fresh[first_factor + i];
            sum += element_area[base + i] * f;
        }
    }
    sums[slot * parcel_count + gl_GlobalInvocationID.x] = sum;
}
