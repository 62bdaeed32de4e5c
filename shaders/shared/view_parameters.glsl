// What a draw of surfaces in a window is told, and what it has of each triangle.
layout(push_constant, scalar) uniform Parameters {
    vec4 x;
    vec4 y;
    vec4 w;
    vec3 reflectance;
    float exposure;        // what radiance is multiplied by
    vec3 emitted;          // Le, W·m⁻²·sr⁻¹
    vec3 ambient;          // E of light not shot yet, W·m⁻²
    vec2 parts;            // how often all light and direct light count
    float elements;        // 1: outlined
    float sources;         // 1: coloured
    uint first_relief;     // the first corner of triangles with relief
    uint chosen;           // element that is marked
};

struct About {
    uint triangle;         // its place in the input
    uint source;
    vec4 stretch;          // by which slopes of its relief lengthen its normal: uu, uv, vv; and
                           // the square of how high it is over what its openness was found for
};

// [drawn triangle]
layout(scalar, binding = 0) readonly buffer AboutTriangles { About about[]; };
