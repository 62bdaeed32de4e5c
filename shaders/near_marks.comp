// Marks near elements without relief, see shared/near_marks.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/near_marks.glsl"
