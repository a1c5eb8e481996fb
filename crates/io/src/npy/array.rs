//! What an array must be for the key that names it, and what to do about one that is not.
//!
//! Centres are rows of three numbers, radii one number each, colours rows of three bytes. What
//! holds just these numbers is read, whatever their type, byte order and order in the file: in
//! place where they lie as the engine reads them, else copied and said so. Everything else is
//! refused with the way from what the file holds to what is needed. A fix that is written in Python
//! loses, rounds and guesses nothing; where no expression can promise that, the fix says what is to
//! be decided.

use std::{ops::Range, path::PathBuf, sync::Arc};

use bytes::Bytes;
use rayon::prelude::*;

use crate::{
    input::{
        mapped::{Mapped, OpenError, ReadError, SMALL, open_regular, read_at, read_whole},
        refused::Refused,
    },
    npy::{
        number::{Kind, Number, are_extended},
        read::{self as npy, Descr, Field, Header, NotNpy},
    },
    zeros::zeros,
};
use planisphere_core::{
    drawing::Control,
    scene::{Column, Reals},
    text,
};
use planisphere_memory as memory;

/// Rows or numbers after which it is looked whether they are still wanted, at most.
const LOOK: usize = 1 << 12;

/// The same items, which end early once they are not wanted.
fn while_wanted<T>(items: impl Iterator<Item = T>, control: &Control) -> impl Iterator<Item = T> {
    let wanted = |&(number, _): &(usize, T)| number % LOOK > 0 || !control.is_cancelled();
    items.enumerate().take_while(wanted).map(|(_, item)| item)
}

/// Bytes from which [`npy::extent`] knows where a header ends.
const BEGINNING: usize = 12;

impl From<NotNpy> for Refused {
    fn from(error: NotNpy) -> Self {
        let fix = match error {
            NotNpy::Zip => {
                "name an .npy file: load the archive with numpy.load, and give the one array of it \
                 that is meant here to numpy.save"
            }
            NotNpy::Compressed => "unpack it with gunzip",
            NotNpy::Pickle => "load it with pickle.load, and give the array to numpy.save",
            NotNpy::Hdf5 => "load the data set that is meant with h5py, and give it to numpy.save",
            NotNpy::Bad(_) => "write the array with numpy.save(name, array)",
        };
        Self::new(error.to_string(), fix)
    }
}

/// What an array is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    Centers,
    Radii,
    Colors,
}

impl Key {
    /// Types that it may have.
    fn types(self) -> &'static str {
        match self {
            Self::Centers | Self::Radii => "float32, float64 or integers are needed",
            Self::Colors => "uint8, or other integers from 0 to 255, are needed",
        }
    }

    /// What to make of something that holds no numbers.
    fn example(self) -> &'static str {
        match self {
            Self::Centers => {
                "save an array of numbers, one row of x, y and z for each sphere, such as \
                 numpy.array(rows, 'f8')"
            }
            Self::Radii => {
                "save an array of numbers, one radius for each sphere, such as numpy.array(radii, \
                 'f8')"
            }
            Self::Colors => {
                "save an array of integers from 0 to 255, one row of red, green and blue for each \
                 sphere, such as numpy.array(rows, 'u1')"
            }
        }
    }
}

/// An array that was copied into memory, for `--stats`.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Copied {
    /// The file.
    pub array: PathBuf,
    /// Why it could not be used where it lies.
    pub why: String,
    /// Bytes that the copy takes.
    pub bytes: usize,
}

/// A file that holds an array, its numbers untouched.
pub(crate) struct Array {
    /// All of the file.
    bytes: Bytes,
    /// Where the numbers begin.
    offset: usize,
    header: Header,
    path: PathBuf,
    /// Ends all that looks at its numbers.
    control: Control,
    /// What is asked whether the file has changed, where it was not read at once.
    pub mapped: Option<Arc<Mapped>>,
}

/// Numbers as the scene takes them.
pub(crate) struct Taken<T> {
    pub numbers: T,
    /// Unless they lie in the file.
    pub copied: Option<Copied>,
}

/// A code that does what is needed to `array`, for the end of a fix.
fn save(code: &str) -> String {
    format!("numpy.save(name, {code})")
}

impl Array {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// When it is not an array, whole; when it is cancelled, here and in all that reads it.
    pub fn open(path: PathBuf, control: &Control) -> Result<Self, Refused> {
        Refused::if_cancelled(control)?;
        let (file, metadata) = open_regular(&path).map_err(|error| match error {
            OpenError::Missing => Refused::new(
                error.to_string(),
                "write the file or correct the name, which is relative to the scene file's folder \
                 (`planisphere make` writes the arrays of the example scenes)",
            ),
            OpenError::NotRegular(_) => Refused::new(error.to_string(), "name a regular .npy file"),
            OpenError::Io(ref source) => Refused::new(error.to_string(), OpenError::fix(source)),
        })?;
        let unread = |error: ReadError| match error {
            ReadError::Io(source) => {
                Refused::new(format!("cannot be read: {source}"), OpenError::fix(&source))
            }
            ReadError::Changed => {
                Refused::new("is being written", "draw again when it is finished")
            }
        };
        let (bytes, mapped, (header, offset)) = if metadata.len() <= SMALL {
            let whole = read_whole(&path, &file).map_err(unread)?;
            let header = npy::header(&whole)?;
            (Bytes::from(whole), None, header)
        } else {
            // Text is not read from a mapping, where it could change between two looks.
            let read = |length| read_at(&file, length, 0).map_err(|error| unread(error.into()));
            let (_, end) = npy::extent(&read(BEGINNING)?)?;
            let header = npy::header(&read(end)?)?;
            let mapped = Mapped::new(&path, file).map_err(|error| unread(error.into()))?;
            (mapped.bytes(), Some(mapped), header)
        };
        Self::of(bytes, header, offset, path, mapped, control.clone())
    }

    /// The array that bytes are, all of them.
    ///
    /// # Errors
    /// When they are none; when it is cancelled, here and in all that reads it.
    #[cfg(feature = "npz")]
    pub fn in_bytes(bytes: Bytes, control: &Control) -> Result<Self, Refused> {
        let (header, offset) = npy::header(&bytes)?;
        Self::of(bytes, header, offset, PathBuf::new(), None, control.clone())
    }

    /// What its header says.
    #[cfg(feature = "npz")]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The bytes that it is, and where its numbers begin in them.
    #[cfg(feature = "npz")]
    pub fn parts(&self) -> (&Bytes, usize) {
        (&self.bytes, self.offset)
    }

    fn of(
        bytes: Bytes,
        header: Header,
        offset: usize,
        path: PathBuf,
        mapped: Option<Arc<Mapped>>,
        control: Control,
    ) -> Result<Self, Refused> {
        if let Descr::One(code) = &header.descr
            && code.trim_start_matches(['|', '<', '>', '=']).starts_with('O')
        {
            // A pickle, of any length.
            return Err(no_numbers("Python objects", "save an array of numbers, of type 'f8'"));
        }
        let size = header
            .descr
            .size()
            .ok_or_else(|| no_numbers("elements of a type without a size", "other types"))?;
        let wanted = header.shape.iter().try_fold(size, |bytes, &n| bytes.checked_mul(n));
        // A file can have become shorter since its header was read.
        let found = bytes.len().saturating_sub(offset);
        if wanted != Some(found) {
            let wanted =
                wanted.map_or("more than there can be".into(), |wanted| wanted.to_string());
            let shape = shape_text(&header.shape);
            let words =
                format!("holds {found} bytes of numbers, but its shape {shape} needs {wanted}");
            let longer = header
                .shape
                .iter()
                .try_fold(size, |bytes, &n| bytes.checked_mul(n))
                .is_some_and(|n| n < found);
            return Err(Refused::new(
                words,
                if longer {
                    "write the file again: something follows the array; each array has a file of \
                     its own"
                } else {
                    "write the file again: it is cut short"
                },
            ));
        }
        Ok(Self { bytes, offset, header, path, control, mapped })
    }

    /// How many spheres the shape speaks of, where it leaves no doubt; for the centres, whose shape
    /// may be in doubt.
    pub fn count(&self, key: Key) -> Option<usize> {
        let long: Vec<usize> = self.header.shape.iter().copied().filter(|&n| n != 1).collect();
        match (key, long.as_slice()) {
            (Key::Radii, &[n]) => Some(n),
            (Key::Colors, &[n, 3 | 4]) => Some(n),
            _ => None,
        }
    }

    /// The numbers as centres, and how many; `count` where other arrays say how many there should
    /// be.
    ///
    /// # Errors
    /// When they are no centres.
    pub fn centers(&self, count: Option<usize>) -> Result<(Taken<Reals>, usize), Refused> {
        let cells = self.triples(&self.grid(Key::Centers)?, Key::Centers, count)?;
        Ok((self.reals(&cells, Key::Centers)?, cells.count()))
    }

    /// The numbers as radii of so many spheres.
    ///
    /// # Errors
    /// When they are not.
    pub fn radii(&self, count: usize) -> Result<Taken<Reals>, Refused> {
        self.reals(&self.singles(&self.grid(Key::Radii)?, count)?, Key::Radii)
    }

    /// The numbers as colours of so many spheres.
    ///
    /// # Errors
    /// When they are not.
    pub fn colors(&self, count: usize) -> Result<Taken<Column<u8>>, Refused> {
        let cells = self.triples(&self.grid(Key::Colors)?, Key::Colors, Some(count))?;
        self.channels(&cells)
    }

    /// The bytes of a number.
    fn cell(&self, at: usize, number: Number) -> &[u8] {
        &self.bytes[self.offset + at..self.offset + at + number.size]
    }

    /// Types that are numbers, and where they lie.
    fn grid(&self, key: Key) -> Result<Grid, Refused> {
        let size = self.header.descr.size().unwrap_or(0);
        let mut axes = vec![(0, size); self.header.shape.len()];
        let mut stride = size;
        let mut place = |axis: usize| {
            axes[axis] = (self.header.shape[axis], stride);
            // The whole fits, as was seen when the file was opened, unless it is empty.
            stride = stride.saturating_mul(self.header.shape[axis]);
        };
        let all = 0..self.header.shape.len();
        if self.header.fortran {
            all.for_each(&mut place)
        } else {
            all.rev().for_each(&mut place)
        }

        let grid = match &self.header.descr {
            Descr::One(code) => {
                let number = Number::of(code).map_err(|found| no_numbers(&found, key.example()))?;
                Grid {
                    code: "array".into(),
                    axes,
                    columns: Columns::Axis(number),
                    start: 0,
                    forced: false,
                }
            }
            Descr::Record(fields) => fields_for(key, fields, axes)?,
        };
        self.real_part(grid, key)
    }

    /// Complex numbers whose imaginary parts are all zero are their real parts.
    fn real_part(&self, mut grid: Grid, key: Key) -> Result<Grid, Refused> {
        let Columns::Axis(number) = &mut grid.columns else { return Ok(grid) };
        if number.kind != Kind::Complex {
            return Ok(grid);
        }
        let half = Number { kind: Kind::Float, size: number.size / 2, big: number.big };
        let found = format!("holds numbers of type {}, but {}", number.name(), key.types());
        *number = half;
        let imaginary = |at: usize| self.cell(at + half.size, half);
        let found_at = while_wanted(grid.places(), &self.control)
            .find(|&at| half.read(imaginary(at)).0 != 0.0);
        Refused::if_cancelled(&self.control)?;
        if let Some(at) = found_at {
            let value = half.read(imaginary(at)).0;
            return Err(Refused::new(
                format!("{found} (one has the imaginary part {value})"),
                key.example(),
            ));
        }
        grid.code += ".real";
        grid.forced = true;
        Ok(grid)
    }

    fn wrong_shape(&self, wanted: &str, fix: impl Into<String>) -> Refused {
        let found = shape_text(&self.header.shape);
        Refused::new(format!("has the shape {found}, but {wanted} is needed"), fix)
    }

    /// Rows of three.
    fn triples(&self, grid: &Grid, key: Key, count: Option<usize>) -> Result<Cells, Refused> {
        let rows = Triples { array: self, grid, key, count };
        let number = match &grid.columns {
            Columns::Axis(number) => *number,
            Columns::Fields(columns) => return rows.of_fields(columns),
        };
        // Where several forms could be meant, the first that fits.
        for form in [Triples::of_table, Triples::of_long_axes, Triples::of_line, Triples::of_tables]
        {
            if let Some(cells) = form(&rows, number)? {
                return Ok(cells);
            }
        }
        let wanted = rows.wanted();
        Err(rows.wrong(match key {
            Key::Colors => format!("write one {wanted} for each sphere, or use `color` for all"),
            _ => format!("write one {wanted} for each sphere"),
        }))
    }

    /// One number for each sphere.
    fn singles(&self, grid: &Grid, count: usize) -> Result<Cells, Refused> {
        let long: Vec<Axis> = grid.axes.iter().copied().filter(|axis| axis.0 != 1).collect();
        let product =
            grid.axes.iter().try_fold(1usize, |product, axis| product.checked_mul(axis.0));
        let column = match &grid.columns {
            Columns::Axis(number) => (0, *number),
            Columns::Fields(columns) => columns[0],
        };
        let fields = matches!(grid.columns, Columns::Fields(_));
        let cells = |code: String, as_is: bool| Cells {
            code,
            rows: grid.axes.clone(),
            columns: vec![column],
            start: grid.start,
            as_is: as_is && !grid.forced && !fields,
        };
        if product == Some(count) {
            return Ok(match grid.axes.len() {
                1 => cells(grid.code.clone(), true),
                // An axis of one number has no order to lose.
                _ => cells(format!("{}.reshape(-1)", grid.code), long.len() <= 1),
            });
        }
        let wanted = format!("({count},), one for each row of `centers`");
        let wrong = |fix: String| self.wrong_shape(&wanted, fix);
        if product == Some(1) {
            let value = column.1.read(self.cell(column.0, column.1)).0;
            return Err(wrong(format!(
                "write `radius = {value:?}` in place of `radii`, or one radius for each sphere"
            )));
        }
        Err(wrong("write one radius for each sphere, or use `radius`".into()))
    }

    /// Real numbers, none of them rounded.
    fn reals(&self, cells: &Cells, key: Key) -> Result<Taken<Reals>, Refused> {
        let numbers = || cells.columns.iter().map(|column| column.1);
        let names = || cells.type_names();
        if let Some(column) = cells.columns.iter().find(|column| column.1.kind == Kind::Complex) {
            let words = format!("holds numbers of type {}, but {}", column.1.name(), key.types());
            return Err(Refused::new(words, key.example()));
        }
        if numbers().any(|number| number.kind == Kind::LongDouble) {
            self.known_long_doubles(cells, key)?;
        }
        let f32s = numbers().all(Number::fits_f32);
        let (size, to) = if f32s { (4, "f4") } else { (8, "f8") };
        let in_place = (numbers()
            .all(|number| number.kind == Kind::Float && number.size >= 4 && !number.big))
        .then(|| cells.run())
        .flatten();
        if cells.as_is && in_place.is_none() {
            // Before anything looks at so many numbers.
            self.room(cells, size, &self.why(cells, false), to)?;
        }
        if !numbers().all(Number::fits_f64)
            && let Some(place) = self.first(cells, |(_, exact)| !exact)?
        {
            let Place { row, column, shown, .. } = place;
            let what = if key == Key::Radii { "radius" } else { "coordinate" };
            return Err(Refused::new(
                format!("{} is {shown}, which no 64-bit float equals", cells.name(row, column)),
                format!(
                    "decide which 64-bit float this {what} is to be, and save the array as float64"
                ),
            ));
        }
        if numbers().any(|number| number.kind == Kind::Bool) {
            let words = format!("holds numbers of type {}, but {}", names(), key.types());
            let code = format!("{}.astype('f8')", cells.code);
            return Err(Refused::new(words, format!("if true is 1 and false 0: {}", save(&code))));
        }
        if !cells.as_is {
            return Err(self.wrong_form(cells, key));
        }
        let number = cells.columns[0].1;
        let count = cells.count() * cells.columns.len();
        if let Some(run) = &in_place {
            let at = self.offset + run.start;
            let column = match number.size {
                4 => Column::in_bytes(&self.bytes, at, count).map(Reals::F32),
                8 => Column::in_bytes(&self.bytes, at, count).map(Reals::F64),
                _ => None,
            };
            if let Some(numbers) = column {
                return Ok(self.uncopied(numbers));
            }
            let bytes = &self.bytes[at..self.offset + run.end];
            let why = self.why(cells, true);
            return match number.size {
                4 => self.moved(cells, why, to, bytes, Reals::F32),
                _ => self.moved(cells, why, to, bytes, Reals::F64),
            };
        }
        let why = self.why(cells, false);
        if f32s {
            let copy = self.copy(cells, why, to, |bytes| number.read(bytes).0 as f32)?;
            return Ok(Taken { numbers: Reals::F32(copy.numbers), copied: copy.copied });
        }
        let copy = self.copy(cells, why, to, |bytes| number.read(bytes).0)?;
        Ok(Taken { numbers: Reals::F64(copy.numbers), copied: copy.copied })
    }

    /// Bytes of colours.
    fn channels(&self, cells: &Cells) -> Result<Taken<Column<u8>>, Refused> {
        self.channel_types(cells)?;
        // The alpha of four, which must say nothing.
        let (rgb, alpha) = cells.split_at(3);
        let brightest = self.brightest(cells, &rgb)?;
        if let Some(alpha) = alpha {
            self.opaque(cells, &alpha, brightest)?;
        }
        if brightest == Brightest::One {
            let words = format!(
                "holds numbers from 0 to 1 of type {}, but {}",
                cells.type_names(),
                Key::Colors.types()
            );
            let code = format!("(255 * {} + 0.5).astype('u1')", cells.code);
            return Err(Refused::new(words, format!("with 1 as the brightest: {}", save(&code))));
        }
        if !cells.as_is {
            return Err(self.wrong_form(cells, Key::Colors));
        }
        let in_place = cells.are_bytes().then(|| cells.run()).flatten();
        if let Some(run) = in_place
            && let Some(numbers) =
                Column::in_bytes(&self.bytes, self.offset + run.start, 3 * cells.count())
        {
            return Ok(self.uncopied(numbers));
        }
        let number = cells.columns[0].1;
        let why = self.why(cells, false);
        self.copy(cells, why, "u1", |bytes| number.read(bytes).0 as u8)
    }

    /// Refuses types that cannot be channels of colours, whatever their numbers.
    fn channel_types(&self, cells: &Cells) -> Result<(), Refused> {
        let wrong_type = |fix: &str| {
            let words = format!(
                "holds numbers of type {}, but {}",
                cells.type_names(),
                Key::Colors.types()
            );
            Refused::new(words, fix)
        };
        let kinds = || cells.columns.iter().map(|column| column.1.kind);
        if kinds().any(|kind| kind == Kind::Bool) {
            return Err(wrong_type(
                "write integers from 0 to 255: 255 * array where true is the brightest",
            ));
        }
        if kinds().any(|kind| kind == Kind::Complex) {
            return Err(wrong_type(Key::Colors.example()));
        }
        if kinds().any(|kind| kind == Kind::LongDouble) {
            self.known_long_doubles(cells, Key::Colors)?;
        }
        Ok(())
    }

    /// Which number is the brightest, by the numbers of red, green and blue; refuses those that are
    /// no channels.
    fn brightest(&self, cells: &Cells, rgb: &Cells) -> Result<Brightest, Refused> {
        let integers =
            cells.columns.iter().all(|column| matches!(column.1.kind, Kind::Int | Kind::Uint));
        let refused = |place: &Place, why: &str, fix: &str| {
            Refused::new(
                format!("{} is {}, {why}", cells.name(place.row, place.column), place.shown),
                fix,
            )
        };
        if !cells.are_bytes()
            && let Some(place) = self.first(rgb, |(value, _)| !(0.0..=255.0).contains(&value))?
        {
            let fix = match integers {
                true => "write integers from 0 to 255",
                false => {
                    "write integers from 0 to 255, or numbers from 0 to 1 and obey the fix that \
                     is printed then"
                }
            };
            return Err(refused(&place, "not a channel of a colour", fix));
        }
        if integers {
            return Ok(Brightest::Full);
        }
        // Between 0 and 1, 1 is the brightest.
        if self.first(rgb, |(value, _)| value > 1.0)?.is_none() {
            return Ok(Brightest::One);
        }
        if let Some(place) = self.first(rgb, |(value, exact)| value.fract() != 0.0 || !exact)? {
            let fix = "write integers from 0 to 255: how numbers between two of them are to be \
                       rounded is not decided here";
            return Err(refused(
                &place,
                "not an integer from 0 to 255 (and others are not from 0 to 1)",
                fix,
            ));
        }
        Ok(Brightest::Full)
    }

    /// Refuses an alpha that is not opaque everywhere.
    fn opaque(&self, cells: &Cells, alpha: &Cells, brightest: Brightest) -> Result<(), Refused> {
        let opaque = match brightest {
            Brightest::One => 1.0,
            Brightest::Full => 255.0,
        };
        let Some(place) = self.first(alpha, |(value, _)| value != opaque)? else { return Ok(()) };
        Err(self.wrong_shape(
            &format!("({}, 3), one row for each row of `centers`", cells.count()),
            format!(
                "write red, green and blue alone; there is no transparency to draw (alpha of \
                 sphere {} is {}, and {opaque} would be opaque): `{}` is the colours without it",
                place.row, place.shown, cells.code
            ),
        ))
    }

    /// The numbers are right, and lie otherwise.
    fn wrong_form(&self, cells: &Cells, key: Key) -> Refused {
        let shape = match (key, cells.count()) {
            (Key::Radii, count) => format!("({count},)"),
            (_, count) => format!("({count}, 3)"),
        };
        let found = match &self.header.descr {
            Descr::Record(_) => {
                Refused::new(format!("holds records, but an array of shape {shape} is needed"), "")
            }
            Descr::One(code)
                if Number::of(code).is_ok_and(|number| number.kind == Kind::Complex) =>
            {
                Refused::new(format!("holds complex numbers, but {}", key.types()), "")
            }
            Descr::One(_) => self.wrong_shape(&shape, ""),
        };
        Refused::new(found.words, save(&cells.code))
    }

    /// Refuses long doubles that are not, or not for sure, those of this kind of machine.
    fn known_long_doubles(&self, cells: &Cells, key: Key) -> Result<(), Refused> {
        let long = || {
            while_wanted(cells.places(), &self.control)
                .filter(|(_, _, _, number)| number.kind == Kind::LongDouble)
        };
        let known = long().all(|(_, _, _, number)| !number.big)
            && are_extended(long().map(|(_, _, at, number)| self.cell(at, number)));
        Refused::if_cancelled(&self.control)?;
        if known {
            return Ok(());
        }
        Err(Refused::new(
            format!(
                "holds long doubles, which differ between machines and do not say whose they are, \
                 but {}",
                key.types()
            ),
            match key {
                Key::Colors => "save integers from 0 to 255",
                _ => {
                    "save float64 numbers; array.astype('f8') has them, and rounds none where it \
                     equals array everywhere, by numpy.array_equal"
                }
            },
        ))
    }

    /// The first number, row by row, of which a test holds.
    fn first(
        &self,
        cells: &Cells,
        test: impl Fn((f64, bool)) -> bool + Sync,
    ) -> Result<Option<Place>, Refused> {
        let found = |row: usize| {
            let at = cells.row(row);
            cells
                .columns
                .iter()
                .position(|&(column, number)| test(number.read(self.cell(at + column, number))))
        };
        let row = (0..cells.count()).into_par_iter().with_min_len(LOOK).position_first(|row| {
            row % LOOK == 0 && self.control.is_cancelled() || found(row).is_some()
        });
        Refused::if_cancelled(&self.control)?;
        let Some(row) = row else { return Ok(None) };
        // The file can be changing.
        let column = found(row).unwrap_or(0);
        let (at, number) = cells.columns[column];
        let bytes = self.cell(cells.row(row) + at, number);
        Ok(Some(Place { row, column, shown: shown(number, bytes) }))
    }

    /// Why the numbers are copied.
    fn why(&self, cells: &Cells, unaligned: bool) -> String {
        let mut why = cells.type_names();
        if cells.run().is_none() {
            why += " in column order";
        }
        if unaligned {
            why += " at a place that is not aligned";
        }
        why
    }

    fn uncopied<T>(&self, numbers: T) -> Taken<T> {
        let copied = self.mapped.is_none().then(|| Copied {
            array: self.path.clone(),
            why: "a small file".into(),
            bytes: self.bytes.len(),
        });
        Taken { numbers, copied }
    }

    /// Copies the numbers, row by row.
    fn copy<T: bytemuck::Pod + Send + Sync>(
        &self,
        cells: &Cells,
        why: String,
        to: &str,
        read: impl Fn(&[u8]) -> T + Sync,
    ) -> Result<Taken<Column<T>>, Refused> {
        let bytes = self.room(cells, size_of::<T>(), &why, to)?;
        let numbers = match cells.columns.len() {
            1 => self.rows::<T, 1>(cells, &read),
            _ => self.rows::<T, 3>(cells, &read),
        };
        Refused::if_cancelled(&self.control)?;
        let numbers = numbers.ok_or_else(|| no_room(&why, bytes, None, to))?;
        Ok(Taken { numbers, copied: Some(Copied { array: self.path.clone(), why, bytes }) })
    }

    /// Numbers that lie one after the other as they are needed, but not at their places in memory.
    fn moved<T: bytemuck::Pod + Send + Sync>(
        &self,
        cells: &Cells,
        why: String,
        to: &str,
        from: &[u8],
        reals: impl Fn(Column<T>) -> Reals,
    ) -> Result<Taken<Reals>, Refused> {
        const PIECE: usize = 1 << 20;
        let bytes = self.room(cells, size_of::<T>(), &why, to)?;
        let numbers = zeros::<T>(from.len() / size_of::<T>());
        let mut numbers = numbers.ok_or_else(|| no_room(&why, bytes, None, to))?;
        let places = bytemuck::cast_slice_mut::<T, u8>(&mut numbers).par_chunks_mut(PIECE);
        places.zip(from.par_chunks(PIECE)).for_each(|(to, from)| {
            if !self.control.is_cancelled() {
                to.copy_from_slice(from);
            }
        });
        Refused::if_cancelled(&self.control)?;
        let copied = Copied { array: self.path.clone(), why, bytes };
        Ok(Taken { numbers: reals(numbers.into()), copied: Some(copied) })
    }

    /// Bytes of a copy of numbers of some size, which can be had.
    fn room(&self, cells: &Cells, size: usize, why: &str, to: &str) -> Result<usize, Refused> {
        let bytes = (cells.count() * cells.columns.len()).saturating_mul(size);
        memory::room(bytes as u64).map_err(|available| no_room(why, bytes, Some(available), to))?;
        Ok(bytes)
    }

    /// Rows of so many numbers; nothing where there is no memory for them, or once it is cancelled.
    fn rows<T: bytemuck::Pod + Send + Sync, const N: usize>(
        &self,
        cells: &Cells,
        read: &(impl Fn(&[u8]) -> T + Sync),
    ) -> Option<Column<T>> {
        let columns: [(usize, Number); N] = cells.columns.as_slice().try_into().ok()?;
        // Of this size, zeros are what the system gives: nothing is written twice.
        let mut rows: Vec<[T; N]> = zeros(cells.count())?;
        let row = |row: usize| {
            let at = cells.row(row);
            columns.map(|(column, number)| read(self.cell(at + column, number)))
        };
        rows.par_chunks_mut(LOOK).enumerate().try_for_each(|(part, rows)| {
            for (k, to) in rows.iter_mut().enumerate() {
                *to = row(LOOK * part + k);
            }
            (!self.control.is_cancelled()).then_some(())
        })?;
        Some(Column::of_rows(rows))
    }
}

/// An axis: how many numbers, and how many bytes lie from one to the next.
type Axis = (usize, usize);

/// An array as its type and shape say it lies.
struct Grid {
    /// How Python calls it.
    code: String,
    axes: Vec<Axis>,
    columns: Columns,
    start: usize,
    /// Whether it is not the array itself.
    forced: bool,
}

enum Columns {
    /// The last axis has them.
    Axis(Number),
    /// Fields of records, put side by side: where each lies in its record.
    Fields(Vec<(usize, Number)>),
}

impl Grid {
    /// Where its numbers lie.
    fn places(&self) -> impl Iterator<Item = usize> + '_ {
        let count = self.axes.iter().map(|axis| axis.0).product();
        (0..count).map(|index| self.start + place(&self.axes, index))
    }
}

/// Where an element lies, by its number in row order.
#[inline]
fn place(axes: &[Axis], mut index: usize) -> usize {
    if let &[axis] = axes {
        return index * axis.1;
    }
    let mut at = 0;
    for &(length, stride) in axes.iter().rev() {
        at += index % length * stride;
        index /= length;
    }
    at
}

/// The numbers of an array that are meant, as rows.
struct Cells {
    /// How Python calls them.
    code: String,
    rows: Vec<Axis>,
    /// Where each number of a row lies in it.
    columns: Vec<(usize, Number)>,
    start: usize,
    /// Whether the array can be taken as it is.
    as_is: bool,
}

/// Which number stands for the brightest of a channel.
#[derive(Clone, Copy, PartialEq)]
enum Brightest {
    /// 1
    One,
    /// 255
    Full,
}

/// An array in which rows of three are looked for.
struct Triples<'a> {
    array: &'a Array,
    grid: &'a Grid,
    key: Key,
    /// How many there should be, where that is known.
    count: Option<usize>,
}

impl Triples<'_> {
    /// A row in words.
    fn wanted(&self) -> &'static str {
        match self.key {
            Key::Colors => "row of red, green and blue",
            _ => "row of three coordinates",
        }
    }

    /// Whether there may be so many rows.
    fn fits(&self, n: usize) -> bool {
        self.count.is_none_or(|count| count == n)
    }

    /// Refuses the shape.
    fn wrong(&self, fix: String) -> Refused {
        let needed = match (self.key, self.count) {
            (Key::Colors, Some(count)) => {
                format!("({count}, 3), one row for each row of `centers`")
            }
            _ => "(N, 3)".into(),
        };
        self.array.wrong_shape(&needed, fix)
    }

    /// The axes of more than one number: one of one number has no order to lose.
    fn long(&self) -> Vec<Axis> {
        self.grid.axes.iter().copied().filter(|axis| axis.0 != 1).collect()
    }

    /// Rows along some axes, the numbers of each along another; not the array as it is.
    fn cells(&self, code: String, rows: &[Axis], across: Axis, number: Number) -> Cells {
        Cells {
            code,
            rows: rows.to_vec(),
            columns: (0..across.0).map(|k| (k * across.1, number)).collect(),
            start: self.grid.start,
            as_is: false,
        }
    }

    /// The array as it is, unless that is not the array itself.
    fn as_is(&self, code: String, rows: &[Axis], across: Axis, number: Number) -> Cells {
        Cells { as_is: !self.grid.forced, ..self.cells(code, rows, across, number) }
    }

    /// Rows whose numbers are fields of a record.
    fn of_fields(&self, columns: &[(usize, Number)]) -> Result<Cells, Refused> {
        let Grid { code, axes, .. } = self.grid;
        let spheres = axes.iter().map(|axis| axis.0).product();
        if !self.fits(spheres) {
            return Err(self.wrong(format!("write one {} for each sphere", self.wanted())));
        }
        let code = if axes.len() == 1 {
            code.clone()
        } else {
            format!("{code}.reshape(-1, {})", columns.len())
        };
        Ok(Cells { code, rows: axes.clone(), columns: columns.to_vec(), start: 0, as_is: false })
    }

    /// Rows or columns of a table.
    fn of_table(&self, number: Number) -> Result<Option<Cells>, Refused> {
        let &[down, across] = self.grid.axes.as_slice() else { return Ok(None) };
        let (code, key, wanted) = (&self.grid.code, self.key, self.wanted());
        let by_rows = across.0 == 3;
        // Centres that are right say themselves how many there are.
        if by_rows && (key == Key::Centers || self.fits(down.0)) {
            return Ok(Some(self.as_is(code.clone(), &[down], across, number)));
        }
        let four = across.0 == 4 && self.fits(down.0);
        let turned = down.0 == 3 && !by_rows && self.fits(across.0);
        let turned_four =
            down.0 == 4 && key == Key::Colors && !by_rows && !four && self.fits(across.0);
        if turned && self.count.is_none() && across.0 <= 8 {
            return Err(self.wrong(format!(
                "write one {wanted} for each sphere: of this array, array.T where every column is \
                 a sphere, or some of its columns where every row is one"
            )));
        }
        if turned {
            return Ok(Some(self.cells(format!("{code}.T"), &[across], down, number)));
        }
        if four && key == Key::Centers {
            return Err(self.wrong(
                "write x, y and z alone: of this array, `array[:, :3]` where the last column is \
                 something else, which goes into an array of its own (radii: `array[:, 3]`)"
                    .into(),
            ));
        }
        if four {
            let code = format!("{code}[:, :3]");
            return Ok(Some(self.cells(code, &[down], across, number)));
        }
        if turned_four {
            let code = format!("{code}.T[:, :3]");
            return Ok(Some(self.cells(code, &[across], down, number)));
        }
        if by_rows {
            return Err(
                self.wrong(format!("write one {wanted} for each sphere, no more and no fewer"))
            );
        }
        Ok(None)
    }

    /// Rows of what is a table, or one row, but for axes of one number.
    fn of_long_axes(&self, number: Number) -> Result<Option<Cells>, Refused> {
        let (code, long) = (&self.grid.code, self.long());
        if let &[down, across] = long.as_slice()
            && across.0 == 3
            && self.fits(down.0)
        {
            let code = format!("{code}.reshape(-1, 3)");
            return Ok(Some(self.as_is(code, &[down], across, number)));
        }
        if let (&[across], Some(last)) = (long.as_slice(), self.grid.axes.last())
            && last.0 == 3
            && self.fits(1)
        {
            let code = format!("{code}.reshape(1, 3)");
            return Ok(Some(self.cells(code, &[], across, number)));
        }
        Ok(None)
    }

    /// A line without numbers, which is no rows; refuses one that would have to be cut into rows.
    fn of_line(&self, number: Number) -> Result<Option<Cells>, Refused> {
        let &[n] = self.grid.axes.as_slice() else { return Ok(None) };
        let wanted = self.wanted();
        if n.0 == 0 && self.fits(0) {
            let code = format!("{}.reshape(0, 3)", self.grid.code);
            return Ok(Some(self.cells(code, &[n], (3, 0), number)));
        }
        if n.0 == 3 && self.key == Key::Colors {
            return Err(self.wrong(format!(
                "write one {wanted} for each sphere, or `color = [217, 79, 61]` in place of \
                 `colors`"
            )));
        }
        if n.0.is_multiple_of(3) && self.fits(n.0 / 3) {
            let row = if self.key == Key::Colors { "colour" } else { "centre" };
            return Err(self.wrong(format!(
                "write one {wanted} for each sphere: of this array, `array.reshape(-1, 3)` where \
                 the numbers of a {row} lie together, or `array.reshape(3, -1).T` where they do \
                 not"
            )));
        }
        Ok(None)
    }

    /// Rows of several tables.
    fn of_tables(&self, number: Number) -> Result<Option<Cells>, Refused> {
        let &[planes, down, across] = self.grid.axes.as_slice() else { return Ok(None) };
        let colors = self.key == Key::Colors;
        if across.0 != 3 && !(across.0 == 4 && colors) {
            return Ok(None);
        }
        let rows = planes.0.checked_mul(down.0);
        if rows.is_some() && rows == self.count {
            let alpha = if across.0 == 4 { "[:, :3]" } else { "" };
            let code = format!("{}.reshape(-1, {}){alpha}", self.grid.code, across.0);
            return Ok(Some(self.cells(code, &[planes, down], across, number)));
        }
        if across.0 == 3 && self.count.is_none() {
            return Err(self.wrong(format!(
                "write one {} for each sphere: of this array, one of its {} tables (`array[0]` is \
                 the first), or all of them, `array.reshape(-1, 3)`",
                self.wanted(),
                planes.0
            )));
        }
        Ok(None)
    }
}

/// A number that is spoken of.
struct Place {
    row: usize,
    column: usize,
    shown: String,
}

impl Cells {
    fn count(&self) -> usize {
        self.rows.iter().map(|axis| axis.0).product()
    }

    #[inline]
    fn row(&self, row: usize) -> usize {
        self.start + place(&self.rows, row)
    }

    /// Every number: row, column, place, type.
    fn places(&self) -> impl Iterator<Item = (usize, usize, usize, Number)> + '_ {
        (0..self.count()).flat_map(move |row| {
            let columns = self.columns.iter().enumerate();
            columns.map(move |(column, &(at, number))| (row, column, self.row(row) + at, number))
        })
    }

    /// The bytes of the numbers where they lie one after the other.
    fn run(&self) -> Option<Range<usize>> {
        let size = self.columns[0].1.size;
        let across = self.columns.len();
        let side_by_side = self.columns.iter().enumerate().all(|(k, column)| column.0 == k * size);
        let mut stride = across * size;
        for &(length, step) in self.rows.iter().rev() {
            if length > 1 && step != stride {
                return None;
            }
            stride *= length;
        }
        side_by_side.then(|| self.start..self.start + stride)
    }

    /// The first columns, and the one that may follow.
    fn split_at(&self, columns: usize) -> (Self, Option<Self>) {
        let some = |columns: &[(usize, Number)]| Self {
            code: self.code.clone(),
            rows: self.rows.clone(),
            columns: columns.to_vec(),
            start: self.start,
            as_is: self.as_is,
        };
        let rest = &self.columns[columns..];
        (some(&self.columns[..columns]), (!rest.is_empty()).then(|| some(rest)))
    }

    /// Whether each number is a byte, from 0 to 255.
    fn are_bytes(&self) -> bool {
        self.columns.iter().all(|column| column.1.kind == Kind::Uint && column.1.size == 1)
    }

    /// The types of the columns.
    fn type_names(&self) -> String {
        let mut names: Vec<String> = self.columns.iter().map(|column| column.1.name()).collect();
        names.dedup();
        names.join(", ")
    }

    /// What an element is called.
    fn name(&self, row: usize, column: usize) -> String {
        let index =
            if self.columns.len() == 1 { format!("[{row}]") } else { format!("[{row}, {column}]") };
        if self.code == "array" {
            format!("element {index}")
        } else {
            format!("element {index} of {}", self.code)
        }
    }
}

/// A number in full.
fn shown(number: Number, bytes: &[u8]) -> String {
    let mut little = bytes.to_vec();
    if number.big {
        little.reverse();
    }
    match (number.kind, <[u8; 8]>::try_from(little.as_slice())) {
        (Kind::Int, Ok(eight)) => i64::from_le_bytes(eight).to_string(),
        (Kind::Uint, Ok(eight)) => u64::from_le_bytes(eight).to_string(),
        (Kind::LongDouble, _) => match number.read(bytes) {
            (value, true) => format!("{value:?}"),
            (value, false) => format!("a long double next to {value:?}"),
        },
        _ => {
            let value = number.read(bytes).0;
            if value.fract() == 0.0 && value.abs() < 1e15 {
                format!("{value}")
            } else {
                format!("{value:?}")
            }
        }
    }
}

/// A copy would need more memory than there is.
fn no_room(why: &str, bytes: usize, available: Option<u64>, to: &str) -> Refused {
    let needed = text::bytes(bytes as u64);
    let there = available
        .map_or("it cannot be had".into(), |bytes| format!("{} is available", text::bytes(bytes)));
    Refused::new(
        format!("is copied to be read ({why}), which takes {needed} of memory, and {there}"),
        format!(
            "save it as it is read in place: {}",
            save(&format!("numpy.ascontiguousarray(array, '{to}')"))
        ),
    )
}

fn no_numbers(found: &str, fix: &str) -> Refused {
    Refused::new(format!("holds {found}, not numbers"), fix)
}

/// A shape in NumPy's notation, such as `(100, 3)`.
pub(super) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        axes => format!("({})", axes.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// A field's name as Python writes it.
fn quoted(name: &str) -> String {
    let mut text = String::from("array['");
    for c in name.chars() {
        match c {
            '\\' | '\'' => text.extend(['\\', c]),
            c if c.is_control() => text += &format!("\\u{:04x}", c as u32),
            c => text.push(c),
        }
    }
    text + "']"
}

/// The fields of records that a key can mean, by their names.
fn fields_for(key: Key, fields: &[Field], axes: Vec<Axis>) -> Result<Grid, Refused> {
    let numbers = NumberFields::of(fields);
    let Names { triples, wholes } = key.names();
    if let Some(grid) = triples.iter().find_map(|names| numbers.side_by_side(names, &axes)) {
        return Ok(grid);
    }
    let red = key == Key::Radii && numbers.named("g").is_some() && numbers.named("b").is_some();
    let field =
        wholes.iter().filter(|name| !(red && **name == "r")).find_map(|name| numbers.named(name));
    field.map(|field| field.grid(axes)).ok_or_else(|| no_field(key, fields))
}

/// Names of fields that hold what is meant by a key.
struct Names {
    /// Of three fields that are one number each.
    triples: &'static [[&'static str; 3]],
    /// Of one field that holds all.
    wholes: &'static [&'static str],
}

impl Key {
    /// Whether an array of this name is meant by it.
    #[cfg(feature = "npz")]
    pub fn is_called(self, name: &str) -> bool {
        self.names().wholes.iter().any(|whole| whole.eq_ignore_ascii_case(name))
    }

    /// Names that a field may have.
    fn names(self) -> Names {
        match self {
            Self::Centers => Names {
                triples: &[["x", "y", "z"]],
                wholes: &[
                    "center",
                    "centre",
                    "centers",
                    "centres",
                    "position",
                    "positions",
                    "pos",
                    "xyz",
                    "coordinates",
                ],
            },
            Self::Radii => Names { triples: &[], wholes: &["radius", "radii", "r"] },
            Self::Colors => Names {
                triples: &[["r", "g", "b"], ["red", "green", "blue"]],
                wholes: &["color", "colour", "colors", "colours", "rgb", "rgba"],
            },
        }
    }
}

/// A field of numbers: where it lies in its record, and their type.
#[derive(Clone, Copy)]
struct NumberField<'a> {
    field: &'a Field,
    at: usize,
    number: Number,
}

impl NumberField<'_> {
    /// The field of all records, with the axes that it has itself behind theirs.
    fn grid(self, mut axes: Vec<Axis>) -> Grid {
        let mut stride = self.number.size;
        let inner: Vec<Axis> = self
            .field
            .shape
            .iter()
            .rev()
            .map(|&n| {
                let axis = (n, stride);
                stride = stride.saturating_mul(n);
                axis
            })
            .collect();
        axes.extend(inner.into_iter().rev());
        Grid {
            code: quoted(&self.field.name),
            axes,
            columns: Columns::Axis(self.number),
            start: self.at,
            forced: true,
        }
    }
}

/// The fields of a record that hold numbers.
struct NumberFields<'a>(Vec<NumberField<'a>>);

impl<'a> NumberFields<'a> {
    /// Those of all the fields.
    fn of(fields: &'a [Field]) -> Self {
        let mut at = 0usize;
        let mut numbers = Vec::new();
        for field in fields {
            if let Descr::One(code) = &field.descr
                && let Ok(number) = Number::of(code)
            {
                numbers.push(NumberField { field, at, number });
            }
            at += field.size().unwrap_or(0);
        }
        Self(numbers)
    }

    /// The field of a name, which must be there once, in one way of writing it.
    fn named(&self, name: &str) -> Option<NumberField<'a>> {
        let mut found = self.0.iter().filter(|number| number.field.name.eq_ignore_ascii_case(name));
        found.next().filter(|_| found.next().is_none()).copied()
    }

    /// Three fields of one number each, put side by side.
    fn side_by_side(&self, names: &[&str; 3], axes: &[Axis]) -> Option<Grid> {
        let found: Vec<_> = names.iter().filter_map(|name| self.named(name)).collect();
        let &[a, b, c] = found.as_slice() else { return None };
        if !found.iter().all(|number| number.field.shape.is_empty()) {
            return None;
        }
        let codes = [a, b, c].map(|number| quoted(&number.field.name)).join(", ");
        Some(Grid {
            code: format!("numpy.stack([{codes}], axis=-1)"),
            axes: axes.to_vec(),
            columns: Columns::Fields([a, b, c].map(|n| (n.at, n.number)).to_vec()),
            start: 0,
            forced: true,
        })
    }
}

/// Refuses records of whose fields none has a name that is known.
fn no_field(key: Key, fields: &[Field]) -> Refused {
    let names = fields
        .iter()
        .map(|field| field.name.escape_debug().to_string())
        .collect::<Vec<_>>()
        .join(", ");
    let (what, array) = match key {
        Key::Centers => ("x, y and z", "centers"),
        Key::Radii => ("the radius", "radii"),
        Key::Colors => ("red, green and blue", "colors"),
    };
    Refused::new(
        format!("holds records, and none of their fields is named for `{array}`: {names}"),
        format!(
            "save the fields that are {what} as an array of their own; `array['{}']` is one field",
            fields.first().map_or(String::new(), |f| f.name.escape_debug().to_string())
        ),
    )
}
