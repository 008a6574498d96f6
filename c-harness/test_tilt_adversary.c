/*
 * Tilt against somebody who means it ill: random machines, configurations and troubles, see tilt_adversary.h. Most runs are the same
 * every time; some are fresh, with a seed that is printed. Only those of one seed: test_tilt_adversary SEED [RUNS]. A run by itself:
 * SEED as printed for it, 1.
 *
 * All laws but one hold in every run. That a value is right is known from statistics: one in six hundred runs comes to one that is off,
 * most by a load that was stuck, late or saturated for a part of the path. So one wrong value is allowed, and one more in 200 runs.
 */
#include "fresh_runs.h"
#include "tilt_adversary.h"

#include <string.h>

enum { KNOWN_SEED = 20260600, KNOWN_RUNS = FEWER(1000), FRESH_RUNS = 20, MISTAKEN = FEWER(200) };

static fresh_runs fresh = {.runs = FRESH_RUNS};
static tilt_adversary a;

static void describe(uint64_t seed)
{
    const gib_tilt_report *r = &a.report[a.run];
    print_message("seed %llu: %s, run %d, cycle %d (named in %d), cycle %g ms, phase %d: %s (%s %g); found %.4f deg +- %.4f of %.4f, x %.4f y %.4f of %.4f %.4f, passes %d %s, left %.4f\n",
                  (unsigned long long)seed, a.broken, a.run + 1, a.broken_at, a.named, 1e3 * a.config.cycle_s, a.out.phase,
                  gib_status_text(a.status[a.run]), a.detail[a.run].field ? a.detail[a.run].field : "", a.detail[a.run].value, r->tilt_deg,
                  r->uncertainty_deg, tilt_adversary_truth(&a, a.run, -1), r->about_x_deg, r->about_y_deg, tilt_adversary_truth(&a, a.run, 0),
                  tilt_adversary_truth(&a, a.run, 1), a.passes, a.config.method ? "two points" : "", a.left_mm[a.run]);
    troubles_print(&a.troubles, tilt_trouble_names);
}

static const char RIGHT[] = "a value that is right, or refused";

/* What came of all runs together. */
typedef struct {
    int broken, wrong, met, done, clean, clean_refused, held, values;
} tally;

static int found(const gib_tilt_report *r)
{
    return r->decision != GIB_TILT_UNDECIDED && r->decision != GIB_TILT_TAUGHT;
}

static tally count(uint64_t seed, int runs)
{
    tally t = {0};
    for (int i = 0; i < runs; i++) {
        tilt_adversary_init(&a, seed + (uint64_t)i, TILT_NO_MISTAKE);
        tilt_adversary_run(&a);
        t.met += troubles_met(&a.troubles);
        for (int run = 0; run <= a.run; run++) {
            const gib_tilt_report *r = &a.report[run];
            int clean = tilt_adversary_clean(&a, run), value = found(r);
            t.done += a.status[run] == GIB_DONE;
            t.clean += clean;
            t.clean_refused += clean && a.status[run] != GIB_DONE && a.status[run] != GIB_ERR_TILT_SIZE;
            for (int axis = 0; clean && value && axis < 2; axis++) {
                double said = axis ? r->about_y_uncertainty_deg : r->about_x_uncertainty_deg, is = axis ? r->about_y_deg : r->about_x_deg;
                t.values += said < 90.0;
                t.held += said < 90.0 && fabs(is - tilt_adversary_truth(&a, run, axis)) <= said;
            }
        }
        int wrong = a.broken && strcmp(a.broken, RIGHT) == 0;
        t.wrong += wrong;
        t.broken += a.broken && !wrong;
        if (a.broken) {
            describe(seed + (uint64_t)i);
        }
    }
    print_message("seed %llu: %d runs of two measurements, %d troubles met, %d ended well, %d broke a law, %d were off; "
                  "without trouble %d, %d of them refused, %.1f %% of %d intervals hold\n",
                  (unsigned long long)seed, runs, t.met, t.done, t.broken, t.wrong, t.clean, t.clean_refused, 100.0 * t.held / t.values, t.values);
    return t;
}

static int every_law_holds(const tally *t, int runs)
{
    return t->broken == 0 && t->wrong <= 1 + runs / 200;
}

static void every_law_holds_in_known_runs(void **state)
{
    (void)state;
    tally t = count(KNOWN_SEED, KNOWN_RUNS);
    assert_true(every_law_holds(&t, KNOWN_RUNS));
    assert_true(t.clean >= KNOWN_RUNS && t.met >= KNOWN_RUNS / 2);
    assert_true(100 * t.held >= 93 * t.values && 100 * t.held <= 99 * t.values);
    assert_true(50 * t.clean_refused <= t.clean);
}

static void every_law_holds_in_fresh_runs(void **state)
{
    (void)state;
    tally t = count(fresh.seed, fresh.runs);
    assert_true(every_law_holds(&t, fresh.runs));
}

static const char *broken_by(int mistake, uint64_t seed)
{
    tilt_adversary_init(&a, seed, (tilt_mistake)mistake);
    tilt_adversary_run(&a);
    return a.broken;
}

/* The laws can fail: each of these mistakes, put in on purpose, breaks the one that is about it. */
static void mistakes_break_laws(void **state)
{
    (void)state;
    static const char *const LAWS[TILT_MISTAKES] = {
        [TILT_JUMPS] = "an offset accelerates too much",
        [TILT_TOO_FAR] = "an offset is too large",
        [TILT_NO_NUMBER] = "an offset is no number",
        [TILT_ASKS_NOBODY] = "an offset before it was accepted",
        [TILT_SAYS_NOTHING] = "a fault in its cycle",
        [TILT_NEVER_ENDS] = "a state that ends in time",
        [TILT_KEEPS] = "offsets left behind",
        [TILT_NO_DOUBT] = "a value with an uncertainty",
        [TILT_OFF] = RIGHT,
        [TILT_WRONG_WAY] = "offsets that undo what was found",
        [TILT_REMEMBERS] = "the same inputs, the same outputs",
    };
    fresh_runs_mistakes(broken_by, LAWS, TILT_MISTAKES, KNOWN_SEED, MISTAKEN, 3);
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
