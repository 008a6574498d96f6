//! One line of a part program: what it is for the head, and the INA statements on it.
//!
//! Works on bytes. Everything that is looked for is ASCII, and in the encodings that controls use (UTF-8, the
//! Windows and ISO code pages, Shift-JIS, GBK) no byte of a longer character is one of `( ) ; = # %`.

use super::{Dialect, Scope};
use std::ops::Range;

/// What a line is for the head.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Blank, a comment, an assignment or a setting without motion: the head goes on.
    Head,
    /// `%`, `%O1234(NAME)` or Okuma's `$PART.MIN%`; `numbered` where a program number stands on the same line.
    TapeMark { numbered: bool },
    /// `O1234`, `ONAME`, `:1234` or `<NAME>`.
    Number,
    /// Something that moves, turns, calls or decides: the head is over.
    Body,
}

/// One INA statement; ranges are byte positions in the line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Statement {
    pub scope: Scope,
    pub dialect: Dialect,
    pub inertia_kg_m2: f64,
    /// The whole statement, with the brackets of its comment.
    pub text: Range<usize>,
    /// The number alone.
    pub number: Range<usize>,
    /// Nothing else stands on the line but blanks and the block-skip sign.
    pub alone: bool,
}

/// The kind of a line (without its line ending) and its INA statements; a body line has none.
///
/// # Errors
/// What is wrong with an INA statement, for people.
pub(super) fn parse(line: &[u8]) -> Result<(Kind, Vec<Statement>), &'static str> {
    let (code, comments) = split(line);
    let kind = kind(&code);
    if kind == Kind::Body {
        return Ok((kind, Vec::new()));
    }
    let mut found = Vec::new();
    for comment in &comments {
        found.extend(in_comment(line, comment)?);
    }
    for at in 0..code.len() {
        found.extend(in_code(&code, at)?);
    }
    found.sort_by_key(|statement| statement.text.start);
    for statement in &mut found {
        let mut start = Cursor { bytes: line, at: 0 };
        start.skip_sign();
        let before = line.get(start.at..statement.text.start).unwrap_or_default();
        let after = line.get(statement.text.end..).unwrap_or_default();
        statement.alone = before.iter().chain(after).all(u8::is_ascii_whitespace);
    }
    Ok((kind, found))
}

/// A comment by its byte positions: with its brackets, and what stands inside.
struct Comment {
    whole: Range<usize>,
    inside: Range<usize>,
    closed: bool,
}

/// The line's code in capitals, comments blanked so that positions stay; and the comments.
fn split(line: &[u8]) -> (Vec<u8>, Vec<Comment>) {
    let mut code = line.to_ascii_uppercase();
    let mut comments = Vec::new();
    let find = |from: usize, wanted: &[u8]| {
        line.iter().enumerate().skip(from).find(|(_, byte)| wanted.contains(byte)).map(|(at, byte)| (at, *byte))
    };
    let mut from = 0;
    while let Some((start, opening)) = find(from, b"(;") {
        let closing = if opening == b'(' { find(start, b")") } else { None };
        let (inside_end, end) = closing.map_or((line.len(), line.len()), |(at, _)| (at, at + 1));
        let closed = closing.is_some() || opening == b';';
        comments.push(Comment { whole: start..end, inside: start + 1..inside_end, closed });
        code.iter_mut().take(end).skip(start).for_each(|byte| *byte = b' ');
        from = end;
    }
    (code, comments)
}

/// The code of a line alone, in capitals: without comments, block-skip sign and block number.
pub(super) fn code(line: &[u8]) -> Vec<u8> {
    let (code, _) = split(line);
    let mut start = Cursor { bytes: &code, at: 0 };
    start.skip_sign();
    start.skip_block_number();
    code.get(start.at..).unwrap_or_default().trim_ascii().to_vec()
}

fn kind(code: &[u8]) -> Kind {
    let mut cursor = Cursor { bytes: code, at: 0 };
    cursor.skip_sign();
    cursor.skip_block_number();
    cursor.skip_blanks();
    let rest = cursor.rest().trim_ascii_end();
    match rest.first() {
        None => Kind::Head,
        Some(b'%') => Kind::TapeMark { numbered: is_number(rest.get(1..).unwrap_or_default().trim_ascii_start()) },
        Some(b'$') if rest.ends_with(b"%") => Kind::TapeMark { numbered: false },
        Some(b'O' | b':' | b'<') if is_number(rest) => Kind::Number,
        Some(b'#') => Kind::Head,
        Some(_) if is_assignment(rest) || is_modal(rest) => Kind::Head,
        Some(_) => Kind::Body,
    }
}

/// `O1234`, `OSHAFT`, `:12`, `<SHAFT>`, also with words behind it; but not LinuxCNC's `O100 SUB`, `O<shaft> CALL`.
fn is_number(code: &[u8]) -> bool {
    if code.first() == Some(&b'<') {
        return code.contains(&b'>');
    }
    if !matches!(code.first(), Some(b'O' | b':')) {
        return false;
    }
    let name = code.iter().skip(1).position(|byte| !byte.is_ascii_alphanumeric() && *byte != b'_');
    let behind = name.map_or(&b""[..], |length| code.get(1 + length..).unwrap_or_default()).trim_ascii_start();
    let digits = code.get(1..).is_some_and(|name| name.first().is_some_and(u8::is_ascii_digit));
    let glued = digits && is_flow(code.iter().skip(1).copied().skip_while(u8::is_ascii_digit));
    code.len() > 1 && name != Some(0) && !glued && !is_flow(behind.iter().copied())
}

/// Two letters in a row start a word of LinuxCNC's flow control (`SUB`, `CALL`, `IF`); NC words have one letter.
fn is_flow(mut code: impl Iterator<Item = u8>) -> bool {
    code.next().is_some_and(|byte| byte.is_ascii_alphabetic())
        && code.next().is_some_and(|byte| byte.is_ascii_alphabetic())
}

/// `NAME=…` or `NAME[1]=…`, also after Okuma's `VARIABLE`; an address word (`X=VC1`) has one letter and is none.
fn is_assignment(code: &[u8]) -> bool {
    let mut cursor = Cursor { bytes: code, at: 0 };
    if cursor.eat(b"VARIABLE ") {
        cursor.skip_blanks();
    }
    let start = cursor.at;
    cursor.skip_while(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    let name = code.get(start..cursor.at).unwrap_or_default();
    cursor.skip_blanks();
    if cursor.eat(b"[") {
        cursor.skip_while(|byte| byte != b']');
        cursor.at += 1;
        cursor.skip_blanks();
    }
    name.iter().take(2).filter(|byte| byte.is_ascii_alphabetic()).count() == 2 && cursor.peek() == Some(b'=')
}

/// Settings alone: G codes but for the motions G0 to G3, feed, speed and offsets (`G50 S2000`, `G15 H1`).
fn is_modal(code: &[u8]) -> bool {
    let mut cursor = Cursor { bytes: code, at: 0 };
    loop {
        cursor.skip_blanks();
        let letter = match cursor.peek() {
            None => return true,
            Some(letter @ (b'G' | b'H' | b'F' | b'S' | b'D')) => letter,
            Some(_) => return false,
        };
        cursor.at += 1;
        let Some((_, value)) = cursor.number() else { return false };
        if letter == b'G' && value < 4.0 {
            return false;
        }
    }
}

/// `(INA=0.5)` or `; INA=0.5`: nothing else may stand in the comment, or it is prose.
fn in_comment(line: &[u8], comment: &Comment) -> Result<Option<Statement>, &'static str> {
    let inside = line.get(comment.inside.clone()).unwrap_or_default().to_ascii_uppercase();
    let mut cursor = Cursor { bytes: &inside, at: 0 };
    cursor.skip_blanks();
    let Some(scope) = cursor.key(&[]) else { return Ok(None) };
    let (number, inertia_kg_m2) = cursor.value()?;
    cursor.skip_blanks();
    if cursor.peek().is_some() {
        return Err("something stands behind the number");
    }
    if !comment.closed {
        return Err("the comment is not closed");
    }
    let number = comment.inside.start + number.start..comment.inside.start + number.end;
    let text = comment.whole.clone();
    Ok(Some(Statement { scope: scope?, dialect: Dialect::Iso, inertia_kg_m2, text, number, alone: false }))
}

/// `#<_ina>=0.5` or `INA=0.5` that starts at `at` in the code (capitals, comments blanked).
fn in_code(code: &[u8], at: usize) -> Result<Option<Statement>, &'static str> {
    let mut cursor = Cursor { bytes: code, at };
    let (dialect, key) = match cursor.peek() {
        Some(b'#') => (Dialect::LinuxCnc, cursor.key(b"#<_")),
        Some(b'I') if !preceded_by_name(code, at) => (Dialect::Okuma, cursor.key(&[])),
        _ => return Ok(None),
    };
    let Some(scope) = key else { return Ok(None) };
    let (number, inertia_kg_m2) = cursor.value()?;
    let end = cursor.at;
    if cursor.peek().is_some_and(|next| !next.is_ascii_whitespace() && next != b'#') {
        return Err("the value is not one plain decimal number");
    }
    cursor.skip_blanks();
    if cursor.peek().is_some_and(|next| b"0123456789.,+-*/[".contains(&next)) {
        return Err("the value is not one plain decimal number");
    }
    let start = declared_at(code, at);
    Ok(Some(Statement { scope: scope?, dialect, inertia_kg_m2, text: start..end, number, alone: false }))
}

fn preceded_by_name(code: &[u8], at: usize) -> bool {
    let before = at.checked_sub(1).and_then(|before| code.get(before));
    before.is_some_and(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'<' | b'#'))
}

/// Where the statement at `at` begins: `VARIABLE INA=0.5` begins with its keyword.
fn declared_at(code: &[u8], at: usize) -> usize {
    let before = code.get(..at).unwrap_or_default().trim_ascii_end();
    let word = before.strip_suffix(b"VARIABLE").filter(|_| before.len() < at);
    word.filter(|rest| rest.is_empty() || rest.ends_with(b" ")).map_or(at, <[u8]>::len)
}

/// Reads forward through bytes in capitals.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Cursor<'_> {
    fn rest(&self) -> &[u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn skip_while(&mut self, skipped: impl Fn(u8) -> bool) {
        while self.peek().is_some_and(&skipped) {
            self.at += 1;
        }
    }

    fn skip_blanks(&mut self) {
        self.skip_while(|byte| byte.is_ascii_whitespace());
    }

    fn eat(&mut self, word: &[u8]) -> bool {
        let found = self.rest().starts_with(word);
        self.at += if found { word.len() } else { 0 };
        found
    }

    /// The block-skip sign, `/` or `/2`.
    fn skip_sign(&mut self) {
        let start = self.at;
        self.skip_blanks();
        if !self.eat(b"/") {
            self.at = start;
            return;
        }
        self.skip_while(|byte| byte.is_ascii_digit());
    }

    /// The block number, `N10`; Okuma's named blocks (`NAT01`) start a process and are left to be seen.
    fn skip_block_number(&mut self) {
        let start = self.at;
        self.skip_blanks();
        let numbered = self.eat(b"N") && self.peek().is_some_and(|byte| byte.is_ascii_digit());
        if !numbered {
            self.at = start;
            return;
        }
        self.skip_while(|byte| byte.is_ascii_digit());
    }

    /// `INA=` or `INA2=` behind `opening` (`#<_`, which `>` then closes), blanks allowed as LinuxCNC allows them.
    ///
    /// `None` where no such key stands here; an error for a key with an impossible step number.
    fn key(&mut self, opening: &[u8]) -> Option<Result<Scope, &'static str>> {
        for byte in opening.iter().chain(b"INA") {
            self.skip_blanks();
            if !self.eat(&[*byte]) {
                return None;
            }
        }
        self.skip_blanks();
        let mut step: Option<u32> = None;
        while let Some(digit) = self.peek().filter(u8::is_ascii_digit) {
            step = Some(step.unwrap_or(0).saturating_mul(10).saturating_add(u32::from(digit - b'0')));
            self.at += 1;
        }
        let closing: &[u8] = if opening.is_empty() { b"=" } else { b">=" };
        for byte in closing {
            self.skip_blanks();
            if !self.eat(&[*byte]) {
                return None;
            }
        }
        Some(match step {
            None => Ok(Scope::Program),
            Some(0) => Err("the step number is not 1 to 9999"),
            Some(step) => Scope::from_number(step).ok_or("the step number is not 1 to 9999"),
        })
    }

    /// A finite positive decimal number, its position and value.
    fn value(&mut self) -> Result<(Range<usize>, f64), &'static str> {
        self.skip_blanks();
        let (range, value) = self.number().ok_or("the value is not a plain decimal number")?;
        if self.peek() == Some(b',') {
            return Err("the value has a comma where the decimal point belongs");
        }
        if value.is_finite() && value > 0.0 { Ok((range, value)) } else { Err("the value is not finite and positive") }
    }

    /// A decimal number without exponent, which NC has not: `12`, `-1.5`, `.5`, `5.`.
    fn number(&mut self) -> Option<(Range<usize>, f64)> {
        let start = self.at;
        if matches!(self.peek(), Some(b'+' | b'-')) {
            self.at += 1;
        }
        self.skip_while(|byte| byte.is_ascii_digit() || byte == b'.');
        let range = start..self.at;
        // std's parse knows no locale; it wants a digit, and one point at most.
        let value = std::str::from_utf8(self.bytes.get(range.clone())?).ok()?.parse().ok()?;
        Some((range, value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(line: &str) -> Statement {
        let (_, mut found) = parse(line.as_bytes()).unwrap_or_else(|reason| panic!("{line}: {reason}"));
        assert_eq!(found.len(), 1, "{line}");
        found.remove(0)
    }

    #[test]
    fn every_spelling_is_read_with_its_place() {
        for (line, scope, dialect, value, text, number, alone) in [
            ("#<_ina>=0.5", 0, Dialect::LinuxCnc, 0.5, "#<_ina>=0.5", "0.5", true),
            (" # < _INA 2 > = .5 ", 2, Dialect::LinuxCnc, 0.5, "# < _INA 2 > = .5", ".5", true),
            ("N10 #<_ina>=0.5 #2=3", 0, Dialect::LinuxCnc, 0.5, "#<_ina>=0.5", "0.5", false),
            ("#2=3 #<_ina3>=0.5", 3, Dialect::LinuxCnc, 0.5, "#<_ina3>=0.5", "0.5", false),
            ("INA=0.5", 0, Dialect::Okuma, 0.5, "INA=0.5", "0.5", true),
            ("INA2 = 12. (ROUGH)", 2, Dialect::Okuma, 12.0, "INA2 = 12.", "12.", false),
            ("VARIABLE INA=0.5", 0, Dialect::Okuma, 0.5, "VARIABLE INA=0.5", "0.5", true),
            ("(INA=0.5)", 0, Dialect::Iso, 0.5, "(INA=0.5)", "0.5", true),
            ("/2 ( ina 02 = +0.5 )", 2, Dialect::Iso, 0.5, "( ina 02 = +0.5 )", "+0.5", true),
            ("O1234 (PART) (INA=0.5)", 0, Dialect::Iso, 0.5, "(INA=0.5)", "0.5", false),
            ("G21 G90 (INA9999=0.5)", 9999, Dialect::Iso, 0.5, "(INA9999=0.5)", "0.5", false),
            ("; INA=0.5", 0, Dialect::Iso, 0.5, "; INA=0.5", "0.5", true),
            ("%O7(INA=1)", 0, Dialect::Iso, 1.0, "(INA=1)", "1", false),
        ] {
            let found = one(line);
            assert_eq!((found.scope, found.dialect), (Scope::from_number(scope).unwrap(), dialect), "{line}");
            assert_eq!(found.inertia_kg_m2, value, "{line}");
            assert_eq!((&line[found.text.clone()], &line[found.number.clone()]), (text, number), "{line}");
            assert_eq!(found.alone, alone, "{line}");
        }
    }

    #[test]
    fn what_only_looks_like_ina_is_left_alone() {
        for line in [
            "(INA)",
            "(INA 0.5)",
            "(OLD INA=0.5)",
            "(INAX=1)",
            "VINA=1",
            "#<ina>=1",
            "#<_ina_old>=1",
            "#<_nina>=2",
            "(T1 INA=3)",
            "#1=#<_ina>",
            "",
            "%",
            "(",
            ";",
            "#",
            "#<_ina",
            "#<_ina>",
            "INA",
            "N10",
            "/",
        ] {
            assert_eq!(parse(line.as_bytes()).map(|(_, found)| found.len()), Ok(0), "{line}");
        }
        assert_eq!(parse(b"G0 X0 (INA=0.5)"), Ok((Kind::Body, vec![])));
    }

    #[test]
    fn a_value_that_is_no_plain_positive_number_is_refused() {
        let huge = format!("INA={}", "9".repeat(400));
        let tiny = format!("(INA=0.{}1)", "0".repeat(400));
        for line in [
            "INA=",
            "INA=0",
            "INA=-0.5",
            "INA=0,5",
            "INA=1e3",
            "INA=0.5kgm2",
            "INA=VC1",
            "INA=1+2",
            "INA=1 +2",
            "INA=0. 5",
            "INA=..5",
            "INA=.",
            "INA=nan",
            "INA=inf",
            "(INA=0.5 KGM2)",
            "(INA=0.5",
            "(INA=0,5)",
            "(INA=)",
            "(INA=NaN)",
            "#<_ina>=[1/2]",
            "#<_ina>=0.5M68",
            "; INA=0.5 rough",
            "(INA0=1)",
            "(INA10000=1)",
            "(INA99999999999=1)",
            "INA=0x1",
            &huge,
            &tiny,
        ] {
            assert!(parse(line.as_bytes()).is_err(), "{line}");
        }
    }

    #[test]
    fn the_head_goes_on_until_something_happens() {
        let numbered = Kind::TapeMark { numbered: true };
        let bare = Kind::TapeMark { numbered: false };
        for (line, expected) in [
            ("", Kind::Head),
            ("N10", Kind::Head),
            ("/ N10 (c)", Kind::Head),
            ("; c", Kind::Head),
            ("#1=2", Kind::Head),
            ("VC1=5", Kind::Head),
            ("VC[1]=5", Kind::Head),
            ("G21 G40G49 G80", Kind::Head),
            ("G15 H1", Kind::Head),
            ("%", bare),
            ("$PART.MIN%", bare),
            ("%_N_SHAFT_MPF", bare),
            ("%O1234(NAME)", numbered),
            ("% O1", numbered),
            ("O1234", Kind::Number),
            ("O1234(PART)", Kind::Number),
            (":12", Kind::Number),
            ("OSHAFT", Kind::Number),
            ("<SHAFT-7>", Kind::Number),
            ("%<SHAFT-7>", numbered),
            ("<", Kind::Body),
            ("O1234 G21", Kind::Number),
            ("O1234G0X0", Kind::Number),
            ("O100 sub", Kind::Body),
            ("o100sub", Kind::Body),
            ("o<shaft> call", Kind::Body),
            ("O", Kind::Body),
            ("G0 X1", Kind::Body),
            ("G01", Kind::Body),
            ("G00G90", Kind::Body),
            ("T1 M6", Kind::Body),
            ("X=VC1", Kind::Body),
            ("G01 X=VC1", Kind::Body),
            ("G50 S2000", Kind::Head),
            ("NAT01", Kind::Body),
            ("M30", Kind::Body),
            ("F100.5", Kind::Head),
            ("G65 P9010", Kind::Body),
            ("IF [#1 EQ 2] GOTO 3", Kind::Body),
            ("CALL O100", Kind::Body),
            ("\u{e9}", Kind::Body),
            ("G", Kind::Body),
            ("$1", Kind::Body),
        ] {
            assert_eq!(parse(line.as_bytes()).map(|(kind, _)| kind), Ok(expected), "{line}");
        }
    }
}
