//! Seals of the messages of a closed process, so that bytes which an instance writes between them
//! are told from them: a keyed hash of the number of the message and of its header. The key lies in
//! the memory of the process, in which an instance can look for it.

use std::hash::{BuildHasher, RandomState};
use std::io;

/// Largest number of bytes of a message.
const LARGEST: usize = 1 << 28;
/// Number of bytes of a header: kind and length of the message, and the hash.
pub(super) const HEADER: usize = 13;

/// The seal of the next message. Both ends of the pipe have one.
#[derive(Clone)]
pub(super) struct Seal {
    key: RandomState,
    /// Number of messages before it.
    pub(super) number: u64,
}

impl Seal {
    /// Makes a seal with a random key.
    pub(super) fn new() -> Self {
        Self { key: RandomState::new(), number: 0 }
    }

    /// Returns the header of the next message, which has so many bytes.
    ///
    /// # Errors
    /// Returns an error if it is too long.
    pub(super) fn header(&self, kind: u8, length: usize) -> io::Result<[u8; HEADER]> {
        if length > LARGEST {
            return Err(io::Error::other("the message is too long"));
        }
        let mut header = [kind; HEADER];
        header[1..5].copy_from_slice(&(length as u32).to_le_bytes());
        let hash: u64 = self.key.hash_one((self.number, kind, length));
        header[5..].copy_from_slice(&hash.to_le_bytes());
        Ok(header)
    }

    /// Returns kind and length of the next message; `None` if this is not its header.
    pub(super) fn opened(&self, header: &[u8; HEADER]) -> Option<(u8, usize)> {
        let [kind, a, b, c, d, ..] = *header;
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        (self.header(kind, length).ok()? == *header).then_some((kind, length))
    }
}
