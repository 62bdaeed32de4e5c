// Read-only data as texels of four words. A software device reads a texel several times as fast as
// four words of a storage buffer, and others do not mind.

uvec4 fetch_words(usamplerBuffer texels, uint at) {
    return texelFetch(texels, int(at));
}

vec4 fetch(usamplerBuffer texels, uint at) {
    return uintBitsToFloat(texelFetch(texels, int(at)));
}

// Texels of struct Source.
const uint SOURCE_TEXELS = 8;
