//! XTC trajectories of GROMACS.
//!
//! The format: the XDR files of GROMACS and `xdrfile`, whose positions are packed as "3dfcoord":
//! integers, of which each is the position by the precision. A frame is a header, the box and the
//! positions, with the big end first; lengths are in nm. A frame's place is the byte at which it
//! begins.

use std::ops::Range;

use super::{
    Cell, Data, Particles, Reader,
    binary::{all_finite, numbers, room, take},
};
use crate::input::report::Fault;
use planisphere_core::{drawing::Control, scene::Reals};

mod unpack;

/// Bytes of a frame before its positions.
const HEADER: usize = 56;

/// Up to so many atoms are not packed.
const PLAIN: usize = 9;

/// What a frame begins with.
const MAGIC: i32 = 1995;
/// The same, where the packed bytes may be many: their number has 64 bits.
const MAGIC_LARGE: i32 = 2023;

/// Whether bytes begin as an XTC file does.
pub(super) fn is(beginning: &[u8]) -> bool {
    let number = |at: usize| take(beginning, at).map(i32::from_be_bytes);
    matches!(number(0), Some(MAGIC | MAGIC_LARGE))
        && number(4).is_some_and(|atoms| atoms >= 0)
        && number(4) == number(HEADER - 4)
}

/// A reader.
pub(super) fn open(_: &Data) -> Result<Box<dyn Reader>, Fault> {
    Ok(Box::new(Xtc))
}

#[derive(Debug)]
struct Xtc;

/// What is known of a frame before its positions are read.
#[derive(Debug)]
struct Header {
    atoms: usize,
    /// The edges of the box.
    edges: [[f64; 3]; 3],
    /// Where the positions lie: what says how they are packed, if they are, and then they.
    packing: Option<Packing>,
    positions: Range<usize>,
    /// Where the frame ends.
    end: usize,
}

/// How positions are packed.
#[derive(Clone, Copy, Debug)]
struct Packing {
    /// What a length of 1 is.
    precision: f32,
    /// The least integers of the three axes.
    least: [i32; 3],
    /// The greatest.
    most: [i32; 3],
    /// Which of the sizes small steps have at first.
    small: u32,
}

impl Reader for Xtc {
    fn frame(&self, data: &Data, at: usize) -> Result<Option<Range<usize>>, Fault> {
        if at >= data.len() {
            return Ok(None);
        }
        let header = Header::read(data.as_slice(), at)?;
        let first = if at > 0 { Header::read(data.as_slice(), 0)?.atoms } else { header.atoms };
        if header.atoms != first {
            return Err(Fault::whole(
                format!(
                    "the frame that begins at byte {at} has {} atoms, but the first has {first}",
                    header.atoms
                ),
                "write each trajectory into a file of its own",
            ));
        }
        Ok(Some(at..header.end))
    }

    fn read(
        &self,
        data: &Data,
        frame: Range<usize>,
        control: &Control,
    ) -> Result<Particles, Fault> {
        let whole = data.as_slice();
        let header = Header::read(whole, frame.start)?;
        room(header.atoms.saturating_mul(12))?;
        data.begin(frame.clone());
        let bytes = whole.get(header.positions.clone()).unwrap_or_default();
        let found = match &header.packing {
            None => numbers(bytes, f32::from_be_bytes),
            Some(packing) => unpack::positions(bytes, header.atoms, packing, control)?
                .ok_or_else(|| broken(&header.positions))?,
        };
        data.done(frame);
        let centers = Reals::F32(found.into());
        all_finite(&centers)?;
        let none = header.edges == [[0.0; 3]; 3];
        let mut notes = Vec::new();
        let finite = header.edges.as_flattened().iter().all(|number| number.is_finite());
        if !finite {
            notes.push("the box is not of finite numbers, and was left out".into());
        }
        let cell = Cell { origin: [0.0; 3], edges: header.edges };
        let cell = Some(cell).filter(|_| finite && !none);
        Ok(Particles {
            centers,
            centers_from: "x y z, in nm".into(),
            columns: Vec::new(),
            cell,
            notes,
        })
    }
}

impl Header {
    fn read(whole: &[u8], at: usize) -> Result<Self, Fault> {
        let short = |end: Option<usize>| {
            let what = match end {
                Some(end) => format!("ends at byte {end}"),
                None => "goes on".into(),
            };
            Fault::whole(
                format!(
                    "the frame that begins at byte {at} {what}, but the file has {} bytes: it is \
                     cut short",
                    whole.len()
                ),
                "wait until the file is written, or copy it again",
            )
        };
        let place = |offset: usize| at.checked_add(offset).ok_or_else(|| short(None));
        let integer = |offset: usize| -> Result<i32, Fault> {
            take(whole, place(offset)?).map(i32::from_be_bytes).ok_or_else(|| short(None))
        };
        let real = |offset: usize| -> Result<f32, Fault> {
            take(whole, place(offset)?).map(f32::from_be_bytes).ok_or_else(|| short(None))
        };
        let magic = integer(0)?;
        let (count, again) = (integer(4)?, integer(HEADER - 4)?);
        let atoms = usize::try_from(count).ok().filter(|_| count == again);
        let (MAGIC | MAGIC_LARGE, Some(atoms)) = (magic, atoms) else {
            return Err(Fault::whole(
                format!(
                    "no frame begins at byte {at}: {magic}, then {count} and {again} atoms, stand \
                     there, where 1995 or 2023 is expected, then two numbers that are equal"
                ),
                "copy the file again, or write it again: it is damaged",
            ));
        };
        let mut edges = [[0.0; 3]; 3];
        for (number, edge) in edges.as_flattened_mut().iter_mut().enumerate() {
            *edge = f64::from(real(16 + 4 * number)?);
        }
        let (packing, start, bytes) = if atoms <= PLAIN {
            (None, HEADER, 12 * atoms)
        } else {
            let axes = |from: usize| -> Result<[i32; 3], Fault> {
                Ok([integer(from)?, integer(from + 4)?, integer(from + 8)?])
            };
            let packing = Packing {
                precision: real(HEADER)?,
                least: axes(HEADER + 4)?,
                most: axes(HEADER + 16)?,
                small: integer(HEADER + 28)?.cast_unsigned(),
            };
            let (length, start) = match magic {
                MAGIC => (i64::from(integer(HEADER + 32)?), HEADER + 36),
                _ => {
                    let [high, low] = [integer(HEADER + 32)?, integer(HEADER + 36)?];
                    (i64::from(high) << 32 | i64::from(low.cast_unsigned()), HEADER + 40)
                }
            };
            let bytes = usize::try_from(length).map_err(|_| no_length(at, length))?;
            (Some(packing), start, bytes)
        };
        let start = place(start)?;
        let end = start.checked_add(bytes).ok_or_else(|| short(None))?;
        // Filled up to whole words.
        let next = bytes.checked_next_multiple_of(4).and_then(|bytes| start.checked_add(bytes));
        let next = next.ok_or_else(|| short(None))?;
        if next > whole.len() {
            return Err(short(Some(next)));
        }
        // Each atom takes two bits at least.
        if packing.is_some() && atoms / 4 > bytes {
            return Err(broken(&(start..end)));
        }
        Ok(Self { atoms, edges, packing, positions: start..end, end: next })
    }
}

fn no_length(at: usize, length: i64) -> Fault {
    Fault::whole(
        format!("the frame that begins at byte {at} has {length} bytes of positions"),
        "copy the file again, or write it again: it is damaged",
    )
}

fn broken(positions: &Range<usize>) -> Fault {
    Fault::whole(
        format!(
            "the packed positions at bytes {} to {} do not unpack: they are not as many as the \
             frame has atoms, or no such numbers",
            positions.start, positions.end
        ),
        "copy the file again, or write it again: it is damaged",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::{
        Format,
        file::tests::{centers, frame, opened},
    };

    /// By MDAnalysis 2.11, of 60 atoms at precision 1000.
    const GROUPS: &str = "\
        000007cb0000003c000000073fc000004040000000000000000000003f00000040500000000000003f800000\
        3e800000408000000000003c447a0000fffff830ffffffff000000000000078800000a4e000009c200000009\
        000000e0e055c90013d60fece16b80425da13a2970088b51dd7e00982c97e00c5d1f52afe65822a406cd7e31\
        5b0f6f3d18b16847c0700583e7f6c533b6d20fabb464404ed0e46e56f03730ff26659a19c1c285f256eb9e92\
        130ff771a9410f8941ca54fdafcd9d2fdda05d51f893053d679f46e0507e745605622713538112248e504579\
        615f01e1c654182c482e4d85f3fe24186f94f86fcbfbbbccfca051ff5fc363490d7ec5e76f34803480348034\
        8034808f5339e270cfc93e4db41fb6afcb4fc56d7cb15c7b64db57bb1971337c7fe65c9e37ff51cec25e3d19\
        2e386947e11d3910";

    /// By mdtraj 1.11, of 12 atoms so far apart that the numbers of one are not one number.
    const FAR: &str = "\
        000007cb0000000c000000000000000000000000000000000000000000000000000000000000000000000000\
        00000000000000000000000c447a0000ff76abc000000000ffaa100000fd4bc000abe000000000000000003f\
        0000007301f40007d0004e20009003405c00300181803e80007d000232800442328002ee0007d000110fa000\
        0fa0001b58004461a8004e20005dc001123280017700013880044bf68006d60003e800113e80001f40000bb8\
        004586a0009c40000fa0012a1d7e810a20cec45840ee480abe00000000108000";

    fn bytes(hex: &str) -> Vec<u8> {
        let digit = |byte: u8| char::from(byte).to_digit(16).expect("a digit") as u8;
        hex.as_bytes().chunks(2).map(|two| 16 * digit(two[0]) + digit(two[1])).collect()
    }

    /// The integers of the first: groups of six that lie near each other, each in its own way.
    fn groups() -> Vec<[i32; 3]> {
        let mut at = [0; 3];
        let atom = |i: i32| {
            let g = i / 6;
            if i % 6 == 0 {
                at = [g * g * 977 % 4000 - 2000, g * 1234 % 3000, g * 555 % 2500];
            } else {
                let f = [1, 2, 4, 8, 16, 30, 1, 0, 60, 3][g as usize];
                let step = [i * 7 % 11 - 5, i * 5 % 13 - 6, i * 3 % 7 - 3];
                at = [at[0] + step[0] * f, at[1] + step[1] * f, at[2] + step[2] * f];
            }
            at
        };
        (0..60).map(atom).collect()
    }

    fn places(integers: &[[i32; 3]]) -> Vec<[f64; 3]> {
        let inverse = 1.0 / 1000f32;
        integers.iter().map(|at| at.map(|n| f64::from(n as f32 * inverse))).collect()
    }

    /// The same frame with the other number at its beginning.
    fn large(frame: &[u8]) -> Vec<u8> {
        let mut large = 2023i32.to_be_bytes().to_vec();
        large.extend(&frame[4..88]);
        large.extend([0; 4]);
        large.extend(&frame[88..]);
        large
    }

    /// A frame of up to nine atoms.
    fn plain(values: &[f32]) -> Vec<u8> {
        let count = (values.len() / 3) as i32;
        let mut out: Vec<u8> =
            [1995, count, 3].iter().flat_map(|n: &i32| n.to_be_bytes()).collect();
        out.extend([0; 40]);
        out.extend(count.to_be_bytes());
        out.extend(values.iter().flat_map(|value| value.to_be_bytes()));
        out
    }

    #[test]
    fn positions_are_those_that_were_packed() {
        let (found, far) = (bytes(GROUPS), bytes(FAR));
        let far_at = |i: i32| [i * i * 256 % 30_000 - 9000, i * 1024, -i * 512].map(|n| n * 1000);
        let far_at: Vec<[i32; 3]> = (0..12).map(far_at).collect();
        let nine: Vec<f32> = (0..27).map(|n| n as f32 * 0.1).collect();
        let nine_at: Vec<[f64; 3]> =
            nine.as_chunks::<3>().0.iter().map(|at| at.map(f64::from)).collect();
        let frames = [&found[..], &large(&found), &plain(&nine), &far, &plain(&[])];
        let wanted = [places(&groups()), places(&groups()), nine_at, places(&far_at), Vec::new()];
        assert!(frames.iter().all(|frame| is(frame)));
        for (frame, wanted) in frames.iter().zip(&wanted) {
            let file = opened(Format::Xtc, [*frame, *frame].concat()).unwrap();
            assert_eq!(file.frames(&Control::new()).unwrap(), 2);
            let found = file.read(1, &Control::new()).unwrap();
            assert_eq!(centers(&found), *wanted);
            assert!(found.columns.is_empty() && found.notes.is_empty());
        }
        // The two kinds may follow one another, but not frames of other numbers of atoms.
        let file = opened(Format::Xtc, frames[..2].concat()).unwrap();
        let cell = file.read(1, &Control::new()).unwrap().cell.unwrap();
        assert_eq!(cell.edges, [[3.0, 0.0, 0.0], [0.5, 3.25, 0.0], [1.0, 0.25, 4.0]]);
        let error = opened(Format::Xtc, frames[1..3].concat()).unwrap().frames(&Control::new());
        assert!(error.expect_err("nine").message().contains("has 9 atoms, but the first has 60"));
        let file = opened(Format::Xtc, frames[2]).unwrap();
        assert_eq!(file.read(0, &Control::new()).unwrap().cell, None);
    }

    #[test]
    fn what_is_wrong_is_told() {
        let whole = [bytes(GROUPS), bytes(GROUPS)].concat();
        let length = whole.len() / 2;
        for cut in [length + 1, length + 60, whole.len() - 1] {
            let file = opened(Format::Xtc, &whole[..cut]).unwrap();
            let error = file.frames(&Control::new()).expect_err("cut");
            let words = ["cut short", "the frame before it is whole: --frame 0"];
            assert!(words.iter().all(|words| error.message().contains(words)), "{error}");
        }
        let set = |at: usize, value: i32| {
            let mut bytes = bytes(GROUPS);
            bytes[at..at + 4].copy_from_slice(&value.to_be_bytes());
            bytes
        };
        for (bytes, words) in [
            (set(0, 1993), "no frame begins at byte 0: 1993, then 60 and 60 atoms"),
            (set(4, -1), "then -1 and 60 atoms"),
            (set(52, 61), "then 60 and 61 atoms"),
            (set(84, 8), "do not unpack"),
            (set(84, 73), "do not unpack"),
            (set(84, -1), "do not unpack"),
            (set(60, i32::MAX), "do not unpack"),
            (set(88, -1), "byte 0 has -1 bytes of positions"),
            (set(88, i32::MAX), "cut short"),
            (set(56, 0), "there is no such place"),
            (plain(&[0.0, f32::NAN, 0.0]), "`y` of particle 0 (counted from 0) is NaN"),
        ] {
            let error = frame(Format::Xtc, bytes, 0).expect_err(words);
            assert!(error.message().contains(words), "{error}");
        }
        // Packed atoms take some bytes each: a number of them is not believed.
        let mut bytes = set(4, i32::MAX);
        bytes[52..56].copy_from_slice(&i32::MAX.to_be_bytes());
        let error = opened(Format::Xtc, bytes).unwrap().frames(&Control::new());
        assert!(error.expect_err("too many").message().contains("do not unpack"));
    }

    #[test]
    fn no_bytes_make_it_panic() {
        for whole in [bytes(GROUPS), large(&bytes(GROUPS)), bytes(FAR), plain(&[1.0; 6])] {
            for at in 0..whole.len() {
                for value in [0, 1, 0x7f, 0x80, 0xff] {
                    let mut bytes = whole.clone();
                    bytes[at] = value;
                    let file = opened(Format::Xtc, bytes).unwrap();
                    drop(file.read(0, &Control::new()));
                }
            }
        }
    }
}
