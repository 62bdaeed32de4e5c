// The pixel estimator for elements without relief in a scene where some sources send by direction:
// the paper's equation (2), ΔE_q = ΔB_iq ΔF_q A_i / A_j, summed over the pixels q that see the
// element.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/pixels.glsl"
