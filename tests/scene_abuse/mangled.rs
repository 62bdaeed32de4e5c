//! Files with bytes changed at random.

use super::{GOOD, try_files};

/// A small generator with a known sequence (xorshift64*), so that a failure can be seen again.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n
    }
}

/// One or two changes: a byte put in, taken out, replaced, a piece doubled or cut off.
fn mangle(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    const BYTES: &[u8] = b"0123456789.-+eE/ \n\r\t\\#\"'[]={},naninfvtfKdmap_\0\xff\xc3\xa9";
    let mut bytes = bytes.to_vec();
    for _ in 0..=dice.below(2) {
        let at = dice.below(bytes.len().max(1));
        let byte = BYTES[dice.below(BYTES.len())];
        match dice.below(6) {
            _ if bytes.is_empty() => bytes.push(byte),
            0 => bytes.insert(at, byte),
            1 => drop(bytes.remove(at)),
            2 | 3 => bytes[at] = byte,
            4 => {
                let end = (at + 1 + dice.below(20)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                let to = dice.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

#[test]
fn mangled_files_never_panic() {
    let dir = tempfile::tempdir().unwrap();
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    let good = GOOD.map(|(name, text)| (name, text.as_bytes()));
    let (mut read, mut refused) = (0, 0);
    for round in 0..3_000 {
        let mut files = good;
        let mangled = mangle(good[round % 3].1, &mut dice);
        files[round % 3].1 = &mangled;
        match try_files(dir.path(), "a.toml", files) {
            Ok(()) => read += 1,
            Err(error) => {
                refused += 1;
                assert!(!error.is_empty() && !error.contains('\n'), "{error:?}");
            }
        }
    }
    // Both ways are taken often, or the mangling is too weak or too strong to tell anything.
    assert!(
        read > 300 && refused > 300,
        "{read} read, {refused} refused"
    );
}
