// The paper's equation (2): irradiance of element j from source i is B_i F_ij A_i / A_j. One invocation an element, which
// also clears its sums for the next batch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) buffer FormFactors { uint64_t form_factors[]; };
layout(scalar, binding = 3) readonly buffer Areas { float element_area[]; };
layout(scalar, binding = 4) buffer Direct { vec3 direct[]; };
layout(scalar, binding = 5) buffer DirectError { vec3 direct_error[]; };
layout(scalar, binding = 6) buffer Indirect { vec3 indirect[]; };
layout(scalar, binding = 7) buffer IndirectError { vec3 indirect_error[]; };

layout(push_constant, scalar) uniform Parameters {
    uint element_count;
    uint slot_count;
};

#include "shared/accumulate.glsl"

void main() {
    uint e = gl_GlobalInvocationID.x;
    if (e >= element_count) {
        return;
    }
    vec3 add_direct = vec3(0.0);
    vec3 add_indirect = vec3(0.0);
    for (uint slot = 0; slot < slot_count; slot++) {
        Slot shot = slots[slot];
        if (shot.source == NONE) {
            break;
        }
        uint64_t sum = form_factors[slot * element_count + e];
        if (sum == 0) {
            continue;
        }
        form_factors[slot * element_count + e] = 0;
        Source s = sources[shot.source];
        float form_factor = float(sum) / float(uint64_t(1) << FIXED_POINT_BITS);
        // A point light sends intensity · solid angle; the table holds shares of 2π.
        float power = s.kind == KIND_POINT ? 6.28318531 : s.area;
        float weight = form_factor * power / element_area[e];
        add_direct += weight * shot.emitted;
        add_indirect += weight * shot.reflected;
    }
    accumulate(direct[e], direct_error[e], add_direct);
    accumulate(indirect[e], indirect_error[e], add_indirect);
}
