// What comes straight from emitters in closed form, as if nothing stood between. Including files
// have shared/types.glsl, shared/texels.glsl, a `usamplerBuffer light_polygons`, and
// `polygon_count`.

#include "lambert.glsl"

// Texels of struct LightPolygon.
const uint POLYGON_TEXELS = 4;

// E of a facet.
vec3 unshadowed(vec3 at, vec3 normal) {
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < polygon_count; i++) {
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
            Contour contour = contour_begin();
            contour_edge(contour, a, b, normal);
            contour_edge(contour, b, c, normal);
            contour_edge(contour, c, d, normal);
            contour_edge(contour, d, a, normal);
            contour_close(contour, normal);
            seen = contour_form_factor(contour);
        }
        sum += uintBitsToFloat(last.xyz) * max(seen, 0.0);
    }
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
