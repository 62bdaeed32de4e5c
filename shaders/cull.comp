// Lists the occluders that each face of each chosen hemicube must draw: one subgroup a face, in
// their order, so that the list is the same every run. A meshlet falls as a whole where the face's
// frustum or the shooter's horizon leaves it out or where it shows its back; a triangle falls also
// where it covers no pixel's centre. Where a list has no room for all, the next part goes on where
// it ended, once what it holds is drawn.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint CULL_MESHLETS = 1;
layout(constant_id = 2) const uint CULL_TRIANGLES = 1;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Meshlets { Meshlet meshlets[]; };
layout(scalar, binding = 3) readonly buffer Components { Component components[]; };
// Of the occluders.
layout(scalar, binding = 4) readonly buffer Indices { uint corners[]; };
layout(scalar, binding = 5) readonly buffer Vertices { vec3 vertices[]; };
// Of the elements.
layout(scalar, binding = 6) readonly buffer Planes { vec4 planes[]; };
layout(scalar, binding = 7) writeonly buffer Drawn { uint drawn_corners[]; };
layout(scalar, binding = 8) writeonly buffer Items { uint drawn_items[]; };
layout(scalar, binding = 9) writeonly buffer Draws { Draw draws[]; };
layout(scalar, binding = 10) writeonly buffer Views { View views[]; };
// [slot][face]: meshlets kept, triangles looked at, triangles listed; of all parts so far.
layout(scalar, binding = 11) buffer Counts { uvec3 counts[]; };
// [occluder]: the element that it is drawn as.
layout(scalar, binding = 12) readonly buffer OccluderItems { uint items[]; };
// [slot][face]: the meshlet that the next part begins with.
layout(scalar, binding = 13) buffer Resume { uint resume[]; };

layout(push_constant, scalar) uniform Parameters {
    uint meshlet_count;
    uint room;           // of a list, triangles; a meshlet's at least
    uint face_size;      // pixels
    uint part;
};

// Rounding of a plane's height at a point: a few steps of f32 at coordinates up to 1.
const float EYE_EPSILON = 1e-6;
// Most pixel centres that are tried one by one.
const float FEW = 4.0;
const float SQRT_2 = 1.41421357;
layout(constant_id = 3) const uint SUBPIXEL_BITS = 4;
// How far the rasteriser's rounding may move a corner, in pixels, with some room for that of the
// projection.
float snap() {
    return 1.0 / float(1u << SUBPIXEL_BITS) + 1.0 / 1024.0;
}

View face_view(Source s, uint face) {
    vec3 n = s.normal;
    vec3 side = face < 3 ? s.tangent : s.bitangent;
    vec3 w = (face & 1u) == 1u ? side : -side;
    vec3 x = face < 3 ? s.bitangent : s.tangent;
    if (face == 0) {
        return View(s.eye, s.tangent, s.bitangent, n);
    }
    // The upper half alone: clip y runs from −w to w while the height runs from 0 to w.
    return View(s.eye, x, 2.0 * n - w, w);
}

bool faces_away(Source s, uint component) {
    // Seen from outside, a closed part's back faces lie behind its front faces. A source on the
    // part itself stands on its front; elsewhere, outside its box is outside.
    Component c = components[component];
    if (c.closed == 0) {
        return false;
    }
    return (s.kind == KIND_SURFACE && s.component == component)
        || any(lessThan(s.eye, c.low)) || any(greaterThan(s.eye, c.high));
}

bool meshlet_seen(Source s, View v, Meshlet m, bool away) {
    vec3 d = m.centre - v.eye;
    float x = dot(d, v.x);
    float y = dot(d, v.y);
    float w = dot(d, v.w);
    // The planes w ± x and w ± y are √2 long at most but for sides' y = 2 n − w, where w − y = 2 (w
    // − n) and w + y = 2 n.
    float margin = 2.0 * SQRT_2 * m.radius;
    bool inside = dot(d, s.normal) > -m.radius && w - abs(x) > -SQRT_2 * m.radius && w - abs(y) > -margin;
    return inside && !(away && dot(d, m.axis) >= m.cutoff * length(d) + m.radius);
}

// `size`: the face's pixels across and down.
bool triangle_seen(View v, vec2 size, vec3 a, vec3 b, vec3 c) {
    vec3 da = a - v.eye;
    vec3 db = b - v.eye;
    vec3 dc = c - v.eye;
    vec3 x = vec3(dot(da, v.x), dot(db, v.x), dot(dc, v.x));
    vec3 y = vec3(dot(da, v.y), dot(db, v.y), dot(dc, v.y));
    vec3 w = vec3(dot(da, v.w), dot(db, v.w), dot(dc, v.w));
    if (all(lessThanEqual(w, vec3(0.0))) || all(greaterThan(x, w)) || all(lessThan(x, -w))
        || all(greaterThan(y, w)) || all(lessThan(y, -w))) {
        return false;
    }
    if (any(lessThanEqual(w, vec3(1e-6)))) {
        return true;
    }
    vec3 col = (x / w * 0.5 + 0.5) * size.x - 0.5;
    vec3 row = (y / w * 0.5 + 0.5) * size.y - 0.5;
    // Pixel centres are the whole numbers now: is there one in the box?
    vec2 low = vec2(min(col.x, min(col.y, col.z)), min(row.x, min(row.y, row.z))) - snap();
    vec2 high = vec2(max(col.x, max(col.y, col.z)), max(row.x, max(row.y, row.z))) + snap();
    vec2 first = ceil(low);
    vec2 last = floor(high);
    if (any(lessThan(last, first))) {
        return false;
    }
    vec2 count = last - first + 1.0;
    if (count.x * count.y > FEW) {
        return true;
    }
    // Few centres: is one of them inside the three edges?
    vec2 pa = vec2(col.x, row.x);
    vec2 pb = vec2(col.y, row.y);
    vec2 pc = vec2(col.z, row.z);
    vec2 ab = pb - pa;
    vec2 bc = pc - pb;
    vec2 ca = pa - pc;
    float side = ab.x * bc.y - ab.y * bc.x >= 0.0 ? 1.0 : -1.0;
    vec3 slack = 2.0 * snap() * vec3(abs(ab.x) + abs(ab.y), abs(bc.x) + abs(bc.y), abs(ca.x) + abs(ca.y));
    bool covered = false;
    for (float r = first.y; r <= last.y; r += 1.0) {
        for (float c = first.x; c <= last.x; c += 1.0) {
            vec2 p = vec2(c, r);
            vec3 inside = side * vec3(
                ab.x * (p.y - pa.y) - ab.y * (p.x - pa.x),
                bc.x * (p.y - pb.y) - bc.y * (p.x - pb.x),
                ca.x * (p.y - pc.y) - ca.y * (p.x - pc.x)
            );
            covered = covered || all(greaterThanEqual(inside, -slack));
        }
    }
    return covered;
}

void main() {
    uint face = gl_WorkGroupID.x;
    uint region = gl_WorkGroupID.y * FACES + face;
    uint lane = gl_SubgroupInvocationID;
    uint source_index = slots[gl_WorkGroupID.y].source;
    uint written = 0;
    uint meshlets_kept = 0;
    uint triangles_tested = 0;
    uint first_out = region * room;
    uint begin = part == 0 ? 0 : resume[region];
    uint next = meshlet_count;
    if (source_index != NONE) {
        Source s = sources[source_index];
        View view = face_view(s, face);
        vec2 size = vec2(face_size, face == 0 ? face_size : face_size / 2);
        if (lane == 0) {
            views[region] = view;
        }
        for (uint first = begin; first < next; first += gl_SubgroupSize) {
            uint mine = first + lane;
            bool keep = mine < meshlet_count;
            bool away = false;
            if (keep && CULL_MESHLETS == 1) {
                Meshlet m = meshlets[mine];
                keep = meshlet_seen(s, view, m, faces_away(s, m.component));
            }
            uvec4 kept = subgroupBallot(keep);
            while (any(notEqual(kept, uvec4(0)))) {
                uint bit = subgroupBallotFindLSB(kept);
                kept[bit / 32] &= ~(1u << (bit % 32));
                Meshlet m = meshlets[first + bit];
                if (written + m.count > room) {
                    next = first + bit;
                    break;
                }
                meshlets_kept++;
                bool m_away = faces_away(s, m.component);
                bool same = s.kind == KIND_SURFACE && m.component == s.component;
                bool own = same && components[m.component].closed == 1;
                triangles_tested += m.count;
                for (uint t = 0; t < m.count; t += gl_SubgroupSize) {
                    uint occluder = m.first + t + lane;
                    bool draw = t + lane < m.count;
                    uvec3 corner = uvec3(0);
                    uint item = NONE;
                    if (draw) {
                        corner = uvec3(corners[3 * occluder], corners[3 * occluder + 1], corners[3 * occluder + 2]);
                        item = items[occluder];
                        // What lies in one plane with the eye, on the part that it stands on, is
                        // seen edge-on, if at all: rounding must not draw it. Nor does an eye on a
                        // closed part see that part's backs, which its group does not stand behind.
                        vec4 plane = vec4(0.0);
                        if (same || (CULL_TRIANGLES == 1 && m_away)) {
                            plane = planes[item];
                        }
                        float height = dot(plane.xyz, view.eye) - plane.w;
                        draw = !(same && abs(height) <= EYE_EPSILON) && !(own && height <= 0.0);
                        if (CULL_TRIANGLES == 1) {
                            draw = draw && !(m_away && height <= 0.0)
                                && triangle_seen(view, size, vertices[corner.x], vertices[corner.y], vertices[corner.z]);
                        }
                    }
                    uvec4 drawn = subgroupBallot(draw);
                    if (draw) {
                        uint at = first_out + written + subgroupBallotExclusiveBitCount(drawn);
                        drawn_corners[3 * at] = corner.x;
                        drawn_corners[3 * at + 1] = corner.y;
                        drawn_corners[3 * at + 2] = corner.z;
                        drawn_items[at] = item;
                    }
                    written += subgroupBallotBitCount(drawn);
                }
            }
        }
    }
    if (lane == 0) {
        draws[region] = Draw(3 * written, written > 0 ? 1 : 0, 3 * first_out, 0);
        uvec3 count = uvec3(meshlets_kept, triangles_tested, written);
        counts[region] = part == 0 ? count : counts[region] + count;
        resume[region] = next;
    }
}
