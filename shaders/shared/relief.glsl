// A tile of relief as a periodic triangulated surface: src/meso/height_field.rs is the same in f64. Lengths are in widths
// of a cell. Including files have the bindings heights of float and the push constants below.

layout(push_constant, scalar) uniform Parameters {
    uint columns;
    uint rows;
    float aspect;     // height of a cell over its width
    float highest;
    uint first;       // of the work items of this dispatch
    uint count;
};

float point(ivec2 at) {
    ivec2 size = ivec2(columns, rows);
    ivec2 wrapped = at % size;
    wrapped += size * ivec2(lessThan(wrapped, ivec2(0)));
    return heights[wrapped.y * columns + wrapped.x];
}

// Height of the surface at a place in cells.
float height_at(vec2 at) {
    vec2 low = floor(at);
    ivec2 i = ivec2(low);
    vec2 f = at - low;
    float right = point(i + ivec2(1, 0));
    float up = point(i + ivec2(0, 1));
    if (f.x + f.y <= 1.0) {
        float corner = point(i);
        return corner + f.x * (right - corner) + f.y * (up - corner);
    }
    float corner = point(i + ivec2(1, 1));
    return corner + (1.0 - f.x) * (up - corner) + (1.0 - f.y) * (right - corner);
}

// The facet at a place in cells.
uint facet_at(vec2 at) {
    vec2 low = floor(at);
    vec2 f = at - low;
    vec2 size = vec2(columns, rows);
    uvec2 cell = uvec2(low - size * floor(low / size));
    return 2 * (cell.y * columns + cell.x) + (f.x + f.y <= 1.0 ? 0 : 1);
}

struct Facet {
    vec3 centre;    // x and y in cells, z in widths of a cell
    vec3 normal;
};

Facet facet_of(uint facet) {
    uint cell = facet / 2;
    ivec2 i = ivec2(cell % columns, cell / columns);
    float right = point(i + ivec2(1, 0));
    float up = point(i + ivec2(0, 1));
    bool lower = facet % 2 == 0;
    float corner = point(lower ? i : i + ivec2(1, 1));
    vec2 slope = lower ? vec2(right - corner, up - corner) : vec2(corner - up, corner - right);
    float share = lower ? 1.0 / 3.0 : 2.0 / 3.0;
    return Facet(vec3(vec2(i) + share, (corner + right + up) / 3.0), normalize(vec3(-slope.x, -slope.y / aspect, 1.0)));
}

// Distances along a straight line at which it crosses the edges of facets, in order. Between two crossings the surface
// below the line is plane.
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
