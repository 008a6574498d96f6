//! The head of a part program: its lines up to the first block that does something, and the INA values there.
//!
//! Lines end with LF, CR LF or CR, mixed as they come. Memory does not depend on the length of the program, of its
//! head or of a line.

use super::error::{Problem, quoted};
use super::line::{self, Kind, Statement};
use super::{Dialect, Entry};
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::ops::Range;

/// Of a longer line only this much is looked at; no control takes blocks of that length.
const LONGEST_LINE: usize = 64 * 1024;

/// A line's place in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    /// First byte, and the byte behind the line ending.
    pub start: u64,
    pub end: u64,
    /// The line's own ending; empty only at the end of the file.
    pub ending: &'static str,
    /// The ending of the line before; empty for the first.
    pub previous_ending: &'static str,
}

/// An INA statement, its line and where it stands in the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Found {
    pub entry: Entry,
    pub place: Place,
    pub text: Range<u64>,
    pub number: Range<u64>,
    pub alone: bool,
    /// Without it what stands before and behind it would be one word.
    pub parts: bool,
    /// The line for messages.
    pub quote: String,
}

/// What the head says, and where a new line belongs.
#[derive(Debug)]
pub(super) struct Head {
    pub found: Vec<Found>,
    /// The last of tape mark and program number: a new line goes behind it.
    pub title: Option<Place>,
    /// Where the text starts behind a byte order mark, and the ending of its first line.
    pub top: (u64, &'static str),
}

impl Head {
    /// Reads as far as the head goes.
    ///
    /// # Errors
    /// Reading fails; NUL bytes or UTF-16; an INA statement that is not a value; one value twice.
    pub fn read(file: impl Read) -> Result<Head, Problem> {
        let mut lines = Lines::new(BufReader::with_capacity(LONGEST_LINE, file))?;
        let mut head = Head { found: Vec::new(), title: None, top: (lines.at, "") };
        let (mut number, mut leader, mut numbered) = (0, true, false);
        while let Some(place) = lines.next_line()? {
            number += 1;
            if number == 1 {
                head.top.1 = place.ending;
            }
            let refused = |reason| Problem::Statement { line: number, text: quoted(&lines.text), reason };
            let (kind, statements) = line::parse(&lines.text).map_err(refused)?;
            match kind {
                Kind::Head => {}
                // Between the tape mark and a second one stands the program; blanks and comments before the first are leader.
                Kind::TapeMark { numbered: here } if leader => {
                    head.title = Some(place);
                    numbered = here;
                }
                Kind::Number if !numbered => {
                    head.title = Some(place);
                    numbered = true;
                }
                // A second tape mark ends the program, a second number begins another one.
                Kind::TapeMark { .. } | Kind::Number | Kind::Body => break,
            }
            leader &= kind == Kind::Head && statements.is_empty() && line::code(&lines.text).is_empty();
            for statement in statements {
                head.add(number, place, &statement, &lines.text)?;
            }
        }
        Ok(head)
    }

    /// The values without their places.
    pub fn entries(&self) -> Vec<Entry> {
        self.found.iter().map(|found| found.entry).collect()
    }

    /// The spelling that the head already uses.
    pub fn dialect(&self) -> Option<Dialect> {
        self.found.first().map(|found| found.entry.dialect)
    }

    fn add(&mut self, line: u64, place: Place, statement: &Statement, text: &[u8]) -> Result<(), Problem> {
        let Statement { scope, dialect, inertia_kg_m2, alone, .. } = *statement;
        let (before, after) = (text.get(..statement.text.start), text.get(statement.text.end..));
        let word = |byte: Option<&u8>| byte.is_some_and(|b| !b.is_ascii_whitespace() && !b"();".contains(b));
        let parts = word(before.and_then(<[u8]>::last)) && word(after.and_then(<[u8]>::first));
        let quote = quoted(text);
        if let Some(first) = self.found.iter().find(|found| found.entry.scope == scope) {
            let first = (first.entry.line, first.quote.clone());
            return Err(Problem::Duplicate { scope, first, second: (line, quote) });
        }
        let in_file = |range: &Range<usize>| place.start + range.start as u64..place.start + range.end as u64;
        let (text, number) = (in_file(&statement.text), in_file(&statement.number));
        let entry = Entry { scope, inertia_kg_m2, line, dialect };
        self.found.push(Found { entry, place, text, number, alone, parts, quote });
        Ok(())
    }
}

/// Reads lines with their places; keeps the text of one.
struct Lines<R> {
    reader: R,
    at: u64,
    previous_ending: &'static str,
    text: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    /// Starts behind a UTF-8 byte order mark.
    fn new(mut reader: R) -> Result<Lines<R>, Problem> {
        let start = fill(&mut reader)?;
        if start.starts_with(b"\xff\xfe") || start.starts_with(b"\xfe\xff") {
            return Err(Problem::NotText { found: "UTF-16 text (save it as plain text or UTF-8)" });
        }
        let mark = if start.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        reader.consume(mark);
        Ok(Lines { reader, at: mark as u64, previous_ending: "", text: Vec::new() })
    }

    /// Reads the next line into `text`, without its ending.
    fn next_line(&mut self) -> Result<Option<Place>, Problem> {
        self.text.clear();
        let start = self.at;
        let ending = loop {
            let buffer = fill(&mut self.reader)?;
            if buffer.is_empty() {
                break "";
            }
            let end = buffer.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            let part = buffer.get(..end.unwrap_or(buffer.len())).unwrap_or_default();
            if part.contains(&0) {
                return Err(Problem::NotText { found: "a NUL byte" });
            }
            let room = LONGEST_LINE.saturating_sub(self.text.len());
            self.text.extend_from_slice(part.get(..room).unwrap_or(part));
            let newline = end.and_then(|end| buffer.get(end)) == Some(&b'\n');
            let used = part.len() + usize::from(end.is_some());
            self.skip(used);
            match end {
                None => {}
                Some(_) if newline => break "\n",
                Some(_) => break self.after_return()?,
            }
        };
        if self.at == start {
            return Ok(None);
        }
        let place = Place { start, end: self.at, ending, previous_ending: self.previous_ending };
        self.previous_ending = ending;
        Ok(Some(place))
    }

    /// The ending that a CR, already read, belongs to.
    fn after_return(&mut self) -> Result<&'static str, Problem> {
        if fill(&mut self.reader)?.first() != Some(&b'\n') {
            return Ok("\r");
        }
        self.skip(1);
        Ok("\r\n")
    }

    fn skip(&mut self, bytes: usize) {
        self.reader.consume(bytes);
        self.at += bytes as u64;
    }
}

/// The bytes read and not yet used; empty at the end of the file. A signal does not end the reading.
fn fill(reader: &mut impl BufRead) -> Result<&[u8], Problem> {
    while reader.fill_buf().is_err_and(|error| error.kind() == ErrorKind::Interrupted) {}
    reader.fill_buf().map_err(|source| Problem::Io { doing: "read the program", source })
}

#[cfg(test)]
mod tests {
    use super::super::Scope;
    use super::*;

    fn head(program: &[u8]) -> Head {
        Head::read(program).unwrap()
    }

    fn values(program: &[u8]) -> Vec<(Scope, f64, u64)> {
        head(program).entries().iter().map(|entry| (entry.scope, entry.inertia_kg_m2, entry.line)).collect()
    }

    #[test]
    fn values_are_found_up_to_the_first_block_that_acts() {
        let program = b"%\r\nO1234 (SHAFT)\n(INA=0.5)\rG21 G90\n\n(INA2=0.4)\nT1 M6\n(INA=0.9)\nM30\n%\n";
        assert_eq!(values(program), [(Scope::Program, 0.5, 3), (Scope::Step(2), 0.4, 6)]);
        assert_eq!(values(b"%\nO1\nM30\nO2\n(INA=0.5)\n%"), [], "a second program's value is not this one's");
        assert_eq!(values(b"%\nO1\nO2\n(INA=0.5)\n%"), []);
        assert_eq!(values(b"%\nO1\n%\n(INA=0.5)"), [], "behind the end mark");
        assert_eq!(values(b"(POSTED)\n\n%\nO1\n(INA=0.5)\n%"), [(Scope::Program, 0.5, 5)]);
        assert_eq!(values(b"(INA=0.4)\n%\nO1\n(INA=0.5)\n%"), [(Scope::Program, 0.4, 1)]);
        assert_eq!(values(b"G21\n%\nO1\n(INA=0.5)\n%"), [], "G21 is a program");
        assert_eq!(values(b"%O1(NAME)\n(INA=0.5)\nO2"), [(Scope::Program, 0.5, 2)]);
        assert_eq!(values(b"$A.MIN%\nOABC\nVARIABLE INA=0.5"), [(Scope::Program, 0.5, 3)]);
        assert_eq!(values(b"\xef\xbb\xbf(INA=0.5)"), [(Scope::Program, 0.5, 1)]);
        assert_eq!(values(b"(\x83\x5c\xff \xe4\xf6)\n(INA=0.5)"), [(Scope::Program, 0.5, 2)]);
        assert_eq!(values(b""), []);
    }

    #[test]
    fn what_stands_twice_is_named_with_both_lines() {
        let problem = Head::read(&b"%\nO1\n(INA=0.5)\n#<_ina>=0.6\nG0 X0"[..]).unwrap_err();
        let Problem::Duplicate { scope, first, second } = problem else { panic!("{problem}") };
        assert_eq!((scope, first.0, second.0), (Scope::Program, 3, 4));
        assert_eq!((first.1.as_str(), second.1.as_str()), ("(INA=0.5)", "#<_ina>=0.6"));
        assert!(Head::read(&b"(INA=0.5) (INA=0.5)"[..]).is_err());
        assert!(Head::read(&b"INA2=0.5\n(INA02=0.5)"[..]).is_err());
        assert!(Head::read(&b"(INA=0.5)\nG0\n(INA=0.5)"[..]).is_ok(), "the second is in the body");
    }

    #[test]
    fn a_refused_value_is_quoted_with_its_line() {
        let problem = Head::read(&b"%\n\n  INA=0,5 (\xfc)\n"[..]).unwrap_err();
        let Problem::Statement { line, text, .. } = problem else { panic!("{problem}") };
        assert_eq!((line, text.as_str()), (3, "INA=0,5 (\u{fffd})"));
    }

    #[test]
    fn bytes_that_are_no_program_are_refused() {
        for bytes in [&b"\xff\xfeO\x001\x00"[..], b"\xfe\xff\x00O", b"%\n\x00\n", b"O1\n(a\x00)"] {
            assert!(matches!(Head::read(bytes), Err(Problem::NotText { .. })), "{bytes:?}");
        }
    }

    #[test]
    fn places_tell_the_endings_whatever_they_are() {
        let mut lines = Lines::new(&b"a\r\nbb\n\n\rc\r\r\nd"[..]).unwrap();
        let mut seen = Vec::new();
        while let Some(place) = lines.next_line().unwrap() {
            seen.push((place.start, place.end, place.ending, String::from_utf8(lines.text.clone()).unwrap()));
        }
        let expected = [(0, 3, "\r\n", "a"), (3, 6, "\n", "bb"), (6, 7, "\n", ""), (7, 8, "\r", "")];
        let behind = [(8, 10, "\r", "c"), (10, 12, "\r\n", ""), (12, 13, "", "d")];
        let expected = expected.iter().chain(&behind).map(|&(a, b, ending, text)| (a, b, ending, text.to_owned()));
        assert_eq!(seen, expected.collect::<Vec<_>>());
    }

    #[test]
    fn a_line_without_end_costs_no_memory() {
        let endless = std::io::repeat(b'(').take(50_000_000);
        let mut lines = Lines::new(BufReader::new(endless)).unwrap();
        assert_eq!(lines.next_line().unwrap().map(|place| place.end), Some(50_000_000));
        assert!(lines.text.capacity() <= 2 * LONGEST_LINE, "{}", lines.text.capacity());
    }
}
