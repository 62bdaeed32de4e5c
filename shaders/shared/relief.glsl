// A tile of relief as a periodic triangulated surface: src/meso/height_field.rs is the same in f64.
// Lengths are in widths of a cell. Including files have the bindings heights of float and the push
// constants below.

layout(push_constant, scalar) uniform Parameters {
    uint columns;
    uint rows;
    float aspect;     // height of a cell over its width
    float highest;
    uint first;       // of the work items of this dispatch
    uint count;
};

// The cell at a place, in the first period. A quotient of integers rounds to no other integer, and
// division of integers is dear.
vec2 cell_at(vec2 at) {
    vec2 low = floor(at);
    vec2 size = vec2(columns, rows);
    return low - size * floor(low / size);
}

// The corner at a facet's right angle, and those to its right (or left) and above (or below) it.
vec3 corners_of(vec2 cell, bool lower) {
    vec2 next = cell + 1.0;
    next = mix(next, vec2(0.0), equal(next, vec2(columns, rows)));
    uvec2 i = uvec2(cell);
    uvec2 j = uvec2(next);
    float right = heights[i.y * columns + j.x];
    float up = heights[j.y * columns + i.x];
    uvec2 square = lower ? i : j;
    return vec3(heights[square.y * columns + square.x], lower ? vec2(right, up) : vec2(up, right));
}

// Height of the surface at a place in cells.
float height_at(vec2 at) {
    vec2 f = at - floor(at);
    bool lower = f.x + f.y <= 1.0;
    vec3 corner = corners_of(cell_at(at), lower);
    vec2 from = lower ? f : 1.0 - f;
    return corner.x + dot(from, corner.yz - corner.x);
}

// The facet at a place in cells.
uint facet_at(vec2 at) {
    vec2 f = at - floor(at);
    uvec2 cell = uvec2(cell_at(at));
    return 2 * (cell.y * columns + cell.x) + (f.x + f.y <= 1.0 ? 0 : 1);
}

struct Facet {
    vec3 centre;    // x and y in cells, z in widths of a cell
    vec3 normal;
};

Facet facet_of(uint facet) {
    vec2 cell = vec2(facet / 2 % columns, facet / 2 / columns);
    bool lower = facet % 2 == 0;
    vec3 corner = corners_of(cell, lower);
    vec2 slope = (corner.yz - corner.x) * (lower ? 1.0 : -1.0);
    float share = lower ? 1.0 / 3.0 : 2.0 / 3.0;
    return Facet(vec3(cell + share, (corner.x + corner.y + corner.z) / 3.0), normalize(vec3(-slope.x, -slope.y / aspect, 1.0)));
}

// Distances along a straight line at which it crosses the edges of facets, in order. Between two
// crossings the surface below the line is plane.
struct Crossings {
    vec3 next;    // of lines x = const, y = const, x + y = const
    vec3 each;
};

const float NEVER = 1e30;

// `step` is in cells for a unit of distance.
Crossings crossings_begin(vec2 from, vec2 step) {
    vec3 at = vec3(from, from.x + from.y);
    vec3 along = vec3(step, step.x + step.y);
    vec3 ahead = mix(floor(at) - at, floor(at) + 1.0 - at, greaterThan(along, vec3(0.0)));
    bvec3 flat_along = lessThan(abs(along), vec3(1e-12));
    vec3 safe = mix(along, vec3(1.0), flat_along);
    return Crossings(mix(ahead / safe, vec3(NEVER), flat_along), mix(1.0 / abs(safe), vec3(NEVER), flat_along));
}

float crossings_next(inout Crossings c) {
    float nearest = min(c.next.x, min(c.next.y, c.next.z));
    c.next += mix(vec3(0.0), c.each, lessThanEqual(c.next, vec3(nearest)));
    return nearest;
}

// Most crossings of one line: four rounds of the largest tile.
const uint MOST_CROSSINGS = 4096;
