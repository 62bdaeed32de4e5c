// What comes straight from emitters in closed form, as if nothing stood between. Including files
// have shared/types.glsl, shared/texels.glsl, a `usamplerBuffer light_polygons`, and
// `polygon_count`.

#include "lambert.glsl"

// Texels of struct LightPolygon.
const uint POLYGON_TEXELS = 4;

// Form factor from the receiver to a convex quadrangle, positive if it is counter-clockwise from
// its front. Its contour leaves the horizon once at most: a closing edge is looked at once, where
// Contour looks at one for each edge, which costs a software device the same whether there is one
// or not.
float quadrangle_form_factor(vec3 corners[4], vec3 n) {
    float sum = 0.0;
    bool crosses = false;
    vec3 exit_point = vec3(0.0);
    vec3 entry = vec3(0.0);
    for (uint k = 0; k < 4; k++) {
        vec3 p = corners[k];
        vec3 q = corners[(k + 1) % 4];
        float hp = dot(p, n);
        float hq = dot(q, n);
        bool from_above = hp > 0.0;
        bool to_above = hq > 0.0;
        vec3 at = horizon(p, q, hp, hq);
        float term = edge_term(from_above ? p : at, to_above ? q : at, n);
        sum += from_above || to_above ? term : 0.0;
        exit_point = from_above && !to_above ? at : exit_point;
        entry = to_above && !from_above ? at : entry;
        crosses = crosses || from_above != to_above;
    }
    float closing = edge_term(exit_point, entry, n);
    sum += crosses ? closing : 0.0;
    return -sum * INV_TWO_PI;
}

// E of a facet.
vec3 unshadowed(vec3 at, vec3 normal) {
    vec3 sum = vec3(0.0);
    uint i = 0;
    // A software device runs a loop once more than its condition says if that stands before it
    // (Mesa 22.3). Without polygons the only one is 0.
    do {
        vec4 first = fetch(light_polygons, POLYGON_TEXELS * i);
        vec4 second = fetch(light_polygons, POLYGON_TEXELS * i + 1);
        vec4 third = fetch(light_polygons, POLYGON_TEXELS * i + 2);
        uvec4 last = fetch_words(light_polygons, POLYGON_TEXELS * i + 3);
        float seen = 0.0;
        bool is_far = last.w == 1;
        if (is_far) {
            seen = dot(normal, first.xyz);
        }
        if (!is_far) {
            vec3 a = first.xyz - at;
            vec3 b = vec3(first.w, second.xy) - at;
            vec3 c = vec3(second.zw, third.x) - at;
            vec3 d = third.yzw - at;
            seen = quadrangle_form_factor(vec3[4](a, b, c, d), normal);
        }
        sum += uintBitsToFloat(last.xyz) * max(seen, 0.0);
        i++;
    } while (i < polygon_count);
    return sum;
}

// Light of emitters by the part of their points that is seen (Heitz, Hill and McGuire, "Combining
// analytic direct illumination and stochastic shadows", I3D 2018): exact where all are seen, to the
// bit, or none. Where only a rim of them is above the horizon, and none of the points, it counts as
// seen.
vec3 shadowed(vec3 unshadowed, vec3 seen, vec3 of_all) {
    vec3 part = seen / max(of_all, vec3(1e-30));
    return unshadowed * mix(vec3(1.0), part, greaterThan(of_all, vec3(0.0)));
}
