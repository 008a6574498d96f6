#!/bin/sh
# That `counts` fails when it should: on counts put in on purpose it must accept the good and refuse the others.
set -eu
cd "$(dirname "$0")"

# try OUTCOME WHAT IDLE MOVING EVALUATE
try() {
    outcome=accepted
    printf 'idle\t%s\nscan\t%s\nevaluate\t%s\n' "$3" "$4" "$5" |
        ./counts - gib_backlash_step backlash.bands >/dev/null || outcome=refused
    [ "$outcome" = "$1" ] || { echo "test_counts: $2: $outcome, $1 was due" >&2; exit 1; }
}
try accepted 'plausible counts' 20 100 900
try refused 'idle too dear' 26 100 900
try refused 'idle suspiciously cheap' 9 100 900
try refused 'moving too dear' 20 121 900
try refused 'moving suspiciously cheap' 20 59 900
try refused 'a step over the bound' 20 100 1501
try refused 'no step of any size' 20 100 100
if printf 'idle\t20\n' | ./counts - gib_backlash_step backlash.bands >/dev/null; then
    echo "test_counts: phases that never ran were accepted" >&2
    exit 1
fi
if ./counts - gib_backlash_step backlash.bands </dev/null >/dev/null; then
    echo "test_counts: no counts at all were accepted" >&2
    exit 1
fi
echo "test_counts: the bands refuse what they should"
