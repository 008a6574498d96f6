/*
 * Corrected positions against somebody who means it ill: random machines, configurations and troubles, see vibration_adversary.h and
 * adversary_test.h.
 */
#include "adversary_test.h"
#include "vibration_adversary.h"

static vibration_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    vibration_adversary_init(&a, seed, (vibration_mistake)mistake);
    vibration_adversary_run(&a);
    return a.base.broken;
}

static void describe(void)
{
    print_message("run %d, cycle %d of %d, %s, %.3g cycles of %.3g ms a turn, %d harmonics, fade %.3g turns, phase %d: %s; %.3g of %.3g um "
                  "left, noise %.3g, worst %.3g\n",
                  a.base.run + 1, a.base.broken_at, a.cycles, a.config.method ? "integrated" : "harmonic", a.turn_cycles,
                  1e3 * a.config.cycle_s, a.form, a.config.fade_s / a.config.cycle_s / a.turn_cycles, a.out.phase,
                  gib_status_text(a.out.message), a.left[a.base.run], a.without[a.base.run], a.floor_um[a.base.run], a.worst);
    troubles_print(&a.base.troubles, vibration_trouble_names);
}

static void count(adversary_tally *t)
{
    t->met += troubles_met(&a.base.troubles);
    for (int run = 0; run <= a.base.run; run++) {
        int clean = vibration_adversary_clean(&a, run);
        t->ended += a.status[run] == GIB_BUSY;
        t->clean += clean;
        t->values += clean && a.config.method == GIB_VIBRATION_HARMONIC;
        t->held += clean && a.config.method == GIB_VIBRATION_HARMONIC && a.left[run] <= 0.1 * a.without[run] + a.floor_um[run];
    }
}

static const char RIGHT[] = "a correction that helps";

static const char *const LAWS[VIBRATION_MISTAKES] = {
    [VIBRATION_LEAPS] = "a correction without a jump",
    [VIBRATION_TOO_FAR] = "a correction no larger than is plausible",
    [VIBRATION_NO_NUMBER] = "a position that is a number",
    [VIBRATION_OF_ANOTHER] = "a position made of scale and correction",
    [VIBRATION_SAYS_NOTHING] = "a fault in its cycle",
    [VIBRATION_STAYS] = "the plain scale where something is wrong",
    [VIBRATION_NEVER_COMES] = "a correction where all is well",
    [VIBRATION_HALF] = RIGHT,
    [VIBRATION_HARMS] = "a correction that does no harm",
    [VIBRATION_REMEMBERS] = "the same inputs, the same outputs",
};

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20261100, .known_runs = FEWER(120), .fresh_runs = 20,
        .least_met = 0.5, .least_ended = 1.0, .least_clean = 1.0,
        .right = RIGHT, .runs_a_wrong = 100, .held_from = 80, .held_to = 100, .most_refused = 4,
        .mistakes = VIBRATION_MISTAKES, .mistaken_runs = 30, .least = 2, .laws = LAWS,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
