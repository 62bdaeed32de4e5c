// Form factors of near elements with a relief into fresh rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#define VECTOR_FLUX
#include "shared/near_rows.glsl"
