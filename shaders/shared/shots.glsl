// What patches have received and sent by the paper's equations, in integers: their sums do not
// depend on an order, and differences are exact. A unit is a power, the same for all.

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

// Texels of struct Shot, struct ReliefPatch and struct ReliefTexel.
const uint SHOT_TEXELS = 8;
const uint PATCH_TEXELS = 4;
const uint RELIEF_TEXELS = 2;

// Of a patch with a relief: all that its texels reflect, and the share that leaves; [colour] each.
const uint REFLECTED_SUMS = 6;
// Direct and indirect light, [colour] each.
const uint RECEIVED_SUMS = 6;
