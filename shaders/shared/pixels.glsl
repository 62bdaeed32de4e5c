// The pixel estimator where light has directions. One invocation owns an element: it looks through
// the part of each hemicube that its triangle can cover for the pixels that hold it, row by row, so
// that sums have one order. A dispatch takes one slot of the batch and some rows of its hemicube:
// lavapipe ends every loop of an invocation for good after 65,535 turns of all of them together.

#extension GL_EXT_control_flow_attributes : require

#include "shared/types.glsl"
#include "shared/hemicube.glsl"
#include "shared/directions.glsl"
#include "shared/texels.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Indices { uint corners[]; };
layout(scalar, binding = 3) readonly buffer Vertices { vec3 vertices[]; };
layout(scalar, binding = 4) readonly buffer Planes { vec4 planes[]; };
layout(scalar, binding = 5) readonly buffer Areas { float element_area[]; };
// Of a surface's form factor, then of a point's share of half the sphere; each [3 n][n].
layout(scalar, binding = 6) readonly buffer Deltas { float deltas[]; };
layout(scalar, binding = 7) buffer Direct { vec3 direct[]; };
layout(scalar, binding = 8) buffer DirectError { vec3 direct_error[]; };
layout(scalar, binding = 9) buffer Indirect { vec3 indirect[]; };
layout(scalar, binding = 10) buffer IndirectError { vec3 indirect_error[]; };
// Light that the sources with a relief send by direction, [slot][emitted, reflected][direction].
layout(binding = 11) uniform usamplerBuffer exits;
layout(binding = 12) uniform usampler2D items;
#ifdef TO_RELIEF
layout(scalar, binding = 13) readonly buffer MesoElements { MesoElement meso_elements[]; };
// Radiosity for each coefficient, [response][rank].
layout(binding = 14) uniform usamplerBuffer albedos;
// [meso element][direction][colour]
layout(scalar, binding = 15) buffer MomentsDirect { vec3 moments_direct[]; };
layout(scalar, binding = 16) buffer MomentsIndirect { vec3 moments_indirect[]; };
layout(scalar, binding = 17) buffer MesoReflected { Reflected meso_reflected[]; };
// Of each direction, and in w its share of a uniform sender's power.
layout(scalar, binding = 18) readonly buffer DirectionList { vec4 direction_list[]; };
// With `by_pixel` alone: where each meso element lies in its texture, the facets of all textures,
// and the light sent by direction, [meso element][direction].
layout(scalar, binding = 19) readonly buffer MesoTexels { MesoTexel meso_texels[]; };
layout(scalar, binding = 20) readonly buffer TextureFacets { TextureFacet texture_facets[]; };
layout(scalar, binding = 21) buffer Outgoing { vec3 outgoing[]; };
layout(binding = 22) uniform usamplerBuffer bases;
layout(scalar, binding = 23) buffer Coefficients { vec4 coefficients[]; };
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint slot;
    uint face_size;
    uint first_relief_source;
    uint relief_source_count;
    uvec2 cells;
    uvec2 kept_cells;         // of the slots
    uint by_pixel;            // 1: reflect by the normal and albedo of each pixel
    uint first_row;           // of the hemicube, of those that this dispatch looks at
    uint end_row;
};

#include "shared/accumulate.glsl"
#include "shared/sent.glsl"
#ifdef TO_RELIEF
#include "shared/relief_basis.glsl"
#include "shared/keep_coefficients.glsl"
#endif

// A triangle is cut off where it comes this near to the plane of the eye that a face looks along.
const float NEAR = 1e-6;
// A grazing pixel's light counts as coming from no lower than this.
const float LEAST_HEIGHT = 1e-3;

// A vector of the source's frame as the face sees it: along its axis, then across in columns and
// rows.
vec3 on_face(uint face, vec3 d) {
    switch (face) {
    case 0: return vec3(d.z, d.x, d.y);
    case 1: return vec3(d.x, d.y, d.z);
    case 2: return vec3(-d.x, d.y, d.z);
    case 3: return vec3(d.y, d.x, d.z);
    default: return vec3(-d.y, d.x, d.z);
    }
}

// First and last column and row of the pixels that a triangle (from the eye, in the source's frame)
// may cover on a face.
ivec4 pixels_on_face(uint face, vec3 triangle[3]) {
    vec2 low = vec2(2.0);
    vec2 high = vec2(-2.0);
    // What lies outside one side of the face's pyramid covers none of its pixels. Without this a
    // triangle through the plane of the eye would be looked for all over the face.
    vec3 inside_low = vec3(-1.0);
    vec3 inside_high = vec3(-1.0);
    for (uint i = 0; i < 3; i++) {
        vec3 p = on_face(face, triangle[i]);
        inside_low = max(inside_low, vec3(p.x, p.x + p.y, face == 0 ? p.x + p.z : p.z));
        inside_high = max(inside_high, vec3(p.x, p.x - p.y, p.x - p.z));
    }
    if (any(lessThan(inside_low, vec3(0.0))) || any(lessThan(inside_high, vec3(0.0)))) {
        return ivec4(0, -1, 0, -1);
    }
    for (uint i = 0; i < 3; i++) {
        vec3 p = on_face(face, triangle[i]);
        vec3 q = on_face(face, triangle[(i + 1) % 3]);
        if (p.x >= NEAR) {
            low = min(low, p.yz / p.x);
            high = max(high, p.yz / p.x);
        }
        if ((p.x >= NEAR) != (q.x >= NEAR)) {
            vec2 at = mix(p.yz, q.yz, (NEAR - p.x) / (q.x - p.x)) / NEAR;
            low = min(low, at);
            high = max(high, at);
        }
    }
    int size = int(face_size);
    bool top = face == 0;
    float least_row = top ? -1.0 : 0.0;
    if (any(greaterThan(low, vec2(1.0))) || high.x < -1.0 || high.y < least_row) {
        return ivec4(0, -1, 0, -1);
    }
    // A pixel more on each side, for rounding.
    ivec2 from = ivec2(floor((clamp(low, -1.0, 1.0) * 0.5 + 0.5) * float(size))) - 1;
    ivec2 to = ivec2(floor((clamp(high, -1.0, 1.0) * 0.5 + 0.5) * float(size))) + 1;
    int first_row = top ? 0 : size / 2;
    from = clamp(from, ivec2(0, first_row), ivec2(size - 1));
    to = clamp(to, ivec2(0, first_row), ivec2(size - 1));
    // A side face has its upper half alone, below the ones before it.
    int shift = top ? 0 : size + (int(face) - 1) * (size / 2) - first_row;
    return ivec4(from.x, to.x, from.y + shift, to.y + shift);
}

#ifdef TO_RELIEF
// The facet of its texture that a ray from the eye meets on an element.
uint texture_facet(uint m, vec3 eye, vec3 ray, vec3 a, vec3 b, vec3 c, vec3 n) {
    vec3 p = eye + ray * (dot(n, a - eye) / dot(n, ray)) - a;
    vec3 ab = b - a;
    vec3 ac = c - a;
    float whole = dot(n, cross(ab, ac));
    float s = dot(n, cross(p, ac)) / whole;
    float t = dot(n, cross(ab, p)) / whole;
    MesoTexel on = meso_texels[m];
    vec2 uv = on.uv_a + s * (on.uv_b - on.uv_a) + t * (on.uv_c - on.uv_a);
    vec2 size = vec2(on.columns, on.rows);
    // A point of the field stands for the middle of its texel.
    vec2 at = (uv - floor(uv)) * size - 0.5;
    vec2 cell = floor(at);
    vec2 within = at - cell;
    uvec2 place = uvec2(mod(cell, size));
    uint half_cell = within.x + within.y > 1.0 ? 1 : 0;
    return on.first + 2 * (min(place.y, on.rows - 1) * on.columns + min(place.x, on.columns - 1)) + half_cell;
}
#endif

void main() {
    uint e = first_element + gl_GlobalInvocationID.x;
    if (gl_GlobalInvocationID.x >= element_count) {
        return;
    }
    vec3 a = vertices[corners[3 * e]];
    vec3 b = vertices[corners[3 * e + 1]];
    vec3 c = vertices[corners[3 * e + 2]];
    vec4 plane = planes[e];
    uint directions = cells.x * cells.y;
    vec3 add_direct = vec3(0.0);
    vec3 add_indirect = vec3(0.0);
#ifdef TO_RELIEF
    uint m = gl_GlobalInvocationID.x;
    MesoElement meso = meso_elements[m];
    vec3 add_reflected = vec3(0.0);
    vec3 sums[RELIEF_RANK];
    for (uint r = 0; r < RELIEF_RANK; r++) {
        sums[r] = vec3(0.0);
    }
#endif
    Slot shot = slots[slot];
    if (shot.source == NONE) {
        return;
    }
    Source s = sources[shot.source];
    // A back blocks light and takes none.
    if (dot(plane.xyz, s.eye) > plane.w) {
        mat3 to_source = transpose(mat3(s.tangent, s.bitangent, s.normal));
        vec3 triangle[3] = vec3[](to_source * (a - s.eye), to_source * (b - s.eye), to_source * (c - s.eye));
        bool by_direction = shot.source - first_relief_source < relief_source_count;
        bool is_point = s.kind == KIND_POINT;
        // A point light sends intensity · solid angle; the table holds shares of 2π.
        float power = (is_point ? 6.28318531 : s.area) / element_area[e];
        uint table = is_point ? 3 * face_size * face_size : 0;
        for (uint face = 0; face < FACES; face++) {
            ivec4 range = pixels_on_face(face, triangle);
            range.z = max(range.z, int(first_row));
            range.w = min(range.w, int(end_row) - 1);
            for (int row = range.z; row <= range.w; row++) {
                for (int column = range.x; column <= range.y; column++) {
                    ivec2 pixel = ivec2(column, row);
                    if (texelFetch(items, ivec2(slot * face_size, 0) + pixel, 0).r != e) {
                        continue;
                    }
                    vec3 ray = normalize(hemicube_direction(pixel, face_size));
                    vec3 emitted = shot.emitted;
                    vec3 reflected = shot.reflected;
                    if (by_direction) {
                        emitted = shot.emitted == vec3(0.0) ? vec3(0.0) : sent_towards(slot, 0, ray);
                        reflected = sent_towards(slot, 1, ray);
                    }
                    float weight = deltas[table + uint(row) * face_size + uint(column)] * power;
                    emitted *= weight;
                    reflected *= weight;
                    add_direct += emitted;
                    add_indirect += reflected;
#ifdef TO_RELIEF
                    vec3 world = s.tangent * ray.x + s.bitangent * ray.y + s.normal * ray.z;
                    vec3 from = -vec3(dot(meso.tangent, world), dot(meso.bitangent, world), dot(plane.xyz, world));
                    // The moment whose height is the irradiance.
                    vec3 moment = vec3(from.xy / max(from.z, LEAST_HEIGHT), 1.0);
                    vec2 square = to_square(from);
                    uint at_moment = 3 * (m * kept_cells.x * kept_cells.y + cell_of(square, kept_cells));
                    for (uint colour = 0; colour < 3; colour++) {
                        moments_direct[at_moment + colour] += emitted[colour] * moment;
                        moments_indirect[at_moment + colour] += reflected[colour] * moment;
                    }
                    vec3 brought = emitted + reflected;
                    if (by_pixel == 1) {
                        TextureFacet facet = texture_facets[texture_facet(m, s.eye, world, a, b, c, plane.xyz)];
                        vec3 sent = facet.reflectance * brought;
                        for (uint j = 0; j < directions; j++) {
                            vec4 of = direction_list[j];
                            if (dot(facet.normal, of.xyz) > 0.0) {
                                outgoing[m * directions + j] += sent;
                                add_reflected += of.w * sent;
                            }
                        }
                    } else {
                        Functions functions = no_functions();
                        add_functions(functions, meso.response, square, 1.0);
                        add_light(sums, functions, brought);
                    }
#endif
                }
            }
        }
    }
    accumulate(direct[e], direct_error[e], add_direct);
    accumulate(indirect[e], indirect_error[e], add_indirect);
#ifdef TO_RELIEF
    if (by_pixel == 1) {
        accumulate(meso_reflected[m].sum, meso_reflected[m].error, add_reflected);
    } else {
        keep_coefficients(m, meso, sums);
    }
#endif
}
