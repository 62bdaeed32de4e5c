// Form factors of near elements without relief into fresh rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/near_rows.glsl"
