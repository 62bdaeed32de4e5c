// Ways through the tree of what casts shadows, for tests and timings of shared/shadow_rays.glsl.
// One invocation a way. src/reference/shadow_rays.rs is the same in f64, without the tree.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/any_lane.glsl"

layout(local_size_x = GROUP) in;

layout(binding = 0) uniform usamplerBuffer shadow_nodes;
layout(binding = 1) uniform usamplerBuffer shadow_triangles;
layout(scalar, binding = 2) readonly buffer Rays { ShadowRay rays[]; };
layout(scalar, binding = 3) writeonly buffer Hits { uint hits[]; };

layout(push_constant, scalar) uniform Parameters {
    uint count;
};

const uint WAYS = 1;
#include "shared/shadow_rays.glsl"

void main() {
    uint item = gl_GlobalInvocationID.x;
    if (item < count) {
        ShadowRay ray = rays[item];
        Ways ways;
        ways.to[0] = ray.to;
        ways.clear[0] = ray.clear;
        ways.open[0] = true;
        follow(ray.from, ways);
        hits[item] = ways.open[0] ? 0 : 1;
    }
}
