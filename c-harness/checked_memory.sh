#!/bin/sh
# The harness under AddressSanitizer and UBSan, library included, and under valgrind's memcheck.
#
#   checked_memory.sh library                builds the library for the next, if it can
#   checked_memory.sh sanitizers TEST...     names of test programs, without .c; HELPERS: names of what they share; 3 where it cannot
#   checked_memory.sh memcheck PROGRAM...    programs that are built already
#   checked_memory.sh sanitized TEST         one test of the first, which calls itself so, several at a time
#
# A fault put in on purpose must be caught first; then the programs must be clean. A tool that is not here is named.
set -eu
cd "$(dirname "$0")"
root=$(cd .. && pwd)
out=$root/build/harness/checked
kind=$1
shift
mkdir -p "$out"

skip() {
    test "$kind" = library || echo "checked_memory: $kind skipped, $1"
    test "$kind" != sanitizers || exit 3
    exit 0
}

# caught COMMAND...: it must fail
caught() {
    if "$@" >"$out/$kind-seed.log" 2>&1; then
        echo "checked_memory: not caught: $*" >&2
        exit 1
    fi
}

# clean COMMAND...: it must not fail; what it says is shown when it does
clean() {
    log=$out/$kind-$(basename "$1").log
    "$@" >"$log" 2>&1 || { tail -n 40 "$log" >&2; echo "checked_memory: failed: $*" >&2; exit 1; }
}

if [ "$kind" = memcheck ]; then
    command -v valgrind >/dev/null || skip "no valgrind"
    memcheck="valgrind -q --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite"
    gcc -std=c11 -g -I../include seeded_memory_fault.c "$root/build/lib/libgib.a" -lm -lpthread -ldl -o "$out/seeded"
    clean "$out/seeded" overread # nothing but the tool notices
    caught $memcheck "$out/seeded" overread
    clean $memcheck "$out/seeded" none
    for program; do
        clean $memcheck "$program"
        echo "memcheck: $(basename "$program") clean"
    done
    exit 0
fi

target=x86_64-unknown-linux-gnu
flags="-std=c11 -D_GNU_SOURCE -O1 -g -I../include -fsanitize=address,undefined -fno-sanitize-recover=all"
library=$root/build/asan/$target/release/libgib.a
build() { clang $flags "$1.c" "$out/helpers.a" "$library" -lcmocka -lm -lpthread -ldl -o "$out/$1"; }
if [ "$kind" = sanitized ]; then
    build "$1"
    clean "$out/$1"
    echo "sanitizers: $1 clean"
    exit 0
fi

[ $# -gt 0 ] || [ "$kind" = library ] || skip "no tests"
command -v clang >/dev/null || skip "no clang"
[ "$(uname -sm)" = "Linux x86_64" ] || skip "set up for Linux on x86_64 only"
echo 'int main(void) { return 0; }' >"$out/empty.c"
clang $flags "$out/empty.c" -o "$out/empty" 2>/dev/null || skip "clang has no sanitizers (libclang-rt-dev)"

# Only the library, and only what changed since the last time. The switch is for compilers of developers, hence the
# variable that says so; a compiler that still refuses it is named.
if ! RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=address -Cdebug-assertions=on -Coverflow-checks=on" \
    CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_TARGET_DIR="$root/build/asan" ${CARGO:-cargo} build -q \
    --manifest-path "$root/Cargo.toml" --lib --release --target $target 2>"$out/cargo.log"; then
    grep -q 'sanitizer' "$out/cargo.log" && skip "the Rust compiler has no sanitizers"
    cat "$out/cargo.log" >&2
    exit 1
fi
[ "$kind" = sanitizers ] || exit 0
rm -f "$out/helpers.a"
for helper in $HELPERS; do
    clang $flags -c "$helper.c" -o "$out/$helper.o"
    ar rcs "$out/helpers.a" "$out/$helper.o"
done

build seeded_memory_fault
caught "$out/seeded_memory_fault" overread
grep -q 'AddressSanitizer: heap-buffer-overflow' "$out/$kind-seed.log"
caught "$out/seeded_memory_fault" undefined
grep -q 'signed integer overflow' "$out/$kind-seed.log"
clean "$out/seeded_memory_fault" none
printf '%s\n' "$@" | xargs -n 1 -P "$(nproc)" "./$(basename "$0")" sanitized
