// What the elements that light_survey.comp has listed for a slot see of its light: the mean over its
// places and as many places on the element. LIGHT_LANES invocations an element, one slot a dispatch.

shared vec3 sums[GROUP];

const uint EYES_OF_LANE = SOURCE_EYES / LIGHT_LANES;
const uint ELEMENTS = GROUP / LIGHT_LANES;

void main() {
    uint slot = first_slot;
    uint list = slot * RECEIVE_LISTS + RECEIVE_CROSSED;
    uint count = lists[list].count;
    uint lane = gl_LocalInvocationIndex % LIGHT_LANES;
    Light light = load_light(slots[slot].source);
    uvec2 range = piece_of(count, ELEMENTS, piece, pieces);
    uint end = range.y;
    uint stride = ELEMENTS * gl_NumWorkGroups.x;
    for (uint at = range.x + ELEMENTS * gl_WorkGroupID.x; at < end; at += stride) {
        uint of = at + gl_LocalInvocationIndex / LIGHT_LANES;
        uint i = listed[list * element_count + min(of, end - 1)];
        Receiver receiver = load_receiver(first_element + i);
        vec3 normal[RAYS] = vec3[](receiver.normal);
        vec3 sum = vec3(0.0);
        for (uint k = 0; k < EYES_OF_LANE; k++) {
            uint eye = EYES_OF_LANE * lane + k;
            vec3 p[RAYS] = vec3[](place_on(receiver, eye));
            vec3 way[RAYS] = vec3[](way_to(light, eye, p[0]));
            bool open[RAYS] = bool[](dot(way[0], normal[0]) > 0.0);
            look_along(way, p, normal, open);
            sum += open[0] ? flux_along(light, way[0]) : vec3(0.0);
        }
        sums[gl_LocalInvocationIndex] = sum;
        barrier();
        if (lane == 0 && of < end) {
            vec3 all = vec3(0.0);
            for (uint k = 0; k < LIGHT_LANES; k++) {
                all += sums[gl_LocalInvocationIndex + k];
            }
            put(slot, i, flux_to(i, all / float(SOURCE_EYES), receiver.normal));
        }
        barrier();
    }
}
