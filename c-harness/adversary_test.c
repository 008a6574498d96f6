/* See adversary_test.h. */
#include "adversary_test.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static const adversary_test *test;
static uint64_t fresh_seed;
static int fresh_runs;

/* Makes so many runs, says what came of them, and asks that every law held. */
static adversary_tally judged(uint64_t seed, int runs)
{
    adversary_tally t = {0};
    int broken = 0, wrong = 0;
    for (int i = 0; i < runs; i++) {
        const char *law = test->run(seed + (uint64_t)i, 0);
        test->count(&t);
        if (law) {
            int is_off = test->right && strcmp(law, test->right) == 0;
            wrong += is_off;
            broken += !is_off;
            print_message("seed %llu: %s, ", (unsigned long long)seed + (unsigned)i, law);
            test->describe();
        }
    }
    print_message("seed %llu: %d runs, %d troubles met, %d ended well, %d broke a law", (unsigned long long)seed, runs, t.met, t.ended, broken);
    if (test->right) {
        print_message(", %d were off; without trouble %d, %d of them refused, %.1f %% of %d values hold", wrong, t.clean, t.clean_refused,
                      t.values ? 100.0 * t.held / t.values : 0.0, t.values);
    }
    print_message("\n");
    assert_int_equal(broken, 0);
    assert_true(wrong <= (test->right ? 1 + runs / test->runs_a_wrong : 0));
    return t;
}

static void every_law_holds_in_known_runs(void **state)
{
    (void)state;
    adversary_tally t = judged(test->known_seed, test->known_runs);
    assert_true(t.met >= test->least_met * test->known_runs && t.ended >= test->least_ended * test->known_runs);
    assert_true(t.clean >= test->least_clean * test->known_runs);
    /* Of fewer runs chance alone would lead beyond these shares. */
    if (test->right && ONE_IN == 1) {
        assert_true(100 * t.held >= test->held_from * t.values && 100 * t.held <= test->held_to * t.values);
        assert_true(100 * t.clean_refused <= test->most_refused * t.clean);
    }
}

static void every_law_holds_in_fresh_runs(void **state)
{
    (void)state;
    judged(fresh_seed, fresh_runs);
}

/* The laws can fail: each mistake, put in on purpose, breaks the one that is about it. */
static void mistakes_break_laws(void **state)
{
    (void)state;
    for (int m = 1; m < test->mistakes; m++) {
        int broken = 0, met = 0;
        for (int i = 0; i < test->mistaken_runs; i++) {
            const char *law = test->run(test->known_seed + (uint64_t)i, m);
            broken += law != NULL;
            met += law && strcmp(law, test->laws[m]) == 0;
        }
        print_message("%s: %d of %d runs of a mistake broke it, %d broke any\n", test->laws[m], met, test->mistaken_runs, broken);
        assert_true(met >= test->least);
    }
}

int adversary_test_main(int argc, char **argv, const adversary_test *its_test)
{
    test = its_test;
    fresh_seed = argc > 1 ? strtoull(argv[1], NULL, 10) : (uint64_t)time(NULL) * 1000u;
    fresh_runs = argc > 2 ? atoi(argv[2]) : test->fresh_runs;
    const struct CMUnitTest fresh[] = {cmocka_unit_test(every_law_holds_in_fresh_runs)};
    const struct CMUnitTest all[] = {
        cmocka_unit_test(every_law_holds_in_known_runs),
        cmocka_unit_test(mistakes_break_laws),
        cmocka_unit_test(every_law_holds_in_fresh_runs),
    };
    return argc > 1 ? cmocka_run_group_tests(fresh, NULL, NULL) : cmocka_run_group_tests(all, NULL, NULL);
}
