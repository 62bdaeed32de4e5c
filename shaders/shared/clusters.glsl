// The paper's way of lighting relief: the light on a face comes as a few parallel lights,
// src/mesh/clusters.rs, and a march over the height map finds which of them a place sees. Including
// files have Prism, ReliefSurface, Place, facet_normal, LIFT, shared/texels.glsl,
// shared/height_march.glsl, shared/horizons.glsl, shared/any_lane.glsl and a `usamplerBuffer
// parallel_lights`.

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
    uint i = p.first_cluster;
    uint end = i + p.cluster_count;
    do {
        // On to the next light that the relief may hide, in a loop of its own: a software device
        // marches wherever any lane does.
        vec3 arriving = vec3(0.0);
        vec3 local = vec3(0.0);
        bool unsure = false;
        while (!unsure && i < end) {
            vec4 first = fetch(parallel_lights, PARALLEL_TEXELS * i);
            vec4 second = fetch(parallel_lights, PARALLEL_TEXELS * i + 1);
            vec4 third = fetch(parallel_lights, PARALLEL_TEXELS * i + 2);
            vec3 towards = first.xyz;
            mat3 fluence = mat3(first.w, second.xyz, second.w, third.x, third.yzw);
            local = towards * place.slopes;
            float cosine = dot(facet, towards);
            bool shines = local.z > 0.0 && cosine > 0.0;
            unsure = shines && !(place.on_surface && rises_above(tile, place.uv, local));
            arriving = cosine * (fluence * place.share);
            sum += shines && !unsure ? arriving : vec3(0.0);
            i++;
        }
        if (unsure) {
            vec3 to = vec3(place.uv + local.xy / local.z * (surface.top - from.z), surface.top);
            HeightHit hit;
            sum += march(tile, from, to, hit) ? vec3(0.0) : arriving;
        }
    } while (any_lane(i < end));
    return max(sum, vec3(0.0));
}
