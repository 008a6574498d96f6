/*
 * Homing against somebody who means it ill: random axes, configurations and troubles, see homing_adversary.h. Most runs are the same
 * every time, so that what a change breaks is found at once and again; some are fresh, with a seed that is printed. Only those of
 * one seed: test_homing_adversary SEED [RUNS]. A run by itself: SEED as printed for it, 1.
 */
#include "fresh_runs.h"
#include "homing_adversary.h"

#include <stdio.h>

enum { KNOWN_SEED = 20260101, KNOWN_RUNS = 2000, FRESH_RUNS = 100 };

static fresh_runs fresh = {.runs = FRESH_RUNS};

static void describe(const homing_adversary *a, uint64_t its_seed)
{
    print_message("seed %llu: %s, cycle %d of %d (named in %d); %s\n", (unsigned long long)its_seed,
                  a->broken ? a->broken : "well", a->broken_at, a->ended, a->named, gib_status_text(a->world.status));
    print_message("    %d motors, cycle %g ms\n", a->world.plant.c.motors, 1e3 * a->world.plant.c.cycle_s);
    for (int i = 0; i < a->troubles; i++) {
        const homing_trouble *t = &a->trouble[i];
        print_message("    %s, side %d, in %s after %d for %d: began in %d\n", homing_trouble_name(t->kind), t->side,
                      homing_state_names[t->state], t->after, t->lasts, t->begun);
    }
}

static void every_law_holds(uint64_t seed, int runs)
{
    static homing_adversary a;
    int broken = 0, homed = 0, met = 0;
    for (int i = 0; i < runs; i++) {
        homing_adversary_init(&a, seed + (uint64_t)i);
        homing_adversary_run(&a);
        homed += a.world.status == GIB_DONE;
        for (int k = 0; k < a.troubles; k++) {
            met += a.trouble[k].begun != 0;
        }
        broken += a.broken != NULL;
        if (a.broken) {
            describe(&a, seed + (uint64_t)i);
        }
    }
    print_message("seed %llu: %d runs, %d troubles met, %d homed, %d broke a law\n", (unsigned long long)seed, runs, met,
                  homed, broken);
    assert_int_equal(broken, 0);
}

static void every_law_holds_in_known_runs(void **state)
{
    (void)state;
    every_law_holds(KNOWN_SEED, KNOWN_RUNS);
}

static void every_law_holds_in_fresh_runs(void **state)
{
    (void)state;
    every_law_holds(fresh.seed, fresh.runs);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_law_holds_in_known_runs),
        cmocka_unit_test(every_law_holds_in_fresh_runs),
    };
    return fresh_runs_main(argc, argv, &fresh, tests, sizeof tests / sizeof *tests);
}
