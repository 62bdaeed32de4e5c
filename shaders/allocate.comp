// Finds room for the rows of a batch and writes their tables: for each block of GROUP elements
// where its factors start, 0 for a block that sees nothing of the source. Rows that find no room go
// to a chunk that the batch after the next overwrites. One workgroup; slots in order, so that which
// sources are kept is the same every run. Words that hold nothing are 0, since chunks go to files.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "shared/types.glsl"

layout(local_size_x = SELECT_GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// [slot][block]
layout(scalar, binding = 1) readonly buffer Occupied { uint occupied[]; };
// [slot]
layout(scalar, binding = 2) writeonly buffer Rows { KeptRow rows[]; };
layout(scalar, binding = 3) readonly buffer Chunks { uvec2 chunks[]; };
layout(scalar, binding = 4) buffer State { KeptState state; };

layout(push_constant, scalar) uniform Parameters {
    uint slot_count;
    uint block_count;
    uint meso_blocks;    // the last of them, with vectors
    uint chunk_count;
    uint chunk_words;
    uint scratch_chunk;  // has room for all slots
};

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Words { uint word[]; };

// 16 bits an element; a vector takes 32 for its direction.
const uint PLAIN_WORDS = GROUP / 2;
const uint MESO_WORDS = GROUP / 2 + GROUP;

shared uint first_word[SELECT_GROUP];
shared uint row_chunk;
shared uint row_first;
// A chunk that is left for the next, and its words from here on.
shared uint left_chunk;
shared uint left_first;

uint words_of(uint slot, uint block) {
    uint words = block < block_count - meso_blocks ? PLAIN_WORDS : MESO_WORDS;
    return occupied[slot * block_count + block] == 0 ? 0 : words;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint share = (block_count + SELECT_GROUP - 1) / SELECT_GROUP;
    uint begin = min(lane * share, block_count);
    uint end = min(begin + share, block_count);
    uint scratch_used = 0;
    for (uint slot = 0; slot < slot_count; slot++) {
        if (slots[slot].source == NONE) {
            break;
        }
        uint mine = 0;
        for (uint block = begin; block < end; block++) {
            mine += words_of(slot, block);
        }
        first_word[lane] = mine;
        barrier();
        if (lane == 0) {
            // Factors begin at a whole texel of four words.
            uint words = (block_count + 3) & ~3u;
            for (uint l = 0; l < SELECT_GROUP; l++) {
                uint of_lane = first_word[l];
                first_word[l] = words;
                words += of_lane;
            }
            left_first = chunk_words;
            if (state.chunk < chunk_count && state.used + words > chunk_words) {
                left_chunk = state.chunk;
                left_first = state.used;
                state.chunk++;
                state.used = 0;
            }
            bool fits = state.chunk < chunk_count && words <= chunk_words;
            row_chunk = fits ? state.chunk : scratch_chunk;
            row_first = fits ? state.used : scratch_used;
            rows[slot] = KeptRow(row_chunk, row_first, slots[slot].scale);
            if (fits) {
                state.used += words;
                state.rows++;
            } else {
                scratch_used += words;
            }
        }
        barrier();
        for (uint word = left_first + lane; word < chunk_words; word += SELECT_GROUP) {
            Words(chunks[left_chunk]).word[word] = 0;
        }
        Words words = Words(chunks[row_chunk]);
        uint table_end = (block_count + 3) & ~3u;
        for (uint word = block_count + lane; word < table_end; word += SELECT_GROUP) {
            words.word[row_first + word] = 0;
        }
        uint at = first_word[lane];
        for (uint block = begin; block < end; block++) {
            uint count = words_of(slot, block);
            words.word[row_first + block] = count == 0 ? 0 : at;
            at += count;
        }
        barrier();
    }
}
