// As view_mesh.frag, but what pictures drawn before show there comes first, from here or from elsewhere. A shader of its own: drivers
// that mask branches would do its work for every surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/view_mesh.glsl"

// sRGB codes of whole views, with how far along the view each pixel is: the last with all its pixels, and a later coarse one.
layout(binding = 4) uniform sampler2D whole;
layout(binding = 5) uniform sampler2D coarse;
layout(binding = 6) uniform sampler2D whole_distances;
layout(binding = 7) uniform sampler2D coarse_distances;

// By view_mesh_laid.vert.
layout(location = 7) in vec3 in_whole;
layout(location = 8) in vec3 in_coarse;
layout(location = 9) flat in vec4 of_whole;
layout(location = 10) flat in vec4 of_coarse;

// Least height of a picture's eye over a surface, in distances along its view: a pixel there is as wide as four here.
const float LEAST_HEIGHT = 0.25;
// Half pixels by which a surface may lie before or behind what the picture's pixel shows beside it.
const float SLACK = 3.0;

// Whether a picture shows this place, and where in its image.
bool in_picture(vec3 place, vec4 view, sampler2D distances, out vec2 at) {
    float away = place.z;
    at = 0.5 * place.xy / away + 0.5;
    float height = view.x / away;
    bool within = view.y > 0.0 && away > 0.0 && height > LEAST_HEIGHT
         && all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
    at *= view.zw;
    // Relief is where its mesh is by so much; what stands before it is nearer.
    float seen = texelFetch(distances, ivec2(clamp(at, 0.0, 1.0) * vec2(textureSize(distances, 0))), 0).r;
    float slack = (about[corner_triangle].rise + SLACK * view.y * away) / height;
    return within && abs(seen - away) <= slack;
}

vec3 shown() {
    if (from_picture == 1 || from_picture == 2) {
        vec4 p = vec4(corner_position, 1.0);
        vec2 at = 0.5 * vec2(dot(p, x), dot(p, y)) / dot(p, w) + 0.5;
        return from_picture == 1 ? textureLod(whole, at * of_whole.zw, 0.0).rgb : textureLod(coarse, at * of_coarse.zw, 0.0).rgb;
    }
    vec2 at;
    if (in_picture(in_whole, of_whole, whole_distances, at)) {
        return textureLod(whole, at, 0.0).rgb;
    }
    if (in_picture(in_coarse, of_coarse, coarse_distances, at)) {
        return textureLod(coarse, at, 0.0).rgb;
    }
    return lit();
}
