// Form factors of the elements that sort_receivers.comp has listed for one slot and kind.
// VECTOR_FLUX: the elements receive by direction, and get the vector whose dot product with the
// normal is the form factor. SHADOW_RAYS: what is seen is asked of rays alone; otherwise of the item
// buffer, and of rays where that leaves it open.

#define RAYS 1
#ifdef VECTOR_FLUX
#define SHADOW_OCCLUDERS 13
#else
#define SHADOW_OCCLUDERS 12
#endif
#ifndef SHADOW_RAYS
#define ITEM_BUFFER
#ifdef VECTOR_FLUX
#define SHADOW_NODES 14
#else
#define SHADOW_NODES 13
#endif
#endif
#include "shared/receivers.glsl"
#include "shared/lambert.glsl"
#include "shared/kept.glsl"

// RECEIVE_FAR, _OUTLINE, _PARTS, _CUT or _NEAR. A software device works through both
// sides of every branch, so that each kind has a pipeline of its own.
layout(constant_id = 0) const uint KIND = RECEIVE_OUTLINE;

// xyz: a corner; w: 1 where a loop of the contour starts (each loop ends with its first corner
// again).
layout(binding = 7) uniform usamplerBuffer contours;
// TRIANGLE_TEXELS an element.
layout(binding = 8) uniform usamplerBuffer triangles;
// Of curved sources, PART_TEXELS a part: centroid, sum of area times normal, radius of the ball
// about the centroid; how many members it has, and these.
layout(binding = 9) uniform usamplerBuffer parts;
// 1 where any element of a block of GROUP sees the source, [slot][block]. A batch
// begins with zeros.
layout(scalar, binding = 10) writeonly buffer Occupied { uint occupied[]; };
// [slot][element of this dispatch]
layout(scalar, binding = 11) writeonly buffer Fresh { FLUX fresh[]; };
#ifdef VECTOR_FLUX
layout(scalar, binding = 12) readonly buffer MesoElements { MesoElement meso_elements[]; };
#endif

const uint PART_TEXELS = 4;
const float INV_PI = 0.318309886;
const uint TRIANGLE_TEXELS = 4;

Triangle load_triangle(uint index) {
    vec4 word[TRIANGLE_TEXELS];
    for (uint i = 0; i < TRIANGLE_TEXELS; i++) {
        word[i] = fetch(triangles, TRIANGLE_TEXELS * index + i);
    }
    return Triangle(word[0].xyz, word[0].w, word[1].xyz, word[1].w, word[2].xyz, word[2].w, word[3].xyz, word[3].w);
}

vec3 own_corner(uint element, uint corner) {
    return fetch(triangles, TRIANGLE_TEXELS * element + corner).xyz;
}

// Form factor (see FLUX) of the source's outline, of whose edges none is seen under more than a
// right angle and none lies below the horizon of n.
FLUX outline_above(vec3 p, vec3 n, Source s) {
    FLUX sum = FLUX(0.0);
    vec3 last = fetch(contours, s.first_contour).xyz - p;
    float inverse_last = inversesqrt(dot(last, last));
    for (uint i = 1; i < s.contour_count; i++) {
        vec4 corner = fetch(contours, s.first_contour + i);
        vec3 next = corner.xyz - p;
        float inverse_next = inversesqrt(dot(next, next));
        float scale = corner.w == 1.0 ? 0.0 : inverse_last * inverse_next;
        // Edge by corner is as far from rounding as the edge is short.
        sum += flux(cross(last, next - last), n) * scale * acute_angle_over_sine(dot(last, next) * inverse_last * inverse_next);
        last = next;
        inverse_last = inverse_next;
    }
    return flux_above(-sum * INV_TWO_PI, n);
}

// The same of any outline, cut at the horizon.
FLUX outline(vec3 p, vec3 n, Source s) {
    Contour contour = contour_begin();
    vec3 last = fetch(contours, s.first_contour).xyz - p;
    for (uint i = 1; i < s.contour_count; i++) {
        vec4 corner = fetch(contours, s.first_contour + i);
        vec3 next = corner.xyz - p;
        if (corner.w == 1.0) {
            contour_close(contour, n);
        } else {
            contour_edge(contour, last, next, n);
        }
        last = next;
    }
    contour_close(contour, n);
    return flux_above(contour_form_factor(contour), n);
}

// Of the parts that show p their fronts, each as a point.
FLUX parts_as_points(vec3 p, vec3 n, Source s) {
    FLUX sum = FLUX(0.0);
    for (uint i = 0; i < s.part_count; i++) {
        uint at = PART_TEXELS * (s.first_part + i);
        vec4 low = fetch(parts, at);
        vec4 high = fetch(parts, at + 1);
        vec3 way = low.xyz - p;
        vec3 vector_area = vec3(low.w, high.xy);
        float square = dot(way, way);
        sum += flux_above(flux(way, n), n) * (max(-dot(vector_area, way), 0.0) / (square * square));
    }
    return sum * INV_PI;
}

// Of a member: nothing where it does not show p its front.
FLUX member(vec3 p, vec3 n, uint index, bool shows) {
    Triangle t = load_triangle(index);
    vec3 a = t.a - p;
    vec3 b = t.b - p;
    vec3 c = t.c - p;
    Contour contour = contour_begin();
    contour_edge(contour, a, b, n);
    contour_edge(contour, b, c, n);
    contour_edge(contour, c, a, n);
    contour_close(contour, n);
    return shows ? flux_above(contour_form_factor(contour), n) : FLUX(0.0);
}

// Of the parts that show p their fronts: those far off as points, of the others each member
// exactly.
FLUX parts_or_members(vec3 p, vec3 n, uint element, Source s) {
    FLUX sum = FLUX(0.0);
    for (uint i = 0; i < s.part_count; i++) {
        uint at = PART_TEXELS * (s.first_part + i);
        vec4 low = fetch(parts, at);
        uvec4 high = fetch_words(parts, at + 1);
        vec3 way = low.xyz - p;
        vec3 vector_area = vec3(low.w, uintBitsToFloat(high.xy));
        float square = dot(way, way);
        float least = PART_POINT_DISTANCE * uintBitsToFloat(high.z);
        bool far = square > least * least;
        float facing = max(-dot(vector_area, way), 0.0);
        float share = far ? INV_PI * facing / (square * square) : 0.0;
        sum += flux_above(flux(way, n), n) * share;
        // A software device works through what a branch leaves out.
        if (subgroupBallot(!far) == uvec4(0)) {
            continue;
        }
        for (uint k = 0; k < high.w; k++) {
            uint index = fetch_words(parts, at + 2 + k / 4)[k % 4];
            float height = fetch(triangles, TRIANGLE_TEXELS * index + 1).w;
            vec3 normal = fetch(triangles, TRIANGLE_TEXELS * index + 3).xyz;
            bool shows = !far && index != element && dot(normal, p) > height;
            if (subgroupBallot(shows) != uvec4(0)) {
                sum += member(p, n, index, shows);
            }
        }
    }
    return sum;
}

// From p (normal n) to the whole source, as if nothing stood between.
FLUX form_factor(vec3 p, vec3 n, uint element, Source s) {
    if (s.kind == KIND_POINT) {
        vec3 d = s.eye - p;
        float square = dot(d, d);
        return flux_above(flux(d, n), n) * (inversesqrt(square) / square);
    }
    if (KIND == RECEIVE_FAR) {
        vec3 d = s.middle - p;
        float square = dot(d, d);
        float projected = -s.facing * dot(s.normal, d);
        return flux_above(flux(d, n), n) * (projected / (3.14159265 * square * square));
    }
    if (KIND == RECEIVE_OUTLINE) {
        return outline_above(p, n, s);
    }
    if (KIND == RECEIVE_CUT) {
        return outline(p, n, s);
    }
    if (KIND == RECEIVE_PARTS) {
        return parts_as_points(p, n, s);
    }
    bool whole = shows_whole_front(s, p);
    FLUX f = FLUX(0.0);
    if (subgroupAny(whole)) {
        f = outline(p, n, s);
    }
    if (subgroupAny(!whole)) {
        FLUX by_parts = parts_or_members(p, n, element, s);
        f = whole ? f : by_parts;
    }
    return f;
}

// Sample points of a triangle and their weights (centroid; degree 2; Radon's degree 5).
const vec3 POINTS[11] = vec3[](
    vec3(0.333333333, 0.333333333, 1.0),
    vec3(0.166666667, 0.166666667, 0.333333333),
    vec3(0.666666667, 0.166666667, 0.333333333),
    vec3(0.166666667, 0.666666667, 0.333333333),
    vec3(0.333333333, 0.333333333, 0.225),
    vec3(0.470142064, 0.470142064, 0.132394153),
    vec3(0.059715872, 0.470142064, 0.132394153),
    vec3(0.470142064, 0.059715872, 0.132394153),
    vec3(0.101286507, 0.101286507, 0.125939181),
    vec3(0.797426985, 0.101286507, 0.125939181),
    vec3(0.101286507, 0.797426985, 0.125939181)
);

bool visible(vec3 p, vec3 n, uint element, Source s, bool asks) {
#ifdef ITEM_BUFFER
    float share;
    uint sight = sight_of(p, n, element, first_slot, s, asks, share);
    asks = sight == DOUBTFUL;
    if (subgroupBallot(asks) == uvec4(0)) {
        return sight == SEEN;
    }
#endif
    bool open[1] = bool[1](asks);
    look(s, vec4[1](vec4(p, 0.0)), vec3[1](n), open);
#ifdef ITEM_BUFFER
    return sight == SEEN || open[0];
#else
    return open[0];
#endif
}

// A place on a surface with normal n, put a little before a plane source where rounding leaves open
// on which side of its plane it is: a sliver along the foot of a wall is lit by it. Surfaces that
// are level with the source see nothing of it there.
vec3 before_plane(vec3 p, vec3 n, Source s) {
    float height = dot(p - s.middle, s.normal);
    bool open = s.kind != KIND_POINT && s.cone_sin == 0.0 && abs(height) <= HEIGHT_EPSILON && abs(dot(n, s.normal)) < LEVEL;
    return open ? p + (2.0 * HEIGHT_EPSILON - height) * s.normal : p;
}

// Mean over the element of form factor times visibility.
FLUX mean_form_factor(uint element, vec4 ball, vec3 n, Source s) {
    if (KIND != RECEIVE_NEAR) {
        // These were looked at when they were sorted.
        vec3 p = KIND == RECEIVE_CUT ? before_plane(ball.xyz, n, s) : ball.xyz;
        return form_factor(p, n, element, s);
    }
    float gap = gap_to(s, ball.xyz);
    bool near = gap <= NEAR * ball.w;
    // What sees much of a curved source receives it part by part instead: within its ball, but off
    // its members, one place will do.
    bool several = near && (s.kind == KIND_POINT || s.cone_sin == 0.0);
    bool touching = several && gap <= ball.w;
    uint first = touching ? 4 : several ? 1 : 0;
    uint count = touching ? 7 : several ? 3 : 1;
    uint most = subgroupAny(touching) ? 7 : subgroupAny(several) ? 3 : 1;
    vec3 a = own_corner(element, 0);
    vec3 ab = own_corner(element, 1) - a;
    vec3 ac = own_corner(element, 2) - a;
    FLUX sum = FLUX(0.0);
    for (uint i = 0; i < most; i++) {
        vec3 point = POINTS[min(first + i, 10)];
        vec3 p = before_plane(several ? a + point.x * ab + point.y * ac : ball.xyz, n, s);
        bool mine = i < count && shows_front(s, p);
        bool open = visible(p, n, element, s, mine && near);
        // What is not near was looked at when it was sorted.
        mine = mine && (open || !near);
        FLUX f = form_factor(p, n, element, s);
        sum += mine ? point.z * f : FLUX(0.0);
    }
    return sum;
}

void main() {
    uint list = first_slot * RECEIVE_LISTS + KIND;
    uvec2 range = piece_of(lists[list].count, GROUP, piece, pieces);
    if (range.x + GROUP * gl_WorkGroupID.x >= range.y) {
        return;
    }
    // The lanes past the end do as the last one does.
    uint at = min(range.x + gl_GlobalInvocationID.x, range.y - 1);
    uint word = listed[list * element_count + at];
    uint i = bitfieldExtract(word, 0, int(LISTED_BITS));
    // The share of the source that it sees.
    float share = SHARE_STEP * float((word >> LISTED_BITS) + 1);
    uint e = first_element + i;
    Source s = load_source(slots[first_slot].source);
    vec3 n = fetch(planes, e).xyz;
    FLUX f = share * mean_form_factor(e, fetch(balls, e), n, s);
#ifdef VECTOR_FLUX
    MesoElement meso = meso_elements[i];
    vec3 local = vec3(dot(meso.tangent, f), dot(meso.bitangent, f), dot(n, f));
    float strength = as_kept(length(local));
    f = strength > 0.0 ? strength * kept_direction(direction_code(local / strength)) : vec3(0.0);
    bool lit = strength > 0.0;
#else
    f = as_kept(f);
    bool lit = f > 0.0;
#endif
    fresh[first_slot * element_count + i] = f;
    if (lit) {
        occupied[first_slot * block_count + first_block + i / GROUP] = 1;
    }
}
