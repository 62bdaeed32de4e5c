// Counts the fragments of prisms and the steps of their marches: each computes its own depth, so
// that none is left out, hidden or not; the pipeline adds them up.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/any_lane.glsl"

layout(location = 0) out vec4 counts;

layout(binding = 0) uniform usamplerBuffer prisms;
layout(binding = 1) uniform usamplerBuffer surfaces;
layout(binding = 2) uniform usamplerBuffer tiles;
layout(binding = 3) uniform usamplerBuffer pyramid;

layout(constant_id = 0) const uint SHADING = SHADING_RELIEF;

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
    float pixel;         // angle of a sample
};

uint march_steps = 0;
#define ALL_STEPS march_steps
// See shared/height_march.glsl; rays of the eye may be long.
const uint LEVELS = 1;
#include "shared/height_march.glsl"
#include "shared/prisms.glsl"
#include "shared/relief_hit.glsl"

void main() {
    float depth;
    hit_of_ray(pixel, depth);
    counts = vec4(1.0, float(march_steps), 0.0, 0.0);
}
