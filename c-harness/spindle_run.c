/* See spindle_run.h. */
#include "spindle_run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

spindle_config spindle_random(uint64_t *state)
{
    spindle_config c = spindle_default();
    c.inertia_kg_m2 = random_over(state, 0.01, 5.0);
    double rated = c.inertia_kg_m2 * random_over(state, 60.0, 240.0); /* N·m: the acceleration it makes is 60 to 240 rad/s² */
    double friction = random_between(state, 0.05, 0.5) * rated, viscous = random_between(state, 0.0, 0.5);
    c.torque_limit_nm = 2.0 * rated;
    c.coulomb_nm = (1.0 - viscous) * friction;
    c.viscous_nm_s = viscous * friction / spindle_rad_s(2000.0);
    c.ripple_nm = random_between(state, 0.005, 0.03) * rated;
    c.ripples_per_turn = floor(random_between(state, 1.0, 13.0));
    c.torque_noise_nm = 0.03 * rated;
    c.outlier_ratio = random_between(state, 0.0, 0.01);
    c.speed_grid_rpm = random_over(state, 0.005, 0.2);
    c.seed = (uint64_t)random_between(state, 1.0, 1e15);
    return c;
}

gib_inertia_config spindle_ramps(const spindle_config *sc, double high_rpm, double share)
{
    gib_inertia_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = sc->cycle_s;
    c.speed_high_rpm = high_rpm;
    c.acceleration_rpm_s = spindle_rpm(share * 0.5 * sc->torque_limit_nm / sc->inertia_kg_m2);
    return c;
}

int32_t spindle_measure(const spindle_config *sc, const gib_inertia_config *c, gib_inertia_report *report)
{
    spindle s;
    gib_inertia_output out;
    gib_inertia *gib = gib_inertia_new();
    spindle_init(&s, sc);
    int32_t status = gib_inertia_start(gib, c);
    while (status == GIB_OK || status == GIB_BUSY) {
        spindle_reading r = spindle_sense(&s);
        gib_inertia_input in = {r.speed_rpm, r.torque, 0, 0};
        status = gib_inertia_step(gib, &in, &out);
        spindle_cycle(&s, out.speed_command_rpm, 0.0);
    }
    if (status == GIB_DONE) {
        status = gib_inertia_result(gib, report);
    }
    gib_inertia_free(gib);
    return status;
}

const char *const SIGNAL_NAMES[SIGNAL_KINDS] = {"as above", "speed in steps of 1 rpm", "speed from 4096 counts a turn", "current, taken by the torque constant",
                                                "torque one cycle late", "all of these"};

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int errors_of_random(uint64_t seed, signal_kind kind, double *errors, int runs)
{
    uint64_t random = seed;
    int inside = 0;
    for (int i = 0; i < runs; i++) {
        spindle_config sc = spindle_random(&random);
        gib_inertia_config c = spindle_ramps(&sc, 2000.0, 0.6);
        gib_inertia_report r;
        if (kind == SIGNAL_COARSE_SPEED || kind == SIGNAL_ALL) {
            sc.speed_grid_rpm = 1.0;
        }
        if (kind == SIGNAL_COUNTS || kind == SIGNAL_ALL) {
            sc.counts_per_turn = 4096.0;
        }
        if (kind == SIGNAL_CURRENT || kind == SIGNAL_ALL) {
            c.torque_unit = GIB_TORQUE_AMPERE;
            c.torque_constant_nm_a = sc.torque_constant_nm_a = random_over(&random, 0.1, 3.0);
        }
        if (kind == SIGNAL_LATE_TORQUE || kind == SIGNAL_ALL) {
            sc.torque_late_cycles = 1;
        }
        if (spindle_measure(&sc, &c, &r) == GIB_OK) {
            double error = fabs(r.total_kg_m2 - sc.inertia_kg_m2);
            errors[i] = error / sc.inertia_kg_m2;
            inside += error <= r.total_uncertainty_kg_m2;
        } else {
            errors[i] = INFINITY;
        }
    }
    qsort(errors, (size_t)runs, sizeof *errors, ascending);
    return inside;
}

gib_speed_variation_config variation_example(void)
{
    gib_speed_variation_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = 0.001;
    c.speed_rpm = 1000.0;
    c.amplitude_ratio = 0.3;
    c.period_s = 2.0;
    c.inertia_kg_m2 = 0.5;
    c.power_w = 10000.0;
    return c;
}

gib_speed_variation_config variation_random(uint64_t *state)
{
    gib_speed_variation_config c = variation_example();
    double mean, at_mean;
    c.waveform = random_between(state, 0.0, 1.0) < 0.3;
    do {
        c.inertia_kg_m2 = random_over(state, 0.01, 5.0);
        c.own_inertia_kg_m2 = random_between(state, 0.0, 0.3) * c.inertia_kg_m2;
        c.speed_rpm = random_over(state, 100.0, 8000.0);
        mean = spindle_rad_s(c.speed_rpm);
        /* What the power would need to bring it from standstill to twice its energy: 0.3 to 20 s. */
        c.power_w = (c.inertia_kg_m2 + c.own_inertia_kg_m2) * mean * mean / random_over(state, 0.3, 20.0);
    } while (c.power_w < 500.0 || c.power_w > 100000.0);
    at_mean = c.power_w / mean;
    c.speed_rpm *= random_between(state, 0.0, 1.0) < 0.3 ? -1.0 : 1.0;
    c.period_s = random_over(state, 0.3, 8.0);
    double friction = random_between(state, 0.0, 0.5) * at_mean, viscous = random_between(state, 0.0, 0.4);
    c.coulomb_nm = (1.0 - viscous) * friction;
    c.viscous_nm_s = viscous * friction / mean;
    c.cutting_nm = random_between(state, 0.0, 0.3) * at_mean;
    return c;
}

double variation_power(const gib_speed_variation_config *c)
{
    spindle_config sc = spindle_default();
    spindle s;
    gib_speed_variation_input in = {c->speed_rpm, 0.0, 0.0, 0.0, 0, 0};
    gib_speed_variation_output out;
    gib_speed_variation *gib = gib_speed_variation_new();
    sc.cycle_s = c->cycle_s;
    sc.inertia_kg_m2 = c->inertia_kg_m2 + c->own_inertia_kg_m2;
    sc.coulomb_nm = c->coulomb_nm;
    sc.viscous_nm_s = c->viscous_nm_s;
    sc.cutting_nm = c->cutting_nm;
    sc.ripple_nm = 0.0;
    sc.torque_limit_nm = 1e9; /* what is drawn, not what a drive would cut off */
    spindle_init(&s, &sc);
    for (int i = 0; i < 5000; i++) {
        spindle_cycle(&s, c->speed_rpm, 0.0);
    }
    int32_t status = gib_speed_variation_start(gib, c);
    s.peak_w = 0.0;
    for (int i = 0; status >= 0 && i < (int)(4.0 * c->period_s / c->cycle_s); i++) {
        status = gib_speed_variation_step(gib, &in, &out);
        spindle_cycle(&s, out.speed_command_rpm, out.torque_nm);
    }
    gib_speed_variation_free(gib);
    return status < 0 ? status : s.peak_w / c->power_w;
}

int drawn_by_random(uint64_t seed, double *drawn, int runs)
{
    uint64_t random = seed;
    int tried = 0, done = 0;
    while (done < runs) {
        gib_speed_variation_config c = variation_random(&random);
        gib_speed_variation_limits limits;
        tried++;
        c.amplitude_ratio = 0.0;
        if (gib_speed_variation_possible(&c, &limits) != GIB_OK || limits.amplitude_ratio < LEAST_AMPLITUDE ||
            limits.limited_by != GIB_ERR_SPEED_VARIATION_POWER) {
            continue;
        }
        c.amplitude_ratio = limits.amplitude_ratio;
        drawn[done++] = variation_power(&c);
    }
    qsort(drawn, (size_t)runs, sizeof *drawn, ascending);
    return tried;
}
