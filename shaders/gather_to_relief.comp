// As gather.comp, for elements with a relief: each source's light is kept as a vector in the slot
// of its direction (the paper's equation (4), with vectors for scalars), and what of it leaves
// again is summed up.
#version 460
#extension GL_GOOGLE_include_directive : require
#define FROM_RELIEF
#define TO_RELIEF
#include "shared/gather.glsl"
