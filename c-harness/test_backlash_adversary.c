/*
 * Lost motion against somebody who means it ill: random axes, configurations and troubles, see backlash_adversary.h. Most runs are the
 * same every time; some are fresh, with a seed that is printed. Only those of one seed: test_backlash_adversary SEED [RUNS]. A run by
 * itself: SEED as printed for it, 1.
 */
#include "backlash_adversary.h"
#include "fresh_runs.h"

#include <math.h>
#include <string.h>

enum { KNOWN_SEED = 20260500, KNOWN_RUNS = 150, FRESH_RUNS = 10 };

static fresh_runs fresh = {.runs = FRESH_RUNS};
static backlash_adversary a;

static void describe(uint64_t seed)
{
    const gib_backlash_report *r = &a.report[a.run];
    print_message("seed %llu: %s, run %d, cycle %d (named in %d), cycle %g ms, mode %d: %s; found %.2f um +- %.2f of %.2f\n", (unsigned long long)seed,
                  a.broken, a.run + 1, a.broken_at, a.named, 1e3 * a.config.cycle_s, (int)a.config.mode, gib_status_text(a.status[a.run]),
                  r->mean.lost_motion_um, r->mean.uncertainty_um, a.truth_um);
    for (int i = 0; i < a.troubles; i++) {
        const backlash_trouble *t = &a.trouble[i];
        print_message("    %s %.2f in cycle %d for %d%s\n", backlash_trouble_names[t->kind], t->size, t->at, t->lasts, t->begun ? "" : ": not met");
    }
}

/* What came of all runs together. */
typedef struct {
    int broken, met, done, clean, clean_refused, held;
} tally;

static tally count(uint64_t seed, int runs)
{
    tally t = {0};
    for (int i = 0; i < runs; i++) {
        backlash_adversary_init(&a, seed + (uint64_t)i, BACKLASH_NO_MISTAKE);
        backlash_adversary_run(&a);
        for (int k = 0; k < a.troubles; k++) {
            t.met += a.trouble[k].begun;
        }
        for (int run = 0; run <= a.run; run++) {
            int clean = backlash_adversary_clean(&a, run), value = a.status[run] == GIB_DONE;
            const gib_backlash_estimate *found = &a.report[run].mean;
            t.done += value;
            t.clean += clean;
            t.clean_refused += clean && !value;
            t.held += clean && value && fabs(found->lost_motion_um - a.truth_um) <= found->uncertainty_um;
            if (clean && !value) print_message("seed %llu run %d refused: %s\n", (unsigned long long)seed + i, run + 1, gib_status_text(a.status[run]));
        }
        t.broken += a.broken != NULL;
        if (a.broken) {
            describe(seed + (uint64_t)i);
        }
    }
    print_message("seed %llu: %d runs of two measurements, %d troubles met, %d came to a value, %d broke a law; "
                  "without trouble %d, %d of them refused, %.1f %% of the intervals hold\n",
                  (unsigned long long)seed, runs, t.met, t.done, t.broken, t.clean, t.clean_refused, 100.0 * t.held / (t.clean - t.clean_refused));
    return t;
}

static void every_law_holds_in_known_runs(void **state)
{
    (void)state;
    tally t = count(KNOWN_SEED, KNOWN_RUNS);
    assert_int_equal(t.broken, 0);
    assert_true(t.clean >= KNOWN_RUNS / 2 && t.met >= KNOWN_RUNS / 2);
}

static void every_law_holds_in_fresh_runs(void **state)
{
    (void)state;
    assert_int_equal(count(fresh.seed, fresh.runs).broken, 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_law_holds_in_known_runs),
        cmocka_unit_test(every_law_holds_in_fresh_runs),
    };
    return fresh_runs_main(argc, argv, &fresh, tests, sizeof tests / sizeof *tests);
}
