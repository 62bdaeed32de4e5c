// Whether places are open to a source's eye: a walk through the tree of src/passes/occluder_tree.rs
// that a subgroup takes together, from one eye to RAYS places a lane, so that what all look at is
// loaded once. Nodes stand in depth-first order, and each knows the one to go on with if no lane
// meets its box. src/reference/occluder_rays.rs is the same in f64.

// NODE_TEXELS a node.
#ifndef SHADOW_NODES
#define SHADOW_NODES 6
#endif
layout(binding = SHADOW_NODES) uniform usamplerBuffer shadow_nodes;
// OCCLUDER_TEXELS an occluder.
layout(binding = SHADOW_OCCLUDERS) uniform usamplerBuffer shadow_occluders;

const uint NODE_TEXELS = 2;
const uint OCCLUDER_TEXELS = 4;
// Components of a way below this count as this, so that their reciprocals are finite: boxes are
// padded by far more.
const float LEAST_WAY = 1e-18;
// Height above a plane from which on boxes of what lies in it are not met.
const float CLEAR = 2.0 * HEIGHT_EPSILON;
// How far behind a plane a place must lie to be hidden. Triangles much smaller than that are met
// where rounding says.
const float HIDDEN = 4.0 * HEIGHT_EPSILON;

// A triangle as it stands about the eye.
struct Met {
    vec3 over_a;        // volumes over its edges, before they meet a way
    vec3 over_b;
    vec3 over_c;
    vec3 normal;
    float eye_height;   // above its plane
    bool hides;         // whether it can hide anything
};

// What lies in one plane with the eye hides nothing, nor do the backs of a closed part that the
// source is on: its group does not stand behind them.
Met met(Source s, uint triangle) {
    uint first = OCCLUDER_TEXELS * triangle;
    uvec4 word_a = fetch_words(shadow_occluders, first);
    uvec4 word_b = fetch_words(shadow_occluders, first + 1);
    uvec4 word_c = fetch_words(shadow_occluders, first + 2);
    uvec4 normal = fetch_words(shadow_occluders, first + 3);
    precise vec3 a = uintBitsToFloat(word_a.xyz) - s.eye;
    precise vec3 b = uintBitsToFloat(word_b.xyz) - s.eye;
    precise vec3 c = uintBitsToFloat(word_c.xyz) - s.eye;
    precise vec3 over_a = b.yzx * c.zxy - b.zxy * c.yzx;
    precise vec3 over_b = c.yzx * a.zxy - c.zxy * a.yzx;
    precise vec3 over_c = a.yzx * b.zxy - a.zxy * b.yzx;
    vec3 n = uintBitsToFloat(normal.xyz);
    float eye_height = dot(n, s.eye) - uintBitsToFloat(word_c.w);
    bool own = s.kind == KIND_SURFACE && word_a.w == s.component && word_b.w == 1;
    bool hides = eye_height > HEIGHT_EPSILON || !own && eye_height < -HEIGHT_EPSILON;
    return Met(over_a, over_b, over_c, n, eye_height, hides);
}

// Whether the triangle stands between the eye and the end of a way. Two triangles find the same
// volume over the edge that they share with the opposite sign, to the bit: no way leads between
// them. By the height, the way itself meets the triangle and not only the line that it is a
// part of.
bool stands_in(Met t, vec3 way) {
    precise float of_a = way.x * t.over_a.x + way.y * t.over_a.y + way.z * t.over_a.z;
    precise float of_b = way.x * t.over_b.x + way.y * t.over_b.y + way.z * t.over_b.z;
    precise float of_c = way.x * t.over_c.x + way.y * t.over_c.y + way.z * t.over_c.z;
    float least = min(min(of_a, of_b), of_c);
    float most = max(max(of_a, of_b), of_c);
    float height = t.eye_height + dot(t.normal, way);
    bool crossed = t.eye_height > 0.0 ? height < -HIDDEN : height > HIDDEN;
    return t.hides && crossed && (least >= 0.0 || most <= 0.0) && least != most;
}

// Which of the places p.xyz, on elements with normals n, are open to the eye, among those that are
// asked for. All lanes must be active.
void look(Source s, vec4 p[RAYS], vec3 n[RAYS], inout bool open[RAYS]) {
    vec3 way[RAYS];
    vec3 each[RAYS];
    float begin[RAYS];
    float end[RAYS];
    for (uint r = 0; r < RAYS; r++) {
        way[r] = p[r].xyz - s.eye;
        each[r] = mix(vec3(1.0), vec3(-1.0), lessThan(way[r], vec3(0.0))) / max(abs(way[r]), vec3(LEAST_WAY));
        // The walk leaves out the ends of the way, within reach of the boxes of what lies in the
        // planes that it begins and ends on.
        float rises = s.kind == KIND_SURFACE ? dot(way[r], s.normal) : 0.0;
        begin[r] = rises > 0.0 ? min(CLEAR / rises, 0.5) : 0.0;
        float falls = -dot(way[r], n[r]);
        end[r] = falls > 0.0 ? max(1.0 - CLEAR / falls, 0.5) : 1.0;
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
            vec3 low = uintBitsToFloat(low_word.xyz) - s.eye;
            vec3 high = uintBitsToFloat(high_word.xyz) - s.eye;
            bool any_enters = false;
            for (uint r = 0; r < RAYS; r++) {
                vec3 one = low * each[r];
                vec3 other = high * each[r];
                vec3 in_at = min(one, other);
                vec3 out_at = max(one, other);
                float enter = max(max(in_at.x, in_at.y), max(in_at.z, begin[r]));
                float leave = min(min(out_at.x, out_at.y), min(out_at.z, end[r]));
                enters[r] = open[r] && enter <= leave;
                any_enters = any_enters || enters[r];
            }
            // A ballot, since lavapipe goes through all lanes for a vote.
            bool entered = subgroupBallot(any_enters) != uvec4(0);
            leaf = entered ? high_word.w : 0;
            at = entered ? at + 1 : low_word.w;
        } while (leaf == 0 && at < count);
        uint first = leaf / LEAF_TRIANGLES;
        for (uint i = first; i < first + leaf % LEAF_TRIANGLES; i++) {
            Met t = met(s, i);
            for (uint r = 0; r < RAYS; r++) {
                open[r] = open[r] && !(enters[r] && stands_in(t, way[r]));
            }
        }
    }
}
