// Radiance of a diffuse surface, L = ρ(u, v) · E / π + Le; alpha says whether an exposure meter
// looks at it. E is that of the corners and, with light points, what comes straight from them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/types.glsl"

layout(location = 0) in vec3 corner_irradiance;
layout(location = 1) in vec2 corner_uv;
layout(location = 2) in vec3 corner_share;
layout(location = 3) in vec3 corner_position;
layout(location = 4) flat in uint corner_triangle;

layout(location = 0) out vec4 radiance;

layout(binding = 0) uniform sampler2D albedo;
layout(scalar, binding = 1) readonly buffer LightPoints { LightPoint light_points[]; };
layout(scalar, binding = 2) readonly buffer Nodes { ShadowNode shadow_nodes[]; };
layout(scalar, binding = 3) readonly buffer Triangles { ShadowTriangle shadow_triangles[]; };
// [drawn triangle]
layout(scalar, binding = 4) readonly buffer LitTriangles { LitTriangle lit_triangles[]; };
layout(scalar, binding = 5) readonly buffer Webs { float webs[]; };

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
    vec3 reflectance;
    vec3 emitted;          // Le, W·m⁻²·sr⁻¹
    float metered;
    uint light_count;      // of light_points; those of emitters come first
    uint emitter_points;
};

#include "shared/light_points.glsl"
#include "shared/shadow_rays.glsl"

const float PI = 3.14159265358979;

// How far a corner's tangent plane lies above a place, as a part of its share.
vec3 lift(vec3 at, vec3 corner, vec3 normal, float share) {
    return normal * (share * max(dot(corner - at, normal), 0.0));
}

// E of what comes straight from emitters and point lights.
vec3 straight() {
    LitTriangle t = lit_triangles[corner_triangle];
    vec3 share = corner_share;
    vec3 at = corner_position;
    vec3 normal = normalize(share.x * t.normal_a + share.y * t.normal_b + share.z * t.normal_c);
    // Ways start on the smooth surface (Hanika 2021), or the facets of a round body would show
    // where light grazes.
    vec3 from = at + t.above * t.plane + lift(at, t.a, t.normal_a, share.x) + lift(at, t.b, t.normal_b, share.y)
              + lift(at, t.c, t.normal_c, share.z);
    vec3 sum = vec3(0.0);
    uint samples = light_samples();
    for (uint i = 0; i < samples; i++) {
        LightPoint light = light_of_sample(i);
        vec3 way = light.position - at;
        float square = dot(way, way);
        vec3 towards = way * inversesqrt(square);
        float arrives = arriving(light, towards, dot(normal, towards), square);
        if (arrives > 0.0 && (t.open == 1 || !blocked(from, end_of_way(light), 0.0))) {
            sum += light.strength * arrives;
        }
    }
    return sum;
}

void main() {
    vec3 rho = reflectance * texture(albedo, corner_uv).rgb;
    vec3 irradiance = corner_irradiance;
    if (light_count > 0) {
        irradiance += straight();
    }
    radiance = vec4(rho * irradiance / PI + emitted, metered);
}
