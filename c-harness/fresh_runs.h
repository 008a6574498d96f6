/*
 * Tests by runs that are random: most are the same every time, so that what a change breaks is found at once and again; some are
 * fresh, with a seed that the test prints.
 */
#ifndef FRESH_RUNS_H
#define FRESH_RUNS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* Runs of a test that has many: with clang, and so under its sanitizers, a fifth, since the library is the same and they are slower. */
#ifdef __clang__
#define FEWER(runs) ((runs) / 5)
#else
#define FEWER(runs) (runs)
#endif

typedef struct {
    uint64_t seed; /* of the first fresh run; the next has one more */
    int runs;
} fresh_runs;

/* Runs all of `count` tests on a seed made from the time, or, where the command line is SEED [RUNS], only the last, which is that of
 * the fresh runs, on these. Returns what main returns. */
int fresh_runs_main(int argc, char **argv, fresh_runs *fresh, const struct CMUnitTest *tests, size_t count);

/* Laws that can fail: each mistake from 1 on, put in on purpose, must break its law in `least` or more of so many runs from that seed on.
 * `broken_by` makes one run with a mistake and returns the first law that it broke, or NULL. */
void fresh_runs_mistakes(const char *(*broken_by)(int mistake, uint64_t seed), const char *const laws[], int mistakes, uint64_t seed,
                         int runs, int least);

#endif
