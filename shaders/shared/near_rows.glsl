// Puts the form factors of near elements, which are found on the host, into the fresh rows of a
// batch. VECTOR_FLUX: of elements with a relief, as vectors.

#include "shared/types.glsl"

#ifdef VECTOR_FLUX
#define FACTOR NearVector
#define FLUX vec3
#else
#define FACTOR NearFactor
#define FLUX float
#endif

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// Where the factors of each source begin; one more than the sources.
layout(scalar, binding = 1) readonly buffer Starts { uint starts[]; };
layout(scalar, binding = 2) readonly buffer Factors { FACTOR factors[]; };
// [slot][element of those of a kind]
layout(scalar, binding = 3) writeonly buffer Fresh { FLUX fresh[]; };
// 1 where any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 4) writeonly buffer Occupied { uint occupied[]; };

layout(push_constant, scalar) uniform Parameters {
    uint element_count;       // of a kind
    uint block_count;
    uint first_block;         // of the kind's
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
    FACTOR near = factors[at];
    fresh[slot * element_count + near.element] = near.factor;
    if (near.factor != FLUX(0.0)) {
        occupied[slot * block_count + first_block + near.element / GROUP] = 1;
    }
}
