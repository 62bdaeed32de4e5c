// Whether a triangle stands on a straight way: a walk through the tree of
// src/passes/shadow_rays.rs. Nodes stand in depth-first order, and each knows the one to go on with
// if its box is missed: no stack, however deep the tree. Including files have
// shared/types.glsl, shared/texels.glsl, `usamplerBuffer`s shadow_nodes and shadow_triangles, and
// WAYS, how many ways are followed together, and shared/any_lane.glsl.

// Components of a way below this count as this, so that their reciprocals are finite: boxes are
// padded by far more.
const float LEAST_WAY = 1e-18;
// Texels of struct ShadowNode and of struct ShadowTriangle.
const uint NODE_TEXELS = 2;
const uint CASTER_TEXELS = 3;

// Ways that are followed together, so that what they look at is loaded once.
struct Ways {
    vec3 to[WAYS];
    float clear[WAYS];    // triangles with a relief are passed over up to this share of the way
    bool open[WAYS];      // those that are to be followed; then, those that nothing stands on
};

// A triangle as it stands about the start of ways.
struct Caster {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 over_a;          // volumes over its edges, before they meet a way
    vec3 over_b;
    vec3 over_c;
    bool relief;
};

Caster caster_at(uint triangle, vec3 from) {
    uint first = CASTER_TEXELS * triangle;
    uvec4 word_a = fetch_words(shadow_triangles, first);
    precise vec3 a = uintBitsToFloat(word_a.xyz) - from;
    precise vec3 b = fetch(shadow_triangles, first + 1).xyz - from;
    precise vec3 c = fetch(shadow_triangles, first + 2).xyz - from;
    precise vec3 over_a = b.yzx * c.zxy - b.zxy * c.yzx;
    precise vec3 over_b = c.yzx * a.zxy - c.zxy * a.yzx;
    precise vec3 over_c = a.yzx * b.zxy - a.zxy * b.yzx;
    return Caster(a, b, c, over_a, over_b, over_c, word_a.w == 1);
}

// Whether a way meets the triangle, past the share `clear` of it where the triangle has a relief.
// Two triangles find the same volume over the edge that they share with the opposite sign, to the
// bit: no way leads between them.
bool stands_on(Caster t, vec3 way, float clear) {
    precise float of_a = way.x * t.over_a.x + way.y * t.over_a.y + way.z * t.over_a.z;
    precise float of_b = way.x * t.over_b.x + way.y * t.over_b.y + way.z * t.over_b.z;
    precise float of_c = way.x * t.over_c.x + way.y * t.over_c.y + way.z * t.over_c.z;
    float least = min(min(of_a, of_b), of_c);
    float most = max(max(of_a, of_b), of_c);
    float whole = of_a + of_b + of_c;
    vec3 place = of_a * t.a + of_b * t.b + of_c * t.c;
    // Its share of the way is along / all.
    float along = whole < 0.0 ? -dot(place, way) : dot(place, way);
    float all = abs(whole) * dot(way, way);
    bool within = least >= 0.0 || most <= 0.0;
    return within && along > (t.relief ? clear * all : 0.0) && along < all;
}

// Follows ways from a place. A way is asked of no triangle whose box it misses: what it meets is
// the same in any company.
void follow(vec3 from, inout Ways ways) {
    vec3 way[WAYS];
    vec3 each[WAYS];
    bool any_open = false;
    for (uint i = 0; i < WAYS; i++) {
        way[i] = ways.to[i] - from;
        vec3 sides = mix(vec3(1.0), vec3(-1.0), lessThan(way[i], vec3(0.0)));
        each[i] = sides / max(abs(way[i]), vec3(LEAST_WAY));
        any_open = any_open || ways.open[i];
    }
    // Without casters the only texel is 0.
    uint count = any_open ? fetch_words(shadow_nodes, 0).w : 0;
    uint at = 0;
    do {
        // On to the next leaf that a way enters, in a loop of its own: a software device works
        // through what a branch leaves out. The condition stands before the loop: lanes that are
        // done lose what they have found if others go on to a condition behind it (Mesa 22.3).
        bool enters[WAYS];
        for (uint i = 0; i < WAYS; i++) {
            enters[i] = false;
        }
        uint leaf = 0;
        while (leaf == 0 && at < count) {
            uvec4 low = fetch_words(shadow_nodes, NODE_TEXELS * at);
            uvec4 high = fetch_words(shadow_nodes, NODE_TEXELS * at + 1);
            vec3 low_from = uintBitsToFloat(low.xyz) - from;
            vec3 high_from = uintBitsToFloat(high.xyz) - from;
            bool entered = false;
            // Of triangles with a relief alone, nothing is met before the ways are clear of theirs.
            bool relief = high.w >= RELIEF_NODE;
            for (uint i = 0; i < WAYS; i++) {
                vec3 one = low_from * each[i];
                vec3 other = high_from * each[i];
                vec3 in_at = min(one, other);
                vec3 out_at = max(one, other);
                float begin = relief ? ways.clear[i] : 0.0;
                float enter = max(max(in_at.x, in_at.y), max(in_at.z, begin));
                float leave = min(min(out_at.x, out_at.y), min(out_at.z, 1.0));
                enters[i] = ways.open[i] && enter <= leave;
                entered = entered || enters[i];
            }
            leaf = entered ? high.w & ~RELIEF_NODE : 0;
            at = entered ? at + 1 : low.w;
        }
        uint k = leaf / LEAF_TRIANGLES;
        uint end = k + leaf % LEAF_TRIANGLES;
        do {
            Caster t = caster_at(min(k, max(end, 1) - 1), from);
            for (uint i = 0; i < WAYS; i++) {
                bool asks = ways.open[i] && enters[i] && k < end;
                ways.open[i] = ways.open[i] && !(asks && stands_on(t, way[i], ways.clear[i]));
            }
            k++;
        } while (any_lane(k < end));
        any_open = false;
        for (uint i = 0; i < WAYS; i++) {
            any_open = any_open || ways.open[i];
        }
        count = any_open ? count : 0;
    } while (any_lane(at < count));
}
