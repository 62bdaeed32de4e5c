// Asks a few places of each light: FIRST_EYES of them, other ones for each of SURVEYS neighbouring
// elements. Where all neighbours see all of these, an element sees the whole light, and where none
// sees any, nothing of it; elements between are listed for light_rows.comp. SURVEY_ELEMENTS elements
// an invocation, GROUP apart.

const uint SURVEYS = SOURCE_EYES / FIRST_EYES;
// Elements that follow one another and decide together.
const uint NEIGHBOURS = 8;

// Whether any of this lane's neighbours says so.
bool any_near(bool says) {
    uvec4 lanes = subgroupBallot(says);
    uint lane = gl_SubgroupInvocationID;
    uint mask = ((1u << NEIGHBOURS) - 1) << (lane % 32 / NEIGHBOURS * NEIGHBOURS);
    return (lanes[lane / 32] & mask) != 0;
}

void main() {
    uint slot = first_slot + gl_WorkGroupID.y;
    uint source = slots[slot].source;
    uint begin = SURVEY_ELEMENTS * GROUP * gl_WorkGroupID.x + gl_LocalInvocationIndex;
    Light light = load_light(source == NONE ? 0 : source);
    Receiver receiver[SURVEY_ELEMENTS];
    vec3 normal[SURVEY_ELEMENTS];
    bool inside[SURVEY_ELEMENTS];
    bool some_open[SURVEY_ELEMENTS];
    bool some_closed[SURVEY_ELEMENTS];
    for (uint j = 0; j < SURVEY_ELEMENTS; j++) {
        uint i = begin + GROUP * j;
        inside[j] = source != NONE && i < element_count;
        receiver[j] = load_receiver(first_element + min(i, element_count - 1));
        normal[j] = receiver[j].normal;
        some_open[j] = false;
        some_closed[j] = false;
    }
    uint survey = gl_LocalInvocationIndex % SURVEYS;
    for (uint k = 0; k < FIRST_EYES; k++) {
        uint eye = FIRST_EYES * survey + k;
        vec3 way[SURVEY_ELEMENTS];
        vec3 p[SURVEY_ELEMENTS];
        bool open[SURVEY_ELEMENTS];
        for (uint j = 0; j < SURVEY_ELEMENTS; j++) {
            p[j] = place_on(receiver[j], eye);
            way[j] = way_to(light, eye, p[j]);
            open[j] = inside[j] && dot(way[j], normal[j]) > 0.0;
        }
        look_along(way, p, normal, open);
        for (uint j = 0; j < SURVEY_ELEMENTS; j++) {
            some_open[j] = some_open[j] || open[j];
            some_closed[j] = some_closed[j] || inside[j] && !open[j];
        }
    }
    for (uint j = 0; j < SURVEY_ELEMENTS; j++) {
        uint i = begin + GROUP * j;
        bool opens = any_near(some_open[j]);
        // The light of a beam is uneven even where nothing blocks it.
        bool closes = BEAMS == 1 || any_near(some_closed[j]);
        bool own = inside[j] && i >= own_begin && i < own_end;
        if (own && opens && !closes) {
            put(slot, i, flux_to(i, flux_along(light, light.middle), normal[j]));
        }
        bool mine = own && opens && closes;
        uvec4 lanes = subgroupBallot(mine);
        uint list = slot * RECEIVE_LISTS + RECEIVE_CROSSED;
        uint first = 0;
        if (subgroupElect() && lanes != uvec4(0)) {
            first = atomicAdd(lists[list].count, subgroupBallotBitCount(lanes));
            uint count = first + subgroupBallotBitCount(lanes);
            atomicMax(lists[list].groups_x, min((count * LIGHT_LANES + GROUP - 1) / GROUP, 65535));
        }
        first = subgroupBroadcastFirst(first);
        if (mine) {
            listed[list * element_count + first + subgroupBallotExclusiveBitCount(lanes)] = i;
        }
    }
}
