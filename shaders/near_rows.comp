// Puts the form factors of near elements, which are found on the host, into the fresh rows of a
// batch. src/reference/near_rows.rs is the same.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// Where the factors of each source begin; one more than the sources.
layout(scalar, binding = 1) readonly buffer Starts { uint starts[]; };
layout(scalar, binding = 2) readonly buffer Factors { NearFactor factors[]; };
// [slot][element], of elements without relief.
layout(scalar, binding = 3) writeonly buffer Fresh { float fresh[]; };
// 1 where any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 4) writeonly buffer Occupied { uint occupied[]; };

layout(push_constant, scalar) uniform Parameters {
    uint plain_count;
    uint block_count;
};

void main() {
    uint slot = gl_WorkGroupID.y;
    uint source = slots[slot].source;
    if (source == NONE) {
        return;
    }
    uint at = starts[source] + gl_GlobalInvocationID.x;
    if (at >= starts[source + 1]) {
        return;
    }
    NearFactor near = factors[at];
    fresh[slot * plain_count + near.element] = near.factor;
    if (near.factor > 0.0) {
        occupied[slot * block_count + near.element / GROUP] = 1;
    }
}
