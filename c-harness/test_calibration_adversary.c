/*
 * Calibration against somebody who means it ill: random machines, configurations and troubles, see calibration_adversary.h and
 * adversary_test.h.
 */
#include "adversary_test.h"
#include "calibration_adversary.h"

static calibration_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    calibration_adversary_init(&a, seed, (calibration_mistake)mistake);
    calibration_adversary_run(&a);
    return a.base.broken;
}

static void describe(void)
{
    const gib_calibration_point *q = &a.table[a.base.run].point[0];
    print_message("run %d, cycle %d (named in %d), cycle %g ms, phase %d: %s; gains %.3f %.3f +- %.3f %.3f of %.3f %.3f\n", a.base.run + 1,
                  a.base.broken_at, a.named, 1e3 * a.config.cycle_s, a.out.phase, gib_status_text(a.status[a.base.run]), q->gain_ratio[0],
                  q->gain_ratio[1], q->gain_uncertainty_ratio[0], q->gain_uncertainty_ratio[1], 1.0 / a.gain[0], 1.0 / a.gain[1]);
    troubles_print(&a.base.troubles, calibration_trouble_names);
}

static void count(adversary_tally *t)
{
    t->met += troubles_met(&a.base.troubles);
    for (int run = 0; run <= a.base.run; run++) {
        int clean = calibration_adversary_clean(&a, run);
        t->ended += a.status[run] == GIB_DONE;
        t->clean += clean;
        t->clean_refused += clean && a.status[run] != GIB_DONE;
        t->values += clean ? a.known[run] : 0;
        t->held += clean ? a.held[run] : 0;
    }
}

static const char RIGHT[] = "a gain that is right, or refused";

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

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20260700, .known_runs = FEWER(800), .fresh_runs = 20,
        .least_met = 0.5, .least_ended = 0.5, .least_clean = 1.0,
        .right = RIGHT, .runs_a_wrong = 100, .held_from = 90, .held_to = 99, .most_refused = 4,
        .mistakes = CALIBRATION_MISTAKES, .mistaken_runs = FEWER(100), .least = 3, .laws = LAWS,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
