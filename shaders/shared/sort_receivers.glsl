// Lists the elements that see each source of the batch, by how their form factor is found: as of a
// point, by the outline of the source, by its parts as points, or, near it, with more care.
// Elements that it lies behind, turns its back to or is hidden from are in no list, and their form
// factor is 0. Where the item buffer leaves open whether an element is seen, it is listed apart, for
// resolve_receivers.comp. SHADOW_RAYS: what is seen is asked of rays instead of the item buffer, one
// slot a dispatch, since lavapipe ends all loops of an invocation after 65,535 turns.

#ifdef SHADOW_RAYS
#define SHADOW_OCCLUDERS 9
#define RAYS SORT_ELEMENTS
#else
#define ITEM_BUFFER
#endif
#include "shared/receivers.glsl"
#include "shared/receive_kinds.glsl"

// 1: blocks of elements that see nothing of a source are passed over as a whole.
layout(constant_id = 0) const uint CULL_BLOCKS = 1;
// 1: where a silhouette may cut a source, rays find the share of it that an element sees.
layout(constant_id = 1) const uint SILHOUETTES = 1;
#ifdef ITEM_BUFFER
// 1: where the four pixels about an element do not agree, it sees the share of the source that they
// show it; no rays.
layout(constant_id = 2) const uint PIXELS_DECIDE = 0;
#endif

// Elements that see nothing of a source, whatever stands between: it lies behind them or shows them
// its back, [slot].
layout(scalar, binding = 7) buffer FacingAway { uint away_count[]; };
// Those without relief, then those with it.
layout(scalar, binding = 8) readonly buffer Blocks { ReceiverBlock blocks[]; };
#ifdef SHADOW_RAYS
// Those of a strong emitter begin with its ends; a point light has none.
layout(scalar, binding = 10) readonly buffer Eyes { vec4 eyes[]; };
#define NEAR_MARKS 11
// [source], one more than there are.
layout(scalar, binding = 12) readonly buffer EyeStarts { uint eye_starts[]; };
#else
#define NEAR_MARKS 9
#endif
// One bit an element that receives the source part by part, [slot][word]. Its form factor is found
// on the host.
layout(scalar, binding = NEAR_MARKS) readonly buffer NearMarks { uint near_marks[]; };

// Rounding of distances, a few steps of f32 at coordinates up to 1.
const float BLOCK_EPSILON = 1e-6;

// Whether `kind_of` is RECEIVE_KINDS for every element of a block. Each lane may ask of another
// source.
bool none_sees(ReceiverBlock block, uint source) {
    uint at = SOURCE_TEXELS * source;
    vec4 facing = fetch(sources, at + 1);
    vec3 normal = facing.xyz;
    float radius = facing.w;
    float cone_sin = fetch(sources, at + 2).w;
    float cone_cos = fetch(sources, at + 3).w;
    bool is_point = fetch_words(sources, at + 4).w == KIND_POINT;
    vec3 middle = fetch(sources, at + 6).yzw;
    vec3 d = block.centre - middle;
    float square = dot(d, d);
    // Whether the source lies behind the element that is turned to it most.
    float along = dot(d, block.axis);
    float across = sqrt(max(square - along * along, 0.0));
    float aside = block.radius * block.cone_sin + block.half_height + BLOCK_EPSILON;
    bool behind = along * block.cone_cos - across * block.cone_sin - aside >= radius;
    // Whether the element that lies highest sees none of its front.
    float height = dot(d, normal);
    float turned = length(cross(normal, block.axis));
    float cosine = abs(dot(normal, block.axis));
    float rise = block.radius * turned + block.half_height * cosine;
    bool level = cosine * block.cone_cos - turned * block.cone_sin > LEVEL + BLOCK_EPSILON;
    float flat_part = sqrt(max(square - height * height, 0.0));
    bool below = is_point || cone_sin == 0.0
        ? height + rise < (level && !is_point ? 0.5 * HEIGHT_EPSILON : -BLOCK_EPSILON)
        : height * cone_cos + flat_part * cone_sin + radius + block.radius < -BLOCK_EPSILON;
    bool near = sqrt(square) - radius - block.radius - BLOCK_EPSILON <= NEAR * block.largest;
    return behind || below && !near;
}

// About the form factor from a place to the part of a source above its horizon, as if nothing stood
// between.
float form_factor_about(Source s, vec3 p, vec3 n) {
    vec3 d = s.middle - p;
    float square = dot(d, d);
    float facing = s.cone_sin == 0.0 ? max(-dot(d, s.normal), 0.0) : sqrt(square);
    float height = dot(d, n);
    float above = max(max(height, 0.25 * (height + s.radius)), 0.0);
    return s.kind == KIND_POINT ? 0.0 : s.area * facing * above * 0.318309886 / (square * square);
}

// An element that sees a source under a larger form factor is worth several rays.
const float CROSSED_FACTOR = 1.0 / 64.0;

// Whether the element of a lane receives a source part by part. Asks only where any lane may: one
// that is not found here costs time alone.
bool is_near_part(uint slot, uint i, bool may) {
    if (subgroupBallot(may) == uvec4(0)) {
        return false;
    }
    uint words = (element_count + 31) / 32;
    uint word = near_marks[slot * words + min(i / 32, words - 1)];
    return bitfieldExtract(word, int(i % 32), 1) == 1;
}

// Whether the eye of a source lies below the horizon of a place that sees more of the source than
// this: what of the source is seen is found from other places on it.
const float BELOW_FACTOR = 1.0 / 2048.0;

bool eye_is_below(Source s, vec3 p, vec3 n) {
    return dot(s.eye - p, n) <= 0.0 && form_factor_about(s, p, n) > BELOW_FACTOR;
}

#ifdef SHADOW_RAYS
// Which of the places asked are to see other ends of the source than its eye.
void cross_unlike(
    uint source,
    Source s,
    vec4 ball[SORT_ELEMENTS],
    vec3 n[SORT_ELEMENTS],
    bool asked[SORT_ELEMENTS],
    bool seen[SORT_ELEMENTS],
    inout bool crossed[SORT_ELEMENTS]
) {
    Source end = s;
    for (uint k = 0; k < SOURCE_ENDS; k++) {
        end.eye = eyes[eye_starts[source] + k].xyz;
        bool above[SORT_ELEMENTS];
        for (uint j = 0; j < SORT_ELEMENTS; j++) {
            above[j] = asked[j] && !crossed[j] && dot(end.eye - ball[j].xyz, n[j]) > 0.0;
        }
        bool open[SORT_ELEMENTS] = above;
        look(end, ball, n, open);
        for (uint j = 0; j < SORT_ELEMENTS; j++) {
            crossed[j] = crossed[j] || above[j] && open[j] != seen[j];
        }
    }
}
#endif

#ifdef ITEM_BUFFER
// Whether places about p, as far off as the source is wide, are seen otherwise than p is.
bool around_differs(vec3 p, vec3 n, uint slot, Source s, uint sight, bool asks) {
    if (subgroupBallot(asks) == uvec4(0)) {
        return false;
    }
    vec3 across = cross(n, p - s.eye);
    vec3 along = cross(n, across);
    float reach = s.radius * inversesqrt(max(dot(across, across), 1e-30));
    bool differs = false;
    for (uint k = 0; k < 4; k++) {
        vec3 way = k < 2 ? across : along;
        vec3 q = p + (k % 2 == 0 ? reach : -reach) * way;
        differs = differs || shown(q, n, slot, s) != (sight == SEEN);
    }
    return asks && differs;
}
#endif

// Bit k: the k-th slot from `first` on holds a source of which one of the elements from `low` to
// `high` may see something. `held`: it holds one at all. A lane a slot, SORT_SLOTS at most.
uint sighted_slots(uint first, uint low, uint high, out uint held) {
    uint sighted = 0;
    held = 0;
    for (uint k = 0; first + k < end_slot; k += gl_SubgroupSize) {
        uint slot = first + k + gl_SubgroupInvocationID;
        uint source = slot < end_slot ? slots[slot].source : NONE;
        bool holds = source != NONE;
        bool none = CULL_BLOCKS == 1;
        for (uint block = low / GROUP; block <= high / GROUP && none; block++) {
            none = none_sees(blocks[first_block + block], holds ? source : 0);
        }
        held |= subgroupBallot(holds).x << k;
        sighted |= subgroupBallot(holds && !none).x << k;
    }
    return sighted;
}

void main() {
    // Of a subgroup the elements follow one another.
    uint begin = SORT_ELEMENTS * (GROUP * gl_WorkGroupID.x + gl_SubgroupID * gl_SubgroupSize);
    uint first = begin + gl_SubgroupInvocationID;
    uint last_element = element_count - 1;
    uint in_range = min(begin + SORT_ELEMENTS * gl_SubgroupSize, element_count) - min(begin, element_count);
    uint own = own_between(begin, begin + in_range);
    uint held;
    uint sighted = sighted_slots(first_slot, min(begin, last_element), min(begin + in_range, element_count) - 1, held);
    uint away = held & ~sighted;
    while (away != 0) {
        uint k = findLSB(away);
        away &= away - 1;
        if (subgroupElect()) {
            atomicAdd(away_count[first_slot + k], own);
        }
    }
    if (sighted != 0) {
        vec4 ball[SORT_ELEMENTS];
        vec3 n[SORT_ELEMENTS];
        for (uint j = 0; j < SORT_ELEMENTS; j++) {
            uint e = first_element + min(first + j * gl_SubgroupSize, last_element);
            ball[j] = fetch(balls, e);
            n[j] = fetch(planes, e).xyz;
        }
        while (sighted != 0) {
            uint slot = first_slot + findLSB(sighted);
            sighted &= sighted - 1;
            Source s = load_source(slots[slot].source);
            uint of_slot = 0;
#ifdef SHADOW_RAYS
            uint kind[SORT_ELEMENTS];
            bool seen[SORT_ELEMENTS];
            bool crossed[SORT_ELEMENTS];
            bool near[SORT_ELEMENTS];
            bool wanted[SORT_ELEMENTS];
            for (uint j = 0; j < SORT_ELEMENTS; j++) {
                uint i = first + j * gl_SubgroupSize;
                kind[j] = kind_of(s, ball[j], n[j], near[j]);
                wanted[j] = is_own(i) && kind[j] < RECEIVE_KINDS;
                bool may = near[j] || form_factor_about(s, ball[j].xyz, n[j]) > CROSSED_FACTOR;
                bool by_parts = is_near_part(slot, i, wanted[j] && may);
                wanted[j] = wanted[j] && !by_parts;
                seen[j] = wanted[j] && !near[j];
                // The element's own body would hide the eye.
                crossed[j] = SILHOUETTES == 1 && seen[j] && eye_is_below(s, ball[j].xyz, n[j]);
                seen[j] = seen[j] && !crossed[j];
            }
            bool asked[SORT_ELEMENTS] = seen;
            look(s, ball, n, seen);
            if (SILHOUETTES == 1 && s.kind == KIND_SURFACE) {
                cross_unlike(slots[slot].source, s, ball, n, asked, seen, crossed);
            }
            for (uint j = 0; j < SORT_ELEMENTS; j++) {
                uint i = first + j * gl_SubgroupSize;
                bool found = wanted[j] && (near[j] || seen[j]) && !crossed[j];
                append(slot, kind[j], found, with_share(i, 1.0));
                append_one(slot, RECEIVE_CROSSED, crossed[j], i);
                bool away = is_own(i) && kind[j] == RECEIVE_KINDS;
                of_slot += subgroupBallotBitCount(subgroupBallot(away));
            }
#else
            for (uint j = 0; j < SORT_ELEMENTS; j++) {
                uint i = first + j * gl_SubgroupSize;
                uint e = first_element + i;
                bool near;
                uint kind = kind_of(s, ball[j], n[j], near);
                bool mine = is_own(i) && kind < RECEIVE_KINDS;
                bool fills = form_factor_about(s, ball[j].xyz, n[j]) > CROSSED_FACTOR;
                mine = mine && !is_near_part(slot, i, mine && (near || fills));
                bool asks = mine && !near;
                // The element's own body would hide the eye.
                bool below = SILHOUETTES == 1 && asks && eye_is_below(s, ball[j].xyz, n[j]);
                asks = asks && !below;
                bool wide = SILHOUETTES == 1 && asks && fills;
                float share;
                uint sight = sight_of(ball[j].xyz, n[j], e, slot, s, asks, share);
                bool crossed = below || wide && sight == DOUBTFUL || around_differs(ball[j].xyz, n[j], slot, s, sight, wide);
                bool open = sight == SEEN || PIXELS_DECIDE == 1 && sight == DOUBTFUL;
                append(slot, kind, mine && (near || open) && !crossed, with_share(i, near ? 1.0 : share));
                if (PIXELS_DECIDE == 0) {
                    append_one(slot, RECEIVE_DOUBTFUL, sight == DOUBTFUL && !crossed, i);
                }
                append_one(slot, RECEIVE_CROSSED, crossed, i);
                bool away = is_own(i) && kind == RECEIVE_KINDS;
                of_slot += subgroupBallotBitCount(subgroupBallot(away));
            }
#endif
            if (subgroupElect()) {
                atomicAdd(away_count[slot], of_slot);
            }
        }
    }
}
