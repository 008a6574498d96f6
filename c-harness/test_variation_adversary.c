/*
 * Speed variation against somebody who means it ill: random motors, configurations and troubles under a power meter, see
 * variation_adversary.h and adversary_test.h.
 */
#include "adversary_test.h"
#include "variation_adversary.h"

static variation_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    variation_adversary_init(&a, seed, (variation_mistake)mistake);
    variation_adversary_run(&a);
    return a.base.broken;
}

static void describe(void)
{
    print_message("run %d, cycle %d (ended from %d), cycle %g ms: %s; the meter took %.0f %% of what it may exceed\n", a.base.run + 1,
                  a.base.broken_at, a.named, 1e3 * a.config.cycle_s, gib_status_text(a.out.status), 100.0 * a.worst);
    troubles_print(&a.base.troubles, variation_trouble_names);
}

static void count(adversary_tally *t)
{
    t->met += troubles_met(&a.base.troubles);
    t->ended += a.status[0] == GIB_DONE;
}

static const char *const LAWS[VARIATION_MISTAKES] = {
    [VARIATION_JUMPS] = "a feed-forward that is what the change takes",
    [VARIATION_TOO_FAST] = "a feed-forward that is what the change takes",
    [VARIATION_NO_COMMAND] = "a command that is a number",
    [VARIATION_SAYS_NOTHING] = "a fault in its cycle",
    [VARIATION_NEVER_ENDS] = "an end in time",
    [VARIATION_TOO_MUCH] = "a feed-forward that is what the change takes",
    [VARIATION_TOO_STEEP] = "no more power than the motor has",
    [VARIATION_TIMID] = "a swing as asked for",
    [VARIATION_REMEMBERS] = "the same inputs, the same outputs",
};

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20260400, .known_runs = FEWER(2000), .fresh_runs = 20,
        .least_met = 1.0, .least_ended = 0.1,
        .mistakes = VARIATION_MISTAKES, .mistaken_runs = 100, .least = 5, .laws = LAWS,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
