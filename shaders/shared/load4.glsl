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

const uint SOURCE_WORDS = 32;
