// The paper's way of lighting relief: the light on a face comes as a few parallel lights,
// src/mesh/clusters.rs, and a march over the height map finds which of them a place sees. Including
// files have Prism, ReliefSurface, Place, facet_normal, LIFT, shared/height_march.glsl and a buffer
// `ParallelLight parallel_lights[]`.

// Irradiance by the parallel lights on a face, by the surface's own normal and shadowed by the
// relief.
vec3 clustered(Prism p, ReliefSurface surface, Place place) {
    vec3 sum = vec3(0.0);
    if (p.cluster_count == 0) {
        return sum;
    }
    vec3 facet = facet_normal(place);
    vec3 from = vec3(place.uv, place.height + LIFT * (surface.top - surface.lowest));
    for (uint i = p.first_cluster; i < p.first_cluster + p.cluster_count; i++) {
        ParallelLight light = parallel_lights[i];
        vec3 local = light.towards * place.slopes;
        float cosine = dot(facet, light.towards);
        if (local.z <= 0.0 || cosine <= 0.0) {
            continue;
        }
        vec3 to = vec3(place.uv + local.xy / local.z * (surface.top - from.z), surface.top);
        HeightHit hit;
        if (!march(tiles[p.surface], from, to, hit)) {
            sum += cosine * (mat3(light.fluence_a, light.fluence_b, light.fluence_c) * place.share);
        }
    }
    return max(sum, vec3(0.0));
}
