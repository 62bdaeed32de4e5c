// Relief mapping, first what is seen: the ray through the sample is followed through the prism over
// a triangle to where it first passes below the height map. The nearest hit of all prisms stays.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/any_lane.glsl"

layout(location = 0) out uvec4 hit;

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

// See shared/height_march.glsl; rays of the eye may be long.
const uint LEVELS = 1;
#include "shared/height_march.glsl"
#include "shared/prisms.glsl"
#include "shared/relief_hit.glsl"

void main() {
    float depth;
    hit = hit_of_ray(pixel, depth);
    // Nothing lies at the depth of 0, so that a miss is drawn nowhere.
    gl_FragDepth = depth;
}
