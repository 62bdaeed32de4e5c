// Marks near elements with a relief, see shared/near_marks.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#define VECTOR_FLUX
#include "shared/near_marks.glsl"
