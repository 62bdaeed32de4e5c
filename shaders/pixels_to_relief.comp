// As pixels_from_relief.comp, for elements with a relief: what a pixel brings is kept in the slot
// of its direction (the paper's equation (4), with vectors for scalars), and with `by_pixel` leaves
// by the pixel's own normal and albedo (equation (3)).
#version 460
#extension GL_GOOGLE_include_directive : require
#define TO_RELIEF
#include "shared/pixels.glsl"
