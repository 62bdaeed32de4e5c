// Unshot power of every source: what its elements send out by now less what it has shot. One invocation a source.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 1) readonly buffer Reflectances { vec3 reflectance[]; };
layout(scalar, binding = 2) readonly buffer Areas { float element_area[]; };
layout(scalar, binding = 3) readonly buffer Direct { vec3 direct[]; };
layout(scalar, binding = 4) readonly buffer Indirect { vec3 indirect[]; };
// rgb: reflected radiosity shot so far; w: 1 once the emission has been shot.
layout(scalar, binding = 5) readonly buffer Shot { vec4 shot[]; };
// rgb: unshot reflected radiosity; w: unshot power.
layout(scalar, binding = 6) writeonly buffer Unshot { vec4 unshot[]; };

layout(push_constant, scalar) uniform Parameters {
    uint source_count;
};

void main() {
    uint s = gl_GlobalInvocationID.x;
    if (s >= source_count) {
        return;
    }
    Source source = sources[s];
    bool emission_left = shot[s].w == SHOT_NOTHING;
    vec3 emitted = emission_left ? source.emitted : vec3(0.0);
    if (source.kind == KIND_POINT) {
        // Half of the sphere of directions, 2π sr.
        unshot[s] = vec4(vec3(0.0), 6.28318531 * (emitted.r + emitted.g + emitted.b));
        return;
    }
    vec3 reflected = vec3(0.0);
    float area = 0.0;
    for (uint i = 0; i < source.element_count; i++) {
        uint e = source.first_element + i;
        reflected += element_area[e] * reflectance[e] * (direct[e] + indirect[e]);
        area += element_area[e];
    }
    // Less than 0 where the source has shot too much: by rounding, or since it took in a correction.
    reflected = reflected / area - shot[s].rgb;
    vec3 total = emitted + abs(reflected);
    unshot[s] = vec4(reflected, source.area * (total.r + total.g + total.b));
}
