// What a draw of surfaces in a window is told, and what it has of each triangle.
layout(push_constant, scalar) uniform Parameters {
    vec4 x;
    vec4 y;
    vec4 w;
    vec3 eye;
    float near;
    vec3 reflectance;
    float exposure;        // what radiance is multiplied by
    vec3 emitted;          // Le, W·m⁻²·sr⁻¹
    vec3 ambient;          // E of light not shot yet, W·m⁻²
    vec2 parts;            // how often all light and direct light count
    float elements;        // 1: outlined
    float sources;         // 1: coloured
    uint from_picture;     // 1, 2: shows the whole or the coarse picture; 3: them from elsewhere
    uint chosen;           // element that is marked
};

struct About {
    uint triangle;         // its place in the input
    uint source;
    float rise;            // how far relief reaches above or below it, internal units
};

// [drawn triangle]
layout(scalar, binding = 3) readonly buffer AboutTriangles { About about[]; };
