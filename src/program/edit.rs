//! One change of a program's bytes: which to take out, which to put in. Pure; the file is not touched here.

use super::error::Problem;
use super::head::{Head, Place};
use super::{Dialect, Scope};

/// From byte `at`, `delete` bytes make way for `insert`; all other bytes stay.
#[derive(Debug, PartialEq)]
pub(super) struct Splice {
    pub at: u64,
    pub delete: u64,
    pub insert: Vec<u8>,
}

/// The change that gives `scope` this value; `None` where it has it. `dialect` is asked only for a new line.
///
/// # Errors
/// The dialect cannot be told, or has no name for this step.
pub(super) fn set(
    head: &Head,
    scope: Scope,
    inertia_kg_m2: f64,
    dialect: impl FnOnce(Option<Dialect>) -> Result<Dialect, Problem>,
) -> Result<Option<Splice>, Problem> {
    if let Some(found) = head.found.iter().find(|found| found.entry.scope == scope) {
        let same = found.entry.inertia_kg_m2 == inertia_kg_m2;
        let (at, delete) = (found.number.start, found.number.end - found.number.start);
        let insert = inertia_kg_m2.to_string().into_bytes();
        return Ok((!same).then_some(Splice { at, delete, insert }));
    }
    let statement = dialect(head.dialect())?.statement(scope, inertia_kg_m2)?;
    // Values stand in the order of their steps, behind the program's title.
    let before = head.found.iter().filter(|found| found.entry.scope < scope).map(|found| found.place);
    let (at, insert) = match before.max_by_key(|place| place.start).or(head.title) {
        Some(Place { end, ending: "", previous_ending, .. }) => {
            (end, some_ending(previous_ending).to_owned() + &statement)
        }
        Some(Place { end, ending, .. }) => (end, statement + ending),
        None => (head.top.0, statement + some_ending(head.top.1)),
    };
    Ok(Some(Splice { at, delete: 0, insert: insert.into_bytes() }))
}

/// The change that takes the value of `scope` out; `None` where there is none.
pub(super) fn remove(head: &Head, scope: Scope) -> Option<Splice> {
    let found = head.found.iter().find(|found| found.entry.scope == scope)?;
    let Place { start, end, ending, previous_ending } = found.place;
    let bytes = match (found.alone, ending) {
        (false, _) => found.text.clone(),
        // The last line has no ending of its own: the one before it came with it.
        (true, "") => start - previous_ending.len() as u64..end,
        (true, _) => start..end,
    };
    let insert = if found.parts { b" ".to_vec() } else { Vec::new() };
    Some(Splice { at: bytes.start, delete: bytes.end - bytes.start, insert })
}

fn some_ending(ending: &'static str) -> &'static str {
    if ending.is_empty() { "\n" } else { ending }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn applied(program: &[u8], splice: Option<Splice>) -> Vec<u8> {
        let Some(Splice { at, delete, insert }) = splice else { return program.to_vec() };
        let (before, rest) = program.split_at(at as usize);
        [before, &insert, &rest[delete as usize..]].concat()
    }

    fn with(program: &[u8], scope: Scope, value: f64, dialect: Dialect) -> Vec<u8> {
        let splice = set(&Head::read(program).unwrap(), scope, value, |own| Ok(own.unwrap_or(dialect))).unwrap();
        applied(program, splice)
    }

    fn without(program: &[u8], scope: Scope) -> Vec<u8> {
        applied(program, remove(&Head::read(program).unwrap(), scope))
    }

    fn value(program: &[u8], scope: Scope) -> Option<f64> {
        let entries = Head::read(program).unwrap().entries();
        entries.iter().find(|entry| entry.scope == scope).map(|entry| entry.inertia_kg_m2)
    }

    #[test]
    fn a_new_value_stands_behind_the_title_with_the_neighbours_line_ending() {
        let program = Scope::Program;
        for (before, after) in [
            (&b"%\r\nO1 (A)\r\nG0 X0\n"[..], &b"%\r\nO1 (A)\r\n(INA=0.5)\r\nG0 X0\n"[..]),
            (b"%\nO1\rG0 X0\n", b"%\nO1\r(INA=0.5)\rG0 X0\n"),
            (b"G0 X0", b"(INA=0.5)\nG0 X0"),
            (b"G0 X0\r\nM2\n", b"(INA=0.5)\r\nG0 X0\r\nM2\n"),
            (b"\xef\xbb\xbfG0 X0\n", b"\xef\xbb\xbf(INA=0.5)\nG0 X0\n"),
            (b"%\r\nO1", b"%\r\nO1\r\n(INA=0.5)"),
            (b"%", b"%\n(INA=0.5)"),
            (b"", b"(INA=0.5)\n"),
            (b"(c)\nG21\nO1 (A)\nT1", b"(c)\nG21\nO1 (A)\n(INA=0.5)\nT1"),
            (b"(c)\r\n%\r\n<SHAFT-7>\r\nT1", b"(c)\r\n%\r\n<SHAFT-7>\r\n(INA=0.5)\r\nT1"),
            (b"O1 G0 X0\nX1\n", b"O1 G0 X0\n(INA=0.5)\nX1\n"),
            (b"o1 sub\no1 endsub\n", b"(INA=0.5)\no1 sub\no1 endsub\n"),
        ] {
            let written = with(before, program, 0.5, Dialect::Iso);
            assert_eq!(String::from_utf8_lossy(&written), String::from_utf8_lossy(after));
            assert_eq!(without(&written, program), before);
        }
    }

    #[test]
    fn an_existing_value_changes_in_place_and_nothing_else_does() {
        for (before, after) in [
            ("/N10 INA = +0.50(\u{fc})  \nG0", "/N10 INA = 0.7(\u{fc})  \nG0"),
            ("#1=2 #<_ina>=.5 #3=4", "#1=2 #<_ina>=0.7 #3=4"),
            ("O1 ( ina=5. ) (x)\r\n", "O1 ( ina=0.7 ) (x)\r\n"),
        ] {
            assert_eq!(with(before.as_bytes(), Scope::Program, 0.7, Dialect::Okuma), after.as_bytes());
        }
        let same = b"(INA=0.500)\n";
        assert_eq!(with(same, Scope::Program, 0.5, Dialect::Iso), same, "an equal value is not spelled anew");
    }

    #[test]
    fn removing_spares_what_else_stands_on_the_line() {
        let program = Scope::Program;
        assert_eq!(without(b"O1 (INA=0.5)\nG0", program), b"O1 \nG0");
        assert_eq!(without(b"N10 INA=0.5 (x)\nG0", program), b"N10  (x)\nG0");
        assert_eq!(without(b"/ VARIABLE INA=0.5 \r\nG0", program), b"G0");
        assert_eq!(without(b"G21\n(INA=0.5)", program), b"G21");
        assert_eq!(without(b"G21\n", program), b"G21\n");
        assert_eq!(without(b"(a)(INA=0.5)G21\nG0", program), b"(a)G21\nG0");
        assert_eq!(without(b"G21(INA=0.5);b\nG0", program), b"G21;b\nG0");
    }

    #[test]
    fn removing_leaves_words_apart() {
        let step = Scope::Step(2);
        for (before, after) in [
            (&b"INA=0.5(INA2=0.4)G21\nG0"[..], &b"INA=0.5 G21\nG0"[..]),
            (b"VC1=5(INA2=0.4)1\nG0", b"VC1=5 1\nG0"),
            (b"/(INA2=0.4)N10 G21\nG0", b"/ N10 G21\nG0"),
        ] {
            assert_eq!(String::from_utf8_lossy(&without(before, step)), String::from_utf8_lossy(after));
        }
        assert_eq!(value(&without(b"INA=0.5(INA2=0.4)G21\nG0", step), Scope::Program), Some(0.5));
    }

    #[test]
    fn steps_stand_in_order_in_the_spelling_that_is_there() {
        let mut program = b"%\nO1\nT1\n".to_vec();
        for (step, value) in [(3, 0.3), (0, 0.5), (2, 0.4)] {
            program = with(&program, Scope::from_number(step).unwrap(), value, Dialect::LinuxCnc);
        }
        assert_eq!(program, b"%\nO1\n#<_ina>=0.5\n#<_ina2>=0.4\n#<_ina3>=0.3\nT1\n");
    }

    fn head_line() -> impl Strategy<Value = Vec<u8>> {
        prop_oneof![
            Just(b"".to_vec()),
            Just(b"G21 G40".to_vec()),
            Just(b"N10 (SETUP)".to_vec()),
            Just(b"/ #1=2".to_vec()),
            Just(b"VC1=5 ; remark".to_vec()),
            proptest::collection::vec(any::<u8>().prop_filter("no control bytes", |b| *b > 31 && *b != b'='), 0..20)
                .prop_map(|prose| [b"(\x83", &prose[..], b")"].concat()),
        ]
    }

    fn title() -> impl Strategy<Value = Vec<u8>> {
        let titles = [&b""[..], b"%\n", b"(c)\r%\n<A-1>\r", b"%\r\nO1\n", b"O1 (A)\r\n", b"\xef\xbb\xbf", b"%", b"O1"];
        proptest::sample::select(titles.to_vec()).prop_map(<[u8]>::to_vec)
    }

    prop_compose! {
        fn program()(
            title in title(),
            lines in proptest::collection::vec((head_line(), prop_oneof![Just("\n"), Just("\r\n"), Just("\r")]), 0..8),
            body in proptest::collection::vec(1..=255u8, 0..40),
            acts in any::<bool>(),
        ) -> Vec<u8> {
            let mut bytes = title;
            for (line, ending) in lines {
                bytes.extend(line);
                bytes.extend(ending.bytes());
            }
            if acts {
                bytes.extend(b"G1 X");
                bytes.extend(body);
            }
            bytes
        }
    }

    fn scope() -> impl Strategy<Value = Scope> {
        (0..=9u32).prop_map(|number| Scope::from_number(number).unwrap())
    }

    fn dialect() -> impl Strategy<Value = Dialect> {
        prop_oneof![Just(Dialect::LinuxCnc), Just(Dialect::Okuma), Just(Dialect::Iso)]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn set_then_get_then_set_again_then_remove(
            program in program(), scope in scope(), dialect in dialect(), exponent in -9.0..9.0f64, other in 1e-9..1e9f64,
        ) {
            let inertia = 10f64.powf(exponent);
            let written = with(&program, scope, inertia, dialect);
            prop_assert_eq!(value(&written, scope), Some(inertia));
            prop_assert_eq!(&with(&written, scope, inertia, dialect), &written);
            let changed = with(&written, scope, other, dialect);
            prop_assert_eq!(value(&changed, scope), Some(other));
            prop_assert_eq!(&with(&changed, scope, inertia, dialect), &written);
            prop_assert_eq!(&without(&written, scope), &program);
        }

        #[test]
        fn many_steps_come_and_go_in_any_order(
            program in program(), dialect in dialect(),
            (came, went) in (0..=9u32).prop_flat_map(|count| {
                let steps: Vec<u32> = (0..=count).collect();
                (Just(steps.clone()).prop_shuffle(), Just(steps).prop_shuffle())
            }),
        ) {
            let mut bytes = program.clone();
            for number in &came {
                bytes = with(&bytes, Scope::from_number(*number).unwrap(), f64::from(*number) + 0.5, dialect);
            }
            for number in &came {
                let scope = Scope::from_number(*number).unwrap();
                prop_assert_eq!(value(&bytes, scope), Some(f64::from(*number) + 0.5));
            }
            for number in went {
                bytes = without(&bytes, Scope::from_number(number).unwrap());
            }
            prop_assert_eq!(bytes, program);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(prop_oneof![
            any::<u8>(), proptest::sample::select(&b"#<_INA2>=.(); \n\r%O/N"[..])], 0..80)) {
            if let Ok(head) = Head::read(&bytes[..]) {
                for scope in [Scope::Program, Scope::Step(2)] {
                    let splice = set(&head, scope, 0.5, |own| Ok(own.unwrap_or(Dialect::Iso))).unwrap();
                    let written = applied(&bytes, splice);
                    prop_assert_eq!(value(&written, scope), Some(0.5));
                    let _ = applied(&bytes, remove(&head, scope));
                }
            }
        }
    }
}
