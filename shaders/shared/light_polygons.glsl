// What comes straight from emitters in closed form, as if nothing stood between. Including files have
// shared/types.glsl, the buffer `LightPolygon light_polygons[]`, and `polygon_count`.

#include "lambert.glsl"

// E of a facet.
vec3 unshadowed(vec3 at, vec3 normal) {
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < polygon_count; i++) {
        LightPolygon light = light_polygons[i];
        float seen;
        if (light.far == 1) {
            seen = dot(normal, light.a);
        } else {
            vec3 a = light.a - at;
            vec3 b = light.b - at;
            vec3 c = light.c - at;
            vec3 d = light.d - at;
            Contour contour = contour_begin();
            contour_edge(contour, a, b, normal);
            contour_edge(contour, b, c, normal);
            contour_edge(contour, c, d, normal);
            contour_edge(contour, d, a, normal);
            contour_close(contour, normal);
            seen = contour_form_factor(contour);
        }
        sum += light.strength * max(seen, 0.0);
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
