// Form factor, with visibility, from every element to every source of a batch. VECTOR_FLUX: the elements of this dispatch
// receive by direction, and get the vector whose dot product with the normal is the form factor.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/hemicube.glsl"
#include "shared/lambert.glsl"
#include "shared/kept.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// Words of struct Source.
layout(scalar, binding = 1) readonly buffer Sources { uint source_words[]; };
// Words of vec4: a corner; w: 1 where a loop of the contour starts (each loop ends with its first corner again).
layout(scalar, binding = 2) readonly buffer Contours { uint contour_words[]; };
// Words of struct Triangle.
layout(scalar, binding = 3) readonly buffer Triangles { uint triangle_words[]; };
// Centroid and area times normal of each element, two words unused.
layout(scalar, binding = 9) readonly buffer Members { uint member_words[]; };
// xyz: unit normal n; w: n · x on the plane.
layout(scalar, binding = 4) readonly buffer Planes { vec4 planes[]; };
// xyz: centroid; w: radius of the ball about it that holds the element.
layout(scalar, binding = 5) readonly buffer Balls { vec4 balls[]; };
// Whether any element of a block of GROUP sees the source, [slot][block]. Whoever reads it sets it to 0 again.
layout(scalar, binding = 6) buffer Occupied { uint occupied[]; };
// [slot][element of this dispatch]
layout(scalar, binding = 7) writeonly buffer Fresh { FLUX fresh[]; };
layout(binding = 8) uniform usampler2D items;
#ifdef VECTOR_FLUX
layout(scalar, binding = 10) readonly buffer MesoElements { MesoElement meso_elements[]; };
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint face_size;
    uint first_block;
    uint block_count;    // of all elements
};

// Rounding of a plane's height at a point: a few steps of f32 at coordinates up to 1.
const float HEIGHT_EPSILON = 1e-6;
// How many pixels' footprints two points of one surface may lie apart and still be taken for one another.
const float REACH = 1.5;

// A source is a point where its radius is no more than this share of the distance. A square's error is then at most
// 2/3 of the square of that: 0.07 %.
const float FAR = 1.0 / 32.0;
// Where a source lies this many squared radii off, no edge of it is seen under more than a right angle.
const float ACUTE = 2.1;
// Members of a curved source that shows some backs are points from so many of their radii off: 2/3 of 1/256 at most.
const float POINT_DISTANCE = 16.0;

// Whether p, on an element with normal n, is seen from the source's eye.
bool visible(vec3 p, vec3 n, uint element, uint slot, Source s) {
    vec3 d = p - s.eye;
    vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal));
    vec2 texel = hemicube_texel(local, face_size);
    ivec2 pixel = hemicube_pixel(texel, face_size);
    uint item = texelFetch(items, ivec2(slot * face_size, 0) + pixel, 0).r;
    if (item == NONE || item == element) {
        return true;
    }
    vec4 plane = planes[item];
    float eye_height = dot(plane.xyz, s.eye) - plane.w;
    float height = dot(plane.xyz, p) - plane.w;
    float depth = eye_height >= 0.0 ? -height : height;
    if (depth <= HEIGHT_EPSILON) {
        return true;
    }
    // The item's plane lies in front of p. It is still the same surface, seen a pixel aside, where the two planes'
    // angle and the distance between the points explain the height.
    vec3 ray = hemicube_direction(pixel, face_size);
    vec3 world = ray.x * s.tangent + ray.y * s.bitangent + ray.z * s.normal;
    float along = -eye_height / dot(plane.xyz, world);
    vec3 seen = s.eye + along * world;
    float distance_p = length(d);
    if (dot(seen - s.eye, d) > distance_p * distance_p) {
        // The item itself is farther off than p.
        return true;
    }
    float apart = length(p - seen);
    float grazing = min(abs(dot(n, d)), abs(dot(plane.xyz, d))) / distance_p;
    float footprint = distance_p * 2.0 / float(face_size) / max(grazing, 0.05);
    float sine = length(cross(n, plane.xyz));
    return apart <= REACH * footprint && depth <= apart * sine + HEIGHT_EPSILON;
}

// Four words that all lanes of the subgroup want, from `first` on. Each lane loads one of them: a load costs a software device
// as much as some ten operations for each lane, wherever it points. All lanes must be active.
#define LOAD4(words, first) share4(words[(first) + (gl_SubgroupInvocationID & 3)])

vec4 share4(uint word) {
    float value = uintBitsToFloat(word);
    return vec4(subgroupBroadcast(value, 0), subgroupBroadcast(value, 1), subgroupBroadcast(value, 2),
                subgroupBroadcast(value, 3));
}

const uint SOURCE_WORDS = 32;
const uint MEMBER_WORDS = 8;
const uint TRIANGLE_WORDS = 16;

Source load_source(uint index) {
    vec4 word[SOURCE_WORDS / 4];
    for (uint i = 0; i < SOURCE_WORDS / 4; i++) {
        word[i] = LOAD4(source_words, index * SOURCE_WORDS + 4 * i);
    }
    return Source(word[0].xyz, word[0].w, word[1].xyz, word[1].w, word[2].xyz, word[2].w, word[3].xyz, word[3].w,
                  word[4].xyz, floatBitsToUint(word[4].w), floatBitsToUint(word[5].x), floatBitsToUint(word[5].y),
                  floatBitsToUint(word[5].z), floatBitsToUint(word[5].w), floatBitsToUint(word[6].x), word[6].yzw, word[7].x, word[7].y, 0, 0);
}

Triangle load_triangle(uint index) {
    vec4 word[TRIANGLE_WORDS / 4];
    for (uint i = 0; i < TRIANGLE_WORDS / 4; i++) {
        word[i] = LOAD4(triangle_words, index * TRIANGLE_WORDS + 4 * i);
    }
    return Triangle(word[0].xyz, word[0].w, word[1].xyz, word[1].w, word[2].xyz, word[2].w, word[3].xyz, word[3].w);
}

vec3 own_corner(uint element, uint corner) {
    uint at = element * TRIANGLE_WORDS + 4 * corner;
    return uintBitsToFloat(uvec3(triangle_words[at], triangle_words[at + 1], triangle_words[at + 2]));
}

// Form factor (see FLUX) of the source's outline, of whose edges none is seen under more than a right angle and none lies below the
// horizon of n.
FLUX outline_above(vec3 p, vec3 n, Source s) {
    FLUX sum = FLUX(0.0);
    vec3 last = LOAD4(contour_words, 4 * s.first_contour).xyz - p;
    float inverse_last = inversesqrt(dot(last, last));
    for (uint i = 1; i < s.contour_count; i++) {
        vec4 corner = LOAD4(contour_words, 4 * (s.first_contour + i));
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
    vec3 last = LOAD4(contour_words, 4 * s.first_contour).xyz - p;
    for (uint i = 1; i < s.contour_count; i++) {
        vec4 corner = LOAD4(contour_words, 4 * (s.first_contour + i));
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

// Of the members that show p their fronts, each as a point.
FLUX members_as_points(vec3 p, vec3 n, Source s) {
    FLUX sum = FLUX(0.0);
    for (uint i = 0; i < s.element_count; i++) {
        uint word = (s.first_element + i) * MEMBER_WORDS;
        vec4 low = LOAD4(member_words, word);
        vec4 high = LOAD4(member_words, word + 4);
        vec3 way = low.xyz - p;
        vec3 vector_area = vec3(low.w, high.xy);
        float square = dot(way, way);
        sum += flux_above(flux(way, n), n) * (max(-dot(vector_area, way), 0.0) / (square * square));
    }
    return sum * 0.318309886;
}

// The same, exactly.
FLUX members(vec3 p, vec3 n, uint element, Source s) {
    FLUX sum = FLUX(0.0);
    for (uint i = 0; i < s.element_count; i++) {
        uint member = s.first_element + i;
        Triangle t = load_triangle(member);
        vec3 a = t.a - p;
        vec3 b = t.b - p;
        vec3 c = t.c - p;
        Contour contour = contour_begin();
        contour_edge(contour, a, b, n);
        contour_edge(contour, b, c, n);
        contour_edge(contour, c, a, n);
        contour_close(contour, n);
        bool shows = member != element && dot(t.normal, p) > t.height;
        sum += shows ? flux_above(contour_form_factor(contour), n) : FLUX(0.0);
    }
    return sum;
}

// Form factor (see FLUX) from p (normal n) to the whole source where `wanted`, as if nothing stood between. In this and what it
// calls, lanes go through the same loops together; each kind of lane has a loop of its own, since a software device works
// through both sides of a branch.
FLUX form_factor(vec3 p, vec3 n, uint element, Source s, bool wanted) {
    if (s.kind == KIND_POINT) {
        vec3 d = s.eye - p;
        float square = dot(d, d);
        return wanted ? flux_above(flux(d, n), n) * (inversesqrt(square) / square) : FLUX(0.0);
    }
    vec3 d = p - s.eye;
    float height = dot(d, s.normal);
    float square = dot(d, d);
    vec3 from_middle = p - s.middle;
    float square_middle = dot(from_middle, from_middle);
    // Heights of p over the planes of the members: the cone of normals and the ball bound them.
    float flat_part = sqrt(max(square - height * height, 0.0));
    bool whole = s.cone_sin == 0.0 || height * s.cone_cos - flat_part * s.cone_sin - s.radius > 0.0;
    bool far = whole && s.radius * s.radius <= FAR * FAR * square_middle;
    bool above = dot(d, n) <= -s.radius && square >= ACUTE * s.radius * s.radius;
    bool points = sqrt(square) - s.radius >= POINT_DISTANCE * s.member_radius;

    FLUX result = FLUX(0.0);
    if (wanted && far) {
        float projected = s.facing * dot(s.normal, from_middle);
        result = flux_above(flux(-from_middle, n), n) * (projected / (3.14159265 * square_middle * square_middle));
    }
    bool mine = wanted && whole && !far && above;
    if (subgroupAny(mine)) {
        FLUX f = outline_above(p, n, s);
        result = mine ? f : result;
    }
    mine = wanted && whole && !far && !above;
    if (subgroupAny(mine)) {
        FLUX f = outline(p, n, s);
        result = mine ? f : result;
    }
    mine = wanted && !whole && points;
    if (subgroupAny(mine)) {
        FLUX f = members_as_points(p, n, s);
        result = mine ? f : result;
    }
    mine = wanted && !whole && !points;
    if (subgroupAny(mine)) {
        FLUX f = members(p, n, element, s);
        result = mine ? f : result;
    }
    return result;
}

// Whether a source can show its front at p.
bool shows_front(Source s, vec3 p) {
    vec3 d = p - s.eye;
    float height = dot(d, s.normal);
    if (s.kind == KIND_POINT) {
        // Each of the two sources of a point light serves its own side; the upper one has the plane between them.
        return s.cone_sin == 0.0 ? height >= 0.0 : height > 0.0;
    }
    if (s.cone_sin == 0.0) {
        return height > HEIGHT_EPSILON * s.radius;
    }
    float flat_part = sqrt(max(dot(d, d) - height * height, 0.0));
    return height * s.cone_cos + flat_part * s.cone_sin + s.radius > 0.0;
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

// Whether the whole source lies behind an element.
bool behind(Source s, vec3 middle, vec3 n) {
    return dot(middle - s.eye, n) >= s.radius;
}

// Mean over the element of form factor (see FLUX) times visibility, where `wanted`.
FLUX mean_form_factor(uint element, vec4 ball, vec3 n, uint slot, Source s, bool wanted) {
    float gap = length(ball.xyz - s.eye) - s.radius;
    bool near = gap <= 4.0 * ball.w;
    bool touching = gap <= ball.w;
    bool any_near = subgroupAny(wanted && near);
    vec3 a = vec3(0.0);
    vec3 ab = vec3(0.0);
    vec3 ac = vec3(0.0);
    if (any_near) {
        a = own_corner(element, 0);
        ab = own_corner(element, 1) - a;
        ac = own_corner(element, 2) - a;
    }
    FLUX sum = FLUX(0.0);
    for (uint i = 0; i < (any_near ? 11 : 1); i++) {
        bool mine = wanted && (i == 0 ? !near : i < 4 ? near && !touching : near && touching);
        vec3 point = POINTS[i];
        vec3 p = i == 0 ? ball.xyz : a + point.x * ab + point.y * ac;
        mine = mine && shows_front(s, p);
        if (!subgroupAny(mine)) {
            continue;
        }
        mine = mine && visible(p, n, element, slot, s);
        if (subgroupAny(mine)) {
            sum += point.z * form_factor(p, n, element, s, mine);
        }
    }
    return sum;
}

void main() {
    uint slot = gl_WorkGroupID.y;
    uint source = slots[slot].source;
    if (source == NONE) {
        return;
    }
    // The lanes past the last element do as that does.
    uint i = min(gl_GlobalInvocationID.x, element_count - 1);
    uint e = first_element + i;
    Source s = load_source(source);
    vec4 ball = balls[e];
    vec3 n = planes[e].xyz;
    bool wanted = !behind(s, ball.xyz, n);
    FLUX f = FLUX(0.0);
    if (subgroupAny(wanted)) {
        f = mean_form_factor(e, ball, n, slot, s, wanted);
    }
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
    fresh[slot * element_count + i] = f;
    if (subgroupAny(lit) && subgroupElect()) {
        atomicOr(occupied[slot * block_count + first_block + gl_WorkGroupID.x], 1);
    }
}
