//! A proof by call graph: from every function that the header tags `[real-time: yes]`, walk the machine code of the
//! release library and meet no panic, allocation, lock, system call, unwinding, recursion, no import but the plain
//! memory and mathematical ones, and no call through a pointer that could hide any of them.
//!
//! What it cannot see is a loop without a bound; the instruction counts of the benchmarks watch those.
#![cfg(all(target_arch = "x86_64", target_os = "linux"))]

mod support;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use support::{command, functions, header, release, run};

/// Imports that neither allocate, lock nor fail: memory and mathematics.
const IMPORTS: &[&str] = &[
    "memcpy", "memmove", "memset", "memcmp", "bcmp", "strlen", "acos", "asin", "atan", "atan2", "cbrt", "ceil", "cos",
    "cosh", "exp", "exp2", "expm1", "fabs", "floor", "fma", "fmax", "fmin", "fmod", "hypot", "ldexp", "log", "log10",
    "log1p", "log2", "pow", "rint", "round", "sin", "sincos", "sinh", "sqrt", "tan", "tanh", "trunc",
];
/// Parts of demangled names that no real-time function may reach.
const REFUSED: &[&str] = &[
    "panic",
    "unwrap_failed",
    "expect_failed",
    "_fail",
    "__rust_",
    "__rustc",
    "__rdl_",
    "__rg_",
    "_Unwind",
    "handle_alloc_error",
    "begin_unwind",
];
/// Instructions that enter the kernel, trap, or read a clock.
const TRAPS: &[&str] = &["syscall", "sysenter", "int", "ud2", "ud1", "hlt", "rdtsc", "rdtscp", "rdrand", "rdseed"];

/// One function of the machine code: its name, what it may do itself, and whom it calls.
#[derive(Default)]
struct Function {
    name: String,
    calls: BTreeSet<u64>,
    imports: BTreeSet<String>,
    /// What is wrong with its own instructions.
    faults: BTreeSet<String>,
}

/// A shared library, disassembled.
struct Library {
    functions: BTreeMap<u64, Function>,
    exported: BTreeMap<String, u64>,
}

fn hex(text: &str) -> Option<u64> {
    u64::from_str_radix(text.trim().trim_start_matches("0x"), 16).ok()
}

impl Library {
    fn read(path: &Path) -> Library {
        let dump = |options: &str| run(command(&format!("objdump {options}")).arg(path)).unwrap();
        let slots = Slots::read(&dump("--dynamic-reloc"), &dump("--section-headers"));
        let mut functions = BTreeMap::new();
        for block in dump("--disassemble --demangle --no-show-raw-insn --wide").split("\n\n") {
            // `0000000000012990 <gib_version>:` and then the instructions.
            let Some((start, name)) = block.trim_start().lines().next().and_then(|line| line.split_once(" <")) else {
                continue;
            };
            let (Some(start), Some(name)) = (hex(start), name.strip_suffix(">:")) else { continue };
            functions.insert(start, Function::read(name, block, &slots));
        }
        let exported = run(command("nm --dynamic --defined-only --format=posix").arg(path)).unwrap();
        let exported = exported.lines().filter_map(|line| {
            let mut fields = line.split_whitespace();
            Some((fields.next()?.to_string(), fields.nth(1).and_then(hex)?))
        });
        Library { functions, exported: exported.collect() }
    }

    /// The function that an address lies in, with its start.
    fn at(&self, address: u64) -> Option<(u64, &Function)> {
        self.functions.range(..=address).next_back().map(|(start, f)| (*start, f))
    }

    /// Everything wrong that `root` reaches, each with the way to it.
    fn faults_from(&self, root: &str) -> Vec<String> {
        let Some(address) = self.exported.get(root) else { return vec![format!("{root}: not exported")] };
        let mut faults = BTreeSet::new();
        self.walk(*address, &mut Vec::new(), &mut BTreeSet::new(), &mut faults);
        faults.into_iter().collect()
    }

    fn walk(&self, address: u64, way: &mut Vec<u64>, seen: &mut BTreeSet<u64>, faults: &mut BTreeSet<String>) {
        let Some((start, function)) = self.at(address) else {
            faults.insert(format!("a call to {address:#x}, where no function is"));
            return;
        };
        let told = |what: &str| {
            let names = way.iter().chain([&start]).map(|a| self.functions[a].name.as_str());
            format!("{}: {what}", names.collect::<Vec<_>>().join(" -> "))
        };
        if way.contains(&start) {
            faults.insert(told("recursion"));
            return;
        }
        if !seen.insert(start) {
            return;
        }
        if let Some(import) = function.name.strip_suffix("@plt") {
            faults.extend((!IMPORTS.contains(&import)).then(|| told("imported")));
            return;
        }
        let outside = ["std::", "<std::", "alloc::", "<alloc::"].iter().any(|p| function.name.starts_with(p));
        if outside || REFUSED.iter().any(|part| function.name.contains(part)) {
            faults.insert(told("not in real time"));
            return;
        }
        faults.extend(function.faults.iter().map(|fault| told(fault)));
        // An import can be an export of the library itself.
        let (own, foreign): (Vec<_>, Vec<_>) = function.imports.iter().partition(|i| self.exported.contains_key(*i));
        let refused = foreign.into_iter().filter(|import| !IMPORTS.contains(&import.as_str()));
        faults.extend(refused.map(|import| told(&format!("imports {import}"))));
        way.push(start);
        for call in function.calls.iter().chain(own.into_iter().map(|name| &self.exported[name])) {
            self.walk(*call, way, seen, faults);
        }
        way.pop();
    }
}

/// The slots that the loader fills once and then makes read-only: a call through one is as good as a direct one.
struct Slots {
    imports: BTreeMap<u64, String>,
    functions: BTreeMap<u64, u64>,
}

impl Slots {
    fn read(relocations: &str, sections: &str) -> Slots {
        let mut constant = Vec::new();
        for line in sections.lines() {
            let fields: Vec<&str> = line.split_whitespace().collect();
            if let [_, ".got" | ".got.plt" | ".data.rel.ro", size, start, ..] = fields[..] {
                let (size, start) = (hex(size).unwrap(), hex(start).unwrap());
                constant.push(start..start + size);
            }
        }
        let mut slots = Slots { imports: BTreeMap::new(), functions: BTreeMap::new() };
        for line in relocations.lines() {
            let [slot, kind, value] = line.split_whitespace().collect::<Vec<_>>()[..] else { continue };
            let Some(slot) = hex(slot).filter(|slot| constant.iter().any(|range| range.contains(slot))) else {
                continue;
            };
            match (kind, value.strip_prefix("*ABS*+")) {
                ("R_X86_64_RELATIVE", Some(address)) => drop(slots.functions.insert(slot, hex(address).unwrap())),
                ("R_X86_64_GLOB_DAT" | "R_X86_64_JUMP_SLOT", None) => {
                    slots.imports.insert(slot, value.split('@').next().unwrap().to_string());
                }
                _ => {}
            }
        }
        slots
    }
}

impl Function {
    fn read(name: &str, block: &str, slots: &Slots) -> Function {
        let mut function = Function { name: name.to_string(), ..Function::default() };
        let instructions: Vec<(u64, &str)> = block
            .lines()
            .filter_map(|line| line.trim().split_once(":\t").and_then(|(address, code)| Some((hex(address)?, code))))
            .collect();
        let (Some(first), Some(last)) = (instructions.first(), instructions.last()) else { return function };
        let body = first.0..=last.0;
        for (i, (_, code)) in instructions.iter().enumerate() {
            let mut words =
                code.split_whitespace().skip_while(|w| ["bnd", "notrack", "addr32", "rep", "data16"].contains(w));
            let (Some(operation), operand) = (words.next(), words.next().unwrap_or("")) else { continue };
            if TRAPS.contains(&operation) {
                function.faults.insert(format!("instruction {operation}"));
            }
            if !operation.starts_with("call") && !operation.starts_with('j') {
                continue;
            }
            if let Some(target) = hex(operand) {
                if operation.starts_with("call") || !body.contains(&target) {
                    function.calls.insert(target);
                }
                continue;
            }
            // Through a pointer: fine when it is one of the loader's slots, or the table of a `match`.
            let through = match operand.strip_prefix("*%") {
                Some(register) => slots_in_register(&instructions, i, register),
                None => slot(code).map(|slot| vec![slot]),
            };
            for slot in through.iter().flatten() {
                match (slots.imports.get(slot), slots.functions.get(slot)) {
                    (Some(import), _) => drop(function.imports.insert(import.clone())),
                    (_, Some(target)) => drop(function.calls.insert(*target)),
                    _ => drop(function.faults.insert(format!("{operation} through {slot:#x}"))),
                }
            }
            if through.is_none() && (operation.starts_with("call") || !is_match_table(&instructions[..i], operand)) {
                function.faults.insert(format!("{operation} {operand} through a pointer"));
            }
        }
        function
    }
}

/// The address that an instruction reads relative to itself: objdump notes it behind `#`.
fn slot(code: &str) -> Option<u64> {
    code.split_once("# ").and_then(|(_, note)| hex(note.split_whitespace().next()?))
}

/// The slots whose content a register can hold at instruction `call`: the compiler loads the address of a function
/// that is called several times once. Goes back over every way that leads there to what was last written to the
/// register; None when that is anything but a slot.
fn slots_in_register(instructions: &[(u64, &str)], call: usize, register: &str) -> Option<Vec<u64>> {
    let stem = register.trim_start_matches('r');
    let names = match stem.parse::<u32>() {
        Ok(_) => ["", "d", "w", "b"].map(|end| format!("%{register}{end}")),
        Err(_) => [format!("%r{stem}"), format!("%e{stem}"), format!("%{stem}"), format!("%{}l", &stem[..1])],
    };
    let reads_only =
        |code: &str| ["cmp", "test", "push", "bt ", "call", "j"].iter().any(|start| code.starts_with(start));
    let mut held = Vec::new();
    let mut seen = BTreeSet::new();
    let mut ways = before(instructions, call)?;
    while let Some(at) = ways.pop() {
        if !seen.insert(at) {
            continue;
        }
        let code = instructions[at].1.split('#').next().unwrap_or("").trim();
        let last_operand = code.rsplit([',', ' ']).next().unwrap_or("");
        if reads_only(code) || !names.iter().any(|name| name == last_operand) {
            ways.extend(before(instructions, at)?);
        } else {
            held.push(slot(instructions[at].1).filter(|_| code.starts_with("mov ") && code.contains("(%rip)"))?);
        }
    }
    Some(held)
}

/// The instructions that can run right before one; None for the first of the function, before which it is not known
/// what a register holds.
fn before(instructions: &[(u64, &str)], at: usize) -> Option<Vec<usize>> {
    let falls_through = |code: &str| !["jmp", "ret", "ud2", "notrack jmp"].iter().any(|end| code.starts_with(end));
    let target = |code: &str| code.starts_with('j').then(|| hex(code.split_whitespace().nth(1)?)).flatten();
    let code_at = |i: usize| instructions[i].1;
    let jumps = |wanted: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..instructions.len()).filter(|i| wanted(instructions[*i].1)).collect()
    };
    let mut found = jumps(&|code| target(code) == Some(instructions[at].0));
    found.extend((at > 0 && falls_through(instructions[at - 1].1)).then(|| at - 1));
    if found.is_empty() && (code_at(at).contains("nop") || code_at(at).starts_with("xchg %ax,%ax")) {
        return Some(found); // Padding behind a jump, which is never run.
    }
    if found.is_empty() {
        // Reached through the table of a `match`.
        found = jumps(&|code| code.contains("jmp") && code.contains('*'));
    }
    (at > 0 && !found.is_empty()).then_some(found)
}

/// Whether a jump to `*%reg` goes to an entry of a table of offsets, which the compiler makes for a `match`:
/// `movslq (%base,%index,4),%reg` and `add %base,%reg` stand before it. Its targets are inside the function.
fn is_match_table(before: &[(u64, &str)], operand: &str) -> bool {
    let Some(register) = operand.strip_prefix("*%") else { return false };
    let lines: Vec<String> =
        before.iter().rev().take(12).map(|(_, code)| code.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    let into = |line: &String| line.ends_with(&format!(",%{register}"));
    let add = lines.iter().find(|line| into(line));
    let load = lines.iter().filter(|line| into(line)).nth(1);
    add.is_some_and(|line| line.starts_with("add %"))
        && load.is_some_and(|line| line.starts_with("movslq (%") && line.contains(",4)"))
}

/// Functions that a header tags `[real-time: yes]`.
fn real_time(header: &str) -> BTreeSet<String> {
    let names = functions(header);
    let mut tagged = BTreeSet::new();
    for piece in header.split("/**").filter(|piece| piece.contains("[real-time: yes]")) {
        let code = piece.split_once("*/").map_or("", |(_, code)| code);
        tagged.extend(names.keys().filter(|name| code.contains(&format!("{name}("))).cloned());
    }
    tagged
}

#[test]
fn real_time_functions_reach_nothing_that_waits_or_panics() {
    let header = header();
    let tagged = real_time(&header);
    for step in functions(&header).keys().filter(|name| name.contains("_step")) {
        assert!(tagged.contains(step), "{step} is not tagged [real-time: yes]");
    }
    let Some(folder) = release("call_graph") else { return };
    let library = Library::read(&folder.join("libgib.so"));
    let faults: Vec<String> = tagged.iter().flat_map(|root| library.faults_from(root)).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    println!("{} real-time functions reach nothing that waits or panics", tagged.len());
}

/// Functions with one fault each, compiled as the library is.
const SEEDED: &str = r#"
use std::sync::Mutex;
#[unsafe(no_mangle)] pub extern "C" fn good(x: f64, n: u32) -> f64 {
    match n { 0 => x.sin(), 1 => x + 2.0, 2 => x.exp(), 3 => x * x, 4 => x.sqrt(), 5 => inner(x), 6 => x.tan(), _ => 0.0 }
}
#[inline(never)] fn inner(x: f64) -> f64 { x.ln() * x.cos() }
#[unsafe(no_mangle)] pub extern "C" fn good_loop(x: f64, n: u32) -> f64 {
    let mut s = x; for _ in 0..n { s = s.sin() + (s + 1.0).sin().sin(); } s
}
#[unsafe(no_mangle)] pub extern "C" fn index(i: usize) -> u8 { deep(i) }
#[inline(never)] fn deep(i: usize) -> u8 { std::hint::black_box([1u8, 2, 3])[i] }
#[unsafe(no_mangle)] pub extern "C" fn unwraps(i: u32) -> u32 { std::hint::black_box(Some(i)).unwrap() }
#[unsafe(no_mangle)] pub extern "C" fn allocates(n: usize) -> usize { std::hint::black_box(vec![1u8; n]).len() }
#[unsafe(no_mangle)] pub extern "C" fn frees(b: Box<u64>) {}
static LOCK: Mutex<u32> = Mutex::new(1);
#[unsafe(no_mangle)] pub extern "C" fn locks() -> u32 { LOCK.lock().map_or(0, |g| *g) }
#[unsafe(no_mangle)] pub extern "C" fn pointer(f: extern "C" fn() -> u32) -> u32 { f() + 1 }
#[unsafe(no_mangle)] pub extern "C" fn pointers(mut x: f64, n: u32, f: extern "C" fn(f64) -> f64) -> f64 {
    for _ in 0..n { x = f(f(x)) + x.sin().sin() } x
}
#[unsafe(no_mangle)] pub extern "C" fn tail(f: extern "C" fn() -> u32) -> u32 { f() }
#[unsafe(no_mangle)] pub extern "C" fn clock() -> u64 { unsafe { std::arch::x86_64::_rdtsc() } }
#[unsafe(no_mangle)] pub extern "C" fn waits() -> i32 { unsafe { sched_yield() } }
unsafe extern "C" { fn sched_yield() -> i32; }
#[unsafe(no_mangle)] pub extern "C" fn calls_itself(n: u32) -> u32 {
    if std::hint::black_box(n) < 2 { n } else { calls_itself(n - 1) ^ calls_itself(n - 2) }
}
"#;

#[test]
fn seeded_faults_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let (source, library) = (folder.path().join("seeded.rs"), folder.path().join("libseeded.so"));
    fs::write(&source, SEEDED).unwrap();
    let rustc = option_env!("RUSTC").unwrap_or("rustc");
    let flags = "--edition 2024 --crate-type cdylib -C opt-level=3 -C codegen-units=1 -A warnings -o";
    run(command(&format!("{rustc} {flags}")).arg(&library).arg(&source)).unwrap();
    let library = Library::read(&library);
    for root in ["good", "good_loop"] {
        assert_eq!(library.faults_from(root), Vec::<String>::new());
    }
    assert!(!library.faults_from("gone").is_empty());
    for (root, wanted) in [
        ("index", "panic"),
        ("unwraps", "unwrap_failed"),
        ("allocates", "not in real time"),
        ("frees", "__rust"),
        ("locks", "not in real time"),
        ("pointer", "through a pointer"),
        ("pointers", "through a pointer"),
        ("tail", "through a pointer"),
        ("clock", "rdtsc"),
        ("waits", "imports sched_yield"),
        ("calls_itself", "recursion"),
    ] {
        let faults = library.faults_from(root);
        assert!(faults.iter().any(|fault| fault.contains(wanted)), "{root}: {faults:?}");
    }
}

/// Padding between a jump and its neighbour's target, in a function with the table of a `match`, leads from nowhere; an
/// instruction there that does something may be an entry of the table.
#[test]
fn padding_leads_nowhere() {
    let code = |padding| {
        [
            (0x10, "jmp *%rcx"),
            (0x12, "dec %r13d"),
            (0x14, "mov 0x88(%rip),%r13        # a0 <slot>"),
            (0x1b, "jmp 22 <f>"),
            (0x1d, padding),
            (0x22, "call *%r13"),
        ]
    };
    assert_eq!(slots_in_register(&code("nopl 0x0(%rax,%rax,1)"), 5, "r13"), Some(vec![0xa0]));
    assert_eq!(slots_in_register(&code("inc %eax"), 5, "r13"), None);
}

#[test]
fn tags_are_read() {
    let header = "/** a [real-time: yes] */\nint gib_a(int x);\n/** b [real-time: no] */\nint gib_b(void);\n";
    assert_eq!(real_time(header), BTreeSet::from(["gib_a".to_string()]));
}
