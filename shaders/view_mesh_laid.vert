// As view_mesh.vert, with where pictures drawn before show the corner: by the fragment that would be many loads.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/view_corner.glsl"

// The view that a picture was drawn of: rows over (p, 1).
struct PictureView {
    vec4 x;
    vec4 y;
    vec4 w;
    vec3 eye;
    float pixel;           // half a pixel's angle, as a tangent; 0: the picture is not to be shown
    vec2 share;            // of the image that is the picture
};

// Of the last whole picture and of a later coarse one.
layout(scalar, binding = 8) readonly buffer Views { PictureView views[2]; };

// Clip coordinates in the pictures' views.
layout(location = 7) out vec3 in_whole;
layout(location = 8) out vec3 in_coarse;
// How far the picture's eye is above the triangle's plane; pixel and share of the view.
layout(location = 9) flat out vec4 of_whole;
layout(location = 10) flat out vec4 of_coarse;

vec3 place(PictureView view) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(p, view.x), dot(p, view.y), dot(p, view.w));
}

vec4 about_view(PictureView view) {
    return vec4(dot(view.eye - position, normal), view.pixel, view.share);
}

void main() {
    corner();
    in_whole = place(views[0]);
    in_coarse = place(views[1]);
    of_whole = about_view(views[0]);
    of_coarse = about_view(views[1]);
}
