/*
 * Tilt against somebody who means it ill: random machines, configurations and troubles, see tilt_adversary.h and adversary_test.h.
 *
 * One in eight hundred runs comes to a value that is off, most by a load that was saturated, missing or scaled for a part of the path.
 */
#include "adversary_test.h"
#include "tilt_adversary.h"

static tilt_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    tilt_adversary_init(&a, seed, (tilt_mistake)mistake);
    tilt_adversary_run(&a);
    return a.base.broken;
}

static void describe(void)
{
    const gib_tilt_report *r = &a.report[a.base.run];
    print_message("run %d, cycle %d (named in %d), cycle %g ms, phase %d: %s (%s %g); found %.4f deg +- %.4f of %.4f, x %.4f y %.4f of "
                  "%.4f %.4f, passes %d %s, left %.4f\n",
                  a.base.run + 1, a.base.broken_at, a.named, 1e3 * a.config.cycle_s, a.out.phase, gib_status_text(a.status[a.base.run]),
                  a.detail[a.base.run].field ? a.detail[a.base.run].field : "", a.detail[a.base.run].value, r->tilt_deg, r->uncertainty_deg,
                  tilt_adversary_truth(&a, a.base.run, -1), r->about_x_deg, r->about_y_deg, tilt_adversary_truth(&a, a.base.run, 0),
                  tilt_adversary_truth(&a, a.base.run, 1), a.passes, a.config.method ? "two points" : "", a.left_mm[a.base.run]);
    troubles_print(&a.base.troubles, tilt_trouble_names);
}

static int found(const gib_tilt_report *r)
{
    return r->decision != GIB_TILT_UNDECIDED && r->decision != GIB_TILT_TAUGHT;
}

static void count(adversary_tally *t)
{
    t->met += troubles_met(&a.base.troubles);
    for (int run = 0; run <= a.base.run; run++) {
        const gib_tilt_report *r = &a.report[run];
        int clean = tilt_adversary_clean(&a, run), value = found(r);
        t->ended += a.status[run] == GIB_DONE;
        t->clean += clean;
        t->clean_refused += clean && a.status[run] != GIB_DONE && a.status[run] != GIB_ERR_TILT_SIZE;
        for (int axis = 0; clean && value && axis < 2; axis++) {
            double said = axis ? r->about_y_uncertainty_deg : r->about_x_uncertainty_deg, is = axis ? r->about_y_deg : r->about_x_deg;
            t->values += said < 90.0;
            t->held += said < 90.0 && fabs(is - tilt_adversary_truth(&a, run, axis)) <= said;
        }
    }
}

static const char RIGHT[] = "a value that is right, or refused";

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

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20260600, .known_runs = FEWER(1000), .fresh_runs = 20,
        .least_met = 0.5, .least_ended = 0.5, .least_clean = 1.0,
        .right = RIGHT, .runs_a_wrong = 300, .held_from = 93, .held_to = 99, .most_refused = 2,
        .mistakes = TILT_MISTAKES, .mistaken_runs = FEWER(200), .least = 3, .laws = LAWS,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
