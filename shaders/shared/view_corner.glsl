// A corner of a triangle in a window: reversed infinite depth, as in the item buffer. LAID and
// OVERLAID as in view_mesh.glsl.
#include "shared/view_parameters.glsl"

layout(location = 0) in vec3 position;     // from the scene's middle, internal units
layout(location = 1) in vec3 normal;       // of the triangle
layout(location = 2) in vec2 uv;

layout(location = 0) out vec3 corner_light; // E of what is shown, W·m⁻²; negative on backs
layout(location = 1) out vec2 corner_uv;

// [corner] of the drawn triangles, W·m⁻²: all light, and what comes straight from emitters and
// point lights.
layout(scalar, binding = 1) readonly buffer All { vec3 all_light[]; };
layout(scalar, binding = 2) readonly buffer Direct { vec3 direct_light[]; };

#ifdef LAID
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
layout(location = 2) out vec3 in_whole;
layout(location = 3) out vec3 in_coarse;
// How far the picture's eye is above the triangle's plane; pixel and share of the view.
layout(location = 4) flat out vec4 of_whole;
layout(location = 5) flat out vec4 of_coarse;
layout(location = 6) flat out float triangle_rise;

vec3 place(PictureView view) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(p, view.x), dot(p, view.y), dot(p, view.w));
}

vec4 about_view(PictureView view) {
    return vec4(dot(view.eye - position, normal), view.pixel, view.share);
}
#endif

#ifdef OVERLAID
layout(location = 7) out vec3 corner_share;
layout(location = 8) out vec3 corner_position;
layout(location = 9) flat out uint corner_triangle;
#endif

void main() {
    vec3 light = parts.x * all_light[gl_VertexIndex] + parts.y * direct_light[gl_VertexIndex];
    bool front = dot(normal, eye - position) > 0.0;
    corner_light = front ? max(light, vec3(0.0)) + ambient : vec3(-1.0);
    corner_uv = uv;
    vec4 p = vec4(position, 1.0);
    gl_Position = vec4(dot(p, x), dot(p, y), near, dot(p, w));
#ifdef LAID
    in_whole = place(views[0]);
    in_coarse = place(views[1]);
    of_whole = about_view(views[0]);
    of_coarse = about_view(views[1]);
    triangle_rise = about[gl_VertexIndex / 3].rise;
#endif
#ifdef OVERLAID
    corner_share = vec3(equal(uvec3(gl_VertexIndex % 3), uvec3(0, 1, 2)));
    corner_position = position;
    corner_triangle = gl_VertexIndex / 3;
#endif
}
