/*
 * Homing against somebody who means it ill: random axes, configurations and troubles, see homing_adversary.h and adversary_test.h.
 */
#include "adversary_test.h"
#include "homing_adversary.h"

static homing_adversary a;

static const char *run(uint64_t seed, int mistake)
{
    (void)mistake;
    homing_adversary_init(&a, seed);
    homing_adversary_run(&a);
    return a.broken;
}

static void describe(void)
{
    print_message("cycle %d of %d (named in %d); %s\n", a.broken_at, a.ended, a.named, gib_status_text(a.world.status));
    print_message("    %d motors, cycle %g ms\n", a.world.plant.c.motors, 1e3 * a.world.plant.c.cycle_s);
    for (int i = 0; i < a.troubles; i++) {
        const homing_trouble *t = &a.trouble[i];
        print_message("    %s, side %d, in %s after %d for %d: began in %d\n", homing_trouble_name(t->kind), t->side,
                      homing_state_names[t->state], t->after, t->lasts, t->begun);
    }
}

static void count(adversary_tally *t)
{
    for (int i = 0; i < a.troubles; i++) {
        t->met += a.trouble[i].begun != 0;
    }
    t->ended += a.world.status == GIB_DONE;
}

int main(int argc, char **argv)
{
    const adversary_test test = {
        .known_seed = 20260101, .known_runs = FEWER(2000), .fresh_runs = 100,
        .least_met = 0.5, .least_ended = 0.1,
        .run = run, .count = count, .describe = describe,
    };
    return adversary_test_main(argc, argv, &test);
}
