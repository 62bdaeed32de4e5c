// What every source reflects by now: the mean by weights over its members of reflectance times
// irradiance. One invocation a source.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 1) readonly buffer Reflectances { vec3 reflectance[]; };
layout(scalar, binding = 2) readonly buffer Weights { float weights[]; };
layout(scalar, binding = 3) readonly buffer Direct { vec3 direct[]; };
layout(scalar, binding = 4) readonly buffer Indirect { vec3 indirect[]; };
// Radiosity, [source].
layout(scalar, binding = 5) writeonly buffer SourceReflected { vec3 source_reflected[]; };

layout(push_constant, scalar) uniform Parameters {
    uint source_count;
};

void main() {
    uint s = gl_GlobalInvocationID.x;
    if (s >= source_count) {
        return;
    }
    Source source = sources[s];
    vec3 reflected = vec3(0.0);
    float area = 0.0;
    for (uint i = 0; i < source.element_count; i++) {
        uint e = source.first_element + i;
        reflected += weights[e] * reflectance[e] * (direct[e] + indirect[e]);
        area += weights[e];
    }
    // A point light has no members.
    source_reflected[s] = area > 0.0 ? reflected / area : vec3(0.0);
}
