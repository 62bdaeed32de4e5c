//! Files of lists of 32-bit words with a header, read as a whole or refused.
//!
//! 16 bytes that say what it is, the length of the envelope, the envelope (JSON), then the lists.

use std::io::{BufReader, Read};
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input_file;

/// What a file says it is, and what its errors call it.
pub(super) struct Kind {
    pub magic: &'static [u8; 16],
    pub name: &'static str,
}

#[derive(Serialize, Deserialize)]
struct Envelope {
    /// JSON.
    header: String,
    /// Words of each list.
    lengths: Vec<usize>,
    /// Of all else.
    sha256: String,
}

/// Most bytes of an envelope.
const LONGEST: u64 = 64 << 20;

pub(super) fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

fn digest<'a>(header: &str, lists: impl Iterator<Item = &'a [u32]>) -> String {
    let mut hash = Sha256::new();
    hash.update(header);
    for list in lists {
        hash.update((list.len() as u64).to_le_bytes());
        hash.update(bytemuck::cast_slice::<u32, u8>(list));
    }
    hexadecimal(hash)
}

impl Kind {
    pub fn write(&self, path: &Path, header: &impl Serialize, lists: &[&[u32]]) -> Result<()> {
        let failed = |e| Error::write(path, std::io::Error::other(e));
        let header = serde_json::to_string(header).map_err(failed)?;
        let envelope = Envelope {
            sha256: digest(&header, lists.iter().copied()),
            header,
            lengths: lists.iter().map(|list| list.len()).collect(),
        };
        let envelope = serde_json::to_vec(&envelope).map_err(failed)?;
        write_atomically(path, |out| {
            out.write_all(self.magic)?;
            out.write_all(&(envelope.len() as u64).to_le_bytes())?;
            out.write_all(&envelope)?;
            (lists.iter()).try_for_each(|list| out.write_all(bytemuck::cast_slice(list)))
        })
    }

    /// The header and the lists; refuses what is cut off or damaged.
    pub fn read<H: DeserializeOwned>(&self, path: &Path) -> Result<(H, Vec<Vec<u32>>)> {
        let name = self.name;
        let bad = |what: String| Error::file(path, what);
        let damaged = || bad(format!("its header is damaged: no file of {name}"));
        let (file, length) = input_file::open(path)?;
        let mut input = BufReader::new(file);
        let mut read = |bytes: &mut [u8]| {
            let ends = |_| bad(format!("ends before its {name} do"));
            input.read_exact(bytes).map_err(ends)
        };
        let mut magic = [0; 16];
        read(&mut magic)?;
        if magic != *self.magic {
            return Err(bad(format!("not a file of {name}")));
        }
        let mut envelope_length = [0; 8];
        read(&mut envelope_length)?;
        let envelope_length = u64::from_le_bytes(envelope_length);
        if envelope_length > LONGEST.min(length) {
            return Err(damaged());
        }
        let mut envelope = vec![0; envelope_length as usize];
        read(&mut envelope)?;
        let envelope: Envelope = serde_json::from_slice(&envelope).map_err(|_| damaged())?;
        let words = (envelope.lengths.iter()).try_fold(0_u64, |sum, &n| sum.checked_add(n as u64));
        let bytes = words.and_then(|words| words.checked_mul(4));
        if bytes.and_then(|bytes| bytes.checked_add(envelope_length + 24)) != Some(length) {
            return Err(bad("its length is not what its header says".into()));
        }
        let mut lists: Vec<Vec<u32>> = envelope.lengths.iter().map(|&n| vec![0; n]).collect();
        for list in &mut lists {
            read(bytemuck::cast_slice_mut(list))?;
        }
        let found = digest(&envelope.header, lists.iter().map(Vec::as_slice));
        // A fuzzer would find no way past it.
        if found != envelope.sha256 && !cfg!(fuzzing) {
            return Err(bad(format!(
                "damaged: its {name} are not those that were written"
            )));
        }
        let header = serde_json::from_str(&envelope.header).map_err(|_| damaged())?;
        Ok((header, lists))
    }
}
