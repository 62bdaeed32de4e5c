// Whether a triangle stands on a straight way: a walk through the tree of
// src/passes/shadow_rays.rs. Nodes stand in depth-first order, and each knows the one to go on with
// if its box is missed: no stack, however deep the tree. Including files have
// shared/types.glsl, shared/texels.glsl, and `usamplerBuffer`s shadow_nodes and shadow_triangles.

// Components of a way below this count as this, so that their reciprocals are finite: boxes are
// padded by far more.
const float LEAST_WAY = 1e-18;
// Texels of struct ShadowNode and of struct ShadowTriangle.
const uint NODE_TEXELS = 2;
const uint CASTER_TEXELS = 3;

// The share of the way where it meets the triangle's plane within the triangle, or -1. Two
// triangles find the same volume over the edge that they share with the opposite sign, to the bit:
// no way leads between them.
float meets(vec3 corner_a, vec3 corner_b, vec3 corner_c, vec3 from, vec3 way) {
    precise vec3 a = corner_a - from;
    precise vec3 b = corner_b - from;
    precise vec3 c = corner_c - from;
    precise vec3 over_a = b.yzx * c.zxy - b.zxy * c.yzx;
    precise vec3 over_b = c.yzx * a.zxy - c.zxy * a.yzx;
    precise vec3 over_c = a.yzx * b.zxy - a.zxy * b.yzx;
    precise float of_a = way.x * over_a.x + way.y * over_a.y + way.z * over_a.z;
    precise float of_b = way.x * over_b.x + way.y * over_b.y + way.z * over_b.z;
    precise float of_c = way.x * over_c.x + way.y * over_c.y + way.z * over_c.z;
    float least = min(min(of_a, of_b), of_c);
    float most = max(max(of_a, of_b), of_c);
    float whole = of_a + of_b + of_c;
    if (least < 0.0 && most > 0.0 || whole == 0.0) {
        return -1.0;
    }
    vec3 place = (of_a * a + of_b * b + of_c * c) / whole;
    return dot(place, way) / dot(way, way);
}

// Triangles with a relief are passed over up to the share `clear` of the way.
bool blocked(vec3 from, vec3 to, float clear) {
    vec3 way = to - from;
    vec3 sides = mix(vec3(1.0), vec3(-1.0), lessThan(way, vec3(0.0)));
    vec3 each = sides / max(abs(way), vec3(LEAST_WAY));
    // Without casters the only texel is 0.
    uint count = fetch_words(shadow_nodes, 0).w;
    uint at = 0;
    while (at < count) {
        uvec4 low = fetch_words(shadow_nodes, NODE_TEXELS * at);
        uvec4 high = fetch_words(shadow_nodes, NODE_TEXELS * at + 1);
        vec3 one = (uintBitsToFloat(low.xyz) - from) * each;
        vec3 other = (uintBitsToFloat(high.xyz) - from) * each;
        vec3 in_at = min(one, other);
        vec3 out_at = max(one, other);
        float enter = max(max(in_at.x, in_at.y), max(in_at.z, 0.0));
        float leave = min(min(out_at.x, out_at.y), min(out_at.z, 1.0));
        if (enter > leave) {
            at = low.w;
            continue;
        }
        uint first = high.w / LEAF_TRIANGLES;
        for (uint i = first; i < first + high.w % LEAF_TRIANGLES; i++) {
            uvec4 a = fetch_words(shadow_triangles, CASTER_TEXELS * i);
            vec3 b = fetch(shadow_triangles, CASTER_TEXELS * i + 1).xyz;
            vec3 c = fetch(shadow_triangles, CASTER_TEXELS * i + 2).xyz;
            float share = meets(uintBitsToFloat(a.xyz), b, c, from, way);
            if (share > (a.w == 1 ? clear : 0.0) && share < 1.0) {
                return true;
            }
        }
        at++;
    }
    return false;
}
