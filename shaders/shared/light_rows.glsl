// Form factors to lights that are no surfaces and are asked for by rays: suns, parts of the sky,
// beams. VECTOR_FLUX: of elements that receive by direction, in their frames. The steps are
// light_survey.comp, which asks a few of the light's places, and light_rows.comp, which asks all of
// them where these do not agree. src/reference/light_rows.rs is the same in f64.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/pieces.glsl"
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/kept.glsl"

#ifdef VECTOR_FLUX
#define FLUX vec3
#else
#define FLUX float
#endif

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// SOURCE_TEXELS a source.
layout(binding = 1) uniform usamplerBuffer sources;
// TRIANGLE_TEXELS an element.
layout(binding = 2) uniform usamplerBuffer triangles;
// SOURCE_EYES a far light: its directions, unit, by even shares of its light.
layout(scalar, binding = 3) readonly buffer Eyes { vec4 eyes[]; };
layout(binding = 4) uniform usamplerBuffer shadow_nodes;
// OCCLUDER_TEXELS an occluder.
layout(binding = 5) uniform usamplerBuffer shadow_occluders;
// Elements that an edge cuts a light for, [slot][list].
layout(scalar, binding = 6) buffer Counts { ReceiverList lists[]; };
// The elements, counted from the first of the dispatch, [slot][list][element].
layout(scalar, binding = 7) buffer Listed { uint listed[]; };
// 1 where any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 8) writeonly buffer Occupied { uint occupied[]; };
// [slot][element of this dispatch]
layout(scalar, binding = 9) writeonly buffer Fresh { FLUX fresh[]; };
// Shares of the intensity of beams by angle, four a texel.
layout(binding = 10) uniform usamplerBuffer webs;
#ifdef VECTOR_FLUX
layout(scalar, binding = 11) readonly buffer MesoElements { MesoElement meso_elements[]; };
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint first_block;
    uint block_count;    // of all elements of a row
    uint first_slot;
    // Elements that are this member's, counted from the first; no form factor is found to others.
    uint own_begin;
    uint own_end;
    // Which of these pieces of a list the dispatch is for; a survey is of all elements.
    uint piece;
    uint pieces;
};

// 1: lights at a finite distance, whose places are the eye alone.
layout(constant_id = 0) const uint BEAMS = 0;

const uint TRIANGLE_TEXELS = 4;
const uint NODE_TEXELS = 2;
const uint OCCLUDER_TEXELS = 4;
// As in shared/receivers.glsl and shared/shadow_packets.glsl.
const float HEIGHT_EPSILON = 1e-6;
const float LEAST_WAY = 1e-18;
const float CLEAR = 2.0 * HEIGHT_EPSILON;
const float HIDDEN = 4.0 * HEIGHT_EPSILON;
const float PI = 3.14159265;

struct Light {
    uint first_eye;
    float size;          // of a far light: its solid angle over π
    vec3 middle;         // of a far light: the mean of its directions; of a beam its place
    vec3 axis;           // of a beam
    vec3 zero;
    vec3 across;
    uint first_share;
    uint columns;
    uint rows;
};

Light load_light(uint source) {
    uint at = SOURCE_TEXELS * source;
    vec4 middle = fetch(sources, at + 6);
    uvec4 ranges = fetch_words(sources, at + 5);
    return Light(ranges.x, fetch(sources, at + 7).x, middle.yzw,
                 fetch(sources, at + 1).xyz, fetch(sources, at + 2).xyz, fetch(sources, at + 3).xyz,
                 ranges.z, ranges.w, floatBitsToUint(fetch(sources, at + 7).w));
}

struct Receiver {
    vec3 a;
    vec3 ab;
    vec3 ac;
    vec3 normal;
};

Receiver load_receiver(uint element) {
    uint at = TRIANGLE_TEXELS * element;
    vec3 a = fetch(triangles, at).xyz;
    return Receiver(a, fetch(triangles, at + 1).xyz - a, fetch(triangles, at + 2).xyz - a,
                    fetch(triangles, at + 3).xyz);
}

// Place i of SOURCE_EYES on an element: the sequence R2, folded into the triangle.
vec3 place_on(Receiver r, uint i) {
    vec2 uv = fract(0.5 + float(i) * vec2(0.7548776662, 0.5698402910));
    uv = uv.x + uv.y > 1.0 ? 1.0 - uv : uv;
    return r.a + uv.x * r.ab + uv.y * r.ac;
}

float share_at(Light light, uint row, uint column) {
    uint at = light.first_share + row * light.columns + column;
    return uintBitsToFloat(fetch_words(webs, at / 4)[at % 4]);
}

// Share of a beam's intensity towards a place, linear in both angles.
float share_of(Light light, vec3 way) {
    vec2 flat_part = vec2(dot(way, light.zero), dot(way, light.across));
    float theta = atan(length(flat_part), dot(way, light.axis)) / PI;
    float turn = atan(flat_part.y, flat_part.x) / (2.0 * PI);
    float row = clamp(theta, 0.0, 1.0) * float(light.rows - 1);
    float column = clamp(turn < 0.0 ? turn + 1.0 : turn, 0.0, 1.0) * float(light.columns - 1);
    uint above = uint(min(floor(row), float(light.rows - 2)));
    uint before = light.columns == 1 ? 0 : uint(min(floor(column), float(light.columns - 2)));
    uint after = min(before + 1, light.columns - 1);
    float left = column - float(before);
    float upper = mix(share_at(light, above, before), share_at(light, above, after), left);
    float lower = mix(share_at(light, above + 1, before), share_at(light, above + 1, after), left);
    return mix(upper, lower, row - float(above));
}

// Way from a place to the light's place i: of a far light a unit vector.
vec3 way_to(Light light, uint i, vec3 p) {
    return BEAMS == 1 ? light.middle - p : eyes[light.first_eye + i].xyz;
}

// What a place receives along a way that nothing blocks: its dot product with the normal is the form
// factor, or for a beam the irradiance of a unit of intensity.
vec3 flux_along(Light light, vec3 way) {
    if (BEAMS == 0) {
        return way * light.size;
    }
    float square = dot(way, way);
    return way * (share_of(light, -way) * inversesqrt(square) / square);
}

FLUX flux_to(uint i, vec3 flux, vec3 normal) {
#ifdef VECTOR_FLUX
    MesoElement meso = meso_elements[i];
    return vec3(dot(meso.tangent, flux), dot(meso.bitangent, flux), dot(normal, flux));
#else
    return dot(normal, flux);
#endif
}

void put(uint slot, uint i, FLUX f) {
#ifdef VECTOR_FLUX
    float strength = f.z > 0.0 ? as_kept(length(f)) : 0.0;
    f = strength > 0.0 ? strength * kept_direction(direction_code(normalize(f))) : vec3(0.0);
    bool lit = strength > 0.0;
#else
    f = as_kept(f);
    bool lit = f > 0.0;
#endif
    fresh[slot * element_count + i] = f;
    if (lit) {
        occupied[slot * block_count + first_block + i / GROUP] = 1;
    }
}

// A triangle as parallel ways meet it. Volumes over its edges along the way w through a place p are
// fixed + p · turned; over an edge of two triangles each finds the other's, negated to the bit: no
// way leads between them.
struct Met {
    vec3 over_a;
    vec3 over_b;
    vec3 over_c;
    float of_a;
    float of_b;
    float of_c;
    vec3 normal;
    float height;
    float rises;        // of the way, above its plane
};

vec3 crossed(vec3 a, vec3 b) {
    precise vec3 over = a.yzx * b.zxy - a.zxy * b.yzx;
    return over;
}

float dotted(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

Met met(uint triangle, vec3 way) {
    uint first = OCCLUDER_TEXELS * triangle;
    uvec4 word_a = fetch_words(shadow_occluders, first);
    uvec4 word_b = fetch_words(shadow_occluders, first + 1);
    uvec4 word_c = fetch_words(shadow_occluders, first + 2);
    uvec4 word_n = fetch_words(shadow_occluders, first + 3);
    precise vec3 a = uintBitsToFloat(word_a.xyz);
    precise vec3 b = uintBitsToFloat(word_b.xyz);
    precise vec3 c = uintBitsToFloat(word_c.xyz);
    precise vec3 w = way;
    vec3 n = uintBitsToFloat(word_n.xyz);
    return Met(crossed(b - c, w), crossed(c - a, w), crossed(a - b, w), dotted(w, crossed(b, c)),
               dotted(w, crossed(c, a)), dotted(w, crossed(a, b)), n, uintBitsToFloat(word_c.w),
               dot(n, way));
}

// Least rise of a way above a plane: less lies in it, and is not hidden by it.
const float LEAST_RISE = 1e-6;

// Whether the triangle stands on the way from p, which ends after its length unless it is_far.
bool stands_in(Met t, vec3 p, bool is_far) {
    precise float of_a = t.of_a + dotted(p, t.over_a);
    precise float of_b = t.of_b + dotted(p, t.over_b);
    precise float of_c = t.of_c + dotted(p, t.over_c);
    float least = min(min(of_a, of_b), of_c);
    float most = max(max(of_a, of_b), of_c);
    float height = dot(t.normal, p) - t.height;
    float end = height + t.rises;
    bool beyond = is_far || (t.rises > 0.0 ? end > 0.0 : end < 0.0);
    bool behind = t.rises > LEAST_RISE ? height < -HIDDEN : t.rises < -LEAST_RISE && height > HIDDEN;
    return behind && beyond && (least >= 0.0 || most <= 0.0) && least != most;
}

// Which of the places p, on elements with these normals, nothing blocks along a way: to infinity, or
// for a beam to its end. All lanes must be active.
void look_along(vec3 way[RAYS], vec3 p[RAYS], vec3 normal[RAYS], inout bool open[RAYS]) {
    vec3 each[RAYS];
    float begin[RAYS];
    const float end = BEAMS == 1 ? 1.0 : 1e30;
    for (uint r = 0; r < RAYS; r++) {
        vec3 sides = mix(vec3(1.0), vec3(-1.0), lessThan(way[r], vec3(0.0)));
        each[r] = sides / max(abs(way[r]), vec3(LEAST_WAY));
        // The walk leaves out the beginning of the way, within reach of the boxes of what lies in
        // the plane that it begins on.
        begin[r] = min(CLEAR / max(dot(way[r], normal[r]), CLEAR), 0.5);
    }
    uint count = fetch_words(shadow_nodes, 0).w;
    uint at = 0;
    while (at < count) {
        // On to the next leaf that a ray enters, in a loop of its own: a software device works
        // through what a branch leaves out. A ray is asked of no triangle whose box it misses: what
        // it meets is the same in any company.
        bool enters[RAYS];
        uint leaf = 0;
        do {
            uvec4 low_word = fetch_words(shadow_nodes, NODE_TEXELS * at);
            uvec4 high_word = fetch_words(shadow_nodes, NODE_TEXELS * at + 1);
            vec3 low = uintBitsToFloat(low_word.xyz);
            vec3 high = uintBitsToFloat(high_word.xyz);
            bool any_enters = false;
            for (uint r = 0; r < RAYS; r++) {
                vec3 one = (low - p[r]) * each[r];
                vec3 other = (high - p[r]) * each[r];
                vec3 in_at = min(one, other);
                vec3 out_at = max(one, other);
                float enter = max(max(in_at.x, in_at.y), max(in_at.z, begin[r]));
                float leave = min(min(out_at.x, out_at.y), min(out_at.z, end));
                enters[r] = open[r] && enter <= leave;
                any_enters = any_enters || enters[r];
            }
            bool entered = subgroupBallot(any_enters) != uvec4(0);
            leaf = entered ? high_word.w : 0;
            at = entered ? at + 1 : low_word.w;
        } while (leaf == 0 && at < count);
        uint first = leaf / LEAF_TRIANGLES;
        for (uint i = first; i < first + leaf % LEAF_TRIANGLES; i++) {
#ifdef ONE_WAY
            Met t = met(i, way[0]);
#endif
            for (uint r = 0; r < RAYS; r++) {
#ifndef ONE_WAY
                Met t = met(i, way[r]);
#endif
                open[r] = open[r] && !(enters[r] && stands_in(t, p[r], BEAMS == 0));
            }
        }
    }
}
