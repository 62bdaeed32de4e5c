// Relief mapping, second how it looks: shades what relief_hits found, each sample once. Radiance is
// ρ E / π + Le with E = Σ_r a_r β_r, the factors of the relief and the light of the vertices
// (src/meso/factors.rs).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_EXT_control_flow_attributes : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/directions.glsl"
#include "shared/any_lane.glsl"

layout(location = 0) out vec4 radiance;

layout(binding = 0) uniform sampler2D albedo;
// See shared/prisms.glsl.
layout(binding = 1) uniform usampler2D hits;
layout(binding = 2) uniform usamplerBuffer prisms;
layout(binding = 3) uniform usamplerBuffer surfaces;
// [surface]
layout(binding = 4) uniform usamplerBuffer tiles;
layout(binding = 5) uniform usamplerBuffer pyramid;
// Irradiance for a unit of β, [surface][cell][corner][rank / 2]: rgb by light from elsewhere in the
// relief, w from outside; packed as src/render/factor_texels.rs says.
layout(binding = 6) uniform usamplerBuffer factors;
// β of the light, [light vertex][MOST_RANK]: of that which goes on inside the relief, and of that
// which arrives; packed too.
layout(binding = 7) uniform usamplerBuffer coefficients;
// Sent light by direction of the vertex's frame, as radiosity πL, [light vertex][direction].
layout(binding = 8) uniform usamplerBuffer exits;

layout(binding = 9) uniform usamplerBuffer light_points;
layout(binding = 10) uniform usamplerBuffer shadow_nodes;
layout(binding = 11) uniform usamplerBuffer shadow_triangles;
// By prism, where it is lit so.
layout(binding = 12) uniform usamplerBuffer parallel_lights;
layout(scalar, binding = 13) readonly buffer Webs { float webs[]; };
layout(binding = 14) uniform usamplerBuffer light_polygons;
// See shared/horizons.glsl.
layout(binding = 15) uniform usamplerBuffer horizons;
// Straight borders of the relief, as the prisms count them: shares of their corners b and c at both
// ends. The relief lies to the left, these shares taken for x and y.
layout(binding = 16) uniform usamplerBuffer borders;

// What a draw cannot need is left out of its pipeline: a software device works through every
// branch.
layout(constant_id = 0) const uint SHADING = SHADING_RELIEF;
layout(constant_id = 1) const uint VIEW = VIEW_SHADED;
// Light by factors, by light points, by parallel lights.
layout(constant_id = 2) const uint FACTORED = 1;
layout(constant_id = 3) const uint SHARP = 1;
layout(constant_id = 4) const uint CLUSTERED = 1;
// Whether point lights have beams.
layout(constant_id = 5) const uint BEAMS = 1;
// Ways to lights that are followed together.
layout(constant_id = 6) const uint WAYS = 4;
// Whether a relief has borders.
layout(constant_id = 7) const uint BORDERS = 1;
// See shared/height_march.glsl.
layout(constant_id = 8) const uint LEVELS = 1;

layout(push_constant, scalar) uniform Parameters {
    uint first_prism;    // of those of the material
    uint prism_count;
    vec3 reflectance;
    vec3 emitted;        // Le, W·m⁻²·sr⁻¹
    float metered;
    uint light_count;    // of light_points; those of emitters come first
    uint emitter_points;
    uint polygon_count;  // 0: emitters shine by their points alone
    float pixel;         // angle of a sample
    uvec2 cells;         // of the directions
    uvec2 corner;        // the tile's top left sample
};

#include "shared/height_march.glsl"
#include "shared/prisms.glsl"
#include "shared/horizons.glsl"
#include "shared/light_points.glsl"
#include "shared/light_polygons.glsl"
#include "shared/shadow_rays.glsl"

const float PI = 3.14159265358979;
// Rays to lights begin so much of the relief's range above it.
const float LIFT = 1e-4;
// Shares of the relief's range by which a way to a light may leave the parabola that it is above a
// bent surface: taken for straight, and by its chords, of which there are so many.
const float STRAIGHT = 0.01;
const float CHORD_OFF = 0.02;
const float MOST_CHORDS = 4.0;

// A place on the relief.
struct Place {
    bool on_surface;     // of the height map, not at its mean height
    vec2 uv;
    vec3 share;          // of the triangle's corners a, b, c
    vec3 at;             // from the eye
    vec2 gradient;       // dh/du, dh/dv
    float height;
    mat3 slopes;         // of u, v and height in space, an internal unit
};

// dh/du and dh/dv where the texture coordinates are.
vec2 gradient_at(HeightTile tile, vec2 uv) {
    vec2 scale = vec2(float(tile.width), -float(tile.height));
    vec2 texel = uv * scale - 0.5;
    vec2 low = floor(texel);
    vec2 size = abs(scale);
    ivec2 cell = min(ivec2(low - size * floor(low / size)), ivec2(size) - 1);
    Patch here = patch_of(tile, cell);
    return (here.slope + here.twist * (texel - low).yx) * scale;
}

// The place of a hit.
Place place_of(Prism p, ReliefSurface surface, HeightTile tile, uvec4 hit) {
    Place place;
    vec2 shares = uintBitsToFloat(hit.yz);
    place.share = vec3(1.0 - shares.x - shares.y, shares);
    place.height = uintBitsToFloat(hit.w);
    place.uv = place.share.x * p.uv_a + place.share.y * p.uv_b + place.share.z * p.uv_c;
    uint which = hit.x >> PRISM_BITS & 3;
    bool plane = SHADING != SHADING_RELIEF || (hit.x & HIT_WIDE) != 0;
    place.on_surface = !plane;
    place.gradient = plane ? vec2(0.0) : gradient_at(tile, place.uv);

    // The shares of the high corners make up that of the height.
    float risen = (place.height - surface.lowest) / (surface.top - surface.lowest);
    vec3 high = which == 0 ? vec3(0.0, 0.0, risen)
              : which == 1 ? vec3(0.0, risen - place.share.z, place.share.z)
                           : vec3(risen - place.share.y - place.share.z, place.share.yz);
    place.at = place.share.x * p.low_a + place.share.y * p.low_b + place.share.z * p.low_c
             + high.x * (p.high_a - p.low_a) + high.y * (p.high_b - p.low_b)
             + high.z * (p.high_c - p.low_c);
    Tetrahedron t = tetrahedron_of(p, surface, which);
    mat3 edges = mat3(t.b.uvh - t.a.uvh, t.c.uvh - t.a.uvh, t.d.uvh - t.a.uvh);
    place.slopes = transpose(edges * turn_of(t));
    return place;
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

// A way from a place to a light, as far as the relief goes.
struct Route {
    float leaves;        // where it leaves the relief's shell if nothing does, internal units
    bool hidden;         // it certainly meets the relief,
    bool clear;          // or certainly does not
    vec3 from;           // u, v, height
    vec3 edge;           // where it leaves its own triangle, or the shell if it is straight
    vec2 rates;          // of u and v past that
    float run;           // how long it is then
    float slope;         // its height there is edge.z + slope x + bend x² / 2
    float bend;
    float chords;        // 0: straight
};

// Shares of a corner, or of a border, by which rounding may put a place beyond it.
const float BORDER_ROUNDING = 1e-3;

float crossed(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// Where a way comes out of the relief by a border, internal units, for its place and its rates in
// shares of the corners b and c.
float border_of(Prism p, vec2 share, vec2 rates) {
    float first = NEVER;
    uint i = 0;
    do {
        vec4 line = fetch(borders, p.first_border + min(i, max(p.border_count, 1) - 1));
        vec2 along = line.zw - line.xy;
        vec2 to = line.xy - share;
        float outward = crossed(rates, along);
        float after = crossed(to, along) / outward;
        float at = crossed(to, rates) / outward;
        bool meets = i < p.border_count && outward > 0.0
                     && after * max(abs(rates.x), abs(rates.y)) > -BORDER_ROUNDING
                     && abs(at - 0.5) < 0.5 + BORDER_ROUNDING;
        first = meets ? min(first, max(after, 0.0)) : first;
        i++;
    } while (any_lane(i < p.border_count));
    return first;
}

// Over its own triangle the way is straight above the height map. Past it, the surface turns away
// from the way as the smooth normals of the triangle say, by triangles like this one, so that the
// way's height above it is a parabola: bumps beyond a triangle's horizon still rise into the light,
// and the next triangle's do not shadow what they cannot. At a border of the relief the way is out of
// it.
Route route_of(Prism p, ReliefSurface surface, HeightTile tile, Place place, Base base,
               vec3 towards) {
    // Slopes over the triangle, not over the tetrahedron of the place, at whose borders they jump.
    float out_of = dot(base.normal, towards) / dot(base.normal, base.axis);
    vec3 tangential = towards - base.axis * out_of;
    vec3 rates = tangential * base.shares;
    vec3 local = vec3(rates.x * p.uv_a + rates.y * p.uv_b + rates.z * p.uv_c, out_of * base.steepness);
    float rise = surface.top - surface.lowest;
    Route route;
    route.from = vec3(place.uv, place.height + LIFT * rise);
    float short_of = surface.top - route.from.z;

    // Find where the way leaves the triangle, how long it is over it, and how the surface bends
    // along it.
    vec3 ends = place.share / max(abs(rates), vec3(1e-12));
    vec3 after = mix(vec3(NEVER), ends, lessThan(rates, vec3(0.0)));
    vec3 before = mix(vec3(NEVER), ends, greaterThan(rates, vec3(0.0)));
    float edge = max(min(min(after.x, after.y), after.z), 0.0);
    float chord = edge + max(min(min(before.x, before.y), before.z), 0.0);
    route.bend = dot(base.axes * rates, tangential) * base.steepness;
    route.rates = local.xy;

    route.leaves = local.z > 0.0 ? short_of / local.z : NEVER;
    float past = route.leaves - edge;
    float border = BORDERS == 1 ? border_of(p, place.share.yz, rates.yz) : NEVER;
    bool straight = past <= 0.0 || border <= edge * (1.0 + BORDER_ROUNDING)
                    || local.z > 0.0
                           && abs(route.bend) * past * (past + chord) < 2.0 * STRAIGHT * rise;

    float at_edge = route.from.z + local.z * edge;
    route.slope = local.z + 0.5 * route.bend * chord;
    float deepest = route.bend > 0.0 && route.slope < 0.0
                        ? at_edge - 0.5 * route.slope * route.slope / route.bend
                        : at_edge;
    // A surface that turns away lowers what is in the way.
    route.clear = place.on_surface && (straight || route.bend >= 0.0)
                  && rises_above(tile, place.uv, local);
    bool sinks = route.bend <= 0.0 && route.slope <= 0.0;
    float square = route.slope * route.slope + 2.0 * route.bend * (surface.top - at_edge);
    // In a hollow the way may sink again before it is out: what shadows it then is the scene.
    float root = sqrt(max(square, 0.0));
    float run = sinks ? NEVER
              : route.slope > 0.0 && square > 0.0
                    ? 2.0 * (surface.top - at_edge) / (route.slope + root)
                    : (root - route.slope) / route.bend;
    route.leaves = straight ? route.leaves : edge + run;
    bool by_border = border < route.leaves;
    route.leaves = by_border ? border : route.leaves;
    route.hidden = !straight && !by_border && (deepest < surface.lowest || sinks);
    route.run = by_border ? max(border - edge, 0.0) : run;
    // A chord of the parabola lies off it by bend / 8 times its length's square.
    float wanted = ceil(route.run * sqrt(abs(route.bend) / (8.0 * CHORD_OFF * rise)));
    route.chords = straight ? 0.0 : clamp(wanted, 1.0, MOST_CHORDS);
    float over = straight ? route.leaves : edge;
    float height = straight && !by_border ? surface.top : route.from.z + local.z * over;
    route.edge = vec3(route.from.xy + local.xy * over, height);
    return route;
}

// On which of the ways that are asked for the relief itself stands, a bit each.
uint meeting_relief(HeightTile tile, Route routes[WAYS], uint asked) {
    // One loop over all parts of all ways: a software device works through each march that is
    // written.
    uint left = asked;
    uint met = 0;
    float part = 0.0;
    do {
        uint own = left & (~left + 1);
        Route route = routes[0];
        for (uint i = 1; i < WAYS; i++) {
            if (own == 1u << i) {
                route = routes[i];
            }
        }
        // Its chords follow what lies over its own triangle.
        vec2 x = route.run * vec2(part - 1.0, part) / route.chords;
        vec2 height = x * (route.slope + 0.5 * route.bend * x);
        vec3 begin = route.edge + vec3(route.rates * x.x, height.x);
        vec3 end = route.edge + vec3(route.rates * x.y, height.y);
        HeightHit hit;
        begin = part == 0.0 ? route.from : begin;
        end = part == 0.0 ? route.edge : end;
        bool meets = left != 0 && march(tile, begin, end, hit);
        met |= meets ? own : 0;
        bool done = meets || part >= route.chords;
        left = done ? left & ~own : left;
        part = done ? 0.0 : part + 1.0;
    } while (any_lane(left != 0));
    return met;
}

// Light straight from emitters and point lights on the surface at a place, by its own normal,
// shadowed by the relief and by the rest of the scene.
vec3 sharp(Prism p, ReliefSurface surface, HeightTile tile, Place place) {
    vec3 at = place.at;
    uint samples = p.state == PART_HIDDEN ? 0 : light_samples();
    if (samples == 0) {
        return vec3(0.0);
    }
    vec3 facet = facet_normal(place);
    Base base = base_of(p, surface, place);
    vec3 seen = vec3(0.0);      // of the points of emitters
    vec3 of_all = vec3(0.0);
    vec3 points = vec3(0.0);    // of point lights
    uint first = 0;
    do {
        Ways ways;
        vec3 whole[WAYS];
        Route routes[WAYS];
        uint unsure = 0;
        for (uint i = 0; i < WAYS; i++) {
            LightPoint light = light_of_sample(min(first + i, samples - 1));
            vec3 way = light.position - at;
            float square = dot(way, way);
            vec3 towards = way * inversesqrt(square);
            float arrives = arriving(light, towards, dot(facet, towards), square);
            bool shines = first + i < samples && arrives > 0.0;
            Route route = route_of(p, surface, tile, place, base, towards);
            routes[i] = route;
            whole[i] = shines ? light.strength * arrives : vec3(0.0);
            ways.to[i] = end_of_way(light);
            ways.clear[i] = route.leaves * inversesqrt(square);
            ways.open[i] = shines && !route.hidden;
            unsure |= ways.open[i] && !route.clear ? 1u << i : 0;
        }
        uint met = meeting_relief(tile, routes, unsure);
        for (uint i = 0; i < WAYS; i++) {
            ways.open[i] = ways.open[i] && (met >> i & 1) == 0;
        }
        if (p.state != PART_OPEN) {
            follow(at, ways);
        }
        for (uint i = 0; i < WAYS; i++) {
            vec3 arrived = ways.open[i] ? whole[i] : vec3(0.0);
            bool of_emitter = first + i < emitter_samples();
            of_all += of_emitter ? whole[i] : vec3(0.0);
            seen += of_emitter ? arrived : vec3(0.0);
            points += of_emitter ? vec3(0.0) : arrived;
        }
        first += WAYS;
    } while (first < samples);
    if (polygon_count > 0 && seen != vec3(0.0)) {
        seen = shadowed(unshadowed(at, facet), seen, of_all);
    }
    return seen + points;
}

#include "shared/clusters.glsl"

// Four whole numbers of 16 bits, each times 2^16.
vec4 halves(uvec2 words) {
    return vec4(ivec4(words.x << 16, words.x & 0xffff0000, words.y << 16, words.y & 0xffff0000));
}

// Light of three vertices by the factor of a rank; their coefficients are six floats of 21 bits.
vec3 lit(vec4 factor, uvec3 at, vec3 share) {
    vec3 inside = vec3(0.0);
    vec3 arriving = vec3(0.0);
    [[unroll]] for (uint i = 0; i < 3; i++) {
        uvec4 words = fetch_words(coefficients, at[i]);
        vec4 four = uintBitsToFloat(words & 0xfffff800);
        vec2 rest = uintBitsToFloat(words.xz << 21 | (words.yw & 0x7fe) << 10);
        inside += share[i] * four.xyz;
        arriving += share[i] * vec3(four.w, rest);
    }
    return factor.rgb * inside + factor.w * arriving;
}

// E by the factors of the cell at a place, for the light of the three vertices.
vec3 factored(Prism p, ReliefSurface surface, Place place) {
    vec2 size = vec2(surface.columns, surface.rows);
    vec2 at = place.uv * size - 0.5;
    vec2 low = floor(at);
    vec2 f = at - low;
    uvec2 cell = min(uvec2(low - size * floor(low / size)), uvec2(size) - 1);
    uint pairs = surface.rank / 2;
    uint row = surface.first_factor + (cell.y * surface.columns + cell.x) * 4 * pairs;
    vec4 weight = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    vec3 sum = vec3(0.0);
    uvec3 lights = uvec3(p.light_a, p.light_b, p.light_c) * MOST_RANK;
    uint r = 0;
    do {
        // Lanes with fewer ranks have coefficients that are 0.
        [[unroll]] for (uint pair = 0; pair < 2; pair++) {
            uint own = row + r / 2;
            uvec4 corner = fetch_words(factors, own);
            vec4 first = weight.x * halves(corner.xy);
            vec4 second = weight.x * halves(corner.zw);
            corner = fetch_words(factors, own + pairs);
            first += weight.y * halves(corner.xy);
            second += weight.y * halves(corner.zw);
            corner = fetch_words(factors, own + 2 * pairs);
            first += weight.z * halves(corner.xy);
            second += weight.z * halves(corner.zw);
            corner = fetch_words(factors, own + 3 * pairs);
            first += weight.w * halves(corner.xy);
            second += weight.w * halves(corner.zw);
            sum += lit(first, lights + r, place.share) + lit(second, lights + r + 1, place.share);
            r += 2;
        }
    } while (any_lane(r < surface.rank));
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

// Radiance of a hit on a prism, and whether an exposure meter looks at it.
vec4 shade(uint prism, uvec4 hit) {
    Prism p = load_prism(prism);
    ReliefSurface surface = load_surface(p.surface);
    HeightTile tile = load_tile(p.surface);
    Place place = place_of(p, surface, tile, hit);
    vec3 to_eye = -normalize(place.at);
    if (SHADING == SHADING_PARALLAX) {
        vec3 local = vec3(dot(p.tangent, to_eye), dot(p.bitangent, to_eye), max(dot(p.normal, to_eye), 0.2));
        HeightHit under;
        vec3 down = vec3(place.uv, surface.lowest);
        bool found = march(tile, vec3(place.uv, surface.top), down, under);
        float height = found ? under.height : surface.mean;
        place.uv += (height - surface.mean) * surface.slope * local.xy / local.z;
    }
    float footprint = length(place.at) * pixel / p.texel;
    float level = log2(max(footprint / float(tile.width) * float(textureSize(albedo, 0).x), 1e-6));
    vec3 rho = reflectance * textureLod(albedo, vec2(place.uv.x, 1.0 - place.uv.y), level).rgb;

    bool wide = (hit.x & HIT_WIDE) != 0;
    bool lit = VIEW == VIEW_IRRADIANCE || VIEW == VIEW_SHADED && !wide;
    vec3 light = vec3(0.0);
    if (lit) {
        if (FACTORED == 1) {
            light += factored(p, surface, place);
        }
        if (SHARP == 1) {
            light += sharp(p, surface, tile, place);
        }
        if (CLUSTERED == 1) {
            light += clustered(p, surface, tile, place);
        }
    }
    vec3 sent = vec3(0.0);
    if (VIEW == VIEW_SHADED && wide) {
        sent = mean_sent(p, place.share, to_eye);
    }
    vec3 shown;
    switch (VIEW) {
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
        shown = fetch(prisms, PRISM_TEXELS * prism + 11).rgb;
        break;
    default:
        shown = emitted + (rho * light + sent) / PI;
    }
    bool under = (hit.x & HIT_UNDER) != 0;
    return under ? vec4(0.0) : vec4(shown, metered);
}

void main() {
    uvec4 hit = texelFetch(hits, ivec2(gl_FragCoord.xy), 0);
    uint prism = (hit.x & (1u << PRISM_BITS) - 1) - 1;
    // Other materials have draws of their own.
    if (prism - first_prism >= prism_count) {
        discard;
    }
    radiance = shade(min(prism, first_prism + prism_count - 1), hit);
}
