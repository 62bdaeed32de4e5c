// Irradiance of every element, kept with the rounding error of its last sum (Kahan), so that 10⁵ shots do not drift.
// Including files have the bindings direct, direct_error, indirect, indirect_error of vec3 per element.

void accumulate(uint e, vec3 add_direct, vec3 add_indirect) {
    precise vec3 y = add_direct - direct_error[e];
    precise vec3 t = direct[e] + y;
    precise vec3 error = (t - direct[e]) - y;
    direct_error[e] = error;
    direct[e] = t;
    y = add_indirect - indirect_error[e];
    t = indirect[e] + y;
    error = (t - indirect[e]) - y;
    indirect_error[e] = error;
    indirect[e] = t;
}

#ifdef TO_RELIEF
// The same of the light that a relief reflects; binding meso_reflected.
void accumulate_reflected(uint m, vec3 add) {
    precise vec3 y = add - meso_reflected[m].error;
    precise vec3 sum = meso_reflected[m].sum;
    precise vec3 total = sum + y;
    precise vec3 error = (total - sum) - y;
    meso_reflected[m] = Reflected(total, error);
}
#endif
