//! Tells how an input is compressed, by its first bytes; its name is not looked at.
//!
//! Sources: gzip RFC 1952, zstd RFC 8878 (section 3.1), xz "The .xz File Format" 1.2.1 (section
//! 2.1.1.1), bzip2 the header of a stream and of its first block, or its end where it is empty.

/// A way in which an input is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    Gzip,
    Zstd,
    Xz,
    Bzip2,
}

impl Packing {
    /// Bytes that tell whether another member begins.
    #[cfg(feature = "compressed")]
    pub const TOLD_BY: usize = 10;

    /// How bytes are compressed that begin so.
    pub fn of(beginning: &[u8]) -> Option<Self> {
        let all = [Self::Gzip, Self::Zstd, Self::Xz, Self::Bzip2];
        // Frames of zstd that say nothing can come first: as parallel compressors write them.
        let mut rest = beginning;
        while let Some(length) = skippable(rest) {
            rest = usize::try_from(length).ok().and_then(|length| rest.get(length..))?;
        }
        let found = all.into_iter().find(|packing| packing.begins(rest))?;
        (found == Self::Zstd || rest.len() == beginning.len()).then_some(found)
    }

    /// Whether a member may begin with these bytes, which are fewer than tell it.
    #[cfg(feature = "compressed")]
    pub fn may_begin(self, bytes: &[u8]) -> bool {
        let magic: &[u8] = match self {
            Self::Gzip => b"\x1f\x8b\x08",
            Self::Zstd => b"\x28\xb5\x2f\xfd",
            Self::Xz => b"\xfd7zXZ\0",
            Self::Bzip2 => b"BZh",
        };
        let fewer = !bytes.is_empty() && bytes.len() < Self::TOLD_BY;
        fewer && (magic.starts_with(bytes) || bytes.starts_with(magic))
    }

    /// Whether a member of this way begins with these bytes.
    pub fn begins(self, bytes: &[u8]) -> bool {
        match self {
            Self::Gzip => bytes.starts_with(b"\x1f\x8b\x08"),
            Self::Zstd => bytes.starts_with(b"\x28\xb5\x2f\xfd"),
            Self::Xz => bytes.starts_with(b"\xfd7zXZ\0"),
            Self::Bzip2 => {
                bytes.starts_with(b"BZh")
                    && bytes.get(3).is_some_and(|level| (b'1'..=b'9').contains(level))
                    && bytes.get(4..10).is_some_and(|block| {
                        [b"\x31\x41\x59\x26\x53\x59", b"\x17\x72\x45\x38\x50\x90"]
                            .iter()
                            .any(|magic| block == *magic)
                    })
            }
        }
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
            Self::Xz => "xz",
            Self::Bzip2 => "bzip2",
        }
    }

    /// The program that unpacks it.
    pub fn tool(self) -> &'static str {
        match self {
            Self::Gzip => "gunzip",
            Self::Zstd => "unzstd",
            Self::Xz => "unxz",
            Self::Bzip2 => "bunzip2",
        }
    }
}

/// How long the frame of zstd is that these bytes begin, if it is one that says nothing.
pub(super) fn skippable(bytes: &[u8]) -> Option<u64> {
    let (magic, rest) = bytes.split_first_chunk()?;
    let (length, _) = rest.split_first_chunk()?;
    let is = u32::from_le_bytes(*magic) & 0xffff_fff0 == 0x184d_2a50;
    is.then(|| 8 + u64::from(u32::from_le_bytes(*length)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packings_are_told_by_content() {
        let cases: [(&[u8], Option<Packing>); 14] = [
            (b"\x1f\x8b\x08\0", Some(Packing::Gzip)),
            (b"\x1f\x8b\x07\0", None),
            (b"\x28\xb5\x2f\xfd\x64", Some(Packing::Zstd)),
            (b"\x5f\x2a\x4d\x18\x01\0\0\0x\x28\xb5\x2f\xfd", Some(Packing::Zstd)),
            (b"\x5f\x2a\x4d\x18\x01\0\0\0x\x1f\x8b\x08", None),
            (b"\x5f\x2a\x4d\x18\xff\xff\xff\xffx\x28\xb5\x2f\xfd", None),
            (b"\xfd7zXZ\0", Some(Packing::Xz)),
            (b"\xfd7zXZ", None),
            (b"BZh9\x31\x41\x59\x26\x53\x59", Some(Packing::Bzip2)),
            (b"BZh1\x17\x72\x45\x38\x50\x90", Some(Packing::Bzip2)),
            (b"BZh0\x31\x41\x59\x26\x53\x59", None),
            (b"BZh9 beside the point", None),
            (b"ITEM: TIMESTEP\n", None),
            (b"", None),
        ];
        for (bytes, wanted) in cases {
            assert_eq!(Packing::of(bytes), wanted, "{bytes:?}");
        }
    }
}
