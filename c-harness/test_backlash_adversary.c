/*
 * Lost motion against somebody who means it ill: random axes, configurations and troubles, see backlash_adversary.h and
 * adversary_test.h.
 *
 * One value in five hundred is off by more than three times what it said, where a probe of a few micrometres mistook the motor's
 * friction: ten fresh runs of two measurements then fail by chance less than once in a thousand times.
 */
#include "adversary_test.h"
#include "backlash_adversary.h"

#include <math.h>

static backlash_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    backlash_adversary_init(&a, seed, (backlash_mistake)mistake);
    backlash_adversary_run(&a);
    return a.base.broken;
}

static void describe(void)
{
    const gib_backlash_report *r = &a.report[a.base.run];
    print_message("run %d, cycle %d (named in %d), cycle %g ms, mode %d: %s; found %.2f um +- %.2f of %.2f\n", a.base.run + 1,
                  a.base.broken_at, a.named, 1e3 * a.config.cycle_s, (int)a.config.mode, gib_status_text(a.status[a.base.run]),
                  r->mean.lost_motion_um, r->mean.uncertainty_um, a.truth_um);
    troubles_print(&a.base.troubles, backlash_trouble_names);
}

static void count(adversary_tally *t)
{
    t->met += troubles_met(&a.base.troubles);
    for (int run = 0; run <= a.base.run; run++) {
        int clean = backlash_adversary_clean(&a, run), value = a.status[run] == GIB_DONE;
        const gib_backlash_estimate *found = &a.report[run].mean;
        t->ended += value;
        t->clean += clean;
        t->clean_refused += clean && !value;
        t->values += clean && value;
        t->held += clean && value && fabs(found->lost_motion_um - a.truth_um) <= found->uncertainty_um;
    }
}

static const char RIGHT[] = "a value that is right, or refused";

static const char *const LAWS[BACKLASH_MISTAKES] = {
    [BACKLASH_JUMPS] = "a command without a jump",
    [BACKLASH_NO_NUMBER] = "a command that is a number",
    [BACKLASH_SAYS_NOTHING] = "a fault in its cycle",
    [BACKLASH_NEVER_ENDS] = "an end in time",
    [BACKLASH_KEEPS] = "what was changed is put back",
    [BACKLASH_OFF] = RIGHT,
    [BACKLASH_FORGETS] = "an end that lets go",
    [BACKLASH_REMEMBERS] = "nothing left behind",
};

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20260500, .known_runs = FEWER(150), .fresh_runs = 10,
        .least_met = 0.5, .least_ended = 0.5, .least_clean = 1.0,
        .right = RIGHT, .runs_a_wrong = 250, .held_from = 92, .held_to = 100, .most_refused = 5,
        .mistakes = BACKLASH_MISTAKES, .mistaken_runs = 100, .least = 3, .laws = LAWS,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
