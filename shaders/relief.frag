// Relief mapping: the ray through the pixel is followed through the prism over a triangle, cut into
// three tetrahedra in each of which texture coordinates and height are linear, to where it first
// passes below the height map. Radiance there is ρ E / π + Le with E = Σ_r a_r β_r, the factors of
// the relief and the light of the vertices (src/meso/factors.rs).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/directions.glsl"

layout(location = 0) in vec3 corner_position;
layout(location = 1) flat in uint corner_prism;

layout(location = 0) out vec4 radiance;

layout(binding = 0) uniform sampler2D albedo;
// Structs of shared/types.glsl by words, PRISM_TEXELS and so on each.
layout(binding = 1) uniform usamplerBuffer prisms;
layout(binding = 2) uniform usamplerBuffer surfaces;
// [surface]
layout(binding = 3) uniform usamplerBuffer tiles;
layout(binding = 4) uniform usamplerBuffer pyramid;
// Irradiance for a unit of β, [surface][cell][corner][rank]: rgb by light from elsewhere in the
// relief, w from outside.
layout(binding = 5) uniform usamplerBuffer factors;
// β of the light, [light vertex][MOST_RANK][2]: of that which goes on inside the relief, and of
// that which arrives.
layout(binding = 6) uniform usamplerBuffer coefficients;
// Sent light by direction of the vertex's frame, as radiosity πL, [light vertex][direction].
layout(binding = 7) uniform usamplerBuffer exits;

layout(binding = 8) uniform usamplerBuffer light_points;
layout(binding = 9) uniform usamplerBuffer shadow_nodes;
layout(binding = 10) uniform usamplerBuffer shadow_triangles;
// By prism, where it is lit so.
layout(binding = 11) uniform usamplerBuffer parallel_lights;
layout(scalar, binding = 12) readonly buffer Webs { float webs[]; };
layout(binding = 13) uniform usamplerBuffer light_polygons;

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
    uint polygon_count;  // 0: emitters shine by their points alone
    uint shading;
    uint view;
    float pixel;         // angle of a sample
    uvec2 cells;         // of the directions
    uvec2 corner;        // the tile's top left sample
};

uint march_steps = 0;
#define ALL_STEPS march_steps
#include "shared/height_march.glsl"
#include "shared/light_points.glsl"
#include "shared/light_polygons.glsl"
#include "shared/shadow_rays.glsl"

const float PI = 3.14159265358979;
// Texels of a struct.
const uint PRISM_TEXELS = 12;
const uint SURFACE_TEXELS = 3;
const uint TILE_TEXELS = 2;
// Rays to lights begin so much of the relief's range above it.
const float LIFT = 1e-4;
// Shares of the relief's range by which a way to a light may leave the parabola that it is above a
// bent surface: taken for straight, and by its chords, of which there are so many.
const float STRAIGHT = 0.01;
const float CHORD_OFF = 0.02;
const float MOST_CHORDS = 4.0;
#include "shared/prisms.glsl"

Prism load_prism(uint prism) {
    uint first = PRISM_TEXELS * prism;
    uvec4 words[11];
    for (uint i = 0; i < 11; i++) {
        words[i] = fetch_words(prisms, first + i);
    }
    Prism p;
    p.low_a = uintBitsToFloat(words[0].xyz);
    p.light_a = words[0].w;
    p.low_b = uintBitsToFloat(words[1].xyz);
    p.light_b = words[1].w;
    p.low_c = uintBitsToFloat(words[2].xyz);
    p.light_c = words[2].w;
    p.high_a = uintBitsToFloat(words[3].xyz);
    p.surface = words[3].w;
    p.high_b = uintBitsToFloat(words[4].xyz);
    p.first_cluster = words[4].w;
    p.high_c = uintBitsToFloat(words[5].xyz);
    p.cluster_count = words[5].w;
    p.uv_a = uintBitsToFloat(words[6].xy);
    p.uv_b = uintBitsToFloat(words[6].zw);
    p.uv_c = uintBitsToFloat(words[7].xy);
    p.texel = uintBitsToFloat(words[7].z);
    p.tangent = uintBitsToFloat(words[8].xyz);
    p.bitangent = uintBitsToFloat(words[9].xyz);
    p.normal = uintBitsToFloat(words[10].xyz);
    return p;
}

ReliefSurface load_surface(uint surface) {
    uint first = SURFACE_TEXELS * surface;
    uvec4 heights = fetch_words(surfaces, first);
    uvec4 sizes = fetch_words(surfaces, first + 1);
    ReliefSurface s;
    s.lowest = uintBitsToFloat(heights.x);
    s.top = uintBitsToFloat(heights.y);
    s.mean = uintBitsToFloat(heights.z);
    s.rank = heights.w;
    s.columns = sizes.x;
    s.rows = sizes.y;
    s.first_factor = sizes.z;
    s.slope = fetch(surfaces, first + 2).xy;
    return s;
}

HeightTile load_tile(uint surface) {
    uvec4 words = fetch_words(tiles, TILE_TEXELS * surface);
    HeightTile t;
    t.first = words.x;
    t.width = words.y;
    t.height = words.z;
    t.top = words.w;
    t.highest = fetch(tiles, TILE_TEXELS * surface + 1).x;
    return t;
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
bool shadowed_by_relief(Prism p, ReliefSurface surface, HeightTile tile, Place place, Base base,
                        vec3 towards, out float leaves) {
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
        return march(tile, from, vec3(from.xy + local.xy * leaves, surface.top), hit);
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
    if (march(tile, from, last, hit)) {
        return true;
    }
    // A chord of the parabola lies off it by bend / 8 times its length's square.
    float chords = clamp(ceil(run * sqrt(abs(bend) / (8.0 * CHORD_OFF * rise))), 1.0, MOST_CHORDS);
    for (float i = 1.0; i <= chords; i++) {
        float x = run * i / chords;
        vec3 next = vec3(from.xy + local.xy * (edge + x), at_edge + x * (slope + 0.5 * bend * x));
        if (march(tile, last, next, hit)) {
            return true;
        }
        last = next;
    }
    return false;
}

// Light straight from emitters and point lights on the surface at a place, by its own normal,
// shadowed by the relief and by the rest of the scene.
vec3 sharp(Prism p, ReliefSurface surface, HeightTile tile, Place place, vec3 at) {
    uint samples = light_samples();
    if (samples == 0) {
        return vec3(0.0);
    }
    vec3 facet = facet_normal(place);
    Base base = base_of(p, surface, place);
    vec3 seen = vec3(0.0);      // of the points of emitters
    vec3 of_all = vec3(0.0);
    vec3 points = vec3(0.0);    // of point lights
    for (uint i = 0; i < samples; i++) {
        LightPoint light = light_of_sample(i);
        vec3 way = light.position - at;
        float square = dot(way, way);
        vec3 towards = way * inversesqrt(square);
        float arrives = arriving(light, towards, dot(facet, towards), square);
        if (arrives <= 0.0) {
            continue;
        }
        vec3 whole = light.strength * arrives;
        float leaves;
        bool open = !shadowed_by_relief(p, surface, tile, place, base, towards, leaves)
                    && !blocked(at, end_of_way(light), leaves * inversesqrt(square));
        vec3 arrived = open ? whole : vec3(0.0);
        if (i < emitter_samples()) {
            of_all += whole;
            seen += arrived;
        } else {
            points += arrived;
        }
    }
    if (polygon_count > 0 && seen != vec3(0.0)) {
        seen = shadowed(unshadowed(at, facet), seen, of_all);
    }
    return seen + points;
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
    uint of_a = p.light_a * MOST_RANK * 2;
    uint of_b = p.light_b * MOST_RANK * 2;
    uint of_c = p.light_c * MOST_RANK * 2;
    for (uint r = 0; r < surface.rank; r++) {
        vec3 inside = place.share.x * fetch(coefficients, of_a + 2 * r).rgb
                    + place.share.y * fetch(coefficients, of_b + 2 * r).rgb
                    + place.share.z * fetch(coefficients, of_c + 2 * r).rgb;
        vec3 arriving = place.share.x * fetch(coefficients, of_a + 2 * r + 1).rgb
                      + place.share.y * fetch(coefficients, of_b + 2 * r + 1).rgb
                      + place.share.z * fetch(coefficients, of_c + 2 * r + 1).rgb;
        vec4 factor = weight.x * fetch(factors, row + r)
                    + weight.y * fetch(factors, row + surface.rank + r)
                    + weight.z * fetch(factors, row + 2 * surface.rank + r)
                    + weight.w * fetch(factors, row + 3 * surface.rank + r);
        sum += factor.rgb * inside + factor.w * arriving;
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
        sum += at.weight[i] * (share.x * fetch(exits, p.light_a * count + at.k[i]).rgb
                             + share.y * fetch(exits, p.light_b * count + at.k[i]).rgb
                             + share.z * fetch(exits, p.light_c * count + at.k[i]).rgb);
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
    Prism p = load_prism(corner_prism);
    ReliefSurface surface = load_surface(p.surface);
    HeightTile tile = load_tile(p.surface);
    vec3 along = corner_position;
    float footprint = length(corner_position) * pixel / p.texel;
    bool wide = shading == SHADING_RELIEF && footprint > float(WIDEST_SAMPLE);
    Place place;
    if (!meet(p, surface, tile, along, shading != SHADING_RELIEF || wide, place)) {
        return;
    }
    if (shading == SHADING_PARALLAX) {
        vec3 to_eye = -normalize(along);
        vec3 local = vec3(dot(p.tangent, to_eye), dot(p.bitangent, to_eye), max(dot(p.normal, to_eye), 0.2));
        HeightHit under;
        vec3 down = vec3(place.uv, surface.lowest);
        bool found = march(tile, vec3(place.uv, surface.top), down, under);
        float height = found ? under.height : surface.mean;
        place.uv += (height - surface.mean) * surface.slope * local.xy / local.z;
    }
    vec3 at = (1.0 + place.along) * corner_position;
    gl_FragDepth = near / dot(at, w);

    float level = log2(max(footprint / float(tile.width) * float(textureSize(albedo, 0).x), 1e-6));
    vec3 rho = reflectance * textureLod(albedo, vec2(place.uv.x, 1.0 - place.uv.y), level).rgb;
    if (place.under) {
        return;
    }
    // Loops that take one turn at most: a software device works through what a branch leaves out.
    bool as_seen = view == VIEW_SHADED || view == VIEW_OVERDRAW;
    bool lit = view == VIEW_IRRADIANCE || as_seen && !wide;
    vec3 light = vec3(0.0);
    for (uint turns = lit ? 1 : 0; turns > 0; turns--) {
        light = factored(p, surface, place) + sharp(p, surface, tile, place, at)
              + clustered(p, surface, tile, place);
    }
    vec3 sent = vec3(0.0);
    for (uint turns = as_seen && wide ? 1 : 0; turns > 0; turns--) {
        sent = mean_sent(p, place.share, -normalize(along));
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
        shown = light / PI;
        break;
    case VIEW_SLOTS:
        shown = fetch(prisms, PRISM_TEXELS * corner_prism + 11).rgb;
        break;
    default:
        shown = emitted + (rho * light + sent) / PI;
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
