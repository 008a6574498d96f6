/*
 * Calibration against somebody who means it ill: random machines, configurations and troubles, see calibration_adversary.h. Most runs
 * are the same every time; some are fresh, with a seed that is printed. Only those of one seed: test_calibration_adversary SEED [RUNS].
 * A run by itself: SEED as printed for it, 1.
 */
#include "calibration_adversary.h"
#include "fresh_runs.h"

#include <string.h>

enum { KNOWN_SEED = 20260700, KNOWN_RUNS = FEWER(800), FRESH_RUNS = 20, MISTAKEN = FEWER(100) };

static fresh_runs fresh = {.runs = FRESH_RUNS};
static calibration_adversary a;

static void describe(uint64_t seed)
{
    const gib_calibration_point *q = &a.table[a.run].point[0];
    print_message("seed %llu: %s, run %d, cycle %d (named in %d), cycle %g ms, phase %d: %s; gains %.3f %.3f +- %.3f %.3f of %.3f %.3f\n",
                  (unsigned long long)seed, a.broken, a.run + 1, a.broken_at, a.named, 1e3 * a.config.cycle_s, a.out.phase,
                  gib_status_text(a.status[a.run]), q->gain_ratio[0], q->gain_ratio[1], q->gain_uncertainty_ratio[0],
                  q->gain_uncertainty_ratio[1], 1.0 / a.gain[0], 1.0 / a.gain[1]);
    troubles_print(&a.troubles, calibration_trouble_names);
}

static const char RIGHT[] = "a gain that is right, or refused";

/* What came of all runs together. */
typedef struct {
    int broken, wrong, met, done, clean, clean_refused, held, known;
} tally;

static tally count(uint64_t seed, int runs)
{
    tally t = {0};
    for (int i = 0; i < runs; i++) {
        calibration_adversary_init(&a, seed + (uint64_t)i, CALIBRATION_NO_MISTAKE);
        calibration_adversary_run(&a);
        t.met += troubles_met(&a.troubles);
        for (int run = 0; run <= a.run; run++) {
            int clean = calibration_adversary_clean(&a, run);
            t.done += a.status[run] == GIB_DONE;
            t.clean += clean;
            t.clean_refused += clean && a.status[run] != GIB_DONE;
            t.held += clean ? a.held[run] : 0;
            t.known += clean ? a.known[run] : 0;
        }
        int wrong = a.broken && strcmp(a.broken, RIGHT) == 0;
        t.wrong += wrong;
        t.broken += a.broken && !wrong;
        if (a.broken) {
            describe(seed + (uint64_t)i);
        }
    }
    print_message("seed %llu: %d runs of two calibrations, %d troubles met, %d ended well, %d broke a law, %d were off; "
                  "without trouble %d, %d of them refused, %.1f %% of %d gains hold\n",
                  (unsigned long long)seed, runs, t.met, t.done, t.broken, t.wrong, t.clean, t.clean_refused, 100.0 * t.held / t.known, t.known);
    return t;
}

static int every_law_holds(const tally *t, int runs)
{
    return t->broken == 0 && t->wrong <= 1 + runs / 100;
}

static void every_law_holds_in_known_runs(void **state)
{
    (void)state;
    tally t = count(KNOWN_SEED, KNOWN_RUNS);
    assert_true(every_law_holds(&t, KNOWN_RUNS));
    assert_true(t.clean >= KNOWN_RUNS && t.met >= KNOWN_RUNS / 2);
    assert_true(100 * t.held >= 90 * t.known && 100 * t.held <= 99 * t.known && 25 * t.clean_refused <= t.clean);
}

static void every_law_holds_in_fresh_runs(void **state)
{
    (void)state;
    tally t = count(fresh.seed, fresh.runs);
    assert_true(every_law_holds(&t, fresh.runs));
}

static const char *broken_by(int mistake, uint64_t seed)
{
    calibration_adversary_init(&a, seed, (calibration_mistake)mistake);
    calibration_adversary_run(&a);
    return a.broken;
}

/* The laws can fail: each of these mistakes, put in on purpose, breaks the one that is about it. */
static void mistakes_break_laws(void **state)
{
    (void)state;
    static const char *const LAWS[CALIBRATION_MISTAKES] = {
        [CALIBRATION_JUMPS] = "a command within the speed",
        [CALIBRATION_TOO_FAR] = "a command within the stroke",
        [CALIBRATION_NO_NUMBER] = "a command that is a number",
        [CALIBRATION_SAYS_NOTHING] = "a fault in its cycle",
        [CALIBRATION_NEVER_ENDS] = "a state that ends in time",
        [CALIBRATION_NO_DOUBT] = "a gain with an uncertainty",
        [CALIBRATION_OFF] = RIGHT,
        [CALIBRATION_REMEMBERS] = "the same inputs, the same outputs",
    };
    fresh_runs_mistakes(broken_by, LAWS, CALIBRATION_MISTAKES, KNOWN_SEED, MISTAKEN, 3);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_law_holds_in_known_runs),
        cmocka_unit_test(mistakes_break_laws),
        cmocka_unit_test(every_law_holds_in_fresh_runs),
    };
    return fresh_runs_main(argc, argv, &fresh, tests, sizeof tests / sizeof *tests);
}
