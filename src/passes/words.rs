//! Lists on the host for buffers of a device, as the words that they are.

use bytemuck::Pod;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Values of a type whose size is a multiple of four bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Words(Vec<u32>);

impl Words {
    pub fn of<T: Pod>(values: &[T]) -> Self {
        Self(bytemuck::cast_slice(values).to_vec())
    }

    /// The values that [`Self::of`] was given.
    pub fn values<T: Pod>(&self) -> &[T] {
        bytemuck::cast_slice(&self.0)
    }

    /// The same as a list of its own, which values that are aligned to more than words need.
    pub fn collected<T: Pod>(&self) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.0)
    }

    pub fn words(&self) -> &[u32] {
        &self.0
    }

    pub fn into_words(self) -> Vec<u32> {
        self.0
    }
}

impl From<Vec<u32>> for Words {
    fn from(words: Vec<u32>) -> Self {
        Self(words)
    }
}

impl Serialize for Words {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bytes(bytemuck::cast_slice(&self.0))
    }
}

impl<'de> Deserialize<'de> for Words {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Bytes;

        impl<'de> Visitor<'de> for Bytes {
            type Value = Words;

            fn expecting(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(to, "bytes of whole words")
            }

            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Words, E> {
                match bytes.len() % 4 {
                    0 => Ok(Words(bytemuck::pod_collect_to_vec(bytes))),
                    _ => Err(E::invalid_length(bytes.len(), &self)),
                }
            }

            // Of a format that has no bytes.
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Words, A::Error> {
                let mut bytes = Vec::new();
                while let Some(byte) = list.next_element()? {
                    bytes.push(byte);
                }
                self.visit_bytes(&bytes)
            }
        }

        from.deserialize_bytes(Bytes)
    }
}
