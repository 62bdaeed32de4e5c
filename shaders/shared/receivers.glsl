// A receiving element and a source: what both steps of the receiver estimator know of them.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/hemicube.glsl"
#include "shared/texels.glsl"
#include "shared/pieces.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// SOURCE_TEXELS a source.
layout(binding = 1) uniform usamplerBuffer sources;
// xyz: unit normal n; w: n · x on the plane.
layout(binding = 2) uniform usamplerBuffer planes;
// xyz: centroid; w: radius of the ball about it that holds the element.
layout(binding = 3) uniform usamplerBuffer balls;
// How many elements each list holds, [slot][kind].
layout(scalar, binding = 4) buffer Counts { ReceiverList lists[]; };
// The elements, counted from the first of the dispatch, [slot][kind][element].
layout(scalar, binding = 5) buffer Listed { uint listed[]; };
#ifdef ITEM_BUFFER
layout(binding = 6) uniform usampler2D items;
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint face_size;
    uint first_slot;     // of the fresh ones
    uint end_slot;
    uint first_block;
    uint block_count;    // of all elements of a row
    // Elements that are this member's, counted from the first; no form factor is found to others.
    uint own_begin;
    uint own_end;
    // Which of these pieces of a list the dispatch is for; sorting is of all elements.
    uint piece;
    uint pieces;
};

// Whether an element of the dispatch is this member's.
bool is_own(uint i) {
    return i >= own_begin && i < own_end;
}

// How many of the elements from `begin` to `end` are.
uint own_between(uint begin, uint end) {
    uint last = min(end, own_end);
    return last - min(max(begin, own_begin), last);
}

// Rounding of a plane's height at a point: a few steps of f32 at coordinates up to 1.
const float HEIGHT_EPSILON = 1e-6;
// How many pixels' footprints two points of one surface may lie apart and still be taken for one
// another.
const float REACH = 1.5;

// Cosine of the angle from which on two surfaces are not level: 8°, at which less than 1/200 of a
// fold's light comes from its other side.
const float LEVEL = 0.99;

// Where a source lies this many squared radii off, no edge of it is seen under more than a right
// angle.
const float ACUTE = 2.1;
// A source or a part of one is a point from so many of its radii off. The error of a square is then
// 2/3 of the square of that at most: 0.07 % for flat sources; 0.26 % for curved ones, of which each
// has another sign.
const float FLAT_POINT_DISTANCE = 32.0;
const float POINT_DISTANCE = 16.0;
// A part of a curved source that is partly turned away, or whose ball an element lies in. The rms of
// tests/furnace.rs, where all emit, is 0.102 %; at 7 it is 0.117 %, at 5 0.137 %.
const float PART_POINT_DISTANCE = 9.0;
// Step of the share of a source that a listed element sees.
const float SHARE_STEP = 1.0 / float(1 << SHARE_BITS);
// An element no further than so many of its radii from a source (see gap_to) takes several samples.
const float NEAR = 4.0;

// A place on a source.
struct Eye {
    vec3 at;
    vec3 normal;    // about; 0 on plane sources
};

Eye load_eye(vec4 eye) {
    return Eye(eye.xyz, unpackSnorm4x8(floatBitsToUint(eye.w)).xyz);
}

#ifdef SHADOW_OCCLUDERS
#include "shared/shadow_packets.glsl"
#endif

#ifdef ITEM_BUFFER
// What an item buffer says of a place.
const uint HIDDEN_FROM = 0;
const uint SEEN = 1;
const uint DOUBTFUL = 2;

// Sine of the angle up to which two surfaces that meet pass for one smooth surface, which does not
// hide itself a pixel aside. What meets at a sharper edge may hide one from the other.
const float SMOOTH = 0.35;

// Whether p, on a surface with normal n, is seen from the source's eye where a pixel shows an item.
uint leaves_open(uint item, ivec2 pixel, vec3 p, vec3 n, Source s) {
    vec4 plane = fetch(planes, item == NONE ? 0 : item);
    float eye_height = dot(plane.xyz, s.eye) - plane.w;
    float height = dot(plane.xyz, p) - plane.w;
    float depth = eye_height >= 0.0 ? -height : height;
    if (depth <= HEIGHT_EPSILON) {
        return SEEN;
    }
    // The item's plane lies in front of p. It is still the same surface, seen a pixel aside, where
    // the two planes' angle and the distance between the points explain the height.
    vec3 d = p - s.eye;
    vec3 ray = hemicube_direction(pixel, face_size);
    vec3 world = ray.x * s.tangent + ray.y * s.bitangent + ray.z * s.normal;
    float along = -eye_height / dot(plane.xyz, world);
    vec3 seen = s.eye + along * world;
    float distance_p = length(d);
    float apart = length(p - seen);
    float grazing = min(abs(dot(n, d)), abs(dot(plane.xyz, d))) / distance_p;
    float footprint = distance_p * 2.0 / float(face_size) / max(grazing, 0.05);
    // The item is farther off than p by more than the pixel explains: of two parallel sheets with a
    // thin gap between them, the near one is seen beyond p in half of the pixels.
    if (dot(seen - s.eye, d) > distance_p * (distance_p + REACH * footprint)) {
        return SEEN;
    }
    float sine = length(cross(n, plane.xyz));
    bool open = apart <= REACH * footprint && depth <= apart * sine + HEIGHT_EPSILON;
    return !open ? HIDDEN_FROM : sine <= SMOOTH ? SEEN : DOUBTFUL;
}

// Whether a place is seen from the source's eye, by its pixel alone.
bool shown(vec3 p, vec3 n, uint slot, Source s) {
    vec3 d = p - s.eye;
    vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal));
    ivec2 pixel = hemicube_pixel(hemicube_texel(local, face_size), face_size);
    uint item = texelFetch(items, ivec2(slot * face_size, 0) + pixel, 0).r;
    return item == NONE || leaves_open(item, pixel, p, n, s) != HIDDEN_FROM;
}

// What the four pixels about p show: it is doubtful where they do not agree. The answer of a lane
// is the same in any company. `share`: of the pixels that show it.
uint sight_of(
    vec3 p,
    vec3 n,
    uint element,
    uint slot,
    Source s,
    bool asks,
    out float share
) {
    vec3 d = p - s.eye;
    vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal));
    ivec2 first = hemicube_corner(hemicube_texel(local, face_size), face_size);
    vec2 between = vec2(first + ivec2(slot * face_size + 1, 1)) / vec2(textureSize(items, 0));
    uvec4 item = textureGather(items, between);
    ivec2 pixel[4] = ivec2[](first + ivec2(0, 1), first + 1, first + ivec2(1, 0), first);
    bool same = item.yzw == item.xxx;
    // In front of what they all show, p is open whatever the pixel.
    vec4 plane = fetch(planes, item[0] == NONE ? 0 : item[0]);
    float height = dot(plane.xyz, p) - plane.w;
    bool before = (dot(plane.xyz, s.eye) >= plane.w ? -height : height) <= HEIGHT_EPSILON;
    bool certain = same && (item[0] == NONE || item[0] == element || before);
    uint open = asks && certain ? 1 : 0;
    uint looked = open;
    bool doubtful = false;
    for (uint k = 0; k < 4; k++) {
        bool looks = asks && !certain;
        // A software device works through what any lane needs.
        if (subgroupBallot(looks) != uvec4(0)) {
            bool own_item = item[k] == NONE || item[k] == element;
            uint says = own_item ? SEEN : leaves_open(item[k], pixel[k], p, n, s);
            open += looks && says != HIDDEN_FROM ? 1 : 0;
            doubtful = doubtful || looks && says == DOUBTFUL;
            looked += looks ? 1 : 0;
        }
    }
    share = float(open) / float(max(looked, 1));
    return open == 0 ? HIDDEN_FROM : open == looked && !doubtful ? SEEN : DOUBTFUL;
}
#endif

Source load_source(uint index) {
    vec4 word[SOURCE_TEXELS];
    for (uint i = 0; i < SOURCE_TEXELS; i++) {
        word[i] = fetch(sources, SOURCE_TEXELS * index + i);
    }
    uvec4 ranges = floatBitsToUint(word[5]);
    uvec2 parts = floatBitsToUint(word[7].zw);
    return Source(word[0].xyz, word[0].w, word[1].xyz, word[1].w, word[2].xyz, word[2].w,
                  word[3].xyz, word[3].w, word[4].xyz, floatBitsToUint(word[4].w), ranges.x,
                  ranges.y, ranges.z, ranges.w, floatBitsToUint(word[6].x), word[6].yzw, word[7].x,
                  word[7].y, parts.x, parts.y);
}

// The least distance at which a place may lie from a source: from its ball, and of a plane one from
// its plane.
float gap_to(Source s, vec3 p) {
    vec3 d = p - s.middle;
    float height = s.kind != KIND_POINT && s.cone_sin == 0.0 ? abs(dot(d, s.normal)) : 0.0;
    return max(length(d) - s.radius, height);
}

// Whether every member shows p its front: the cone of normals and the ball bound their heights.
bool shows_whole_front(Source s, vec3 p) {
    vec3 d = p - s.middle;
    float height = dot(d, s.normal);
    float flat_part = sqrt(max(dot(d, d) - height * height, 0.0));
    return s.cone_sin == 0.0 || height * s.cone_cos - flat_part * s.cone_sin - s.radius > 0.0;
}

// Whether p, on a surface with normal n, lies in the plane of a plane source with which it is
// level: of the source it sees nothing that rounding does not make up.
bool lies_in_plane(Source s, vec3 p, vec3 n) {
    bool level = abs(dot(n, s.normal)) >= LEVEL;
    return s.kind != KIND_POINT && s.cone_sin == 0.0 && level && dot(p - s.middle, s.normal) <= HEIGHT_EPSILON;
}

// Whether a source can show its front at p.
bool shows_front(Source s, vec3 p) {
    vec3 d = p - s.middle;
    float height = dot(d, s.normal);
    if (s.kind == KIND_POINT) {
        // Each of the two sources of a point light serves its own side; the upper one has the plane
        // between them.
        return s.cone_sin == 0.0 ? height >= 0.0 : height > 0.0;
    }
    if (s.cone_sin == 0.0) {
        return height > HEIGHT_EPSILON * s.radius;
    }
    float flat_part = sqrt(max(dot(d, d) - height * height, 0.0));
    return height * s.cone_cos + flat_part * s.cone_sin + s.radius > 0.0;
}
