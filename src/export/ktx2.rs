//! A page as KTX 2 in BC6H blocks: half floats at 8 bits a texel, which GPUs read as they are.

use std::io;

use block_compression::encode::compress_rgba16;
use block_compression::{BC6HSettings, CompressionVariant};
use exr::prelude::f16;
use glam::Vec3;
use ktx2::{Format, Header, Index, LevelIndex, dfd};
use rayon::prelude::*;

/// Texels a side of a block.
pub const BLOCK: u32 = 4;

/// Bytes of a block: where it begins in a file is a multiple of them.
const BLOCK_BYTES: usize = 16;

const FORMAT: Format = Format::BC6H_UFLOAT_BLOCK;

/// The file of a page, `[row][column]` from the top, one level.
///
/// # Errors
/// A format descriptor that cannot be made; a size of 4 GiB and more.
pub fn encode(width: u32, height: u32, texels: &[Vec3]) -> io::Result<Vec<u8>> {
    let blocks = compressed(width, height, texels);
    let (basic, type_size) = dfd::Basic::from_format(FORMAT).map_err(io::Error::other)?;
    let descriptor = dfd::Block::Basic(basic).to_vec();
    // The section begins with its own length.
    let of_descriptor = size_of::<u32>() + descriptor.len();
    let writer = key_value("KTXwriter", concat!("Mesolux ", env!("CARGO_PKG_VERSION")));
    let descriptor_at = Header::LENGTH + LevelIndex::LENGTH;
    let writer_at = descriptor_at + of_descriptor;
    let blocks_at = (writer_at + writer.len()).next_multiple_of(BLOCK_BYTES);
    let short = |of: usize| u32::try_from(of).map_err(io::Error::other);
    let header = Header {
        format: Some(FORMAT),
        type_size,
        pixel_width: width,
        pixel_height: height,
        pixel_depth: 0,
        layer_count: 0,
        face_count: 1,
        level_count: 1,
        supercompression_scheme: None,
        index: Index {
            dfd_byte_offset: short(descriptor_at)?,
            dfd_byte_length: short(of_descriptor)?,
            kvd_byte_offset: short(writer_at)?,
            kvd_byte_length: short(writer.len())?,
            sgd_byte_offset: 0,
            sgd_byte_length: 0,
        },
    };
    let level = LevelIndex {
        byte_offset: blocks_at as u64,
        byte_length: blocks.len() as u64,
        uncompressed_byte_length: blocks.len() as u64,
    };
    let mut file = Vec::with_capacity(blocks_at + blocks.len());
    file.extend(header.as_bytes());
    file.extend(level.as_bytes());
    file.extend(short(of_descriptor)?.to_le_bytes());
    file.extend(descriptor);
    file.extend(writer);
    file.resize(blocks_at, 0);
    file.extend(blocks);
    Ok(file)
}

/// An entry of the section of keys and values: length, key, value, and what fills four bytes.
fn key_value(key: &str, value: &str) -> Vec<u8> {
    let text = format!("{key}\0{value}\0");
    let mut entry = (text.len() as u32).to_le_bytes().to_vec();
    entry.extend(text.as_bytes());
    entry.resize(entry.len().next_multiple_of(4), 0);
    entry
}

/// The blocks; beyond the page the last row and column go on.
fn compressed(width: u32, height: u32, texels: &[Vec3]) -> Vec<u8> {
    let variant = CompressionVariant::BC6H(BC6HSettings::slow());
    let across = width.next_multiple_of(BLOCK);
    let mut blocks = vec![0; variant.blocks_byte_size(across, height)];
    let of_row = variant.blocks_byte_size(across, BLOCK);
    blocks
        .par_chunks_exact_mut(of_row)
        .enumerate()
        .for_each(|(row, blocks)| {
            let mut halves = Vec::with_capacity(4 * (across * BLOCK) as usize);
            for y in (row as u32 * BLOCK..).take(BLOCK as usize) {
                for x in 0..across {
                    let [x, y] = [x.min(width - 1), y.min(height - 1)].map(|at| at as usize);
                    let texel = texels[y * width as usize + x];
                    let [r, g, b] = texel.to_array().map(half);
                    halves.extend([r, g, b, f16::ONE]);
                }
            }
            compress_rgba16(variant, &halves, blocks, across, BLOCK, 4 * across);
        });
    blocks
}

fn half(value: f32) -> f16 {
    f16::from_f32(value.clamp(0.0, f16::MAX.to_f32()))
}
