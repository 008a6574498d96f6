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

typedef struct {
    uint64_t seed; /* of the first fresh run; the next has one more */
    int runs;
} fresh_runs;

/* Runs all of `count` tests on a seed made from the time, or, where the command line is SEED [RUNS], only the last, which is that of
 * the fresh runs, on these. Returns what main returns. */
int fresh_runs_main(int argc, char **argv, fresh_runs *fresh, const struct CMUnitTest *tests, size_t count);

#endif
