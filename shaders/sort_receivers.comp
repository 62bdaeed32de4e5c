// Lists the elements that see each source, by how their form factor is found; the item buffer says
// what is seen.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/sort_receivers.glsl"
