// Form factor, with visibility, from every element to every source of a batch. VECTOR_FLUX: the elements of this dispatch
// receive by direction, and get the vector whose dot product with the normal is the form factor.

#include "shared/types.glsl"
#include "shared/hemicube.glsl"
#include "shared/lambert.glsl"
#include "shared/kept.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
// xyz: a corner; w: 1 where a loop of the contour starts (each loop ends with its first corner again).
layout(scalar, binding = 2) readonly buffer Contours { vec4 contours[]; };
layout(scalar, binding = 3) readonly buffer Indices { uint corners[]; };
layout(scalar, binding = 4) readonly buffer Vertices { vec3 vertices[]; };
// xyz: unit normal n; w: n · x on the plane.
layout(scalar, binding = 5) readonly buffer Planes { vec4 planes[]; };
// xyz: centroid; w: radius of the ball about it that holds the element.
layout(scalar, binding = 6) readonly buffer Balls { vec4 balls[]; };
layout(scalar, binding = 7) readonly buffer Areas { float element_area[]; };
// Whether any element of a block of GROUP sees the source, [slot][block].
layout(scalar, binding = 8) writeonly buffer Occupied { uint occupied[]; };
// [slot][element of this dispatch]
layout(scalar, binding = 9) writeonly buffer Fresh { FLUX fresh[]; };
layout(binding = 10) uniform usampler2D items;
#ifdef VECTOR_FLUX
layout(scalar, binding = 11) readonly buffer MesoElements { MesoElement meso_elements[]; };
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

// Form factor (see FLUX) from p (normal n) to the whole source, as if nothing stood between.
FLUX form_factor(vec3 p, vec3 n, uint element, Source s) {
    if (s.kind == KIND_POINT) {
        vec3 d = s.eye - p;
        float square = dot(d, d);
        // Each of the two sources of a point light serves its own side; the upper one has the plane between them.
        bool mine = s.cone_sin == 0.0 ? dot(d, s.normal) <= 0.0 : dot(d, s.normal) < 0.0;
        return mine ? flux_above(flux(d, n), n) * (inversesqrt(square) / square) : FLUX(0.0);
    }
    vec3 d = p - s.eye;
    float height = dot(d, s.normal);
    vec3 from_middle = p - s.middle;
    float square = dot(from_middle, from_middle);
    bool far = s.radius * s.radius <= FAR * FAR * square;
    // Of the receiver's cosine and the distances, all that a far source's projected area is multiplied by.
    FLUX far_factor = flux_above(flux(-from_middle, n), n) / (3.14159265 * square * square);
    if (s.cone_sin == 0.0) {
        if (height <= HEIGHT_EPSILON * s.radius) {
            return FLUX(0.0);
        }
        if (far) {
            return far_factor * s.area * height;
        }
    } else {
        // Heights of p over the planes of the members: the cone of normals and the ball bound them.
        float flat_part = sqrt(max(dot(d, d) - height * height, 0.0));
        float lowest = height * s.cone_cos - flat_part * s.cone_sin - s.radius;
        float highest = height * s.cone_cos + flat_part * s.cone_sin + s.radius;
        if (highest <= 0.0) {
            return FLUX(0.0);
        }
        if (lowest <= 0.0) {
            // Some members show their backs: each by itself.
            if (far) {
                float facing_area = 0.0;
                for (uint i = 0; i < s.element_count; i++) {
                    uint member = s.first_element + i;
                    float facing = dot(planes[member].xyz, from_middle);
                    facing_area += element_area[member] * max(facing, 0.0);
                }
                return far_factor * facing_area;
            }
            FLUX sum = FLUX(0.0);
            for (uint i = 0; i < s.element_count; i++) {
                uint member = s.first_element + i;
                vec4 plane = planes[member];
                if (member == element || dot(plane.xyz, p) - plane.w <= 0.0) {
                    continue;
                }
                vec3 a = vertices[corners[3 * member]] - p;
                vec3 b = vertices[corners[3 * member + 1]] - p;
                vec3 c = vertices[corners[3 * member + 2]] - p;
                Contour contour = contour_begin();
                contour_edge(contour, a, b, n);
                contour_edge(contour, b, c, n);
                contour_edge(contour, c, a, n);
                contour_close(contour, n);
                sum += flux_above(contour_form_factor(contour), n);
            }
            return sum;
        }
    }
    Contour contour = contour_begin();
    vec3 last = contours[s.first_contour].xyz - p;
    for (uint i = 1; i < s.contour_count; i++) {
        vec4 corner = contours[s.first_contour + i];
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

// Mean over the element of form factor (see FLUX) times visibility.
FLUX gather(uint element, vec4 ball, vec3 n, uint slot, Source s) {
    vec3 d = ball.xyz - s.eye;
    float gap = length(d) - s.radius;
    bool near = gap <= 4.0 * ball.w;
    uint first = near ? (gap > ball.w ? 1 : 4) : 0;
    uint end = near ? (gap > ball.w ? 4 : 11) : 1;
    vec3 a = vec3(0.0);
    vec3 ab = vec3(0.0);
    vec3 ac = vec3(0.0);
    if (near) {
        a = vertices[corners[3 * element]];
        ab = vertices[corners[3 * element + 1]] - a;
        ac = vertices[corners[3 * element + 2]] - a;
    }
    FLUX sum = FLUX(0.0);
    for (uint i = first; i < end; i++) {
        vec3 point = POINTS[i];
        vec3 p = near ? a + point.x * ab + point.y * ac : ball.xyz;
        FLUX f = form_factor(p, n, element, s);
        if (f != FLUX(0.0) && visible(p, n, element, slot, s)) {
            sum += point.z * f;
        }
    }
    return sum;
}

shared uint any_seen;

void main() {
    uint slot = gl_WorkGroupID.y;
    Slot shot = slots[slot];
    if (shot.source == NONE) {
        return;
    }
    if (gl_LocalInvocationID.x == 0) {
        any_seen = 0;
    }
    barrier();
    uint i = gl_GlobalInvocationID.x;
    uint e = first_element + i;
    if (i < element_count) {
        Source s = sources[shot.source];
        vec4 ball = balls[e];
        vec3 n = planes[e].xyz;
        FLUX f = FLUX(0.0);
        if (!behind(s, ball.xyz, n)) {
            f = gather(e, ball, n, slot, s);
        }
#ifdef VECTOR_FLUX
        MesoElement meso = meso_elements[i];
        vec3 local = vec3(dot(meso.tangent, f), dot(meso.bitangent, f), dot(n, f));
        float strength = as_kept(length(local));
        if (strength > 0.0) {
            any_seen = 1;
            local = strength * kept_direction(direction_code(local / strength));
        } else {
            local = vec3(0.0);
        }
        fresh[slot * element_count + i] = local;
#else
        f = as_kept(f);
        if (f > 0.0) {
            any_seen = 1;
        }
        fresh[slot * element_count + i] = f;
#endif
    }
    barrier();
    if (gl_LocalInvocationID.x == 0) {
        occupied[slot * block_count + first_block + gl_WorkGroupID.x] = any_seen;
    }
}
