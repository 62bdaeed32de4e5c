// Where a ray through a prism over a triangle meets its relief: the prism is cut into three
// tetrahedra, in each of which texture coordinates and height are linear. After
// shared/height_march.glsl.

// Shares of its size that a tetrahedron is padded by.
const float PADDING = 2e-5;
// Share of a prism's height that counts as its bottom; MARGIN of src/render/relief_mesh.rs lies
// below the relief.
const float BOTTOM = 5e-4;

// A place on the relief.
struct Place {
    vec2 uv;
    vec3 share;          // of the triangle's corners a, b, c
    float along;         // on the ray, from corner_position
    vec2 gradient;       // dh/du, dh/dv
    float height;
    mat3 slopes;         // of u, v and height in space, an internal unit
    bool under;          // seen from below
};

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

// A corner of a tetrahedron.
struct Corner {
    vec3 position;
    vec3 uvh;
    vec3 share;
};

struct Tetrahedron {
    Corner a;
    Corner b;
    Corner c;
    Corner d;
};

// From space to the shares of the corners b, c and d.
mat3 turn_of(Tetrahedron t) {
    mat3 edges = mat3(t.b.position - t.a.position, t.c.position - t.a.position,
                      t.d.position - t.a.position);
    float volume = determinant(edges);
    return volume == 0.0 ? mat3(0.0) : inverse(edges);
}

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

// Where the ray first meets the relief (or, for `plane`, the mean height) within a part of it.
bool meet_part(Part part, ReliefSurface surface, HeightTile tile, bool plane, out Place place) {
    if (part.leave <= part.enter) {
        return false;
    }
    vec3 from = part.from;
    vec3 to = part.to;
    float t;
    if (plane) {
        float above = from.z - surface.mean;
        float below = to.z - surface.mean;
        if (!(above >= 0.0 && below < 0.0)) {
            return false;
        }
        t = above / (above - below);
        place.gradient = vec2(0.0);
        place.height = surface.mean;
        place.under = false;
    } else {
        HeightHit hit;
        if (!march(tile, from, to, hit)) {
            return false;
        }
        // A ray that comes in through the bottom shows the underside; one that comes in below the
        // surface through a side, at a seam of heights, shows the step.
        place.under = hit.t == 0.0
                      && from.z < surface.lowest + BOTTOM * (surface.top - surface.lowest);
        t = hit.t;
        place.gradient = hit.gradient;
        place.height = hit.height;
    }
    place.uv = mix(from.xy, to.xy, t);
    place.share = mix(part.first, part.last, t);
    place.along = mix(part.enter, part.leave, t);
    return true;
}

// The same within the prism.
bool meet(Prism p, ReliefSurface surface, HeightTile tile, vec3 along, bool plane,
          out Place place) {
    const vec3 A = vec3(1.0, 0.0, 0.0);
    const vec3 B = vec3(0.0, 1.0, 0.0);
    const vec3 C = vec3(0.0, 0.0, 1.0);
    Corner low_a = Corner(p.low_a, vec3(p.uv_a, surface.lowest), A);
    Corner low_b = Corner(p.low_b, vec3(p.uv_b, surface.lowest), B);
    Corner low_c = Corner(p.low_c, vec3(p.uv_c, surface.lowest), C);
    Corner high_a = Corner(p.high_a, vec3(p.uv_a, surface.top), A);
    Corner high_b = Corner(p.high_b, vec3(p.uv_b, surface.top), B);
    Corner high_c = Corner(p.high_c, vec3(p.uv_c, surface.top), C);
    Tetrahedron low = Tetrahedron(low_a, low_b, low_c, high_c);
    Tetrahedron middle = Tetrahedron(low_a, low_b, high_b, high_c);
    Tetrahedron high = Tetrahedron(low_a, high_a, high_b, high_c);
    Part parts_low = cut(low, corner_position, along);
    Part parts_middle = cut(middle, corner_position, along);
    Part parts_high = cut(high, corner_position, along);

    // Nearest first: the middle one lies between the others, so that the ray meets the low or the
    // high one first.
    bool from_high = parts_high.enter < parts_low.enter && parts_high.leave > parts_high.enter
                   || parts_low.leave <= parts_low.enter;
    bool in_middle_first = parts_middle.leave > parts_middle.enter
        && parts_middle.enter < min(parts_low.leave > parts_low.enter ? parts_low.enter : NEVER,
                                    parts_high.leave > parts_high.enter ? parts_high.enter : NEVER);
    uint found = 3;
    for (uint round = 0; round < 3 && found == 3; round++) {
        uint which;
        if (in_middle_first) {
            which = round == 0 ? 1 : (round == 1) == from_high ? 2 : 0;
        } else {
            which = round == 1 ? 1 : (round == 0) == from_high ? 2 : 0;
        }
        Part part = which == 0 ? parts_low : which == 1 ? parts_middle : parts_high;
        if (meet_part(part, surface, tile, plane, place)) {
            found = which;
        }
    }
    if (found == 3) {
        return false;
    }
    Tetrahedron t = found == 0 ? low : found == 1 ? middle : high;
    mat3 edges = mat3(t.b.uvh - t.a.uvh, t.c.uvh - t.a.uvh, t.d.uvh - t.a.uvh);
    place.slopes = transpose(edges * turn_of(t));
    return true;
}

// Of the surface, outward.
vec3 facet_normal(Place place) {
    return normalize(place.slopes * vec3(-place.gradient, 1.0));
}
