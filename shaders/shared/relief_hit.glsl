// Where the ray through a sample meets the relief of the prism that is drawn. Included after
// shared/height_march.glsl, shared/prisms.glsl and shared/any_lane.glsl; SHADING is one of
// SHADING_….

layout(location = 0) in vec3 corner_position;
layout(location = 1) flat in uint corner_prism;

// Shares of its size that a tetrahedron is padded by.
const float PADDING = 2e-5;
// Share of a prism's height that counts as its bottom; MARGIN of
// src/render/relief_surfaces.rs lies below the relief.
const float BOTTOM = 5e-4;

// The part of the ray in a tetrahedron: places on the ray, texture coordinates with height and the
// shares of the triangle's corners at both ends.
struct Part {
    float enter;
    float leave;
    vec3 from;
    vec3 to;
    vec3 first;
    vec3 last;
};

Part cut(Tetrahedron t, vec3 from, vec3 along) {
    mat3 turn = turn_of(t);
    vec3 start = turn * (from - t.a.position);
    vec3 each = turn * along;
    vec4 at = vec4(1.0 - start.x - start.y - start.z, start);
    vec4 rate = vec4(-each.x - each.y - each.z, each);
    // Each share is positive behind its zero or before it. The ray begins at the eye, at s = -1.
    bvec4 grows = greaterThan(rate, vec4(0.0));
    bvec4 falls = lessThan(rate, vec4(0.0));
    // A little wider than it is, so that a ray along a side that two of them share lies in one for
    // certain.
    vec4 padded = at + PADDING;
    vec4 zero = -padded / mix(vec4(1.0), rate, notEqual(rate, vec4(0.0)));
    vec4 behind = mix(vec4(-1.0), zero, grows);
    vec4 before = mix(mix(vec4(NEVER), vec4(-NEVER), lessThan(padded, vec4(0.0))),
                      mix(vec4(NEVER), zero, falls), notEqual(rate, vec4(0.0)));
    Part part;
    part.enter = max(max(max(behind.x, behind.y), max(behind.z, behind.w)), -1.0);
    part.leave = min(min(before.x, before.y), min(before.z, before.w));
    vec4 first = at + part.enter * rate;
    vec4 last = at + part.leave * rate;
    part.from = first.x * t.a.uvh + first.y * t.b.uvh + first.z * t.c.uvh + first.w * t.d.uvh;
    part.to = last.x * t.a.uvh + last.y * t.b.uvh + last.z * t.c.uvh + last.w * t.d.uvh;
    part.first = first.x * t.a.share + first.y * t.b.share + first.z * t.c.share
                 + first.w * t.d.share;
    part.last = last.x * t.a.share + last.y * t.b.share + last.z * t.c.share + last.w * t.d.share;
    return part;
}

// A place on the ray, of the relief.
struct Met {
    float along;         // from corner_position
    vec3 share;          // of the triangle's corners
    float height;
    bool under;          // seen from below
};

// Where the ray first meets the relief (or, for `plane`, the mean height) within a part of it.
bool meet_part(Part part, ReliefSurface surface, HeightTile tile, bool plane, out Met met) {
    vec3 from = part.from;
    vec3 to = part.to;
    float t;
    if (SHADING != SHADING_RELIEF || plane) {
        float above = from.z - surface.mean;
        float below = to.z - surface.mean;
        if (!(above >= 0.0 && below < 0.0)) {
            return false;
        }
        t = above / (above - below);
        met.height = surface.mean;
        met.under = false;
    } else {
        HeightHit hit;
        if (!march(tile, from, to, hit)) {
            return false;
        }
        // A ray that comes in through the bottom shows the underside; one that comes in below the
        // surface through a side, at a seam of heights, shows the step.
        met.under = hit.t == 0.0
                    && from.z < surface.lowest + BOTTOM * (surface.top - surface.lowest);
        t = hit.t;
        met.height = hit.height;
    }
    met.share = mix(part.first, part.last, t);
    met.along = mix(part.enter, part.leave, t);
    return true;
}

// The tetrahedron of the prism in which the ray first meets the relief, 3 for none.
uint meet(Prism p, ReliefSurface surface, HeightTile tile, bool plane, out Met met) {
    vec3 along = corner_position;
    Part low = cut(tetrahedron_of(p, surface, 0), corner_position, along);
    Part middle = cut(tetrahedron_of(p, surface, 1), corner_position, along);
    Part high = cut(tetrahedron_of(p, surface, 2), corner_position, along);

    // Nearest first: the middle one lies between the others, so that the ray meets the low or the
    // high one first.
    bool from_high = high.enter < low.enter && high.leave > high.enter || low.leave <= low.enter;
    float others = min(low.leave > low.enter ? low.enter : NEVER,
                       high.leave > high.enter ? high.enter : NEVER);
    bool in_middle_first = middle.leave > middle.enter && middle.enter < others;
    uint nearer = from_high ? 2 : 0;
    uint first = in_middle_first ? 1 : nearer;
    uint second = in_middle_first ? nearer : 1;
    uint left = (low.leave > low.enter ? 1 : 0) | (middle.leave > middle.enter ? 2 : 0)
                | (high.leave > high.enter ? 4 : 0);
    uint found = 3;
    do {
        uint which = (left >> first & 1) != 0 ? first
                     : (left >> second & 1) != 0 ? second : 2 - nearer;
        Part part = which == 0 ? low : which == 1 ? middle : high;
        Met here;
        if (left != 0 && meet_part(part, surface, tile, plane, here)) {
            found = which;
            met = here;
        }
        left = found == 3 ? left & ~(1u << which) : 0;
    } while (any_lane(left != 0));
    return found;
}

// The hit of the ray, as shared/prisms.glsl says, and its depth; 0 where it meets nothing.
uvec4 hit_of_ray(float pixel, out float depth) {
    depth = 0.0;
    Prism p = load_prism(corner_prism);
    ReliefSurface surface = load_surface(p.surface);
    HeightTile tile = load_tile(p.surface);
    float footprint = length(corner_position) * pixel / p.texel;
    bool wide = SHADING == SHADING_RELIEF && footprint > float(WIDEST_SAMPLE);
    Met met;
    uint which = meet(p, surface, tile, wide, met);
    if (which == 3) {
        return uvec4(0);
    }
    depth = near / dot((1.0 + met.along) * corner_position, w);
    uint marks = (wide ? HIT_WIDE : 0) | (met.under ? HIT_UNDER : 0);
    return uvec4(1 + corner_prism | which << PRISM_BITS | marks,
                 floatBitsToUint(vec3(met.share.yz, met.height)));
}
