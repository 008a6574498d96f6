/*
 * What the tests against all who mean it ill share: random runs, most the same every time, so that what a change breaks is found at once
 * and again, some fresh, with a seed that is printed; and seeded mistakes, each of which must break its law.
 *
 * All laws but one hold in every run. That a value is right is known from statistics: of a stated number of runs one may come to a value
 * that is off, and one more may in any number.
 */
#ifndef ADVERSARY_TEST_H
#define ADVERSARY_TEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "fewer.h"

/* What came of all runs together. */
typedef struct {
    int met;                    /* troubles */
    int ended;                  /* measurements that ended well */
    int clean, clean_refused;   /* that met no trouble; of these without a value */
    int values, held;           /* of those: values, and how many are as right as they say */
} adversary_tally;

typedef struct {
    uint64_t known_seed;
    int known_runs, fresh_runs;
    /* Of a known run: least troubles met, measurements ended well and those without trouble. */
    double least_met, least_ended, least_clean;
    /* The law that is known from statistics, NULL for none; one value may be off in so many runs. Of the values without trouble from
     * and to so many % must be as right as they say, and of those measurements so many % at most may be refused. */
    const char *right;
    int runs_a_wrong;
    int held_from, held_to, most_refused;
    /* Mistakes 1 to mistakes − 1, and the law that each must break in `least` of so many runs. */
    int mistakes, mistaken_runs, least;
    const char *const *laws;
    /* Makes a run, without a mistake (0) or with one; returns the first law that it broke, or NULL. */
    const char *(*run)(uint64_t seed, int mistake);
    /* Adds the last run to a tally; says what went wrong in it. */
    void (*count)(adversary_tally *tally);
    void (*describe)(void);
} adversary_test;

/* What main returns. The command line may be SEED [RUNS]: only fresh runs then, on these. A run by itself: the SEED printed for it, 1. */
int adversary_test_main(int argc, char **argv, const adversary_test *test);

#endif
