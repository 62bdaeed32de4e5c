// Relief mapping: the ray through the pixel is followed through the prism over a triangle, cut into three tetrahedra in
// each of which texture coordinates and height are linear, to where it first passes below the height map. Radiance there
// is ρ E / π + Le with E = Σ_r a_r β_r, the factors of the relief and the light of the vertices (src/meso/factors.rs).
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
// Irradiance for a unit of β, [surface][cell][corner][rank]: rgb by light from elsewhere in the relief, w from outside.
layout(scalar, binding = 5) readonly buffer Factors { vec4 factors[]; };
// β of the light, [light vertex][MOST_RANK]: of that which goes on inside the relief, and of that which arrives.
layout(scalar, binding = 6) readonly buffer Coefficients { Coefficient coefficients[]; };
// Sent light by direction of the vertex's frame, as radiosity πL, [light vertex][direction].
layout(scalar, binding = 7) readonly buffer Exits { vec3 exits[]; };

layout(scalar, binding = 8) readonly buffer LightPoints { LightPoint light_points[]; };
// Share of the light of light_points that reaches the vertex, [light vertex].
layout(scalar, binding = 9) readonly buffer Shares { vec3 light_shares[]; };

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
    vec3 reflectance;
    vec3 emitted;        // Le, W·m⁻²·sr⁻¹
    float metered;
    uint shading;
    uint view;
    float pixel;         // angle of a sample
    uvec2 cells;         // of the directions
    uint light_count;    // of light_points; those of emitters come first
    uint emitter_points;
};

#include "shared/height_march.glsl"

const float PI = 3.14159265358979;
// Samples wider than so many texels show the mean of the relief.
const float WIDEST_SAMPLE = 2.0;
// Rays to lights begin so much of the relief's range above it.
const float LIFT = 1e-4;
// Share of a prism's height that counts as its bottom; MARGIN of src/render/relief.rs lies below the relief.
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

// Barycentric coordinates along the ray: at + s step.
struct Tetrahedron {
    mat3 turn;           // from space to the shares of the last three corners
    vec4 at;
    vec4 step;
    float enter;
    float leave;
};

Tetrahedron cut(vec3 a, vec3 b, vec3 c, vec3 d, vec3 from, vec3 along) {
    mat3 edges = mat3(b - a, c - a, d - a);
    float volume = determinant(edges);
    Tetrahedron result = Tetrahedron(mat3(0.0), vec4(0.0), vec4(0.0), 1.0, 0.0);
    if (volume == 0.0) {
        return result;
    }
    mat3 turn = inverse(edges);
    vec3 at = turn * (from - a);
    vec3 step = turn * along;
    result.turn = turn;
    result.at = vec4(1.0 - at.x - at.y - at.z, at);
    result.step = vec4(-step.x - step.y - step.z, step);
    // The ray begins at the eye, at s = -1.
    float enter = -1.0;
    float leave = NEVER;
    for (int i = 0; i < 4; i++) {
        float rate = result.step[i];
        float zero = -result.at[i] / rate;
        if (rate > 0.0) {
            enter = max(enter, zero);
        } else if (rate < 0.0) {
            leave = min(leave, zero);
        } else if (result.at[i] < 0.0) {
            leave = -NEVER;
        }
    }
    result.enter = enter;
    result.leave = leave;
    return result;
}

// What a tetrahedron's corners are: share of a, b, c and whether it is one of the high ones.
mat4 corners_of(uint which) {
    const vec4 LOW_A = vec4(1, 0, 0, 0);
    const vec4 LOW_B = vec4(0, 1, 0, 0);
    const vec4 LOW_C = vec4(0, 0, 1, 0);
    const vec4 UP = vec4(0, 0, 0, 1);
    switch (which) {
    case 0: return mat4(LOW_A, LOW_B, LOW_C, LOW_C + UP);
    case 1: return mat4(LOW_A, LOW_B, LOW_B + UP, LOW_C + UP);
    default: return mat4(LOW_A, LOW_A + UP, LOW_B + UP, LOW_C + UP);
    }
}

vec3 position_of(Prism p, vec4 corner) {
    mat3 low = mat3(p.low_a, p.low_b, p.low_c);
    mat3 high = mat3(p.high_a, p.high_b, p.high_c);
    return (corner.w > 0.0 ? high : low) * corner.xyz;
}

// Where the ray first meets the relief (or, for `plane`, the mean height) within the prism.
bool meet(Prism p, ReliefSurface surface, vec3 along, bool plane, out Place place) {
    Tetrahedron parts[3];
    mat4 corners[3];
    for (uint i = 0; i < 3; i++) {
        corners[i] = corners_of(i);
        parts[i] = cut(position_of(p, corners[i][0]), position_of(p, corners[i][1]), position_of(p, corners[i][2]),
                       position_of(p, corners[i][3]), corner_position, along);
    }
    place.under = false;
    for (uint round = 0; round < 3; round++) {
        // The nearest of those not yet passed.
        uint nearest = 3;
        float enter = NEVER;
        for (uint i = 0; i < 3; i++) {
            if (parts[i].leave > parts[i].enter && parts[i].enter < enter) {
                nearest = i;
                enter = parts[i].enter;
            }
        }
        if (nearest == 3) {
            return false;
        }
        Tetrahedron part = parts[nearest];
        mat4 shares = corners[nearest];
        parts[nearest].leave = -NEVER;
        vec4 first = shares * (part.at + part.enter * part.step);
        vec4 last = shares * (part.at + part.leave * part.step);
        mat3x2 uv = mat3x2(p.uv_a, p.uv_b, p.uv_c);
        float rise = surface.top - surface.lowest;
        vec3 from = vec3(uv * first.xyz, surface.lowest + first.w * rise);
        vec3 to = vec3(uv * last.xyz, surface.lowest + last.w * rise);
        float t;
        if (plane) {
            float above = from.z - surface.mean;
            float below = to.z - surface.mean;
            if (!(above >= 0.0 && below < 0.0)) {
                continue;
            }
            t = above / (above - below);
            place.gradient = vec2(0.0);
            place.height = surface.mean;
        } else {
            HeightHit hit;
            if (!march(tiles[p.surface], from, to, hit)) {
                continue;
            }
            // A ray that comes in through the bottom shows the underside; one that comes in below the surface through a side,
            // at a seam of heights, shows the step.
            place.under = hit.t == 0.0 && from.z < surface.lowest + BOTTOM * rise;
            t = hit.t;
            place.gradient = hit.gradient;
            place.height = hit.height;
        }
        // Corner by corner, u, v and height less those of the first.
        mat4x3 texture_at = mat3x3(vec3(p.uv_a, 0.0), vec3(p.uv_b, 0.0), vec3(p.uv_c, 0.0)) * mat4x3(shares)
                          + mat4x3(vec3(0.0, 0.0, rise * shares[0].w), vec3(0.0, 0.0, rise * shares[1].w),
                                   vec3(0.0, 0.0, rise * shares[2].w), vec3(0.0, 0.0, rise * shares[3].w));
        mat3 edges = mat3(texture_at[1] - texture_at[0], texture_at[2] - texture_at[0], texture_at[3] - texture_at[0]);
        place.slopes = transpose(edges * part.turn);
        place.uv = mix(from.xy, to.xy, t);
        place.share = mix(first.xyz, last.xyz, t);
        place.along = mix(part.enter, part.leave, t);
        return true;
    }
    return false;
}

// Of the surface, outward.
vec3 facet_normal(Place place) {
    return normalize(place.slopes * vec3(-place.gradient, 1.0));
}

// Light straight from emitters and point lights on the surface at a place, by its own normal and shadowed by the relief.
vec3 sharp(Prism p, ReliefSurface surface, Place place, vec3 at) {
    vec3 facet = facet_normal(place);
    float rise = surface.top - surface.lowest;
    float height = place.height + LIFT * rise;
    uvec2 pixel_at = uvec2(gl_FragCoord.xy) % 4;
    uint turn = pixel_at.y * 4 + pixel_at.x;
    vec3 sum = vec3(0.0);
    uint emitters = emitter_points / LIGHT_TURNS;
    for (uint i = 0; i < emitters + light_count - emitter_points; i++) {
        bool emitter = i < emitters;
        LightPoint light = light_points[emitter ? i * LIGHT_TURNS + turn : emitter_points + i - emitters];
        vec3 way = light.position - at;
        float square = dot(way, way);
        vec3 towards = way * inversesqrt(square);
        vec3 local = towards * place.slopes;
        float cosine = dot(facet, towards);
        float sent = emitter ? float(LIGHT_TURNS) * max(-dot(light.normal, towards), 0.0) : 1.0;
        if (local.z <= 0.0 || cosine <= 0.0 || sent == 0.0) {
            continue;
        }
        vec3 from = vec3(place.uv, height);
        vec3 to = vec3(place.uv + local.xy / local.z * (surface.top - height), surface.top);
        HeightHit hit;
        if (!march(tiles[p.surface], from, to, hit)) {
            sum += light.strength * (sent * cosine / square);
        }
    }
    return sum * (place.share.x * light_shares[p.light_a] + place.share.y * light_shares[p.light_b]
                + place.share.z * light_shares[p.light_c]);
}

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

void main() {
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
    bool wide = shading == SHADING_RELIEF && footprint > WIDEST_SAMPLE;
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
    case VIEW_NORMAL: {
        shown = 0.5 + 0.5 * facet_normal(place);
        break;
    }
    case VIEW_HEIGHT:
        shown = vec3((place.height - surface.lowest) / (surface.top - surface.lowest));
        break;
    case VIEW_IRRADIANCE:
        shown = (factored(p, surface, place) + sharp(p, surface, place, at)) / PI;
        break;
    default:
        shown = emitted;
        if (wide) {
            shown += mean_sent(p, place.share, -normalize(along)) / PI;
        } else {
            shown += rho * (factored(p, surface, place) + sharp(p, surface, place, at)) / PI;
        }
    }
    radiance = vec4(shown, metered);
}
