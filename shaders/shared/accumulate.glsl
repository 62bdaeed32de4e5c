// Adds to a sum that is kept with the rounding error of the last addition (Kahan), so that 10⁵
// shots do not drift.

void accumulate(inout vec3 sum, inout vec3 error, vec3 add) {
    precise vec3 y = add - error;
    precise vec3 t = sum + y;
    precise vec3 rounding = (t - sum) - y;
    error = rounding;
    sum = t;
}
