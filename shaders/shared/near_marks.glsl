// Marks the near elements of each source of a batch, which sort_receivers.comp leaves out.

#include "shared/near_factors.glsl"

// One bit an element, [slot][word]; zeros at first.
layout(scalar, binding = 3) buffer NearMarks { uint near_marks[]; };

layout(push_constant, scalar) uniform Parameters {
    uint element_count;       // of a kind
};

void main() {
    uint slot = gl_WorkGroupID.y;
    uint at = own_factor(slot);
    if (at == NONE) {
        return;
    }
    uint element = factors[at].element;
    uint words = (element_count + 31) / 32;
    atomicOr(near_marks[slot * words + element / 32], 1u << (element % 32));
}
