// Lists the elements that see each source of the batch, by how their form factor is found: as of a
// point, by the outline of the source, by its parts as points, or, near it, with more care.
// Elements that it lies behind, turns its back to or is hidden from are in no list, and their form
// factor is 0. SHADOW_RAYS: what is seen is asked of rays instead of the item buffer, one slot a
// dispatch, since lavapipe ends all loops of an invocation after 65,535 turns.

#ifdef SHADOW_RAYS
#define SHADOW_OCCLUDERS 9
#define RAYS SORT_ELEMENTS
#endif
#include "shared/receivers.glsl"

// 1: blocks of elements that see nothing of a source are passed over as a whole.
layout(constant_id = 0) const uint CULL_BLOCKS = 1;

// Elements that see nothing of a source, whatever stands between: it lies behind them or shows them
// its back, [slot].
layout(scalar, binding = 7) buffer FacingAway { uint away_count[]; };
// Those without relief, then those with it.
layout(scalar, binding = 8) readonly buffer Blocks { ReceiverBlock blocks[]; };

// Rounding of distances, a few steps of f32 at coordinates up to 1.
const float BLOCK_EPSILON = 1e-6;

// Lane k of a subgroup makes room in the list of kind k for all lanes.
void append(uint slot, uint kind, bool mine, uint i) {
    uint count = 0;
    uint before = 0;
    for (uint k = 0; k < RECEIVE_KINDS; k++) {
        uvec4 lanes = subgroupBallot(mine && kind == k);
        count = gl_SubgroupInvocationID == k ? subgroupBallotBitCount(lanes) : count;
        before = kind == k ? subgroupBallotExclusiveBitCount(lanes) : before;
    }
    uint first = 0;
    if (count > 0) {
        uint list = slot * RECEIVE_KINDS + gl_SubgroupInvocationID;
        first = atomicAdd(lists[list].count, count);
        atomicMax(lists[list].groups_x, (first + count + GROUP - 1) / GROUP);
    }
    for (uint k = 0; k < RECEIVE_KINDS; k++) {
        uint first_of_kind = subgroupBroadcast(first, k);
        before += kind == k ? first_of_kind : 0;
    }
    if (mine) {
        listed[(slot * RECEIVE_KINDS + kind) * element_count + before] = i;
    }
}

// How the form factor from an element to a source is found, should it be seen; RECEIVE_KINDS where
// it is 0. `near`: parts of the element may be seen, whether its centroid is or not.
uint kind_of(Source s, vec4 ball, vec3 n, out bool near) {
    vec3 d = ball.xyz - s.middle;
    float distance_middle = length(d);
    float across = dot(d, n);
    near = distance_middle - s.radius <= NEAR * ball.w;
    bool behind = across >= s.radius;
    bool above = across <= -s.radius && distance_middle * distance_middle >= ACUTE * s.radius * s.radius;
    bool whole = shows_whole_front(s, ball.xyz);
    bool points = distance_middle - s.radius >= POINT_DISTANCE * s.part_radius;
    bool curved = s.cone_sin != 0.0;
    float far_distance = (curved ? POINT_DISTANCE : FLAT_POINT_DISTANCE) * s.radius;
    bool far = s.kind == KIND_POINT || whole && distance_middle >= far_distance;
    bool by_parts = curved && points;
    uint kind = near ? RECEIVE_NEAR : far ? RECEIVE_FAR : by_parts ? RECEIVE_PARTS
        : whole && above ? RECEIVE_OUTLINE : RECEIVE_NEAR;
    bool shows = shows_front(s, ball.xyz) && !lies_in_plane(s, ball.xyz, n);
    return !behind && (near || shows) ? kind : RECEIVE_KINDS;
}

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
    uint held;
    uint sighted = sighted_slots(first_slot, min(begin, last_element), min(begin + in_range, element_count) - 1, held);
    uint away = held & ~sighted;
    while (away != 0) {
        uint k = findLSB(away);
        away &= away - 1;
        if (subgroupElect()) {
            atomicAdd(away_count[first_slot + k], in_range);
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
            uint kind[SORT_ELEMENTS];
            bool seen[SORT_ELEMENTS];
            bool near[SORT_ELEMENTS];
            for (uint j = 0; j < SORT_ELEMENTS; j++) {
                uint i = first + j * gl_SubgroupSize;
                kind[j] = kind_of(s, ball[j], n[j], near[j]);
                seen[j] = i < element_count && kind[j] < RECEIVE_KINDS && !near[j];
            }
#ifdef SHADOW_RAYS
            look(s, ball, n, seen);
#else
            for (uint j = 0; j < SORT_ELEMENTS; j++) {
                uint e = first_element + first + j * gl_SubgroupSize;
                seen[j] = visible(ball[j].xyz, n[j], e, slot, s, seen[j]);
            }
#endif
            uint of_slot = 0;
            for (uint j = 0; j < SORT_ELEMENTS; j++) {
                uint i = first + j * gl_SubgroupSize;
                bool mine = i < element_count && kind[j] < RECEIVE_KINDS;
                append(slot, kind[j], mine && (near[j] || seen[j]), i);
                of_slot += subgroupBallotBitCount(subgroupBallot(i < element_count && kind[j] == RECEIVE_KINDS));
            }
            if (subgroupElect()) {
                atomicAdd(away_count[slot], of_slot);
            }
        }
    }
}
