//! Which control a program is written for, as far as the spelling of INA depends on it.

use super::Scope;
use super::error::Problem;
use super::line;
use std::fmt;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// How INA is spelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// `#<_ina>=0.5`: a named global parameter. A later line can hand it on: `M68 E0 Q#<_ina>`.
    LinuxCnc,
    /// `INA=0.5`: a local variable of OSP, whose names have four characters at most; so steps end at 9.
    Okuma,
    /// `(INA=0.5)`: a comment, which every control runs over.
    Iso,
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Dialect::LinuxCnc => "linuxcnc",
            Dialect::Okuma => "okuma",
            Dialect::Iso => "iso",
        })
    }
}

impl Dialect {
    /// The statement in this dialect.
    pub(super) fn statement(self, scope: Scope, inertia_kg_m2: f64) -> Result<String, Problem> {
        let value = inertia_kg_m2; // std writes the shortest decimal that reads back the same, never an exponent
        match (self, scope) {
            (Dialect::LinuxCnc, _) => Ok(format!("#<_{}>={value}", scope.to_string().to_ascii_lowercase())),
            (Dialect::Okuma, Scope::Step(10..)) => Err(Problem::OkumaStep(scope)),
            (Dialect::Okuma, _) => Ok(format!("{scope}={value}")),
            (Dialect::Iso, _) => Ok(format!("({scope}={value})")),
        }
    }

    /// Recognises the dialect by the file's ending, then by what only one control understands in its first 64 KiB.
    ///
    /// A program without such signs, or with signs of both, is taken for ISO: a comment does no harm anywhere.
    pub(super) fn detect(path: &Path, file: &mut (impl Read + Seek)) -> Result<Dialect, Problem> {
        const SAMPLE: u64 = 64 * 1024;
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "ngc" => return Ok(Dialect::LinuxCnc),
            "min" | "ssb" => return Ok(Dialect::Okuma),
            _ => {}
        }
        let mut sample = Vec::new();
        let read = file.seek(SeekFrom::Start(0)).and_then(|_| file.by_ref().take(SAMPLE).read_to_end(&mut sample));
        read.map_err(|source| Problem::Io { doing: "read the program", source })?;
        let lines = || sample.split(|byte| matches!(byte, b'\n' | b'\r')).map(line::code);
        match (lines().any(|code| is_linuxcnc(&code)), lines().any(|code| is_okuma(&code))) {
            (true, false) => Ok(Dialect::LinuxCnc),
            (false, true) => Ok(Dialect::Okuma),
            _ => Ok(Dialect::Iso),
        }
    }
}

/// Named parameters (`#<name>`) and O-words (`O100 SUB`, `O<name> CALL`).
fn is_linuxcnc(code: &[u8]) -> bool {
    let o_word = || {
        let name = code.strip_prefix(b"O")?;
        let end = name.iter().position(|byte| !byte.is_ascii_alphanumeric() && !b"_-<>".contains(byte))?;
        let word = name.get(end..)?.trim_ascii();
        Some([&b"SUB"[..], b"CALL", b"IF", b"WHILE", b"DO", b"REPEAT"].iter().any(|flow| word.starts_with(flow)))
    };
    code.windows(2).any(|pair| pair == b"#<") || o_word().unwrap_or(false)
}

/// The header `$PART.MIN%`, named blocks (`NAT01`), common variables (`VC1`) and `CALL O100`.
fn is_okuma(code: &[u8]) -> bool {
    let named_block = matches!(code, [b'N', second, ..] if second.is_ascii_alphabetic());
    let common =
        code.windows(3).any(|word| matches!(word, [b'V', b'C', last] if last.is_ascii_digit() || *last == b'['));
    code.first() == Some(&b'$') && code.ends_with(b"%") || named_block || common || code.starts_with(b"CALL O")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn detected(name: &str, program: &str) -> Dialect {
        Dialect::detect(Path::new(name), &mut Cursor::new(program.as_bytes())).unwrap()
    }

    #[test]
    fn each_dialect_is_known_by_its_own_signs() {
        assert_eq!(detected("a.ngc", "G21\nG0 X0"), Dialect::LinuxCnc);
        assert_eq!(detected("A.MIN", "G0 X0"), Dialect::Okuma);
        assert_eq!(detected("a.nc", "%\nO1\nG21\nG0 X0\nM30\n%"), Dialect::Iso);
        assert_eq!(detected("a.nc", "%\n#<feed>=100\nG0 X0"), Dialect::LinuxCnc);
        assert_eq!(detected("a", "G21\no<probe> call [1]\nM2"), Dialect::LinuxCnc);
        assert_eq!(detected("a.txt", "$SHAFT.MIN%\nO1\nG0 X0"), Dialect::Okuma);
        assert_eq!(detected("a", "O1\r\nG15 H1\r\nNAT01\r\nG0 X0"), Dialect::Okuma);
        assert_eq!(detected("a", "O1\rVC1=3\rG0 X=VC1"), Dialect::Okuma);
        assert_eq!(detected("a", "O1 (#<x> VC1 NAT01 IN A COMMENT)\nG0 X0"), Dialect::Iso);
        assert_eq!(detected("a", "NAT01\n#<x>=1\n"), Dialect::Iso, "signs of both");
        assert_eq!(detected("a", ""), Dialect::Iso);
    }

    #[test]
    fn statements_are_spelled_without_exponent() {
        let step = Scope::Step(2);
        assert_eq!(Dialect::LinuxCnc.statement(step, 0.5).unwrap(), "#<_ina2>=0.5");
        assert_eq!(Dialect::Okuma.statement(Scope::Program, 3.0).unwrap(), "INA=3");
        assert_eq!(Dialect::Iso.statement(step, 1e-9).unwrap(), "(INA2=0.000000001)");
        assert_eq!(Dialect::Iso.statement(step, 1e9).unwrap(), "(INA2=1000000000)");
        assert!(Dialect::Okuma.statement(Scope::Step(9), 1.0).is_ok());
        assert!(matches!(Dialect::Okuma.statement(Scope::Step(10), 1.0), Err(Problem::OkumaStep(_))));
    }
}
