//! The serial form of a REV state: exact, and compact enough to be written at every step.
//!
//! (cell, positions, pairs, tangential forces) where positions and forces are little-endian f64 in
//! one byte string each and pairs are delta-coded: grain i as the difference to the previous contact's,
//! grain j as the difference to i, both as LEB128. About 14 kB for 400 grains.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use crate::{Cell, Contact, RevState};

#[derive(Serialize, Deserialize)]
struct Wire<const D: usize> {
    cell: Cell<D>,
    #[serde(with = "serde_bytes")]
    positions: Vec<u8>,
    #[serde(with = "serde_bytes")]
    pairs: Vec<u8>,
    #[serde(with = "serde_bytes")]
    tangential: Vec<u8>,
}

/// Numbers as little-endian bytes.
pub fn to_bytes<'a>(values: impl Iterator<Item = &'a f64>) -> Vec<u8> {
    values.flat_map(|value| value.to_le_bytes()).collect()
}

/// The numbers back; `None` when the length is no multiple of 8.
pub fn from_bytes(bytes: &[u8]) -> Option<Vec<f64>> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    rest.is_empty().then(|| {
        chunks
            .iter()
            .map(|chunk| f64::from_le_bytes(*chunk))
            .collect()
    })
}

impl<const D: usize, const S: usize> Serialize for RevState<D, S> {
    fn serialize<Se: Serializer>(&self, serializer: Se) -> Result<Se::Ok, Se::Error> {
        let mut pairs = Vec::with_capacity(2 * self.contacts.len());
        let mut previous = 0;
        for contact in &self.contacts {
            put(&mut pairs, contact.i.wrapping_sub(previous));
            put(&mut pairs, contact.j.wrapping_sub(contact.i));
            previous = contact.i;
        }
        Wire {
            cell: self.cell,
            positions: to_bytes(self.positions.iter().flatten()),
            pairs,
            tangential: to_bytes(self.contacts.iter().flat_map(|c| &c.tangential)),
        }
        .serialize(serializer)
    }
}

impl<'de, const D: usize, const S: usize> Deserialize<'de> for RevState<D, S> {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        let wire = Wire::<D>::deserialize(deserializer)?;
        let torn = || De::Error::custom("torn REV state");
        let positions = from_bytes(&wire.positions).ok_or_else(torn)?;
        let tangential = from_bytes(&wire.tangential).ok_or_else(torn)?;
        let (positions, odd) = positions.as_chunks::<D>();
        let (tangential, odd_too) = tangential.as_chunks::<S>();
        if !odd.is_empty() || !odd_too.is_empty() {
            return Err(torn());
        }
        let mut contacts = Vec::with_capacity(tangential.len());
        let mut bytes = wire.pairs.iter();
        let mut i = 0u32;
        for force in tangential {
            i = i.wrapping_add(take(&mut bytes).ok_or_else(torn)?);
            let j = i.wrapping_add(take(&mut bytes).ok_or_else(torn)?);
            if j as usize >= positions.len() || i >= j {
                return Err(torn());
            }
            contacts.push(Contact {
                i,
                j,
                tangential: *force,
            });
        }
        if bytes.next().is_some() {
            return Err(torn());
        }
        Ok(Self {
            cell: wire.cell,
            positions: positions.to_vec(),
            contacts,
        })
    }
}

fn put(out: &mut Vec<u8>, mut value: u32) {
    while value >= 0x80 {
        out.push((value & 0x7f) as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn take(bytes: &mut std::slice::Iter<'_, u8>) -> Option<u32> {
    let mut value = 0u32;
    for shift in (0..35).step_by(7) {
        let byte = *bytes.next()?;
        value |= u32::from(byte & 0x7f).checked_shl(shift)?;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}
