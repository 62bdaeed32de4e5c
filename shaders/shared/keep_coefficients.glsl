// Adds an invocation's sums to what a meso element holds. Including files have the bindings
// `coefficients`, [meso element][rank], `albedos`, [response][rank], and `meso_reflected`.

void keep_coefficients(uint i, MesoElement meso, vec3 sums[RELIEF_RANK]) {
    vec3 reflected = vec3(0.0);
    for (uint r = 0; r < RELIEF_RANK; r++) {
        uint at = i * RELIEF_RANK + r;
        coefficients[at] += vec4(sums[r], 0.0);
        reflected += fetch(albedos, meso.response * RELIEF_RANK + r).xyz * sums[r];
    }
    accumulate(meso_reflected[i].sum, meso_reflected[i].error, reflected * meso.scale);
}
