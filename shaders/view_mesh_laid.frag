// As view_mesh.frag, but what pictures drawn before show there comes first, from here or from elsewhere. A shader of its own: drivers
// that mask branches would do its work for every surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/view_mesh.glsl"

// Least cosine under which a picture saw what it is laid over: a pixel there is as wide as four here.
const float LEAST_COSINE = 0.25;
// Half pixels by which a surface may lie before or behind what the picture's pixel shows beside it.
const float SLACK = 3.0;

// Where in a picture's image this place is shown, 0 to 1; elsewhere `found` is false.
vec2 in_picture(uint i, sampler2D distances, out bool found) {
    PictureView view = views[i];
    vec4 p = vec4(corner_position, 1.0);
    float away = dot(p, view.w);
    vec2 at = 0.5 * vec2(dot(p, view.x), dot(p, view.y)) / away + 0.5;
    vec3 way = view.eye - corner_position;
    float cosine = dot(normalize(way), triangle_normal);
    found = view.pixel > 0.0 && away > 0.0 && cosine > LEAST_COSINE
         && all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
    if (found) {
        // Relief is where its mesh is by so much; what stands before it is nearer.
        float seen = texelFetch(distances, ivec2(at * view.share * vec2(textureSize(distances, 0))), 0).r;
        float slack = (about[corner_triangle].rise + SLACK * view.pixel * away) / cosine;
        found = abs(seen - away) <= slack;
    }
    return at * view.share;
}

vec3 shown() {
    if (from_picture == 1 || from_picture == 2) {
        vec4 p = vec4(corner_position, 1.0);
        vec2 at = 0.5 * vec2(dot(p, x), dot(p, y)) / dot(p, w) + 0.5;
        at *= views[from_picture - 1].share;
        return from_picture == 1 ? textureLod(whole, at, 0.0).rgb : textureLod(coarse, at, 0.0).rgb;
    }
    if (from_picture == 3) {
        bool found;
        vec2 at = in_picture(0, whole_distances, found);
        if (found) {
            return textureLod(whole, at, 0.0).rgb;
        }
        at = in_picture(1, coarse_distances, found);
        if (found) {
            return textureLod(coarse, at, 0.0).rgb;
        }
    }
    return lit();
}
