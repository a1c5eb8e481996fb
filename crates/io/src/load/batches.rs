//! Large scene files in pieces: a parser of whole files keeps every token of a file in memory,
//! forty times the file.
//!
//! [`quick`] cuts out `[[sphere]]` tables by lines. It can be wrong inside a string or a list of
//! several lines; then the piece that has its beginning does not parse, and nothing of what it gave
//! may be used. [`exact`] goes by the tokens of TOML, for files of every other shape and for files
//! with a fault. It holds limits that no scene needs to exceed, so that a file of any size and
//! shape takes about as much memory as its text and its spheres.

use std::{borrow::Cow, ops::Range};

use toml_parser::{
    Source,
    lexer::{Token, TokenKind},
};

use crate::input::report::Fault;
use planisphere_core::drawing::Control;

/// Bytes of a piece, about.
const PIECE: usize = 1 << 15;

/// A file of fewer bytes is parsed whole.
const WORTH: usize = 1 << 16;

/// [`quick`] is used only if the text outside of `[[sphere]]` tables has fewer bytes than this.
const REST: usize = 1 << 20;

/// Bytes from the beginning of a value to its end, in a file that is read in pieces: a name of a
/// file has 4,096 at most.
const VALUE: usize = 1 << 16;

/// How deep lists and tables may be nested, and of how many parts a key may be. A scene needs
/// three.
const DEPTH: usize = 16;

/// Keys and headers outside of `[[sphere]]` and `[[spheres]]`: more than [camera] and [image] have,
/// so that one must be wrong.
const KEYS: usize = 64;

/// Tables of `[[spheres]]`: each maps up to three files, and systems map about as many as this.
const BLOCKS: usize = 1 << 16;

/// Two parts are joined if at most this many bytes, of space and comments, lie between them.
const GAP: usize = 64;

/// Parts of a text, joined, which know where each stands in the text.
#[derive(Default)]
pub(super) struct Parts(Vec<Range<usize>>);

impl Parts {
    /// Bytes of the parts.
    fn len(&self) -> usize {
        self.0.iter().map(Range::len).sum()
    }

    /// Adds a part; when nothing but space and comments is between it and the last, and few of
    /// these, they come along.
    fn push(&mut self, part: Range<usize>, follows: bool) {
        match self.0.last_mut() {
            Some(last) if follows && part.start <= last.end + GAP => last.end = part.end,
            _ => self.0.push(part),
        }
    }

    /// The parts, each with a line end behind it.
    pub fn text(&self, whole: &str) -> String {
        let mut text = String::with_capacity(self.len() + self.0.len());
        for part in &self.0 {
            text.push_str(&whole[part.clone()]);
            text.push('\n');
        }
        text
    }

    /// Where a place of the joined text stands in the whole.
    pub fn place(&self, span: Range<usize>) -> Range<usize> {
        let find = |at: usize, end: bool| {
            let mut before = 0;
            for part in &self.0 {
                let inside = at - before;
                if inside < part.len() || (end && inside == part.len()) {
                    return part.start + inside;
                }
                // The line end behind it.
                if inside == part.len() {
                    return part.end;
                }
                before += part.len() + 1;
            }
            self.0.last().map_or(0, |part| part.end)
        };
        let start = find(span.start, false);
        start..find(span.end, true).max(start)
    }
}

/// Spheres of a scene file that are parsed together.
pub(super) struct Piece {
    /// Where they stand.
    parts: Parts,
    /// What must stand around them, when they are items of one list.
    around: [&'static str; 2],
}

impl Piece {
    /// The piece as a document of its own, with all its spheres under `sphere`.
    pub fn text<'t>(&self, whole: &'t str) -> Cow<'t, str> {
        match (&*self.parts.0, self.around) {
            ([only], ["", ""]) => whole[only.clone()].into(),
            (_, [before, behind]) => [before, &self.parts.text(whole), behind].concat().into(),
        }
    }

    /// Where a place of the document stands in the file.
    pub fn place(&self, span: Range<usize>) -> Range<usize> {
        let before = self.around[0].len();
        self.parts.place(span.start.saturating_sub(before)..span.end.saturating_sub(before))
    }
}

/// A scene file in pieces.
#[derive(Default)]
pub(super) struct Batches {
    /// Everything but spheres that are written one by one.
    pub rest: Parts,
    /// These, in order, some hundred in each piece.
    pub pieces: Vec<Piece>,
}

/// Bytes of a file, and tokens, after which it is looked whether it is still wanted.
const LOOK: [usize; 2] = [1 << 18, 1 << 12];

/// Whether a file is so large that it is read in pieces.
pub(super) fn large(text: &str) -> bool {
    text.len() >= WORTH
}

/// Cuts a scene file by its lines, if that is worth while. When any piece, or the rest, does not
/// parse, or the rest has `sphere` too, then the cut may be wrong. Nothing, too, once it is
/// cancelled.
pub(super) fn quick(text: &str, control: &Control) -> Option<Batches> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    let (mut at, mut inside, mut looked) = (0, false, 0);
    for line in text.split_inclusive('\n') {
        if at - looked >= LOOK[0] {
            looked = at;
            Fault::if_cancelled(control).ok()?;
        }
        let start = line.trim_start_matches([' ', '\t']);
        if start.starts_with('[') {
            let header = start.trim_end().strip_prefix("[[sphere]]");
            inside =
                header.is_some_and(|rest| rest.is_empty() || rest.trim_start().starts_with('#'));
            // A piece ends at a header, when it is long enough or the table is of another kind.
            if inside && runs.last().is_none_or(|run| run.end != at || run.len() > PIECE) {
                runs.push(at..at);
            }
        }
        at += line.len();
        if let (true, Some(run)) = (inside, runs.last_mut()) {
            run.end = at;
        }
    }
    let mut rest = Parts::default();
    let mut from = 0;
    for run in &runs {
        if from < run.start {
            rest.0.push(from..run.start);
        }
        from = run.end;
    }
    if from < text.len() {
        rest.0.push(from..text.len());
    }
    let pieces = runs
        .into_iter()
        .map(|run| Piece { parts: Parts(vec![run]), around: [""; 2] })
        .collect::<Vec<_>>();
    (!pieces.is_empty() && rest.len() < REST).then_some(Batches { rest, pieces })
}

/// Refuses keys of more parts than any scene has, before a parser makes a table of each.
///
/// # Errors
/// At the first part that is too deep.
pub(super) fn check_keys(text: &str) -> Result<(), Fault> {
    let mut depth = Depth::default();
    Source::new(text).lex().try_for_each(|token| {
        depth.brackets = 0;
        depth.follow(token)
    })
}

/// The words for brackets in brackets in brackets.
pub(super) fn too_deep(span: Range<usize>) -> Fault {
    Fault::new(
        format!(
            "lists or tables are nested more than {DEPTH} deep, and a scene needs three levels"
        ),
        span,
        "too deep",
        "close each bracket that is opened; a list here holds three numbers",
    )
}

/// How deep a token stands.
#[derive(Default)]
struct Depth {
    brackets: usize,
    dots: usize,
}

impl Depth {
    fn follow(&mut self, token: Token) -> Result<(), Fault> {
        match token.kind() {
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => self.brackets += 1,
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                self.brackets = self.brackets.saturating_sub(1);
            }
            TokenKind::Dot => self.dots += 1,
            _ => {}
        }
        match token.kind() {
            TokenKind::Dot | TokenKind::Atom | TokenKind::Whitespace => {}
            TokenKind::BasicString | TokenKind::LiteralString => {}
            _ => self.dots = 0,
        }
        if self.brackets.max(self.dots) <= DEPTH {
            return Ok(());
        }
        let span = token.span().start()..token.span().end();
        if self.brackets > DEPTH {
            return Err(too_deep(span));
        }
        Err(Fault::new(
            format!("a key has more than {DEPTH} parts, and a scene needs one or two"),
            span,
            "too deep",
            "write `key = value`, with one of the keys of the section",
        ))
    }
}

/// What a statement belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Within {
    /// Nothing yet, or [camera], [image], or what is unknown.
    Other,
    /// `[[sphere]]`
    Sphere,
    /// `[[spheres]]`
    Spheres,
}

/// A header or `key = value`, as far as it has been read.
#[derive(Default)]
struct Statement {
    /// Its tokens that mean something: the first of them.
    first: Vec<Token>,
    /// From its first to its last such token.
    span: Range<usize>,
    /// Brackets of the value that are open.
    open: usize,
}

impl Statement {
    fn is_header(&self) -> bool {
        self.first.first().is_some_and(|token| token.kind() == TokenKind::LeftSquareBracket)
    }

    /// The kinds of its first tokens.
    fn starts(&self, kinds: &[TokenKind]) -> bool {
        self.first.len() >= kinds.len()
            && self.first.iter().zip(kinds).all(|(token, kind)| token.kind() == *kind)
    }

    /// Takes a token that means something.
    fn follow(&mut self, token: Token) {
        use TokenKind::{
            LeftCurlyBracket, LeftSquareBracket, RightCurlyBracket, RightSquareBracket,
        };
        if self.first.is_empty() {
            self.span.start = token.span().start();
        }
        self.span.end = token.span().end();
        if self.first.len() < 8 {
            self.first.push(token);
        }
        if self.is_header() {
            return;
        }
        match token.kind() {
            LeftSquareBracket | LeftCurlyBracket => self.open += 1,
            RightSquareBracket | RightCurlyBracket => self.open = self.open.saturating_sub(1),
            _ => {}
        }
    }

    /// Whether `sphere = [` has been read, and nothing behind it.
    fn begins_list(&self, text: &str) -> bool {
        let &[name, equals, bracket] = self.first.as_slice() else { return false };
        self.open == 1
            && key(text, name) == "sphere"
            && equals.kind() == TokenKind::Equals
            && bracket.kind() == TokenKind::LeftSquareBracket
    }
}

/// A key's text without its quotes.
fn key(text: &str, token: Token) -> &str {
    let span = token.span();
    text[span.start()..span.end()].trim_matches(['"', '\''])
}

/// Cuts a scene file by its tokens.
///
/// # Errors
/// What is beyond the limits, or given twice; when it is cancelled.
pub(super) fn exact(text: &str, control: &Control) -> Result<Batches, Fault> {
    use TokenKind::{Comma, Comment, Eof, Newline, Whitespace};
    let mut cut = Cut::new(text);
    let mut depth = Depth::default();
    let mut statement = Statement::default();
    // The item of a list of spheres that is being read, and the pieces of the list.
    let mut list: Option<List> = None;
    for (number, token) in Source::new(text).lex().enumerate() {
        if number % LOOK[1] == 0 {
            Fault::if_cancelled(control)?;
        }
        let span = token.span().start()..token.span().end();
        let kind = token.kind();
        let ends = kind == Eof || kind == Newline && (statement.open == 0 || statement.is_header());
        if ends {
            check_space(text, span)?;
            depth = Depth::default();
            if let Some(list) = list.take() {
                list.end(&mut cut);
            } else if !statement.first.is_empty() && !cut.statement(&statement)? {
                return Ok(cut.batches);
            }
            statement = Statement::default();
            continue;
        }
        if matches!(kind, Whitespace | Newline | Comment) {
            check_space(text, span)?;
            continue;
        }
        depth.follow(token)?;
        statement.follow(token);
        let begun = match &mut list {
            Some(list) => list.follow(kind, span.clone(), statement.open),
            None if !cut.header && statement.begins_list(text) => {
                cut.once(statement.first[0])?;
                list = Some(List::default());
                continue;
            }
            None => statement.span.start,
        };
        // Of a list, what it holds is measured.
        if span.end - begun > VALUE && kind != Comma {
            let what = if list.is_some() { "an item of `sphere` is" } else { "a value is" };
            return Err(too_long(text, what, begun..span.end));
        }
    }
    Ok(cut.batches)
}

/// The words for a value that is longer than any a scene needs; the line where it begins is shown.
fn too_long(text: &str, what: &str, span: Range<usize>) -> Fault {
    let begun = span.start;
    let end = text[begun..].find('\n').map_or(span.end, |at| begun + at);
    Fault::new(
        format!("{what} more than {VALUE} bytes long, and a scene needs no such value"),
        begun..end,
        "begins here",
        "close the bracket or the quotes that are open, and write many spheres as [[sphere]] \
         tables or as arrays in [[spheres]]",
    )
}

/// Refuses control characters in what is not given to a parser.
fn check_space(text: &str, span: Range<usize>) -> Result<(), Fault> {
    let bytes = text[span.clone()].trim_end_matches(['\n', '\t']).bytes();
    let mut bytes = bytes.enumerate();
    let Some((at, byte)) = bytes.find(|(_, byte)| byte.is_ascii_control() && *byte != b'\t') else {
        return Ok(());
    };
    let at = span.start + at;
    if byte == b'\r' && text[at + 1..].starts_with('\n') {
        return Ok(());
    }
    Err(stray(at..at + 1, byte))
}

/// A control character where TOML has none.
pub(super) fn stray(span: Range<usize>, byte: u8) -> Fault {
    let (message, fix) = match byte {
        b'\r' => (
            "not TOML: a carriage return without a line feed".to_owned(),
            "save the file with line ends of LF, or of CRLF",
        ),
        0 => (
            "not TOML: a byte of 0, which no text has".to_owned(),
            "save the file as text in UTF-8 (in UTF-16, every other byte of plain letters is 0)",
        ),
        byte => (
            format!("not TOML: the control character {byte:#04x}"),
            "remove it, or write it as an escape in a string",
        ),
    };
    Fault::new(message, span, "here", fix)
}

/// The items of `sphere = [...]`.
#[derive(Default)]
struct List {
    /// Pieces that are complete.
    pieces: Vec<Parts>,
    /// The one that is being filled.
    parts: Parts,
    /// Where the present item begins.
    item: Option<usize>,
}

impl List {
    /// Takes a token, and says where the item that it belongs to begins.
    fn follow(&mut self, kind: TokenKind, span: Range<usize>, open: usize) -> usize {
        let start = *self.item.get_or_insert(span.start);
        if kind == TokenKind::Comma && open == 1 {
            self.parts.push(start..span.end, true);
            self.item = None;
            if self.parts.len() > PIECE {
                self.pieces.push(std::mem::take(&mut self.parts));
            }
        } else if open == 0 {
            // The end of the list, or what should not be behind it.
            self.parts.push(start..span.end, true);
            self.item = None;
        }
        start
    }

    /// The statement is over: its last piece has the end of the list, if it has one.
    fn end(mut self, cut: &mut Cut) {
        if let Some(start) = self.item {
            self.parts.push(start..cut.text.len(), true);
        }
        self.pieces.push(self.parts);
        let last = self.pieces.len() - 1;
        for (k, parts) in self.pieces.into_iter().enumerate() {
            cut.batches
                .pieces
                .push(Piece { parts, around: ["sphere=[", if k < last { "]" } else { "" }] });
        }
    }
}

/// A file that is being cut.
struct Cut<'t> {
    text: &'t str,
    batches: Batches,
    within: Within,
    /// Whether there was a header.
    header: bool,
    keys: usize,
    blocks: usize,
    /// Where the last statement ends.
    previous: usize,
    /// The key of `sphere = [...]`.
    list: Option<Token>,
}

impl<'t> Cut<'t> {
    /// At the beginning of a file.
    fn new(text: &'t str) -> Self {
        Self {
            text,
            batches: Batches::default(),
            within: Within::Other,
            header: false,
            keys: 0,
            blocks: 0,
            previous: 0,
            list: None,
        }
    }

    /// Notes that `sphere` is a list, which it is once, and not beside `[[sphere]]`.
    fn once(&mut self, key: Token) -> Result<(), Fault> {
        match self.list.replace(key) {
            None => Ok(()),
            Some(first) => Err(twice(key, first)),
        }
    }

    /// Takes a statement. False: what has been taken holds a fault for certain, and nothing more is
    /// needed.
    fn statement(&mut self, statement: &Statement) -> Result<bool, Fault> {
        use TokenKind::{Dot, LeftSquareBracket as Left, RightSquareBracket as Right};
        let span = statement.span.clone();
        let previous = std::mem::replace(&mut self.previous, span.end);
        if statement.is_header() {
            self.header = true;
            let first = &statement.first;
            let double =
                statement.starts(&[Left, Left]) && first[0].span().end() == first[1].span().start();
            let at = if double { 2 } else { 1 };
            let name = first.get(at).map_or("", |token| key(self.text, *token));
            let (alone, deeper) = match first.get(at + 1).map(Token::kind) {
                Some(Right) => (true, false),
                Some(Dot) => (false, true),
                _ => (false, false),
            };
            let same = match self.within {
                Within::Sphere => name == "sphere",
                Within::Spheres => name == "spheres",
                Within::Other => false,
            };
            match name {
                "sphere" if double && alone => {
                    if let (Some(list), Some(key)) = (self.list, first.get(at)) {
                        return Err(twice(*key, list));
                    }
                    self.within = Within::Sphere;
                    let full =
                        self.batches.pieces.last().is_none_or(|piece| piece.parts.len() > PIECE);
                    // Order does not matter between tables: a piece may go on behind others.
                    if full {
                        self.batches
                            .pieces
                            .push(Piece { parts: Parts::default(), around: [""; 2] });
                    }
                }
                "spheres" if double && alone => {
                    self.within = Within::Spheres;
                    (self.blocks, self.keys) = (self.blocks + 1, 0);
                    if self.blocks > BLOCKS {
                        return Err(Fault::new(
                            format!("more than {BLOCKS} [[spheres]] tables"),
                            span,
                            "too many",
                            "write the spheres of several into one array",
                        ));
                    }
                }
                // A table inside of the last one of a list belongs to it.
                _ if same && deeper => {}
                _ => self.within = Within::Other,
            }
        }
        if self.within == Within::Sphere
            && let Some(piece) = self.batches.pieces.last_mut()
        {
            let follows = piece.parts.0.last().map(|last| last.end) == Some(previous);
            piece.parts.push(span, follows);
            return Ok(true);
        }
        let follows = self.batches.rest.0.last().map(|last| last.end) == Some(previous);
        self.batches.rest.push(span, follows);
        self.keys += 1;
        Ok(self.keys <= KEYS)
    }
}

fn twice(key: Token, first: Token) -> Fault {
    let place = |token: Token| token.span().start()..token.span().end();
    Fault::new(
        "not TOML: duplicate key, `sphere` is a list and [[sphere]] or a list again",
        place(key),
        "here",
        "write all spheres as [[sphere]] tables, or all into one list",
    )
    .and(place(first), "the list")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "[[sphere]]\ncenter = [1, 2, 3] # [[sphere]]\nradius = 1\n\n";

    fn words(text: &str) -> String {
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Both ways agree on what is what, and know where it stands.
    #[test]
    fn pieces_and_rest_are_the_file() {
        let camera = "[camera]\nview = [1, 0, 0]\n";
        let spheres = format!("  {}[[sphere]] # last\n", TABLE.repeat(2000));
        let text = format!("{camera}{spheres}[image]\nwidth = 4\n{}", TABLE.repeat(3));
        for batches in
            [quick(&text, &Control::new()).unwrap(), exact(&text, &Control::new()).unwrap()]
        {
            let Batches { rest, pieces } = batches;
            let all: String =
                pieces.iter().map(|piece| piece.text(&text).into_owned() + "\n").collect();
            let wanted = format!("{spheres}{}", TABLE.repeat(3))
                .replace(" # last", "")
                .replace(" # [[sphere]]", "");
            let all = all.replace(" # last", "").replace(" # [[sphere]]", "");
            assert!(words(&all) == words(&wanted), "{} bytes of pieces", all.len());
            assert!(
                pieces.len() > 3
                    && pieces
                        .iter()
                        .all(|piece| piece.text(&text).trim_start().starts_with("[[sphere]]"))
            );
            let beside = rest.text(&text);
            assert_eq!(words(&beside), "[camera] view = [1, 0, 0] [image] width = 4");
            let at = beside.find("[image]").unwrap();
            assert_eq!(
                rest.place(at..at + 7),
                text.find("[image]").unwrap()..text.find("[image]").unwrap() + 7
            );
            let inside = pieces[2].text(&text).find("radius").unwrap();
            assert!(text[pieces[2].place(inside..inside + 6)].starts_with("radius"));
        }
        assert!(quick(camera, &Control::new()).is_none());
        assert!(quick(&"# nothing but words\n".repeat(5000), &Control::new()).is_none());
        // Other tables whose names begin the same way are left alone.
        let text = "[[spheres]]\nradius = 1\n[sphere.x]\n[[spherex]]\n".repeat(5);
        assert!(quick(&text, &Control::new()).is_none());
        assert!(exact(&text, &Control::new()).unwrap().pieces.is_empty());
    }

    #[test]
    fn lists_are_cut_between_their_items() {
        let item = |k: usize| format!("{{center=[{k},0,0], radius=0.5}}");
        let text = format!(
            "# first\nsphere = [ # of many\n{},]\n[image]\nwidth = 4",
            (0..5000).map(item).collect::<Vec<_>>().join(",\n")
        );
        let Batches { rest, pieces } = exact(&text, &Control::new()).unwrap();
        assert_eq!(words(&rest.text(&text)), "[image] width = 4");
        assert!(pieces.len() > 3);
        for piece in &pieces {
            let part = piece.text(&text);
            let document = toml::de::DeTable::parse(&part).unwrap();
            assert!(document.get_ref().contains_key("sphere"));
            let at = part.rfind("{center").unwrap();
            assert_eq!(text[piece.place(at..at + 7)], part[at..at + 7]);
        }
    }

    #[test]
    fn limits_have_words() {
        let deep = "[".repeat(100_000);
        let cases = [
            (format!("view = {deep}"), "nested more than 16 deep"),
            (format!("a = {}", "{a=".repeat(100_000)), "nested more than 16 deep"),
            (format!("[{}]", vec!["b"; 100_000].join(".")), "a key has more than 16 parts"),
            (format!("{} = 1", vec!["b"; 100_000].join(" . ")), "a key has more than 16 parts"),
            (format!("view = \"{}\"", "x".repeat(100_000)), "a value is more than 65536 bytes"),
            (
                format!("[camera]\nview = [1, 0\n{}", TABLE.repeat(2000)),
                "a value is more than 65536 bytes",
            ),
            (
                format!("sphere = [{{center=[{}]}}]", "0,".repeat(100_000)),
                "an item of `sphere` is more than",
            ),
            (format!("sphere = []\nsphere = []\n{TABLE}"), "duplicate key"),
            (format!("sphere = []\n{TABLE}"), "duplicate key"),
            ("[[spheres]]\nradius = 1\n".repeat(70_000), "more than 65536 [[spheres]]"),
            (format!("# \u{1b}[31m\n{TABLE}"), "control character 0x1b"),
            (format!("{TABLE}\r{TABLE}"), "carriage return"),
        ];
        for (text, wanted) in cases {
            let error =
                exact(&text, &Control::new()).err().expect(wanted).into_error("test", &text);
            assert!(error.message().contains(wanted), "{wanted}: {error}");
            assert!(error.to_string().len() < 2000, "{error}");
        }
        assert!(check_keys(&vec!["b"; 20_000].join(".")).is_err());
        assert!(check_keys("a.b = 1.5\n[camera]\nview = [1.5, 2.5, 3.5]").is_ok());
    }

    /// What cannot be right is not read to its end.
    #[test]
    fn no_more_is_kept_than_a_scene_can_have() {
        for line in ["[camera]\n", "x = 1\n", "[camera.view]\n", "hello\n", "[a]\nb = 1\n"] {
            let text = line.repeat(100_000);
            let batches = exact(&text, &Control::new()).unwrap();
            assert!(batches.rest.text(&text).len() < 2000, "{line}");
        }
    }
}
