// Form factors of near elements, which are found on the host: those of one slot's source, one an
// invocation. VECTOR_FLUX: of elements with a relief, as vectors.

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

// Which of the factors is this invocation's; NONE past the last one.
uint own_factor(uint slot) {
    uint source = slots[slot].source;
    if (source == NONE) {
        return NONE;
    }
    uint at = starts[source] + gl_GlobalInvocationID.x;
    return at < starts[source + 1] ? at : NONE;
}
