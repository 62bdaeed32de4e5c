// Prisms over triangles with relief, each cut into three tetrahedra in which texture coordinates
// and height are linear, and where the ray through a sample meets the relief in one: what
// relief_hits.frag leaves for relief.frag. Including files have shared/types.glsl,
// shared/texels.glsl and `usamplerBuffer`s prisms, surfaces and tiles: structs of
// shared/types.glsl, so many texels each.
const uint PRISM_TEXELS = 12;
const uint SURFACE_TEXELS = 3;
const uint TILE_TEXELS = 3;

// A hit: x is 0 of samples that meet no relief, or 1 + the prism in the lower bits and then the
// tetrahedron and the marks below; y and z are the shares of the corners b and c, and w the height.
const uint PRISM_BITS = 28;
// The sample is wider than the texels, so that it has the mean height.
const uint HIT_WIDE = 1u << 30;
// Seen from below.
const uint HIT_UNDER = 1u << 31;

Prism load_prism(uint prism) {
    uint first = PRISM_TEXELS * prism;
    uvec4 words[11];
    for (uint i = 0; i < 11; i++) {
        words[i] = fetch_words(prisms, first + i);
    }
    Prism p;
    p.low_a = uintBitsToFloat(words[0].xyz);
    p.light_a = words[0].w;
    p.low_b = uintBitsToFloat(words[1].xyz);
    p.light_b = words[1].w;
    p.low_c = uintBitsToFloat(words[2].xyz);
    p.light_c = words[2].w;
    p.high_a = uintBitsToFloat(words[3].xyz);
    p.surface = words[3].w;
    p.high_b = uintBitsToFloat(words[4].xyz);
    p.first_cluster = words[4].w;
    p.high_c = uintBitsToFloat(words[5].xyz);
    p.cluster_count = words[5].w;
    p.uv_a = uintBitsToFloat(words[6].xy);
    p.uv_b = uintBitsToFloat(words[6].zw);
    p.uv_c = uintBitsToFloat(words[7].xy);
    p.texel = uintBitsToFloat(words[7].z);
    p.state = words[7].w;
    p.tangent = uintBitsToFloat(words[8].xyz);
    p.first_border = words[8].w;
    p.bitangent = uintBitsToFloat(words[9].xyz);
    p.border_count = words[9].w;
    p.normal = uintBitsToFloat(words[10].xyz);
    return p;
}

ReliefSurface load_surface(uint surface) {
    uint first = SURFACE_TEXELS * surface;
    uvec4 heights = fetch_words(surfaces, first);
    uvec4 sizes = fetch_words(surfaces, first + 1);
    ReliefSurface s;
    s.lowest = uintBitsToFloat(heights.x);
    s.top = uintBitsToFloat(heights.y);
    s.mean = uintBitsToFloat(heights.z);
    s.rank = heights.w;
    s.columns = sizes.x;
    s.rows = sizes.y;
    s.first_factor = sizes.z;
    s.slope = fetch(surfaces, first + 2).xy;
    return s;
}

HeightTile load_tile(uint surface) {
    uvec4 words = fetch_words(tiles, TILE_TEXELS * surface);
    HeightTile t;
    t.first = words.x;
    t.width = words.y;
    t.height = words.z;
    t.top = words.w;
    words = fetch_words(tiles, TILE_TEXELS * surface + 1);
    t.highest = uintBitsToFloat(words.x);
    t.first_horizon = words.y;
    t.horizon_columns = words.z;
    t.horizon_rows = words.w;
    t.horizon_step = fetch(tiles, TILE_TEXELS * surface + 2).x;
    return t;
}

// A corner of a tetrahedron.
struct Corner {
    vec3 position;
    vec3 uvh;
    vec3 share;
};

struct Tetrahedron {
    Corner a;
    Corner b;
    Corner c;
    Corner d;
};

// The low one, the middle one or the high one.
Tetrahedron tetrahedron_of(Prism p, ReliefSurface surface, uint which) {
    const vec3 A = vec3(1.0, 0.0, 0.0);
    const vec3 B = vec3(0.0, 1.0, 0.0);
    const vec3 C = vec3(0.0, 0.0, 1.0);
    Corner low_a = Corner(p.low_a, vec3(p.uv_a, surface.lowest), A);
    Corner low_b = Corner(p.low_b, vec3(p.uv_b, surface.lowest), B);
    Corner low_c = Corner(p.low_c, vec3(p.uv_c, surface.lowest), C);
    Corner high_a = Corner(p.high_a, vec3(p.uv_a, surface.top), A);
    Corner high_b = Corner(p.high_b, vec3(p.uv_b, surface.top), B);
    Corner high_c = Corner(p.high_c, vec3(p.uv_c, surface.top), C);
    Tetrahedron low = Tetrahedron(low_a, low_b, low_c, high_c);
    Tetrahedron middle = Tetrahedron(low_a, low_b, high_b, high_c);
    Tetrahedron high = Tetrahedron(low_a, high_a, high_b, high_c);
    return which == 0 ? low : which == 1 ? middle : high;
}

// From space to the shares of the corners b, c and d.
mat3 turn_of(Tetrahedron t) {
    mat3 edges = mat3(t.b.position - t.a.position, t.c.position - t.a.position,
                      t.d.position - t.a.position);
    float volume = determinant(edges);
    return volume == 0.0 ? mat3(0.0) : inverse(edges);
}
