// Light that elements with a relief receive of the parts of near sources, beyond what the sources'
// rows bring: added to their irradiance, their moments and coefficients, and what they reflect. One invocation an
// element. src/reference/near_to_relief.rs is the same.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"
#include "shared/directions.glsl"
#include "shared/disc.glsl"
#include "shared/accumulate.glsl"
#include "shared/texels.glsl"

layout(local_size_x = GROUP) in;

// Where the parts of each element begin, [meso element]; one more than they are.
layout(scalar, binding = 0) readonly buffer Starts { uint starts[]; };
layout(scalar, binding = 1) readonly buffer Parts { NearPart parts[]; };
// Radiosity, [part of all near sources].
layout(scalar, binding = 2) readonly buffer Beyond { vec3 beyond[]; };
layout(scalar, binding = 3) readonly buffer MesoElements { MesoElement meso_elements[]; };
// Radiosity for each coefficient, [response][rank].
layout(binding = 4) uniform usamplerBuffer albedos;
// [meso element][direction][colour]
layout(scalar, binding = 5) buffer Moments { vec3 moments[]; };
layout(scalar, binding = 6) buffer MesoReflected { Reflected meso_reflected[]; };
// Of emitted or of reflected light.
layout(scalar, binding = 7) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 8) buffer IrradianceError { vec3 irradiance_error[]; };
layout(binding = 9) uniform usamplerBuffer bases;
layout(scalar, binding = 10) buffer Coefficients { vec4 coefficients[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uvec2 kept_cells;         // of the square of the slots
};

#include "shared/receive_relief.glsl"
#include "shared/keep_coefficients.glsl"

void main() {
    uint m = gl_GlobalInvocationID.x;
    if (m >= element_count || starts[m] == starts[m + 1]) {
        return;
    }
    MesoElement meso = meso_elements[m];
    vec3 sum = vec3(0.0);
    vec3 sums[RELIEF_RANK];
    for (uint r = 0; r < RELIEF_RANK; r++) {
        sums[r] = vec3(0.0);
    }
    for (uint i = starts[m]; i < starts[m + 1]; i++) {
        vec3 light = beyond[parts[i].part];
        sum += parts[i].factor.z * light;
        receive_by_direction(m, meso.response, parts[i].factor, light, sums);
    }
    accumulate(irradiance[first_element + m], irradiance_error[first_element + m], sum);
    keep_coefficients(m, meso, sums);
}
