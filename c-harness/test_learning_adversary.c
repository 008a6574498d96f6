/*
 * Learning against somebody who means it ill: random servos, configurations and troubles, see learning_adversary.h and
 * adversary_test.h.
 */
#include "adversary_test.h"
#include "learning_adversary.h"

static learning_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    learning_adversary_init(&a, seed, (learning_mistake)mistake);
    learning_adversary_run(&a);
    return a.base.broken;
}

static void describe(void)
{
    const gib_learning_report *r = &a.report[a.base.run];
    print_message("run %d, cycle %d, %s, %.3g cycles of %.3g ms a turn, phase %d: %s; %.3g um at first, %.3g in the end, tolerance %.3g, "
                  "%d updates\n",
                  a.base.run + 1, a.base.broken_at, a.config.method ? "published" : "filtered", a.turn_cycles, 1e3 * a.config.cycle_s,
                  a.out.phase, gib_status_text(a.out.message), a.first[a.base.run], a.last[a.base.run], a.config.tolerance_um, r->updates);
    troubles_print(&a.base.troubles, learning_trouble_names);
}

static void count(adversary_tally *t)
{
    t->met += troubles_met(&a.base.troubles);
    for (int run = 0; run <= a.base.run; run++) {
        int clean = learning_adversary_clean(&a, run), done = a.status[run] == GIB_DONE;
        t->ended += done;
        t->clean += clean;
        t->values += clean && a.config.method == GIB_LEARNING_FILTERED;
        t->held += clean && a.config.method == GIB_LEARNING_FILTERED && (done || a.last[run] < 0.5 * a.first[run]);
    }
}

static const char RIGHT[] = "what was learnt kept, no worse, and as good as it says";

static const char *const LAWS[LEARNING_MISTAKES] = {
    [LEARNING_LEAPS] = "a correction within its speed",
    [LEARNING_TOO_FAR] = "a correction within its bound",
    [LEARNING_NO_NUMBER] = "a command that is a number",
    [LEARNING_OF_ANOTHER] = "a command made of target and correction",
    [LEARNING_SAYS_NOTHING] = "a fault in its cycle",
    [LEARNING_STAYS] = "no correction after a fault",
    [LEARNING_NEVER_ENDS] = "a state that ends in time",
    [LEARNING_TURNED_ROUND] = RIGHT,
    [LEARNING_REMEMBERS] = "the same inputs, the same outputs",
};

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20261200, .known_runs = FEWER(400), .fresh_runs = 20,
        .least_met = 0.5, .least_ended = 0.2, .least_clean = 1.0,
        .right = RIGHT, .runs_a_wrong = 500, .held_from = 30, .held_to = 90, .most_refused = 4,
        .mistakes = LEARNING_MISTAKES, .mistaken_runs = FEWER(100), .least = 2, .laws = LAWS,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
