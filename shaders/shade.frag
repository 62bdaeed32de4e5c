// Radiance of a diffuse surface, L = ρ(u, v) · E / π + Le; alpha says whether an exposure meter
// looks at it. E is that of the corners and, with light points, what comes straight from them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/any_lane.glsl"

layout(location = 0) in vec3 corner_irradiance;
layout(location = 1) in vec2 corner_uv;
layout(location = 2) in vec3 corner_share;
layout(location = 3) in vec3 corner_position;
layout(location = 4) flat in uint corner_triangle;

layout(location = 0) out vec4 radiance;

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform usamplerBuffer light_points;
layout(binding = 2) uniform usamplerBuffer shadow_nodes;
layout(binding = 3) uniform usamplerBuffer shadow_triangles;
// [drawn triangle]
layout(binding = 4) uniform usamplerBuffer lit_triangles;
layout(scalar, binding = 5) readonly buffer Webs { float webs[]; };
layout(binding = 6) uniform usamplerBuffer light_polygons;
// States of parts of triangles, STATES_IN_TEXEL a texel: [row along c][column along b][2]
layout(binding = 7) uniform usamplerBuffer part_states;

// LIT_…: how light points light the draw. What a draw cannot need is left out of its pipeline: a
// software device works through every branch.
layout(constant_id = 0) const uint LIT = LIT_IN_PARTS;
// Whether point lights have beams.
layout(constant_id = 1) const uint BEAMS = 1;
// Ways to lights that are followed together.
layout(constant_id = 2) const uint WAYS = 4;
// Whether points light what is open: without point lights, and emitters in closed form, none does.
layout(constant_id = 3) const uint POINTS = 1;

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
    uint polygon_count;    // 0: emitters shine by their points alone
    uvec2 corner;          // the tile's top left sample
};

#include "shared/light_points.glsl"
#include "shared/light_polygons.glsl"
#include "shared/shadow_rays.glsl"

const float PI = 3.14159265358979;

// How far a corner's tangent plane lies above a place, as a part of its share.
vec3 lift(vec3 at, vec3 corner, vec3 normal, float share) {
    return normal * (share * max(dot(corner - at, normal), 0.0));
}

// Texels of struct LitTriangle.
const uint LIT_TEXELS = 7;
const uint STATES_IN_TEXEL = 64;

LitTriangle load_lit(uint triangle) {
    uint first = LIT_TEXELS * triangle;
    vec4 a = fetch(lit_triangles, first);
    uvec4 b = fetch_words(lit_triangles, first + 1);
    LitTriangle t;
    t.a = a.xyz;
    t.above = a.w;
    t.b = uintBitsToFloat(b.xyz);
    t.level = b.w;
    uvec4 c = fetch_words(lit_triangles, first + 2);
    t.c = uintBitsToFloat(c.xyz);
    t.first_part = c.w;
    t.normal_a = fetch(lit_triangles, first + 3).xyz;
    t.normal_b = fetch(lit_triangles, first + 4).xyz;
    t.normal_c = fetch(lit_triangles, first + 5).xyz;
    t.plane = fetch(lit_triangles, first + 6).xyz;
    return t;
}

// PART_... of the part of a triangle that a place is in.
uint state_at(LitTriangle t, vec3 share) {
    uint side = 1u << t.level;
    vec2 place = share.yz * float(side);
    uvec2 at = min(uvec2(max(place, vec2(0.0))), uvec2(side - 1));
    vec2 within = place - vec2(at);
    uint upper = within.x + within.y > 1.0 ? 1 : 0;
    uint part = t.first_part + 2 * (at.y * side + at.x) + upper;
    uvec4 words = fetch_words(part_states, part / STATES_IN_TEXEL);
    uint state = words[part / 16 % 4] >> 2 * (part % 16) & 3u;
    return t.level == 0 ? t.first_part : state;
}

// E of what comes straight from emitters and point lights.
vec3 straight() {
    LitTriangle t = load_lit(corner_triangle);
    vec3 share = corner_share;
    vec3 at = corner_position;
    vec3 normal = normalize(share.x * t.normal_a + share.y * t.normal_b + share.z * t.normal_c);
    // Ways start on the smooth surface (Hanika 2021), or the facets of a round body would show
    // where light grazes.
    vec3 from = at + t.above * t.plane + lift(at, t.a, t.normal_a, share.x) + lift(at, t.b, t.normal_b, share.y)
              + lift(at, t.c, t.normal_c, share.z);
    uint state = LIT == LIT_OPEN ? PART_OPEN : state_at(t, share);
    // By points, if not in closed form: polygon_count is 0 then.
    vec3 exact = unshadowed(at, normal);
    bool dark = polygon_count > 0 && exact == vec3(0.0);
    vec3 seen = vec3(0.0);      // of the points of emitters
    vec3 of_all = vec3(0.0);
    vec3 points = vec3(0.0);    // of point lights
    uint emitters = emitter_samples();
    uint samples = light_samples();
    if (LIT == LIT_OPEN && POINTS == 0) {
        return exact;
    }
    if (samples == 0) {
        return state == PART_HIDDEN ? vec3(0.0) : exact;
    }
    // Points of emitters are asked only where they may be hidden in part, and none where all are.
    bool by_points = polygon_count == 0 || state == PART_UNSURE && !dark;
    uint end = state == PART_HIDDEN ? 0 : samples;
    uint first = by_points ? 0 : emitters;
    do {
        Ways ways;
        vec3 whole[WAYS];
        for (uint i = 0; i < WAYS; i++) {
            LightPoint light = light_of_sample(min(first + i, samples - 1));
            vec3 way = light.position - at;
            float square = dot(way, way);
            vec3 towards = way * inversesqrt(square);
            float arrives = arriving(light, towards, dot(normal, towards), square);
            ways.open[i] = first + i < end && arrives > 0.0;
            whole[i] = ways.open[i] ? light.strength * arrives : vec3(0.0);
            ways.to[i] = end_of_way(light);
            ways.clear[i] = 0.0;
        }
        if (state != PART_OPEN) {
            follow(from, ways);
        }
        for (uint i = 0; i < WAYS; i++) {
            vec3 arrived = ways.open[i] ? whole[i] : vec3(0.0);
            bool of_emitter = first + i < emitters;
            of_all += of_emitter ? whole[i] : vec3(0.0);
            seen += of_emitter ? arrived : vec3(0.0);
            points += of_emitter ? vec3(0.0) : arrived;
        }
        first += WAYS;
    } while (any_lane(first < end));
    if (polygon_count > 0) {
        float lit = state == PART_HIDDEN ? 0.0 : 1.0;
        seen = state == PART_OPEN || dark ? exact : lit * shadowed(exact, seen, of_all);
    }
    return seen + points;
}

void main() {
    vec3 rho = reflectance * texture(albedo, corner_uv).rgb;
    vec3 irradiance = corner_irradiance;
    if (LIT != LIT_NOT) {
        irradiance += straight();
    }
    radiance = vec4(rho * irradiance / PI + emitted, metered);
}
