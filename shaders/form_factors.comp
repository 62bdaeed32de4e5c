// The form factor from the listed elements to a source: Lambert's exact formula for how much of its
// sky the source fills, the item buffer for whether it is seen. src/reference/form_factors.rs is
// the same in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/form_factors.glsl"
