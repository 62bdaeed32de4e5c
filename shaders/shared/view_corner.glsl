// A corner of a triangle in a window: reversed infinite depth, as in the item buffer. RELIEF and
// OVERLAY as in view_mesh.glsl.
#include "shared/view_parameters.glsl"

layout(location = 0) in vec3 position;     // from the scene's middle, internal units
layout(location = 1) in vec2 uv;

// Distance of the near plane, internal units.
const float NEAR = 1e-4;

// An overlay lies exactly on the surfaces.
invariant gl_Position;

#ifdef OVERLAY
layout(location = 0) out vec3 corner_share;
layout(location = 1) flat out uint corner_triangle;
#else
layout(location = 0) out vec3 corner_light; // E of what is shown, W·m⁻²
layout(location = 1) out vec2 corner_uv;

// [corner] of the drawn triangles, W·m⁻²: all light, and what comes straight from emitters and
// point lights.
layout(scalar, binding = 2) readonly buffer All { vec3 all_light[]; };
layout(scalar, binding = 3) readonly buffer Direct { vec3 direct_light[]; };
#endif

#ifdef RELIEF
// [corner of triangles with relief][along u, along v, lift], W·m⁻²: what E loses for a slope of 1,
// and gains by slopes of TILT in the mean.
layout(scalar, binding = 4) readonly buffer AllSlanted { vec3 all_slanted[]; };
layout(scalar, binding = 5) readonly buffer DirectSlanted { vec3 direct_slanted[]; };

layout(location = 2) out vec3 slanted_u;
layout(location = 3) out vec3 slanted_v;
layout(location = 4) out vec3 lift;
layout(location = 5) flat out vec4 stretch;
#endif

void main() {
    vec4 p = vec4(position, 1.0);
    gl_Position = vec4(dot(p, x), dot(p, y), NEAR, dot(p, w));
#ifdef OVERLAY
    corner_share = vec3(equal(uvec3(gl_VertexIndex % 3), uvec3(0, 1, 2)));
    corner_triangle = gl_VertexIndex / 3;
#else
    vec3 light = parts.x * all_light[gl_VertexIndex] + parts.y * direct_light[gl_VertexIndex];
    corner_light = max(light, vec3(0.0)) + ambient;
    corner_uv = uv;
#endif
#ifdef RELIEF
    uint place = 3 * (gl_VertexIndex - first_relief);
    slanted_u = parts.x * all_slanted[place] + parts.y * direct_slanted[place];
    slanted_v = parts.x * all_slanted[place + 1] + parts.y * direct_slanted[place + 1];
    lift = parts.x * all_slanted[place + 2] + parts.y * direct_slanted[place + 2];
    stretch = about[gl_VertexIndex / 3].stretch;
#endif
}
