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
    /* Of 600 that hold 95 of 100 each, chance leads below 90 % once in a million times; of such that hold 98, beyond 99.6 %
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
    /* The commands keep to P exactly, which the library's own tests prove; this is a drive that follows them, to a thousandth. */
    assert_true(drawn[0] >= 0.97 && drawn[RUNS - 1] <= 1.001);
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

/* Further off than 1 % and three standard deviations. */
static int wrong(const gib_inertia_report *r, double truth)
{
    return fabs(r->total_kg_m2 - truth) > fmax(0.01 * truth, 1.5 * r->total_uncertainty_kg_m2);
}

/* Ripple keeps step with short ramps, and more of them than a measurement has room for are no reason to refuse it. */
static void many_short_ramps(void **state)
{
    (void)state;
    enum { RUNS = 80 };
    uint64_t random = seed;
    int held = 0, narrow = 0, off = 0, refused = 0;
    for (int i = 0; i < RUNS; i++) {
        spindle_config sc = spindle_random(&random);
        gib_inertia_config c = spindle_ramps(&sc, 300.0, 0.15);
        gib_inertia_report r;
        c.ramps = (int32_t)random_between(&random, 8.0, 51.0);
        c.takeup_s = 0.05;
        c.acceleration_rpm_s = fmin(c.acceleration_rpm_s, 270.0 / 0.3);
        if (spindle_measure(&sc, &c, &r) != GIB_OK) {
            refused++;
            continue;
        }
        double error = fabs(r.total_kg_m2 - sc.inertia_kg_m2);
        held += error <= r.total_uncertainty_kg_m2;
        narrow += error <= 0.34 * r.total_uncertainty_kg_m2;
        off += wrong(&r, sc.inertia_kg_m2);
    }
    print_message("8 to 50 short ramps, seed %llu: of %d spindles %d refused, %d wrong by more than 1 %% and three deviations; "
                  "%d intervals hold the truth, a third of them %d\n",
                  (unsigned long long)seed, RUNS, refused, off, held, narrow);
    /* Of 80 intervals that hold 95 of 100 each, chance leads below 65 once in a million times. A third of such an interval
       holds half, and of 80 chance leads beyond 62 once in a million times: suspiciously wide. Two of 1360 were wrong: chance leads beyond 3 of 80 once in 100 000 times. */
    assert_true(refused <= 1 && off <= 3 && held >= 65 && narrow <= 62);
}

/* A weakened field and saturation are found by themselves, since every second ramp is gentler; a saturation that is told is left
   out. Of 560 of each none, one and one were wrong. */
static void what_lies_beyond_base_speed_and_saturation_is_left_out(void **state)
{
    (void)state;
    enum { RUNS = 40, WEAKENED, SATURATED, TOLD };
    static const struct {
        int kind, most_wrong;
        const char *name;
    } cases[] = {{WEAKENED, 4, "weakened field"}, {SATURATED, 2, "saturation"}, {TOLD, 3, "saturation that is told"}};
    for (int k = 0; k < 3; k++) {
        uint64_t random = seed;
        int found = 0, off = 0, refused = 0;
        for (int i = 0; i < RUNS; i++) {
            spindle_config sc = spindle_random(&random);
            gib_inertia_config c = spindle_ramps(&sc, 2000.0, 0.6);
            gib_inertia_report r;
            double share = random_between(&random, 0.4, 1.1), top = spindle_rad_s(2000.0);
            double strongest = sc.coulomb_nm + sc.viscous_nm_s * top + sc.inertia_kg_m2 * spindle_rad_s(c.acceleration_rpm_s);
            sc.weakening_rpm = cases[k].kind == WEAKENED ? share * 2000.0 : 0.0;
            sc.saturation_nm = cases[k].kind == WEAKENED ? 0.0 : share * strongest;
            c.saturation_nm = cases[k].kind == TOLD ? sc.saturation_nm : 0.0;
            if (spindle_measure(&sc, &c, &r) != GIB_OK) {
                refused++;
                continue;
            }
            /* Of ramps of which nothing is left out, there are two paces. */
            if (cases[k].kind != TOLD && r.saturation_nm == 0.0 && r.weakening_rpm == 0.0)
                assert_int_equal(r.one_acceleration, 0);
            found += r.weakening_rpm > 0.0 || r.saturation_nm > 0.0;
            off += wrong(&r, sc.inertia_kg_m2);
        }
        print_message("%s, seed %llu: of %d found in %d, refused %d, wrong %d\n", cases[k].name, (unsigned long long)seed, RUNS,
                      found, refused, off);
        assert_true((cases[k].kind == TOLD || found >= RUNS / 3) && off <= cases[k].most_wrong && 4 * refused <= RUNS);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inertia_is_within_one_percent_and_its_intervals_hold),
        cmocka_unit_test(the_motor_gives_all_it_has_and_no_more),
        cmocka_unit_test(a_ramp_too_short_is_told_with_one_that_will_do),
        cmocka_unit_test(many_short_ramps),
        cmocka_unit_test(what_lies_beyond_base_speed_and_saturation_is_left_out),
    };
    seed = argc > 1 ? strtoull(argv[1], NULL, 10) : (uint64_t)time(NULL);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
