// The structs that Rust and GLSL share, scalar layout: the build writes src/structs.rs from them.

#extension GL_EXT_scalar_block_layout : require

// A group of neighbouring, nearly coplanar elements that shoots together, half of a point light, or
// a light at an infinite distance: a sun, a part of the sky.
struct Source {
    vec3 eye;          // what it sees from: a place on the group's surface, or the point light
    float area;
    vec3 normal;       // mean normal, the hemicube's axis
    float radius;      // of the ball about `middle` that holds the group
    vec3 tangent;
    float cone_sin;    // sine of the largest angle between `normal` and a member's; 0: plane
    vec3 bitangent;
    float cone_cos;
    vec3 emitted;      // radiosity from emission; a point light's intensity
    uint kind;
    uint first_element; // of a far light, its first eye
    uint element_count;
    uint first_contour;
    uint contour_count;
    uint component;    // the connected component it lies on
    vec3 middle;       // centroid of the area; of a far light the mean of its directions
    float facing;      // area that a far place in the direction of `normal` sees; of a far light its solid angle / π
    float part_radius; // of the largest part's ball
    uint first_part;   // a curved source's members, a few put together
    uint part_count;
};

// An element as it is gathered from, for loading by fours.
struct Triangle {
    vec3 a;
    float area;
    vec3 b;
    float height;      // normal · x on its plane
    vec3 c;
    float unused_c;
    vec3 normal;
    float unused;
};

// Up to MESHLET_TRIANGLES consecutive occluders. A cutoff of 2 never hides them.
struct Meshlet {
    vec3 centre;
    float radius;
    vec3 axis;         // of the cone of normals
    float cutoff;      // hidden where (centre - eye) · axis >= cutoff |centre - eye| + radius
    uint first;
    uint count;
    uint component;
};

// GROUP consecutive elements, fewer at the end, as receivers.
struct ReceiverBlock {
    vec3 centre;       // of the ball and of the cylinder about the axis that hold their centroids
    float radius;
    vec3 axis;         // of the cone of their normals
    float half_height; // of the cylinder
    float cone_sin;    // a cone wider than a quarter turn to each side passes for that
    float cone_cos;
    float largest;     // radius of an element
};

// A connected part of the mesh.
struct Component {
    vec3 low;
    uint closed;       // 1: closed, with all normals outward; back faces are hidden from outside
    vec3 high;
};

// A source of a batch, and what it sends now.
struct Slot {
    vec3 emitted;
    uint source;
    vec3 reflected;
    float scale;       // of all its form factors
};

// VkDispatchIndirectCommand of a list of receivers, and how many they are.
struct ReceiverList {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint count;
};

// Where the form factors of a source lie: first the table of its blocks.
struct KeptRow {
    uint chunk;
    uint first;        // word of the chunk
    float scale;       // of all of them
};

// A form factor to a near source, which is found on the host.
struct NearFactor {
    uint element;
    float factor;
};

// The same for an element with a relief, numbered among those: a vector in its frame.
struct NearVector {
    uint element;
    vec3 factor;
};

// What an element receives of a part of a near source: a vector in its frame.
struct NearPart {
    vec3 factor;
    uint part;
};

// How far the memory for kept form factors is filled.
struct KeptState {
    uint chunk;        // the one under way
    uint used;         // words of it
    uint rows;         // kept in all
};

// One face of a hemicube: clip = (dot(d, x), dot(d, y), near, dot(d, w)) with d = position - eye.
struct View {
    vec3 eye;
    vec3 x;
    vec3 y;
    vec3 w;
};

// VkDrawIndexedIndirectCommand.
struct Draw {
    uint vertex_count;
    uint instance_count;
    uint first_vertex;
    uint first_instance;
};

// A source as it receives: the words of a coupling row that belong to it.
struct CouplingTarget {
    uint first_element;
    uint element_count;
    uint first_word;
    uint word_count;   // 1: one reflectance; 3: a colour each; 0 is in no list
    float inverse_area;
};

// An element with a relief.
struct MesoElement {
    vec3 tangent;       // along growing u
    uint response;      // index of its relief's response
    vec3 bitangent;     // along growing v
    vec3 scale;         // its own reflectance over the tile's mean
};

// Reflected radiosity of an element with a relief, with the rounding error of its last sum.
struct Reflected {
    vec3 sum;
    vec3 error;
};

// One height map's part of the buffer of pyramids.
struct HeightTile {
    uint first;         // of its values in the buffer
    uint width;         // texels
    uint height;
    uint top;           // the coarsest level that a march uses
    float highest;
    uint first_horizon; // block of the buffer of horizons
    uint horizon_columns; // blocks
    uint horizon_rows;
    float horizon_step; // slope of a step of the bounds
    uint unused_a;
    uint unused_b;
    uint unused_c;
};

// A straight segment over a height map.
struct HeightRay {
    vec3 from;          // u, v, height
    uint tile;
    vec3 to;
};

// Where a segment first passes below the surface.
struct HeightHit {
    float t;            // 0 at the segment's start, 1 at its end
    uint cell;          // row * width + column of the texel at its low corner; NONE: no hit
    vec2 local;         // place in the cell, 0..1 to the next column and the next row
    float height;       // of the surface there
    vec2 gradient;      // dh/du, dh/dv of the cell's bilinear patch
    uint steps;         // of the march, hit or not
};

// A triangle with relief, extruded to the lowest and the highest of its height map. Corners a, b, c
// ascend by the mesh's vertex, so that neighbours cut the side that they share along one diagonal.
struct Prism {
    vec3 low_a;         // from the eye, internal units
    uint light_a;       // light vertices
    vec3 low_b;
    uint light_b;
    vec3 low_c;
    uint light_c;
    vec3 high_a;
    uint surface;
    vec3 high_b;
    uint first_cluster; // parallel lights on it
    vec3 high_c;
    uint cluster_count; // 0: lit by the light vertices alone
    vec2 uv_a;
    vec2 uv_b;
    vec2 uv_c;
    float texel;        // internal units
    uint state;         // PART_… of the ways from it to the lights, past other surfaces
    vec3 tangent;       // frame of the triangle
    uint first_border;  // of the relief, near it
    vec3 bitangent;
    uint border_count;
    vec3 normal;
    uint unused_a;
    vec3 slots;         // false colour of its light by direction
    uint unused_b;
};

// A parallel light on a face, in place of the light from near-parallel directions.
struct ParallelLight {
    vec3 towards;       // unit, along the world's axes
    vec3 fluence_a;     // at the corners of the prism, W·m⁻²
    vec3 fluence_b;
    vec3 fluence_c;
};

// A place that light comes straight from: a part of an emitter, or a point light.
struct LightPoint {
    vec3 position;      // from the eye, internal units
    uint kind;          // KIND_SURFACE, KIND_POINT or KIND_BEAM
    vec3 normal;        // of a beam its axis
    float area;         // of the part of an emitter
    vec3 strength;      // Le times its area, or radiant intensity
    uint first_share;   // of a beam
    vec3 zero;          // of a beam: where its azimuth is 0
    uint rows;
    uint columns;
    uint unused_a;
    uint unused_b;
    uint unused_c;
};

// An emitter whose light is found in closed form: a convex polygon, of a triangle with its last
// corner twice; or a sun.
struct LightPolygon {
    vec3 a;             // corners from the eye, internal units; of a sun the direction to it
    vec3 b;
    vec3 c;
    vec3 d;
    vec3 strength;      // πLe, or irradiance of what faces the sun
    uint far;           // 1 for a sun
};

// A relief as it is drawn.
struct ReliefSurface {
    float lowest;       // of the prisms, in the map's heights
    float top;
    float mean;
    uint rank;
    uint columns;       // of the height field that the factors belong to
    uint rows;
    uint first_factor;
    uint unused_a;
    vec2 slope;         // scene heights a texture repeat in u and in v for a unit of height
    uint unused_b;
    uint unused_c;
};

// A box of the tree of what casts shadows, in depth-first order: the first within it follows it.
// `leaf` has RELIEF_NODE where all triangles within it have a relief.
struct ShadowNode {
    vec3 low;           // from the eye, internal units
    uint skip;          // the node that follows all that is in this one
    vec3 high;
    uint leaf;          // LEAF_TRIANGLES · its first triangle + how many; 0: no leaf
};

// What casts a shadow.
struct ShadowTriangle {
    vec3 a;
    uint relief;        // 1: it stands for a relief about it
    vec3 b;
    uint unused_a;
    vec3 c;
    uint unused_b;
};

// What hides places from a source, and where it does.
struct ShadowOccluder {
    vec3 a;
    uint component;     // the connected part that it is of
    vec3 b;
    uint closed;        // 1: that part is closed, with all normals outward
    vec3 c;
    float height;       // normal · x on its plane
    vec3 normal;
    uint unused;
};

// A straight way.
struct ShadowRay {
    vec3 from;
    float clear;        // share of the way before which triangles with a relief are passed over
    vec3 to;
};

// A plain triangle that is lit straight.
struct LitTriangle {
    vec3 a;             // from the eye, internal units
    float above;        // what rays start above it
    vec3 b;
    uint level;         // its sides are cut in 2^level
    vec3 c;
    uint first_part;    // of its parts; of a triangle that is not cut its state: PART_...
    vec3 normal_a;      // of the smooth surface at the corners
    uint unused_a;
    vec3 normal_b;
    uint unused_b;
    vec3 normal_c;
    uint unused_c;
    vec3 plane;         // its own normal
    uint unused_d;
};

// A patch that shoots, as the pixels of its hemicube read it.
struct Shot {
    vec3 eye;
    float power;        // of a radiosity of 1 through the whole hemicube, in units of the sums
    vec3 tangent;       // of the hemicube
    uint source;
    vec3 bitangent;
    uint kind;
    vec3 normal;
    uint by_direction;  // 1: what it reflects depends on the direction
    vec3 emitted;       // radiosity
    uint unused_a;
    vec3 reflected;
    uint unused_b;
    vec3 along_u;       // frame of its directions, beside the normal
    uint unused_c;
    vec3 along_v;
    uint unused_d;
};

// A patch with a relief as pixels see it: texel = (across, along) · (place - centroid) + at.
struct ReliefPatch {
    vec3 across;
    float across_at;
    vec3 along;
    float along_at;
    vec3 tangent;
    uint first;         // of its texture among the texels of all
    vec3 bitangent;
    uint size;          // columns + rows << 16
};

// Half a texel of a relief, as it sends light on.
struct ReliefTexel {
    vec3 reflectance;
    float share;        // of a uniform sender's power: by the directions that it sends in
    uint hidden_low;    // bits of the directions that are 90° and more from its normal
    uint hidden_high;
    uint unused_a;
    uint unused_b;
};
