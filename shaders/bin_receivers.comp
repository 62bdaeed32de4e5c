// Every element gathers from the sources of a batch: Lambert's exact formula for how much of its sky a source fills, the
// item buffer for whether it is seen. One invocation an element, sources in slot order: no atomics, the same bits every
// run. src/reference/bin_receivers.rs is the same in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/receivers.glsl"
