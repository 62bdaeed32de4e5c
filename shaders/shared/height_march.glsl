// Where a straight segment first passes below a bilinear, periodic height map: exact, by the
// pyramid of maxima of src/meso/height_pyramid.rs. Including files have shared/types.glsl,
// shared/texels.glsl, a `usamplerBuffer pyramid`, four values a texel, and LEVELS, 0 where marches
// go from cell to cell without the pyramid: short ones are done sooner so, as a software device
// works through what a branch leaves out. The steps of all marches are added to the variable
// ALL_STEPS if there is one.
//
// Lengths are in texels here, x along columns and y along rows (down the image, against v), heights
// as the map has them. A texel's centre has whole coordinates. f32 keeps no more than 1e-4 of a
// texel a thousand texels away from where it counts from; so t is a pair of floats whose sum it is,
// places are counted from the corner of the cell at hand, and the products and sums that lose
// digits between the two keep their rests. A place along the segment is then right to about 1e-7 of
// a texel however far it lies, and errors do not grow from step to step.

// Components of a direction below this never reach a border: they move less than 1e-20 of a texel.
const float LEAST_STEP = 1e-20;
const float NEVER = 1e30;
// Times to start and to end the march are this much wider than the crossing of the highest level,
// for their rounding.
const float WIDER = 1e-6;
// More steps than any segment with coordinates that a float still tells apart: 2^24.
const float MOST_STEPS = 16777216.0;

// a + b, and what its rounding left out (Knuth 1969).
vec3 sum_rest(vec3 a, vec3 b, out vec3 rest) {
    precise vec3 sum = a + b;
    precise vec3 second = sum - a;
    precise vec3 first = sum - second;
    precise vec3 left_out = (a - first) + (b - second);
    rest = left_out;
    return sum;
}

// a * b, and what its rounding left out (Dekker 1971): halves of 12 bits have exact products.
vec3 product_rest(vec3 a, vec3 b, out vec3 rest) {
    precise vec3 product = a * b;
    precise vec3 a_high = uintBitsToFloat(floatBitsToUint(a) & uvec3(0xfffff000u));
    precise vec3 b_high = uintBitsToFloat(floatBitsToUint(b) & uvec3(0xfffff000u));
    precise vec3 a_low = a - a_high;
    precise vec3 b_low = b - b_high;
    precise vec3 left_out = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    rest = left_out;
    return product;
}

float value_of_pyramid(uint at) {
    return fetch(pyramid, at / 4)[at % 4];
}

struct Segment {
    ivec2 whole;      // cell of the start, in the period from texture coordinate 0 to 1
    vec3 start;       // place in that cell, and height
    vec3 step;        // from the start to the end
    vec3 step_rest;
};

Segment segment_of(HeightTile tile, vec3 from, vec3 to) {
    vec3 scale = vec3(float(tile.width), -float(tile.height), 1.0);
    Segment s;
    vec3 rest;
    vec3 texels = product_rest(from - vec3(trunc(from.xy), 0.0), scale, rest);
    s.whole = ivec2(floor(texels.xy - 0.5));
    precise vec3 start = ((texels - vec3(vec2(s.whole), 0.0)) - vec3(0.5, 0.5, 0.0)) + rest;
    s.start = start;
    vec3 difference_rest;
    vec3 difference = sum_rest(to, -from, difference_rest);
    s.step = product_rest(difference, scale, rest);
    s.step_rest = rest + difference_rest * scale;
    return s;
}

// The segment's place at t.x + t.y, counted from the corner of a cell.
vec3 place_at(Segment s, vec2 t, ivec2 cell) {
    vec3 rest;
    vec3 gone = product_rest(s.step, vec3(t.x), rest);
    precise vec3 place = ((gone - vec3(vec2(cell - s.whole), 0.0)) + s.start) + (rest + (s.step * t.y + s.step_rest * t.x));
    return place;
}

// Heights of the bilinear patch over a cell: corner + slope · p + twist p.x p.y.
struct Patch {
    float corner;
    vec2 slope;
    float twist;
};

Patch patch_of(HeightTile tile, ivec2 cell) {
    vec4 corners = fetch(pyramid, tile.first / 4 + cell.y * tile.width + cell.x);
    vec2 slope = corners.yz - corners.x;
    return Patch(corners.x, slope, (corners.w - corners.z) - slope.x);
}

// The first place, 0..1, where a line from `at` to `at + along` over a patch goes from above or on
// it to below it; -1 where it does not. The height above the patch is c + b r + a r²; a line that
// is below where it comes in crosses there: what rounding lost at the border of a cell is found at
// the next one's.
float crossing(Patch p, vec3 at, vec3 along) {
    float c = (at.z - p.corner) - (p.slope.x * at.x + p.slope.y * at.y + p.twist * at.x * at.y);
    float b = along.z - (p.slope.x * along.x + p.slope.y * along.y + p.twist * (at.x * along.y + at.y * along.x));
    float a = -p.twist * along.x * along.y;
    if (c < 0.0) {
        return 0.0;
    }
    bool ends_below = c + b + a < 0.0;
    bool dips = a > 0.0 && b < 0.0 && b + 2.0 * a > 0.0 && b * b > 4.0 * a * c;
    if (!ends_below && !dips) {
        return -1.0;
    }
    // Where the slope along the line is negative: (-b - root) / 2a without cancellation, nor a
    // division by a = 0.
    float root = sqrt(max(b * b - 4.0 * a * c, 0.0));
    float r = b > 0.0 ? -(b + root) / (2.0 * a) : (root - b > 0.0 ? 2.0 * c / (root - b) : 0.0);
    return clamp(r, 0.0, 1.0);
}

// The first t in 0..1 where the segment goes from above or on the surface to below it; 0 where it
// starts below it. The ends are (u, v, height). `hit` has the steps even where there is no hit.
bool march(HeightTile tile, vec3 from, vec3 to, out HeightHit hit) {
    hit = HeightHit(0.0, NONE, vec2(0.0), 0.0, vec2(0.0), 0);

    // Leave out what is above all of the map.
    if (from.z >= tile.highest && to.z >= tile.highest) {
        return false;
    }
    Segment segment = segment_of(tile, from, to);
    float highest_at = (tile.highest - from.z) / segment.step.z;
    vec2 t = vec2(from.z > tile.highest ? highest_at * (1.0 - WIDER) : 0.0, 0.0);
    float end = to.z > tile.highest ? min(highest_at * (1.0 + WIDER), 1.0) : 1.0;

    // Find the cell of the start: `cell` in the period, `period` + `cell` counted on from the
    // segment's own zero. The quotient may be rounded over a whole number, which is put right.
    ivec2 size = ivec2(tile.width, tile.height);
    ivec2 cell = segment.whole + ivec2(floor(place_at(segment, t, segment.whole).xy));
    cell += ivec2(floor(place_at(segment, t, cell).xy));
    vec3 at = place_at(segment, t, cell);
    at.xy = clamp(at.xy, 0.0, 1.0);
    ivec2 period = ivec2(floor(vec2(cell) / vec2(size))) * size;
    cell -= period;
    period += size * (ivec2(greaterThanEqual(cell, size)) - ivec2(lessThan(cell, ivec2(0))));
    cell += size * (ivec2(lessThan(cell, ivec2(0))) - ivec2(greaterThanEqual(cell, size)));

    vec3 step = segment.step;
    bvec2 forward = greaterThan(step.xy, vec2(0.0));
    bvec2 still = lessThan(abs(step.xy), vec2(LEAST_STEP));
    uint level = 0;
    uint first = tile.first + 4 * tile.width * tile.height;
    ivec2 blocks = size;

    // A move passes a line between cells, of which there are so many; it is followed by one ascent
    // at most, and there are no more descents than ascents. With NaN there are no steps.
    float moves = (abs(step.x) + abs(step.y)) * (end - t.x) + 6.0;
    float most = min(2.0 * moves, MOST_STEPS);
    if (!(most > 0.0)) {
        return false;
    }
    float count = 0.0;
    // A software device goes once more through a loop whose condition stands before it. Nothing
    // that the last turn finds is looked at behind it, see shared/shadow_rays.glsl.
    do {
        hit.steps++;
#ifdef ALL_STEPS
        ALL_STEPS++;
#endif
        // Find where the segment leaves this block.
        ivec2 block = cell >> level;
        ivec2 low = block << level;
        ivec2 high = min(low + (1 << level), size);
        vec2 border = mix(vec2(low - cell), vec2(high - cell), forward);
        vec2 leave = mix(max((border - at.xy) / mix(step.xy, vec2(1.0), still), 0.0), vec2(NEVER), still);
        float left = max((end - t.x) - t.y, 0.0);
        float gone = min(min(leave.x, leave.y), left);
        vec3 along = gone * step;

        // Look closer where it comes below the highest of the block. No `continue`: it would have
        // the whole loop in a branch.
        float highest = value_of_pyramid(first + block.y * blocks.x + block.x);
        bool near = LEVELS == 0 || min(at.z, at.z + along.z) < highest;
        bool closer = LEVELS == 1 && near && level > 0;
        if (closer) {
            level--;
            blocks = (size + ((1 << level) - 1)) >> level;
            first -= blocks.x * blocks.y;
        }
        if (!closer) {
            if (near) {
                Patch patch_here = patch_of(tile, cell);
                float r = crossing(patch_here, at, along);
                if (r >= 0.0) {
                    vec2 p = clamp(at.xy + r * along.xy, 0.0, 1.0);
                    hit.t = t.x + (t.y + r * gone);
                    hit.cell = cell.y * tile.width + cell.x;
                    hit.local = p;
                    hit.height = patch_here.corner
                                 + (dot(patch_here.slope, p) + patch_here.twist * p.x * p.y);
                    hit.gradient = (patch_here.slope + patch_here.twist * p.yx)
                                   * vec2(float(tile.width), -float(tile.height));
                    return true;
                }
            }
            if (gone >= left) {
                return false;
            }

            // Move over the border. The line that is crossed is known exactly; the other coordinate
            // only goes forward, and stays in the block.
            bvec2 over = bvec2(leave.x <= leave.y, leave.x > leave.y);
            ivec2 least = mix(low, cell, forward);
            ivec2 greatest = mix(cell, high - 1, forward);
            ivec2 next = clamp(cell + ivec2(floor(at.xy + along.xy)), least, greatest);
            next = mix(next, mix(low - 1, high, forward), over);
            precise float sum = t.x + (t.y + gone);
            precise float rest = (t.x - sum) + (t.y + gone);
            t = vec2(sum, rest);
            at = place_at(segment, t, period + next);
            vec2 edge = mix(vec2(1.0), vec2(0.0), forward);
            float late = over.x ? (edge.x - at.x) / step.x : (edge.y - at.y) / step.y;
            t.y += late;
            at += late * step;
            ivec2 true_next = mix(clamp(next + ivec2(floor(at.xy)), least, greatest), next, over);
            at.xy = mix(clamp(at.xy - vec2(true_next - next), 0.0, 1.0), edge, over);
            next = true_next;

            // Go on in the next period; climb where nothing was near, if a larger block was left
            // too.
            ivec2 wrap = ivec2(greaterThanEqual(next, size)) - ivec2(lessThan(next, ivec2(0)));
            bool left_larger = wrap != ivec2(0) || (next >> (level + 1)) != (cell >> (level + 1));
            period += wrap * size;
            cell = next - wrap * size;
            if (LEVELS == 1 && !near && left_larger && level < tile.top) {
                first += blocks.x * blocks.y;
                level++;
                blocks = (size + ((1 << level) - 1)) >> level;
            }
        }
    } while (++count < most);
    return false;
}
