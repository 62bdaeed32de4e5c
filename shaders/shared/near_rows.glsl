// Puts the form factors of near elements into the fresh rows of a batch.

#include "shared/near_factors.glsl"

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
    uint at = own_factor(slot);
    if (at == NONE) {
        return;
    }
    FACTOR near = factors[at];
    fresh[slot * element_count + near.element] = near.factor;
    if (near.factor != FLUX(0.0)) {
        occupied[slot * block_count + first_block + near.element / GROUP] = 1;
    }
}
