/*
 * Speed variation against somebody who means it ill: random motors, configurations and troubles under a power meter, see
 * variation_adversary.h. Most runs are the same every time; some are fresh, with a seed that is printed. Only those of one seed:
 * test_variation_adversary SEED [RUNS]. A run by itself: SEED as printed for it, 1.
 */
#include "fresh_runs.h"
#include "variation_adversary.h"


enum { KNOWN_SEED = 20260400, KNOWN_RUNS = 2000, FRESH_RUNS = 20 };

static fresh_runs fresh = {.runs = FRESH_RUNS};
static variation_adversary a;

static void describe(uint64_t seed)
{
    print_message("seed %llu: %s, run %d, cycle %d (ended from %d), cycle %g ms: %s\n", (unsigned long long)seed, a.broken, a.run + 1,
                  a.broken_at, a.named, 1e3 * a.config.cycle_s, gib_status_text(a.out.status));
    troubles_print(&a.troubles, variation_trouble_names);
}

typedef struct {
    int broken, met, well;
} tally;

static tally count(uint64_t seed, int runs)
{
    tally t = {0, 0, 0};
    double worst = 0.0;
    for (int i = 0; i < runs; i++) {
        variation_adversary_init(&a, seed + (uint64_t)i, VARIATION_NO_MISTAKE);
        variation_adversary_run(&a);
        t.met += troubles_met(&a.troubles);
        t.well += a.status[0] == GIB_DONE;
        worst = a.worst > worst ? a.worst : worst;
        t.broken += a.broken != NULL;
        if (a.broken) {
            describe(seed + (uint64_t)i);
        }
    }
    print_message("seed %llu: %d runs of two variations, %d troubles met, %d ended well, %d broke a law; the meter took %.0f %% of what it may exceed\n",
                  (unsigned long long)seed, runs, t.met, t.well, t.broken, 100.0 * worst);
    return t;
}

static void every_law_holds_in_known_runs(void **state)
{
    (void)state;
    tally t = count(KNOWN_SEED, KNOWN_RUNS);
    assert_int_equal(t.broken, 0);
    assert_true(t.met >= KNOWN_RUNS && t.well >= KNOWN_RUNS / 10);
}

static void every_law_holds_in_fresh_runs(void **state)
{
    (void)state;
    assert_int_equal(count(fresh.seed, fresh.runs).broken, 0);
}

static const char *broken_by(int mistake, uint64_t seed)
{
    variation_adversary_init(&a, seed, (variation_mistake)mistake);
    variation_adversary_run(&a);
    return a.broken;
}

/* The laws can fail: each of these mistakes, put in on purpose, breaks the one that is about it. */
static void mistakes_break_laws(void **state)
{
    (void)state;
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
    fresh_runs_mistakes(broken_by, LAWS, VARIATION_MISTAKES, KNOWN_SEED, 100, 5);
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
