//! Unpacks what is compressed, piece by piece: gzip, zstd, xz and bzip2.
//!
//! Members that follow one another (as `bgzip`, `pigz`, `pbzip2` and `cat` leave them) are all
//! read, and their checksums compared. What stands behind the last one is met as the tool of the
//! same name meets it: `gzip` and `bzip2` leave it out and say so, `xz` and `zstd` fail. Zeros
//! behind gzip data are passed over by all, and zeros between and behind xz data are its padding.

use std::{
    cell::Cell,
    io::{self, ErrorKind, Read},
    rc::Rc,
};

use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder, errors::FrameDecoderError};

use super::packing::{Packing, skippable};
use crate::input::{refused::Refused, stream::Source};

/// Bytes of what was unpacked before that a decoder may keep to look back at: what `zstd` takes
/// without being told otherwise, and twice what `xz -9` asks for.
const WINDOW: u64 = 128 << 20;

/// KiB that a decoder of xz may take: its window, and what is beside it.
const XZ_MEMORY: u32 = (WINDOW >> 10) as u32 + (1 << 10);

/// Unpacks an input.
pub(super) struct Unpacker {
    packing: Packing,
    source: Source<Box<dyn Read>>,
    /// The member that is unpacked now.
    member: Option<Member>,
    /// Bytes that were made of the members before.
    unpacked: u64,
    /// Whether there is nothing more.
    done: bool,
    /// Bytes behind the last member.
    left_out: Rc<Cell<u64>>,
}

/// What unpacks a member.
enum Member {
    Gzip(Box<flate2::Decompress>),
    Bzip2(Box<bzip2::Decompress>),
    Xz(Box<lzma_rust2::XzStream>),
    /// And the bytes that it has made.
    Zstd(Box<FrameDecoder>, u64),
}

/// What was done in one go.
struct Step {
    /// Bytes that were read, of those ahead.
    taken: usize,
    /// Bytes that were made.
    made: usize,
    /// Whether the member has ended.
    ended: bool,
}

/// Why a member cannot be unpacked.
enum Failure {
    /// It ends early.
    Cut,
    /// It is not what it should be; says how.
    Damaged(String),
    /// Its window is larger than [`WINDOW`].
    Wide,
    /// It is compressed against other data, which it does not hold.
    Dictionary,
    /// The input cannot be read.
    Refused(Refused),
}

impl From<Refused> for Failure {
    fn from(refused: Refused) -> Self {
        Self::Refused(refused)
    }
}

impl Unpacker {
    /// Nothing is unpacked before it is asked for.
    pub fn new(packing: Packing, source: Source<Box<dyn Read>>) -> Self {
        let (member, left_out) = (None, Rc::default());
        Self { packing, source, member, unpacked: 0, done: false, left_out }
    }

    /// Where it will be told how many bytes stand behind the last member.
    pub fn left_out(&self) -> Rc<Cell<u64>> {
        Rc::clone(&self.left_out)
    }

    /// Unpacks some bytes; none at the end only.
    fn unpack(&mut self, to: &mut [u8]) -> Result<usize, Failure> {
        while !self.done && !to.is_empty() {
            let Some(member) = &mut self.member else {
                self.begin()?;
                continue;
            };
            let Step { made, ended, .. } = member.step(&mut self.source, to)?;
            if ended {
                self.unpacked += member.made();
                self.member = None;
            }
            if made > 0 {
                return Ok(made);
            }
        }
        Ok(0)
    }

    /// Begins the next member, or sees that there is none.
    fn begin(&mut self) -> Result<(), Failure> {
        self.source.check()?;
        let packing = self.packing;
        let ahead = self.source.peek(Packing::TOLD_BY)?;
        if let Some(length) = skippable(ahead).filter(|_| packing == Packing::Zstd) {
            return match self.source.pass(length)? {
                passed if passed < length => Err(Failure::Cut),
                _ => Ok(()),
            };
        }
        if packing.begins(ahead) {
            self.member = Some(Member::new(packing, &mut self.source)?);
            return Ok(());
        }
        if packing.may_begin(ahead) {
            return Err(Failure::Cut);
        }
        if ahead.first() == Some(&0) && matches!(packing, Packing::Gzip | Packing::Xz) {
            let zeros = ahead.iter().take_while(|&&byte| byte == 0).count();
            self.source.take(zeros);
            return Ok(());
        }
        self.done = true;
        match (ahead.is_empty(), packing) {
            (true, _) => {}
            (false, Packing::Gzip | Packing::Bzip2) => {
                self.left_out.set(self.source.pass(u64::MAX)?);
            }
            (false, Packing::Xz | Packing::Zstd) => {
                return Err(Failure::Damaged("something else stands behind them".into()));
            }
        }
        Ok(())
    }

    /// The words for a failure.
    fn refused(&self, failure: Failure) -> Refused {
        let (name, tool) = (self.packing.name(), self.packing.tool());
        let bytes = self.unpacked + self.member.as_ref().map_or(0, Member::made);
        match failure {
            Failure::Refused(refused) => refused,
            Failure::Cut => Refused::new(
                format!("the {name} data end early: {bytes} bytes were unpacked"),
                "copy or write the file again: its end is missing",
            ),
            Failure::Damaged(words) => Refused::new(
                format!("the {name} data are damaged ({words}): {bytes} bytes were unpacked"),
                format!("copy or write the file again, until `{name} -t` finds no fault in it"),
            ),
            Failure::Wide => Refused::new(
                format!("the {name} data need more than {} MiB to be unpacked", WINDOW >> 20),
                match self.packing {
                    Packing::Zstd => format!("unpack it with `{tool} --long=31`"),
                    _ => format!("unpack it with {tool}"),
                },
            ),
            Failure::Dictionary => Refused::new(
                format!("the {name} data are compressed with a dictionary"),
                format!("unpack it with `{tool} -D DICTIONARY`"),
            ),
        }
    }
}

/// Errors hold a [`Refused`].
impl Read for Unpacker {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        self.unpack(to).map_err(|failure| io::Error::other(self.refused(failure)))
    }
}

impl Member {
    fn new(packing: Packing, from: &mut Source<Box<dyn Read>>) -> Result<Self, Failure> {
        /// The largest window of gzip, which is that of all its members: 2^15 bytes.
        const WINDOW_BITS: u8 = 15;
        Ok(match packing {
            Packing::Gzip => Self::Gzip(Box::new(flate2::Decompress::new_gzip(WINDOW_BITS))),
            Packing::Bzip2 => Self::Bzip2(Box::new(bzip2::Decompress::new(false))),
            Packing::Xz => {
                Self::Xz(Box::new(lzma_rust2::XzStream::new_mem_limit(false, XZ_MEMORY)))
            }
            Packing::Zstd => {
                let mut decoder = FrameDecoder::new();
                decoder.set_max_window_size(WINDOW);
                let mut from = Asked { source: from, failure: None };
                let begun = decoder.init(&mut from);
                begun.map_err(|error| from.failed(error))?;
                Self::Zstd(Box::new(decoder), 0)
            }
        })
    }

    /// Bytes that it has made.
    fn made(&self) -> u64 {
        match self {
            Self::Gzip(decoder) => decoder.total_out(),
            Self::Bzip2(decoder) => decoder.total_out(),
            Self::Xz(decoder) => decoder.total_out(),
            Self::Zstd(_, made) => *made,
        }
    }

    /// Unpacks some bytes; none only where the member has ended.
    fn step(&mut self, from: &mut Source<Box<dyn Read>>, to: &mut [u8]) -> Result<Step, Failure> {
        if let Self::Zstd(decoder, made) = self {
            let step = step_of_zstd(decoder, from, to)?;
            *made += step.made as u64;
            // Unknown is 0.
            let length = decoder.content_size();
            if step.ended && length > 0 && length != *made {
                return Err(Failure::Damaged("their length is another one".into()));
            }
            return Ok(step);
        }
        loop {
            let ahead = from.next()?;
            let there = ahead.len();
            let step = self.push(ahead, to)?;
            from.take(step.taken);
            match step {
                Step { made: 0, ended: false, .. } if there == 0 => return Err(Failure::Cut),
                Step { made: 0, ended: false, taken: 0 } => {
                    return Err(Failure::Damaged("they lead nowhere".into()));
                }
                Step { made: 0, ended: false, .. } => {}
                step => return Ok(step),
            }
        }
    }

    /// Unpacks some of these bytes. Where there are none, the input has ended.
    fn push(&mut self, bytes: &[u8], to: &mut [u8]) -> Result<Step, Failure> {
        /// The difference of two counts of bytes, which are both of pieces in memory.
        fn since(before: u64, now: u64) -> usize {
            usize::try_from(now.saturating_sub(before)).unwrap_or(usize::MAX)
        }
        match self {
            Self::Gzip(decoder) => {
                let before = (decoder.total_in(), decoder.total_out());
                let run = flate2::FlushDecompress::None;
                let status = decoder.decompress(bytes, to, run).map_err(|error| {
                    Failure::Damaged(error.message().unwrap_or("invalid data").into())
                })?;
                Ok(Step {
                    taken: since(before.0, decoder.total_in()),
                    made: since(before.1, decoder.total_out()),
                    ended: status == flate2::Status::StreamEnd,
                })
            }
            Self::Bzip2(decoder) => {
                let before = (decoder.total_in(), decoder.total_out());
                let status = decoder.decompress(bytes, to).map_err(|error| {
                    let words = error.to_string();
                    Failure::Damaged(words.trim_start_matches("bzip2: ").into())
                })?;
                Ok(Step {
                    taken: since(before.0, decoder.total_in()),
                    made: since(before.1, decoder.total_out()),
                    ended: status == bzip2::Status::StreamEnd,
                })
            }
            Self::Xz(decoder) => {
                let step = decoder.process(bytes, to, lzma_rust2::Action::Run);
                let step = step.map_err(|error| match error.kind() {
                    ErrorKind::OutOfMemory => Failure::Wide,
                    _ => Failure::Damaged(error.to_string()),
                })?;
                Ok(Step {
                    taken: step.bytes_consumed,
                    made: step.bytes_produced,
                    ended: step.status == lzma_rust2::Status::StreamEnd,
                })
            }
            // It reads its input itself.
            Self::Zstd(..) => Ok(Step { taken: 0, made: 0, ended: true }),
        }
    }
}

/// Unpacks some bytes of a frame of zstd; none only where it has ended.
fn step_of_zstd(
    decoder: &mut FrameDecoder,
    from: &mut Source<Box<dyn Read>>,
    to: &mut [u8],
) -> Result<Step, Failure> {
    let step = |made, ended| Ok(Step { taken: 0, made, ended });
    loop {
        if decoder.can_collect() > 0 {
            let made = decoder.read(to).map_err(|error| Failure::Damaged(error.to_string()))?;
            return step(made, false);
        }
        if decoder.is_finished() {
            let wanted = decoder.get_checksum_from_data();
            return match wanted.is_none_or(|sum| decoder.get_calculated_checksum() == Some(sum)) {
                true => step(0, true),
                false => Err(Failure::Damaged("their checksum is another one".into())),
            };
        }
        let mut from = Asked { source: &mut *from, failure: None };
        let decoded = decoder.decode_blocks(&mut from, BlockDecodingStrategy::UptoBlocks(1));
        decoded.map_err(|error| from.failed(error))?;
    }
}

/// An input that notes why it did not give what it was asked for.
struct Asked<'a> {
    source: &'a mut Source<Box<dyn Read>>,
    failure: Option<Failure>,
}

impl Asked<'_> {
    /// What is behind an error of a decoder.
    fn failed(self, error: FrameDecoderError) -> Failure {
        self.failure.unwrap_or_else(|| match error {
            FrameDecoderError::WindowSizeTooBig { .. } => Failure::Wide,
            FrameDecoderError::DictNotProvided { .. } => Failure::Dictionary,
            error => Failure::Damaged(error.to_string()),
        })
    }
}

impl Read for Asked<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let ahead = match self.source.next() {
            Ok(ahead) => ahead,
            Err(refused) => {
                self.failure = Some(refused.into());
                return Err(ErrorKind::Other.into());
            }
        };
        if ahead.is_empty() && !to.is_empty() {
            self.failure = Some(Failure::Cut);
        }
        let length = ahead.len().min(to.len());
        to[..length].copy_from_slice(&ahead[..length]);
        self.source.take(length);
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use std::{io::Write, path::Path};

    use super::*;
    use crate::particles::input::{Beginning, Input};
    use planisphere_core::drawing::Control;

    // The text of `text`, as gzip 1.12, zstd 1.5.4, xz 5.4.1 and bzip2 1.0.8 pack it.
    const GZIP: &str = "1f8b0800000000000003edc6310d00300800b01f151860095bf06f0d1f4b7bb5f39ec97ad1\
        2222222222222222222222222222222222ff66015456279f28230000";
    const ZSTD: &str = "28b52ffd6428228d0000483120322e35202d330a01001c837c3902ea11b442";
    const XZ: &str = "fd377a585a000004e6d6b4460200210116000000742fe5a3e0232700335d00188802a96575ce\
        761eb399229ee562455e5ca2540f64e62d5651489d717d56f825a51b6e42ab50840e569d09d65930904ad60000\
        00b964cb68291a549400014fa846000000d2bf73c3b1c467fb020000000004595a";
    const BZIP2: &str = "425a68393141592653592a219e15000bb7d800001040033a00200050860409aaa1994ca90\
        6d4832a41ca906d483b520f6a419520da907e2ee48a70a12054433c2a";
    /// By `xz --check=sha256`.
    const XZ_SHA: &str = "fd377a585a00000ae1fb0ca10200210116000000742fe5a3e0232700335d00188802a965\
        75ce761eb399229ee562455e5ca2540f64e62d5651489d717d56f825a51b6e42ab50840e569d09d65930904ad6\
        00000060d179953843d5cc7e6f5cfe388e03ef80dffbbcea4b56fe8b18f272ffbdac95000167a8460000008938\
        8c28b6e9df1c02000000000a595a";
    /// By `xz --check=crc32 --x86 --lzma2`: through a second filter.
    const XZ_X86: &str = "fd377a585a0000016922de3602010400210116000d86351fe0232700335d00188802a965\
        75ce761eb399229ee562455e5ca2540f64e62d5651489d717d56f825a51b6e42ab50840e569d09d65930904ad6\
        0000005456279f00014ba846000000c4fde2583e300d8b020000000001595a";
    /// By `xz --lzma2=preset=0,dict=512MiB`.
    const XZ_WIDE: &str = "fd377a585a000004e6d6b44602002101220000008240acdce0232700335d00188802a96\
        575ce761eb399229ee562455e5ca2540f64e62d5651489d717d56f825a51b6e42ab50840e569d09d65930904ad\
        6000000b964cb68291a549400014fa846000000d2bf73c3b1c467fb020000000004595a";

    const ALL: [(&str, &str); 4] = [("gzip", GZIP), ("zstd", ZSTD), ("xz", XZ), ("bzip2", BZIP2)];

    fn text() -> Vec<u8> {
        b"1 2.5 -3\n".repeat(1000)
    }

    fn bytes(hex: &str) -> Vec<u8> {
        let pairs = hex.as_bytes().chunks(2).map(|pair| std::str::from_utf8(pair).unwrap());
        pairs.map(|pair| u8::from_str_radix(pair, 16).unwrap()).collect()
    }

    fn read(from: impl Read + 'static, control: &Control) -> Result<Input, Refused> {
        Beginning::of_stream(Path::new("it"), Box::new(from), control)?.into_data()
    }

    fn unpacked(packed: &[u8]) -> Result<Input, Refused> {
        read(io::Cursor::new(packed.to_vec()), &Control::new())
    }

    /// Gives a byte at a time, and is interrupted before each.
    struct Dribble(Vec<u8>, usize);

    impl Read for Dribble {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            self.1 += 1;
            match self.1 % 2 {
                1 => Err(ErrorKind::Interrupted.into()),
                _ => self.0.get(self.1 / 2 - 1..).unwrap_or_default().take(1).read(to),
            }
        }
    }

    #[test]
    fn all_members_are_read() {
        for (name, hex) in ALL.into_iter().chain([("xz", XZ_SHA), ("xz", XZ_X86)]) {
            let (once, text) = (bytes(hex), text());
            let mut cases = vec![(once.clone(), 1), (once.repeat(3), 3)];
            match name {
                // Zeros: what a tape is filled up with, and the padding of xz.
                "gzip" => cases.push(([&once[..], &[0; 512]].concat(), 1)),
                "xz" => cases.push(([&once[..], &[0; 8], &once[..], &[0; 4]].concat(), 2)),
                // Frames that say nothing, as pzstd and the seekable format write them.
                "zstd" => {
                    let skipped = b"\x5e\x2a\x4d\x18\x03\0\0\0abc";
                    cases.push(([skipped, &once[..], skipped, &once[..], skipped].concat(), 2));
                }
                _ => {}
            }
            for (packed, times) in cases {
                let read = unpacked(&packed).unwrap();
                assert_eq!(read.packed, Some(name));
                assert!(read.data.as_slice() == text.repeat(times), "{name}, {times} times");
                assert!(read.notes.is_empty(), "{:?}", read.notes);
                let read = self::read(Dribble(packed, 0), &Control::new()).unwrap();
                assert!(read.data.as_slice() == text.repeat(times), "{name}, byte by byte");
            }
        }
    }

    #[test]
    fn data_that_end_early_are_refused_with_how_far_they_go() {
        for (name, hex) in ALL {
            let once = bytes(hex);
            let twice = once.repeat(2);
            for end in (18..once.len()).chain(once.len() + 1..twice.len()) {
                let error = unpacked(&twice[..end]).expect_err("cut");
                let start = format!("the {name} data end early: ");
                assert!(error.words.starts_with(&start), "{name}, {end}: {error:?}");
            }
            let error = unpacked(&twice[..once.len() + 18]).expect_err("cut");
            assert!(error.words.ends_with(": 9000 bytes were unpacked"), "{error:?}");
        }
        let skipped = [&bytes(ZSTD)[..], b"\x5e\x2a\x4d\x18\x03\0\0\0ab"].concat();
        let error = unpacked(&skipped).expect_err("cut");
        assert!(error.words.contains("end early: 9000 bytes"), "{error:?}");
    }

    /// Every bit that is turned over is found, unless the text is the right one without it.
    #[test]
    fn damage_is_found() {
        for (name, hex) in ALL.into_iter().chain([("xz", XZ_SHA)]) {
            let (right, text) = (bytes(hex), text());
            let mut found = 0;
            for bit in 8 * 10..8 * right.len() {
                let mut wrong = right.clone();
                wrong[bit / 8] ^= 1 << (bit % 8);
                match unpacked(&wrong) {
                    Ok(read) => assert!(read.data.as_slice() == text, "{name}: bit {bit}"),
                    Err(error) => {
                        found += 1;
                        assert!(error.words.starts_with(&format!("the {name} data")), "{error:?}");
                    }
                }
            }
            assert!(found > 8 * (right.len() - 20), "{name}: {found}");
        }
        // The checksums themselves.
        for (name, hex, behind, words) in [
            ("gzip", GZIP, 6, "incorrect data check"),
            ("zstd", ZSTD, 1, "their checksum is another one"),
            ("bzip2", BZIP2, 2, "invalid data"),
        ] {
            let mut wrong = bytes(hex);
            let at = wrong.len() - behind;
            wrong[at] ^= 0x10;
            let error = unpacked(&wrong).expect_err("another checksum");
            let wanted = format!("the {name} data are damaged ({words}): 9000 bytes were unpacked");
            assert_eq!(error.words, wanted);
        }
        // A frame without a checksum, but with a length: 256 more than there are.
        let mut wrong = bytes(ZSTD);
        wrong.truncate(wrong.len() - 4);
        (wrong[4], wrong[6]) = (0x60, 0x23);
        assert_eq!(
            unpacked(&wrong).expect_err("another length").words,
            "the zstd data are damaged (their length is another one): 9000 bytes were unpacked"
        );
    }

    #[test]
    fn what_stands_behind_is_met_as_the_tools_meet_it() {
        for (name, hex) in ALL {
            let read = unpacked(&[&bytes(hex)[..], b"and more of it"].concat());
            match name {
                "gzip" | "bzip2" => {
                    let read = read.unwrap();
                    assert!(read.data.as_slice() == text());
                    let note = format!("14 bytes behind the {name} data were left out");
                    assert_eq!(read.notes, [note]);
                }
                _ => {
                    let error = read.expect_err("something else");
                    assert!(error.words.contains("something else stands behind"), "{error:?}");
                }
            }
        }
    }

    #[test]
    fn what_would_take_too_much_is_refused() {
        // A frame of zstd with a window of 256 MiB, and one that needs a dictionary.
        let wide = unpacked(&bytes("28b52ffd0090010000")).expect_err("wide");
        assert_eq!(wide.words, "the zstd data need more than 128 MiB to be unpacked");
        assert_eq!(wide.fix, "unpack it with `unzstd --long=31`");
        let wide = unpacked(&bytes(XZ_WIDE)).expect_err("wide");
        assert_eq!(wide.words, "the xz data need more than 128 MiB to be unpacked");
        let other = unpacked(&bytes("28b52ffd010807010000")).expect_err("a dictionary");
        assert_eq!(other.words, "the zstd data are compressed with a dictionary");
        let mut twice = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        twice.write_all(&bytes(XZ)).unwrap();
        let twice = unpacked(&twice.finish().unwrap()).expect_err("twice");
        assert_eq!(twice.words, "is compressed twice: xz within gzip");
        assert_eq!(twice.fix, "unpack it once with gunzip");
    }

    /// Above 64 MiB, so that it lies in a temporary file.
    #[test]
    fn what_is_long_is_kept_in_a_file() {
        let line = |number: u32| format!("{number:07}\n");
        let lines = (64 << 20) / 8 + 1000;
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        for first in (0..lines).step_by(1000) {
            let some: String = (first..lines.min(first + 1000)).map(line).collect();
            packed.write_all(some.as_bytes()).unwrap();
        }
        let packed = packed.finish().unwrap();
        let read = unpacked(&packed).unwrap();
        assert!(read.data.mapped().is_some_and(|mapped| mapped.changed().is_none()));
        assert_eq!(read.data.len(), lines as usize * 8);
        for (row, number) in read.data.as_slice().chunks(8).zip(0..) {
            assert!(row == line(number).as_bytes(), "{number}");
        }
        let control = Control::new();
        let mut packed = io::Cursor::new(packed);
        let cancelled = control.clone();
        // Cancelled once half of it was read.
        let from = std::iter::from_fn(move || {
            if packed.position() > packed.get_ref().len() as u64 / 2 {
                cancelled.cancel();
            }
            let mut piece = vec![0; 1 << 16];
            let read = packed.read(&mut piece).unwrap();
            Some(io::Cursor::new(piece[..read].to_vec()))
        });
        let error = read_pieces(from, &control).expect_err("cancelled");
        assert_eq!(error.words, crate::input::report::CANCELLED);
    }

    /// Reads pieces that come one after another.
    fn read_pieces(
        pieces: impl Iterator<Item = io::Cursor<Vec<u8>>> + 'static,
        control: &Control,
    ) -> Result<Input, Refused> {
        struct Pieces<I>(I);
        impl<I: Iterator<Item = io::Cursor<Vec<u8>>>> Read for Pieces<I> {
            fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
                self.0.next().map_or(Ok(0), |mut piece| piece.read(to))
            }
        }
        read(Pieces(pieces), control)
    }

    #[test]
    fn a_file_that_changes_while_it_is_unpacked_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        for changes in [false, true] {
            std::fs::write(&path, bytes(GZIP)).unwrap();
            let beginning = Beginning::open(&path, &Control::new()).unwrap();
            assert_eq!((beginning.bytes(), beginning.packed), (&text()[..], Some("gzip")));
            if changes {
                let file = std::fs::OpenOptions::new().append(true).open(&path);
                file.unwrap().write_all(&bytes(GZIP)).unwrap();
            }
            match beginning.into_data() {
                Ok(read) => assert!(!changes && read.data.as_slice() == text()),
                Err(error) => assert!(changes && error.words.contains("changed"), "{error:?}"),
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_unpacked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        for (_, hex) in ALL {
            let writer = path.clone();
            let writer = std::thread::spawn(move || std::fs::write(writer, bytes(hex)).unwrap());
            let read = Beginning::open(&path, &Control::new()).unwrap().into_data().unwrap();
            assert!(read.data.as_slice() == text());
            writer.join().unwrap();
        }
    }

    /// A scene can be compressed too.
    #[test]
    fn text_is_unpacked() {
        for (_, hex) in ALL {
            let from = Box::new(io::Cursor::new(bytes(hex)));
            let beginning = Beginning::of_stream(Path::new("it"), from, &Control::new()).unwrap();
            assert!(beginning.into_text().unwrap() == text());
        }
    }
}
