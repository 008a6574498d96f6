/*
 * What is claimed of inertia and speed variation, over random spindles: errors, coverage of the intervals, and power at
 * the limit. Another seed than the fresh one that is printed: test_spindle_random SEED.
 */
#include "spindle_run.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <time.h>

#include <cmocka.h>

static uint64_t seed;

/* Spindles of their own for each kind of signal. */
static void inertia_is_within_one_percent_and_its_intervals_hold(void **state)
{
    (void)state;
    enum { RUNS = 100 };
    static double errors[RUNS];
    int held = 0;
    for (int k = 0; k < SIGNAL_KINDS; k++) {
        int inside = errors_of_random(seed + (uint64_t)k, (signal_kind)k, errors, RUNS);
        print_message("%s, seed %llu: median error %.3f %%, worst %.3f %%, %d of %d intervals hold the truth\n",
                      SIGNAL_NAMES[k], (unsigned long long)seed + (unsigned long long)k, 100.0 * errors[RUNS / 2],
                      100.0 * errors[RUNS - 1], inside, RUNS);
        assert_true(errors[RUNS - 1] <= 0.01);
        held += inside;
    }
    print_message("%.1f %% of all intervals hold the truth\n", 100.0 * held / (RUNS * SIGNAL_KINDS));
    /* Of 500 that hold 95 of 100 each, chance leads below 90 % once in a million times; of such that hold 98, beyond 99.6 %
       once in two thousand. */
    assert_true(held >= 0.90 * RUNS * SIGNAL_KINDS && held <= 0.996 * RUNS * SIGNAL_KINDS);
}

static void the_motor_gives_all_it_has_and_no_more(void **state)
{
    (void)state;
    enum { RUNS = 150 };
    static double drawn[RUNS];
    int tried = drawn_by_random(seed, drawn, RUNS);
    print_message("seed %llu: %d of %d random spindles, limited by power, draw %.4f to %.4f P, median %.4f P\n",
                  (unsigned long long)seed, RUNS, tried, drawn[0], drawn[RUNS - 1], drawn[RUNS / 2]);
    assert_true(drawn[0] >= 0.97 && drawn[RUNS - 1] <= 1.0);
    /* The check can fail: the published limit draws more. */
    gib_speed_variation_config c = variation_example();
    c.formula = GIB_SPEED_VARIATION_PUBLISHED;
    c.amplitude_ratio = 0.9;
    double published = variation_power(&c);
    print_message("as published: %.3f P\n", published);
    assert_true(published > 1.86 && published < 1.90);
}

/* Ramps too short for the uncertainty wanted are told from others, and the ramp proposed in their place does it. */
static void a_ramp_too_short_is_told_with_one_that_will_do(void **state)
{
    (void)state;
    uint64_t random = seed;
    int told = 0, promised = 0, enough = 0;
    for (int i = 0; i < 40; i++) {
        spindle_config sc = spindle_random(&random);
        gib_inertia_config c = spindle_ramps(&sc, 300.0, 0.15);
        gib_inertia_report r, again;
        c.ramps = 1;
        c.takeup_s = 0.05;
        c.target_ratio = 0.01;
        c.acceleration_rpm_s = fmin(c.acceleration_rpm_s, 270.0 / 0.3);
        int32_t status = spindle_measure(&sc, &c, &r);
        assert_true(status == GIB_OK || status == GIB_ERR_INERTIA_EXCITATION || status == GIB_ERR_INERTIA_FEW ||
                    status == GIB_ERR_INERTIA_TORQUE);
        if (status == GIB_OK && r.target_reached) {
            continue;
        }
        assert_true(r.ramp_acceleration_rpm_s > 0.0 && r.ramp_high_rpm > r.ramp_low_rpm && r.ramp_times >= 1);
        told++;
        if (status != GIB_OK) {
            continue; /* what is not known well enough to be a value cannot be promised for either */
        }
        if (r.ramp_times > 15) {
            continue; /* more than one measurement has room for */
        }
        c.speed_low_rpm = r.ramp_low_rpm;
        c.speed_high_rpm = r.ramp_high_rpm;
        c.acceleration_rpm_s = r.ramp_acceleration_rpm_s;
        c.ramps = r.ramp_times;
        enough += spindle_measure(&sc, &c, &again) == GIB_OK && again.target_reached;
        promised++;
    }
    print_message("%d of 40 were told a ramp; of %d whose noise was known and that are not too many, %d did it by that\n", told,
                  promised, enough);
    assert_true(promised >= 5 && 10 * enough >= 9 * promised);
}

/* More ramps than a measurement has room for are no reason to refuse it. Of short ramps, though, one in twenty reads some
 * per cent low, beyond its interval: docs/spindle.md says so, and this keeps it from growing. */
static void many_short_ramps(void **state)
{
    (void)state;
    enum { RUNS = 40 };
    uint64_t random = seed;
    int wrong = 0, refused = 0;
    for (int i = 0; i < RUNS; i++) {
        spindle_config sc = spindle_random(&random);
        gib_inertia_config c = spindle_ramps(&sc, 300.0, 0.15);
        gib_inertia_report r;
        c.ramps = 50;
        c.takeup_s = 0.05;
        c.acceleration_rpm_s = fmin(c.acceleration_rpm_s, 270.0 / 0.3);
        if (spindle_measure(&sc, &c, &r) != GIB_OK) {
            refused++;
            continue;
        }
        double error = fabs(r.total_kg_m2 - sc.inertia_kg_m2);
        wrong += error > fmax(0.01 * sc.inertia_kg_m2, 1.5 * r.total_uncertainty_kg_m2);
    }
    print_message("50 short ramps, seed %llu: of %d spindles %d refused, %d wrong by more than 1 %% and three deviations\n",
                  (unsigned long long)seed, RUNS, refused, wrong);
    assert_true(4 * wrong <= RUNS && 4 * refused <= RUNS);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inertia_is_within_one_percent_and_its_intervals_hold),
        cmocka_unit_test(the_motor_gives_all_it_has_and_no_more),
        cmocka_unit_test(a_ramp_too_short_is_told_with_one_that_will_do),
        cmocka_unit_test(many_short_ramps),
    };
    seed = argc > 1 ? strtoull(argv[1], NULL, 10) : (uint64_t)time(NULL);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
