// Relief mapping: the ray through the pixel is followed through the prism over a triangle, cut into
// three tetrahedra in each of which texture coordinates and height are linear, to where it first
// passes below the height map. Radiance there is ρ E / π + Le with E = Σ_r a_r β_r, the factors of
// the relief and the light of the vertices (src/meso/factors.rs).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/types.glsl"
#include "shared/directions.glsl"

struct Coefficient {
    vec3 inside;
    vec3 arriving;
};

layout(location = 0) in vec3 corner_position;
layout(location = 1) flat in uint corner_prism;

layout(location = 0) out vec4 radiance;

layout(binding = 0) uniform sampler2D albedo;
layout(scalar, binding = 1) readonly buffer Prisms { Prism prisms[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { ReliefSurface surfaces[]; };
// [surface]
layout(scalar, binding = 3) readonly buffer Tiles { HeightTile tiles[]; };
layout(scalar, binding = 4) readonly buffer Pyramids { float pyramid[]; };
// Irradiance for a unit of β, [surface][cell][corner][rank]: rgb by light from elsewhere in the
// relief, w from outside.
layout(scalar, binding = 5) readonly buffer Factors { vec4 factors[]; };
// β of the light, [light vertex][MOST_RANK]: of that which goes on inside the relief, and of that
// which arrives.
layout(scalar, binding = 6) readonly buffer Coefficients { Coefficient coefficients[]; };
// Sent light by direction of the vertex's frame, as radiosity πL, [light vertex][direction].
layout(scalar, binding = 7) readonly buffer Exits { vec3 exits[]; };

layout(scalar, binding = 8) readonly buffer LightPoints { LightPoint light_points[]; };
layout(scalar, binding = 9) readonly buffer Nodes { ShadowNode shadow_nodes[]; };
layout(scalar, binding = 10) readonly buffer Triangles { ShadowTriangle shadow_triangles[]; };
// By prism, where it is lit so.
layout(scalar, binding = 11) readonly buffer ParallelLights { ParallelLight parallel_lights[]; };

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
    vec3 reflectance;
    vec3 emitted;        // Le, W·m⁻²·sr⁻¹
    float metered;
    uint light_count;    // of light_points; those of emitters come first
    uint emitter_points;
    uint shading;
    uint view;
    float pixel;         // angle of a sample
    uvec2 cells;         // of the directions
};

uint march_steps = 0;
#define ALL_STEPS march_steps
#include "shared/height_march.glsl"
#include "shared/light_points.glsl"
#include "shared/shadow_rays.glsl"

const float PI = 3.14159265358979;
// Rays to lights begin so much of the relief's range above it.
const float LIFT = 1e-4;
// Shares of the relief's range by which a way to a light may leave the parabola that it is above a
// bent surface: taken for straight, and by its chords, of which there are so many.
const float STRAIGHT = 0.01;
const float CHORD_OFF = 0.02;
const float MOST_CHORDS = 4.0;
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
    mat3 edges = mat3(t.b.position - t.a.position, t.c.position - t.a.position, t.d.position - t.a.position);
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
    vec4 before = mix(mix(vec4(NEVER), vec4(-NEVER), lessThan(padded, vec4(0.0))), mix(vec4(NEVER), zero, falls),
                      notEqual(rate, vec4(0.0)));
    Part part;
    part.enter = max(max(max(behind.x, behind.y), max(behind.z, behind.w)), -1.0);
    part.leave = min(min(before.x, before.y), min(before.z, before.w));
    vec4 first = at + part.enter * rate;
    vec4 last = at + part.leave * rate;
    part.from = first.x * t.a.uvh + first.y * t.b.uvh + first.z * t.c.uvh + first.w * t.d.uvh;
    part.to = last.x * t.a.uvh + last.y * t.b.uvh + last.z * t.c.uvh + last.w * t.d.uvh;
    part.first = first.x * t.a.share + first.y * t.b.share + first.z * t.c.share + first.w * t.d.share;
    part.last = last.x * t.a.share + last.y * t.b.share + last.z * t.c.share + last.w * t.d.share;
    return part;
}

// Where the ray first meets the relief (or, for `plane`, the mean height) within a part of it.
bool meet_part(Part part, Prism p, ReliefSurface surface, bool plane, out Place place) {
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
        if (!march(tiles[p.surface], from, to, hit)) {
            return false;
        }
        // A ray that comes in through the bottom shows the underside; one that comes in below the
        // surface through a side, at a seam of heights, shows the step.
        place.under = hit.t == 0.0 && from.z < surface.lowest + BOTTOM * (surface.top - surface.lowest);
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
bool meet(Prism p, ReliefSurface surface, vec3 along, bool plane, out Place place) {
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
        if (meet_part(part, p, surface, plane, place)) {
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

// The surface that a prism stands on, as ways to lights pass over it.
struct Base {
    mat3 shares;         // slopes of the corners' shares in space, an internal unit
    mat3 axes;           // the corners' smooth normals, along which the relief rises
    vec3 axis;           // at the place
    vec3 normal;
    float steepness;     // heights of an internal unit
};

Base base_of(Prism p, ReliefSurface surface, Place place) {
    float middle = (surface.mean - surface.lowest) / (surface.top - surface.lowest);
    vec3 a = mix(p.low_a, p.high_a, middle);
    vec3 b = mix(p.low_b, p.high_b, middle) - a;
    vec3 c = mix(p.low_c, p.high_c, middle) - a;
    vec3 normal = cross(b, c);
    float square = max(dot(normal, normal), 1e-30);
    Base base;
    vec3 of_b = cross(c, normal) / square;
    vec3 of_c = cross(normal, b) / square;
    base.shares = mat3(-of_b - of_c, of_b, of_c);
    base.axes = mat3(normalize(p.high_a - p.low_a), normalize(p.high_b - p.low_b), normalize(p.high_c - p.low_c));
    base.axis = normalize(base.axes * place.share);
    base.normal = normal * inversesqrt(square);
    base.steepness = (surface.top - surface.lowest) / length(p.high_a - p.low_a);
    return base;
}

// Whether the relief itself stands on the way from a place to a light. `leaves` is where the way
// leaves the relief's shell if nothing does, internal units.
//
// Over its own triangle the way is straight above the height map. Past it, the surface turns away
// from the way as the smooth normals of the triangle say, by triangles like this one, so that the
// way's height above it is a parabola: bumps beyond a triangle's horizon still rise into the light,
// and the next triangle's do not shadow what they cannot.
bool shadowed_by_relief(Prism p, ReliefSurface surface, Place place, Base base, vec3 towards, out float leaves) {
    // Slopes over the triangle, not over the tetrahedron of the place, at whose borders they jump.
    float out_of = dot(base.normal, towards) / dot(base.normal, base.axis);
    vec3 tangential = towards - base.axis * out_of;
    vec3 rates = tangential * base.shares;
    vec3 local = vec3(rates.x * p.uv_a + rates.y * p.uv_b + rates.z * p.uv_c, out_of * base.steepness);
    float rise = surface.top - surface.lowest;
    vec3 from = vec3(place.uv, place.height + LIFT * rise);
    float short_of = surface.top - from.z;
    HeightHit hit;

    // Find where the way leaves the triangle, how long it is over it, and how the surface bends
    // along it.
    vec3 ends = place.share / max(abs(rates), vec3(1e-12));
    vec3 after = mix(vec3(NEVER), ends, lessThan(rates, vec3(0.0)));
    vec3 before = mix(vec3(NEVER), ends, greaterThan(rates, vec3(0.0)));
    float edge = max(min(min(after.x, after.y), after.z), 0.0);
    float chord = edge + max(min(min(before.x, before.y), before.z), 0.0);
    float bend = dot(base.axes * rates, tangential) * base.steepness;

    leaves = local.z > 0.0 ? short_of / local.z : NEVER;
    float past = leaves - edge;
    bool straight = past <= 0.0 || local.z > 0.0 && abs(bend) * past * (past + chord) < 2.0 * STRAIGHT * rise;
    if (straight) {
        return march(tiles[p.surface], from, vec3(from.xy + local.xy * leaves, surface.top), hit);
    }

    // Past the edge the height is at_edge + slope x + bend x² / 2.
    float at_edge = from.z + local.z * edge;
    float slope = local.z + 0.5 * bend * chord;
    float deepest = bend > 0.0 && slope < 0.0 ? at_edge - 0.5 * slope * slope / bend : at_edge;
    if (deepest < surface.lowest || bend <= 0.0 && slope <= 0.0) {
        return true;
    }
    float square = slope * slope + 2.0 * bend * (surface.top - at_edge);
    // In a hollow the way may sink again before it is out: what shadows it then is the scene.
    float root = sqrt(max(square, 0.0));
    float run = slope > 0.0 && square > 0.0 ? 2.0 * (surface.top - at_edge) / (slope + root) : (root - slope) / bend;
    leaves = edge + run;
    vec3 last = vec3(from.xy + local.xy * edge, at_edge);
    if (march(tiles[p.surface], from, last, hit)) {
        return true;
    }
    // A chord of the parabola lies off it by bend / 8 times its length's square.
    float chords = clamp(ceil(run * sqrt(abs(bend) / (8.0 * CHORD_OFF * rise))), 1.0, MOST_CHORDS);
    for (float i = 1.0; i <= chords; i++) {
        float x = run * i / chords;
        vec3 next = vec3(from.xy + local.xy * (edge + x), at_edge + x * (slope + 0.5 * bend * x));
        if (march(tiles[p.surface], last, next, hit)) {
            return true;
        }
        last = next;
    }
    return false;
}

// Light straight from emitters and point lights on the surface at a place, by its own normal,
// shadowed by the relief and by the rest of the scene.
vec3 sharp(Prism p, ReliefSurface surface, Place place, vec3 at) {
    uint samples = light_samples();
    if (samples == 0) {
        return vec3(0.0);
    }
    vec3 facet = facet_normal(place);
    Base base = base_of(p, surface, place);
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < samples; i++) {
        LightPoint light = light_of_sample(i);
        vec3 way = light.position - at;
        float square = dot(way, way);
        vec3 towards = way * inversesqrt(square);
        float arrives = arriving(light, towards, dot(facet, towards), square);
        if (arrives <= 0.0) {
            continue;
        }
        float leaves;
        if (!shadowed_by_relief(p, surface, place, base, towards, leaves)
            && !blocked(at, end_of_way(light), leaves * inversesqrt(square))) {
            sum += light.strength * arrives;
        }
    }
    return sum;
}

#include "shared/clusters.glsl"

// E by the factors of the cell at a place, for the light of the three vertices.
vec3 factored(Prism p, ReliefSurface surface, Place place) {
    vec2 size = vec2(surface.columns, surface.rows);
    vec2 at = place.uv * size - 0.5;
    vec2 low = floor(at);
    vec2 f = at - low;
    uvec2 cell = min(uvec2(low - size * floor(low / size)), uvec2(size) - 1);
    uint row = surface.first_factor + (cell.y * surface.columns + cell.x) * 4 * surface.rank;
    vec4 weight = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    vec3 sum = vec3(0.0);
    for (uint r = 0; r < surface.rank; r++) {
        Coefficient a = coefficients[p.light_a * MOST_RANK + r];
        Coefficient b = coefficients[p.light_b * MOST_RANK + r];
        Coefficient c = coefficients[p.light_c * MOST_RANK + r];
        mat3 inside = mat3(a.inside, b.inside, c.inside);
        mat3 arriving = mat3(a.arriving, b.arriving, c.arriving);
        vec4 factor = weight.x * factors[row + r] + weight.y * factors[row + surface.rank + r]
                    + weight.z * factors[row + 2 * surface.rank + r] + weight.w * factors[row + 3 * surface.rank + r];
        sum += factor.rgb * (inside * place.share) + factor.w * (arriving * place.share);
    }
    return max(sum, vec3(0.0));
}

// What the whole relief sends towards the eye, as radiosity.
vec3 mean_sent(Prism p, vec3 share, vec3 to_eye) {
    vec3 local = vec3(dot(p.tangent, to_eye), dot(p.bitangent, to_eye), dot(p.normal, to_eye));
    Look at = look(local, cells);
    uint count = cells.x * cells.y;
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < 4; i++) {
        sum += at.weight[i] * (share.x * exits[p.light_a * count + at.k[i]] + share.y * exits[p.light_b * count + at.k[i]]
                             + share.z * exits[p.light_c * count + at.k[i]]);
    }
    return sum;
}

void draw() {
    // Nothing lies at the depth of 0, so that this is drawn nowhere.
    radiance = vec4(0.0);
    gl_FragDepth = 0.0;
    // The back of a prism is seen from outside and from inside, and once.
    if (gl_FrontFacing) {
        return;
    }
    Prism p = prisms[corner_prism];
    ReliefSurface surface = surfaces[p.surface];
    vec3 along = corner_position;
    float footprint = length(corner_position) * pixel / p.texel;
    bool wide = shading == SHADING_RELIEF && footprint > float(WIDEST_SAMPLE);
    Place place;
    if (!meet(p, surface, along, shading != SHADING_RELIEF || wide, place)) {
        return;
    }
    if (shading == SHADING_PARALLAX) {
        vec3 to_eye = -normalize(along);
        vec3 local = vec3(dot(p.tangent, to_eye), dot(p.bitangent, to_eye), max(dot(p.normal, to_eye), 0.2));
        HeightHit under;
        bool found = march(tiles[p.surface], vec3(place.uv, surface.top), vec3(place.uv, surface.lowest), under);
        float height = found ? under.height : surface.mean;
        place.uv += (height - surface.mean) * surface.slope * local.xy / local.z;
    }
    vec3 at = (1.0 + place.along) * corner_position;
    gl_FragDepth = near / dot(at, w);

    float level = log2(max(footprint / float(tiles[p.surface].width) * float(textureSize(albedo, 0).x), 1e-6));
    vec3 rho = reflectance * textureLod(albedo, vec2(place.uv.x, 1.0 - place.uv.y), level).rgb;
    if (place.under) {
        return;
    }
    vec3 shown;
    switch (view) {
    case VIEW_ALBEDO:
        shown = rho;
        break;
    case VIEW_NORMAL:
        shown = 0.5 + 0.5 * facet_normal(place);
        break;
    case VIEW_HEIGHT:
        shown = vec3((place.height - surface.lowest) / (surface.top - surface.lowest));
        break;
    case VIEW_IRRADIANCE:
        shown = (factored(p, surface, place) + sharp(p, surface, place, at) + clustered(p, surface, place)) / PI;
        break;
    case VIEW_SLOTS:
        shown = p.slots;
        break;
    default:
        shown = emitted;
        if (wide) {
            shown += mean_sent(p, place.share, -normalize(along)) / PI;
        } else {
            shown += rho * (factored(p, surface, place) + sharp(p, surface, place, at) + clustered(p, surface, place)) / PI;
        }
    }
    radiance = vec4(shown, metered);
}

void main() {
    draw();
    // Every fragment is shaded, hidden or not, for its depth is its own; the pipeline adds them up.
    if (view == VIEW_OVERDRAW && !gl_FrontFacing) {
        radiance = vec4(1.0, float(march_steps), 0.0, 0.0);
    }
}
