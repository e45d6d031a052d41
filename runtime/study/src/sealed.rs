//! Sealed files: bytes that know what they are, which study they belong to, and whether they are whole.
//!
//! ```text
//! magic [8] · format u32 · numerics u32 · belongs_to [32] · sections u32 · (length u64 · BLAKE3 [32])…
//! BLAKE3 of all before [32] · the sections
//! ```
//! Numbers are little-endian. A length is checked against the file before anything is read.

use thiserror::Error;

/// Version of everything that decides a bit of a record: simulator, learner, random numbers, statistics.
pub const NUMERICS_VERSION: u32 = 1;

/// What a sealed file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    pub magic: [u8; 8],
    pub format: u32,
}

/// Why a sealed file was not opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Damage {
    #[error("it is of another kind")]
    Foreign,
    #[error("it has format {found}, this version reads {known}")]
    Format { found: u32, known: u32 },
    #[error("it has numerics version {found}, this version has {known}")]
    Numerics { found: u32, known: u32 },
    #[error("it belongs to another study or cell")]
    OtherStudy,
    #[error("it is damaged or cut off")]
    Broken,
}

const HASH: usize = 32;

/// The file with these sections.
pub(crate) fn seal(kind: Kind, belongs_to: &blake3::Hash, sections: &[&[u8]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend_from_slice(&kind.magic);
    bytes.extend_from_slice(&kind.format.to_le_bytes());
    bytes.extend_from_slice(&NUMERICS_VERSION.to_le_bytes());
    bytes.extend_from_slice(belongs_to.as_bytes());
    bytes.extend_from_slice(&(sections.len() as u32).to_le_bytes());
    for section in sections {
        bytes.extend_from_slice(&(section.len() as u64).to_le_bytes());
        bytes.extend_from_slice(blake3::hash(section).as_bytes());
    }
    let header = blake3::hash(&bytes);
    bytes.extend_from_slice(header.as_bytes());
    for section in sections {
        bytes.extend_from_slice(section);
    }
    bytes
}

/// The `N` sections of a file, if it is whole and what it should be.
pub(crate) fn open<'a, const N: usize>(
    kind: Kind,
    belongs_to: &blake3::Hash,
    bytes: &'a [u8],
) -> Result<[&'a [u8]; N], Damage> {
    let mut rest = bytes;
    if take::<8>(&mut rest)? != kind.magic {
        return Err(Damage::Foreign);
    }
    let format = number(&mut rest)?;
    if format != kind.format {
        return Err(Damage::Format { found: format, known: kind.format });
    }
    let numerics = number(&mut rest)?;
    let owner = take::<HASH>(&mut rest)?;
    if number(&mut rest)? as usize != N {
        return Err(Damage::Broken);
    }
    let mut described = [(0, [0; HASH]); N];
    for one in &mut described {
        *one = (u64::from_le_bytes(take(&mut rest)?), take(&mut rest)?);
    }
    let header = bytes.get(..bytes.len() - rest.len()).unwrap_or_default();
    if blake3::hash(header) != take::<HASH>(&mut rest)? {
        return Err(Damage::Broken);
    }
    if numerics != NUMERICS_VERSION {
        return Err(Damage::Numerics { found: numerics, known: NUMERICS_VERSION });
    }
    if *belongs_to != owner {
        return Err(Damage::OtherStudy);
    }
    let mut opened = [[].as_slice(); N];
    for (section, (length, hash)) in opened.iter_mut().zip(described) {
        let length = usize::try_from(length).map_err(|_| Damage::Broken)?;
        (*section, rest) = rest.split_at_checked(length).ok_or(Damage::Broken)?;
        if blake3::hash(section) != hash {
            return Err(Damage::Broken);
        }
    }
    if rest.is_empty() { Ok(opened) } else { Err(Damage::Broken) }
}

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], Damage> {
    let (first, others) = rest.split_first_chunk().ok_or(Damage::Broken)?;
    *rest = others;
    Ok(*first)
}

fn number(rest: &mut &[u8]) -> Result<u32, Damage> {
    Ok(u32::from_le_bytes(take(rest)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: Kind = Kind { magic: *b"mpgxtest", format: 3 };

    fn sample() -> (blake3::Hash, Vec<u8>) {
        let study = blake3::hash(b"study");
        (study, seal(KIND, &study, &[b"first section", b"", b"third"]))
    }

    #[test]
    fn what_was_sealed_is_opened() {
        let (study, bytes) = sample();
        assert_eq!(open(KIND, &study, &bytes), Ok([b"first section".as_slice(), b"", b"third"]));
    }

    /// Seen to fail when the hash of the header or of a section is not compared, or when bytes may follow.
    #[test]
    fn every_flipped_byte_and_every_cut_is_noticed() {
        let (study, bytes) = sample();
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut flipped = bytes.clone();
                flipped[at] ^= 1 << bit;
                assert!(open::<3>(KIND, &study, &flipped).is_err(), "byte {at}, bit {bit}");
            }
            assert!(open::<3>(KIND, &study, &bytes[..at]).is_err(), "cut to {at}");
        }
        assert!(open::<3>(KIND, &study, &[bytes.as_slice(), b"x"].concat()).is_err());
    }

    /// Seen to fail when format, owner or numerics version is not compared.
    #[test]
    fn the_reason_is_told() {
        let (study, bytes) = sample();
        let other = Kind { format: 2, ..KIND };
        assert_eq!(open::<3>(other, &study, &bytes), Err(Damage::Format { found: 3, known: 2 }));
        let foreign = Kind { magic: *b"whatelse", ..KIND };
        assert_eq!(open::<3>(foreign, &study, &bytes), Err(Damage::Foreign));
        assert_eq!(open::<3>(KIND, &blake3::hash(b"x"), &bytes), Err(Damage::OtherStudy));
        let numerics = |version: u32| {
            let mut bytes = seal(KIND, &study, &[b"abc"]);
            bytes[12..16].copy_from_slice(&version.to_le_bytes());
            let header = blake3::hash(&bytes[..92]);
            bytes[92..124].copy_from_slice(header.as_bytes());
            open::<1>(KIND, &study, &bytes).err()
        };
        let (found, known) = (NUMERICS_VERSION + 1, NUMERICS_VERSION);
        assert_eq!((numerics(known), numerics(found)), (None, Some(Damage::Numerics { found, known })));
    }

    #[test]
    fn a_huge_length_is_refused_without_reading() {
        let study = blake3::hash(b"study");
        let mut bytes = seal(KIND, &study, &[b"abc"]);
        bytes[52..60].copy_from_slice(&u64::MAX.to_le_bytes());
        let header = blake3::hash(&bytes[..92]);
        bytes[92..124].copy_from_slice(header.as_bytes());
        assert_eq!(open::<1>(KIND, &study, &bytes), Err(Damage::Broken));
    }
}
