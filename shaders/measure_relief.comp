// As measure.comp, for the sources with a relief, whose reflected light is kept as such. One invocation a source.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 1) readonly buffer Areas { float element_area[]; };
layout(scalar, binding = 2) readonly buffer MesoReflected { Reflected meso_reflected[]; };
// rgb: reflected radiosity shot so far; w: SHOT_EMISSION once the emission has been shot, SHOT_EVENLY where all that was shot has
// gone evenly to all directions.
layout(scalar, binding = 3) readonly buffer Shot { vec4 shot[]; };
// rgb: unshot reflected radiosity; w: unshot power.
layout(scalar, binding = 4) writeonly buffer Unshot { vec4 unshot[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first_source;
    uint source_count;
    uint first_element;
};

// About the share of a relief's light that leaves in other directions than if it left evenly.
const float UNEVEN = 0.1;

void main() {
    if (gl_GlobalInvocationID.x >= source_count) {
        return;
    }
    uint s = first_source + gl_GlobalInvocationID.x;
    Source source = sources[s];
    vec3 emitted = shot[s].w == SHOT_NOTHING ? source.emitted : vec3(0.0);
    vec3 reflected = vec3(0.0);
    float area = 0.0;
    for (uint i = 0; i < source.element_count; i++) {
        uint e = source.first_element + i;
        reflected += element_area[e] * meso_reflected[e - first_element].sum;
        area += element_area[e];
    }
    reflected = reflected / area - shot[s].rgb;
    vec3 total = emitted + abs(reflected) + (shot[s].w == SHOT_EVENLY ? UNEVEN * shot[s].rgb : vec3(0.0));
    unshot[s] = vec4(reflected, source.area * (total.r + total.g + total.b));
}
