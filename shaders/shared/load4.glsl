// Four words that all lanes of the subgroup want, from `first` on. Each lane loads one of them: a load costs a software device
// as much as some ten operations for each lane, wherever it points. All lanes must be active.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require

#define LOAD4(words, first) share4(words[(first) + (gl_SubgroupInvocationID & 3)])

vec4 share4(uint word) {
    float value = uintBitsToFloat(word);
    return vec4(subgroupBroadcast(value, 0), subgroupBroadcast(value, 1), subgroupBroadcast(value, 2),
                subgroupBroadcast(value, 3));
}

uvec4 lanes_0_to_3(uint word) {
    return uvec4(subgroupBroadcast(word, 0), subgroupBroadcast(word, 1), subgroupBroadcast(word, 2), subgroupBroadcast(word, 3));
}

uvec4 lanes_4_to_7(uint word) {
    return uvec4(subgroupBroadcast(word, 4), subgroupBroadcast(word, 5), subgroupBroadcast(word, 6), subgroupBroadcast(word, 7));
}

// Eight words as bits, in one load where a subgroup has as many lanes.
#define LOAD8(words, first, low, high)                                            \
    {                                                                             \
        bool one = gl_SubgroupSize >= 8;                                          \
        uint word = words[(first) + (gl_SubgroupInvocationID & (one ? 7 : 3))];   \
        low = lanes_0_to_3(word);                                                 \
        if (one) {                                                                \
            high = lanes_4_to_7(word);                                            \
        } else {                                                                  \
            high = lanes_0_to_3(words[(first) + 4 + (gl_SubgroupInvocationID & 3)]); \
        }                                                                         \
    }

const uint SOURCE_WORDS = 32;
