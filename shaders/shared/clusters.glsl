// The paper's way of lighting relief: the light on a face comes as a few parallel lights,
// src/mesh/clusters.rs, and a march over the height map finds which of them a place sees. Including
// files have Prism, ReliefSurface, Place, facet_normal, LIFT, shared/texels.glsl,
// shared/height_march.glsl and a `usamplerBuffer parallel_lights`.

// Texels of struct ParallelLight.
const uint PARALLEL_TEXELS = 3;

// Irradiance by the parallel lights on a face, by the surface's own normal and shadowed by the
// relief.
vec3 clustered(Prism p, ReliefSurface surface, HeightTile tile, Place place) {
    vec3 sum = vec3(0.0);
    if (p.cluster_count == 0) {
        return sum;
    }
    vec3 facet = facet_normal(place);
    vec3 from = vec3(place.uv, place.height + LIFT * (surface.top - surface.lowest));
    for (uint i = p.first_cluster; i < p.first_cluster + p.cluster_count; i++) {
        vec4 first = fetch(parallel_lights, PARALLEL_TEXELS * i);
        vec4 second = fetch(parallel_lights, PARALLEL_TEXELS * i + 1);
        vec4 third = fetch(parallel_lights, PARALLEL_TEXELS * i + 2);
        vec3 towards = first.xyz;
        mat3 fluence = mat3(first.w, second.xyz, second.w, third.x, third.yzw);
        vec3 local = towards * place.slopes;
        float cosine = dot(facet, towards);
        if (local.z <= 0.0 || cosine <= 0.0) {
            continue;
        }
        vec3 to = vec3(place.uv + local.xy / local.z * (surface.top - from.z), surface.top);
        HeightHit hit;
        if (!march(tile, from, to, hit)) {
            sum += cosine * (fluence * place.share);
        }
    }
    return max(sum, vec3(0.0));
}
