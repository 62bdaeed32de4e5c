// As measure.comp, for the sources with a relief, whose elements keep their reflected light by
// direction of arrival. One invocation a source.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 1) readonly buffer Areas { float element_area[]; };
layout(scalar, binding = 2) readonly buffer MesoReflected { Reflected meso_reflected[]; };
// Radiosity, [source].
layout(scalar, binding = 3) writeonly buffer SourceReflected { vec3 source_reflected[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first_source;
    uint source_count;
    uint first_element;
};

void main() {
    if (gl_GlobalInvocationID.x >= source_count) {
        return;
    }
    uint s = first_source + gl_GlobalInvocationID.x;
    Source source = sources[s];
    vec3 reflected = vec3(0.0);
    float area = 0.0;
    for (uint i = 0; i < source.element_count; i++) {
        uint e = source.first_element + i;
        reflected += element_area[e] * meso_reflected[e - first_element].sum;
        area += element_area[e];
    }
    source_reflected[s] = reflected / area;
}
