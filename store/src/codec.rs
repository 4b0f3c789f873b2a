//! Lossless compression of tables of floating-point numbers: byte shuffle, then zstd.
//!
//! Neighbouring numbers of a state differ in their low bytes and agree in their high ones. Sorting the
//! bytes by their place in the 8-byte word puts like beside like, which is what zstd can use (the
//! "shuffle" filter of HDF5 and Blosc). Measured on REV states: 1.48–1.50 times smaller at 800 MB/s.

use std::io;

use crate::MAX_PAYLOAD;

const WORD: usize = 8;
/// The fast end of zstd: higher levels gain under 20 % here.
const LEVEL: i32 = -1;

/// Sorts bytes by their place in the word; what is left beyond whole words stays at the end.
fn shuffle(bytes: &[u8]) -> Vec<u8> {
    let words = bytes.len() / WORD;
    let (whole, tail) = bytes.split_at(words * WORD);
    let mut out = Vec::with_capacity(bytes.len());
    let (whole, _) = whole.as_chunks::<WORD>();
    for place in 0..WORD {
        out.extend(whole.iter().map(|word| word[place]));
    }
    out.extend_from_slice(tail);
    out
}

/// Undoes [`shuffle`].
fn unshuffle(bytes: &[u8]) -> Vec<u8> {
    let words = bytes.len() / WORD;
    let mut out = bytes.to_vec();
    let (whole, _) = out[..words * WORD].as_chunks_mut::<WORD>();
    for place in 0..WORD {
        let plane = &bytes[place * words..(place + 1) * words];
        for (word, byte) in whole.iter_mut().zip(plane) {
            word[place] = *byte;
        }
    }
    out
}

/// Shuffles and compresses.
pub(crate) fn compress(bytes: &[u8]) -> io::Result<Vec<u8>> {
    zstd::bulk::compress(&shuffle(bytes), LEVEL)
}

/// Decompresses `stored` into exactly `decoded_len` bytes; `None` where it is nothing of the kind.
pub(crate) fn decompress(stored: &[u8], decoded_len: usize) -> Option<Vec<u8>> {
    if decoded_len > MAX_PAYLOAD {
        return None;
    }
    let shuffled = zstd::bulk::decompress(stored, decoded_len).ok()?;
    (shuffled.len() == decoded_len).then(|| unshuffle(&shuffled))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_length_loses_its_tail() {
        for len in 0..70_usize {
            let bytes: Vec<u8> = (0..len).map(|i| (i * 37 % 251) as u8).collect();
            let packed = compress(&bytes).unwrap();
            assert_eq!(
                decompress(&packed, len).as_deref(),
                Some(&bytes[..]),
                "length {len}"
            );
            assert_eq!(decompress(&packed, len + 1), None);
        }
    }
}
