// The paper's equation (2) as a row: the pixels' sum F_ij of bin_pixels.comp times A_i / A_j is the
// form factor from element j to source i. One invocation an element and slot, which also clears the
// sum for the next batch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "shared/types.glsl"
#include "shared/kept.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) buffer Sums { uint64_t sums[]; };
layout(scalar, binding = 3) readonly buffer Areas { float element_area[]; };
// [slot][element]
layout(scalar, binding = 4) writeonly buffer Fresh { float fresh[]; };
// 1 where any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 5) writeonly buffer Occupied { uint occupied[]; };

layout(push_constant, scalar) uniform Parameters {
    uint element_count;
    uint block_count;
};

void main() {
    uint e = gl_GlobalInvocationID.x;
    uint slot = gl_WorkGroupID.y;
    if (e >= element_count || slots[slot].source == NONE) {
        return;
    }
    uint at = slot * element_count + e;
    uint64_t sum = sums[at];
    sums[at] = 0;
    Source s = sources[slots[slot].source];
    float form_factor = float(sum) / float(uint64_t(1) << FIXED_POINT_BITS);
    // A point light sends intensity · solid angle; the table holds shares of 2π.
    float power = s.kind == KIND_POINT ? 6.28318531 : s.area;
    float f = as_kept(form_factor * power / element_area[e]);
    fresh[at] = f;
    if (f > 0.0) {
        occupied[slot * block_count + e / GROUP] = 1;
    }
}
