/*
 * Spindle inertia and speed variation on a simulated spindle, printed as tables: how close the inertia comes, what the
 * published limit would draw from the motor and what gib's does, and what the variation is good for.
 */
#include "gib.h"
#include "spindle_plant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check(int32_t status, const char *what)
{
    if (status < 0) {
        fprintf(stderr, "%s: %s\n", what, gib_status_text(status));
        exit(1);
    }
}

/* One measurement; returns the verdict. */
static int32_t measure(const spindle_config *sc, gib_inertia_report *report)
{
    spindle s;
    gib_inertia_config c;
    gib_inertia_output out;
    int32_t status = GIB_BUSY;
    gib_inertia *gib = gib_inertia_new();
    spindle_init(&s, sc);
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = sc->cycle_s;
    c.speed_high_rpm = 2000.0;
    c.acceleration_rpm_s = spindle_rpm(0.3 * sc->torque_limit_nm / sc->inertia_kg_m2);
    check(gib_inertia_start(gib, &c), "start");
    while (status == GIB_BUSY) {
        spindle_reading r = spindle_sense(&s);
        gib_inertia_input in = {r.speed_rpm, r.torque_nm, 0, 0};
        status = gib_inertia_step(gib, &in, &out);
        spindle_cycle(&s, out.speed_command_rpm, 0.0);
    }
    check(status, "step");
    status = gib_inertia_result(gib, report);
    gib_inertia_free(gib);
    return status;
}

static void inertia_table(void)
{
    enum { RUNS = 40 };
    static const double inertia[] = {0.01, 0.1, 0.5, 2.0, 5.0};
    static const double friction[] = {0.1, 0.5};
    printf("Inertia: torque noise 3 %%, ripple 1.5 %%, 1 %% wild samples, %d runs each\n", RUNS);
    printf("%10s %10s %14s %14s %12s %14s\n", "J kg.m2", "friction", "worst error", "uncertainty", "in interval",
           "T/a alone");
    for (int f = 0; f < 2; f++) {
        for (int i = 0; i < 5; i++) {
            double worst = 0.0, uncertainty = 0.0, naive = 0.0;
            int inside = 0;
            for (int run = 0; run < RUNS; run++) {
                spindle_config sc = spindle_default();
                gib_inertia_report r;
                double rated = 60.0 * inertia[i] / 0.5;
                sc.inertia_kg_m2 = inertia[i];
                sc.torque_limit_nm = 2.0 * rated;
                sc.coulomb_nm = 0.7 * friction[f] * rated;
                sc.viscous_nm_s = 0.3 * friction[f] * rated / spindle_rad_s(2000.0);
                sc.ripple_nm = 0.015 * rated;
                sc.torque_noise_nm = 0.03 * rated;
                sc.outlier_ratio = 0.01;
                sc.seed = (uint64_t)(1000 * i + 100000 * f + run + 1);
                check(measure(&sc, &r), "result");
                double error = fabs(r.total_kg_m2 - inertia[i]);
                worst = fmax(worst, error / inertia[i]);
                uncertainty += r.total_uncertainty_kg_m2 / inertia[i] / RUNS;
                naive += (r.naive_kg_m2 / inertia[i] - 1.0) / RUNS;
                inside += error <= r.total_uncertainty_kg_m2;
            }
            printf("%10.2f %9.0f%% %13.2f%% %13.2f%% %8d/%d %+13.0f%%\n", inertia[i], 100.0 * friction[f],
                   100.0 * worst, 100.0 * uncertainty, inside, RUNS, 100.0 * naive);
        }
    }
}

static gib_speed_variation_config example(void)
{
    gib_speed_variation_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = 0.001;
    c.speed_rpm = 1000.0;
    c.amplitude_ratio = 0.1;
    c.period_s = 2.0;
    c.inertia_kg_m2 = 0.5;
    c.power_w = 10000.0;
    return c;
}

/* Runs a variation for some periods on a spindle and returns what the power meter saw, W. */
static double power_meter(const gib_speed_variation_config *c)
{
    spindle_config sc = spindle_default();
    spindle s;
    gib_speed_variation_input in = {c->speed_rpm, 0.0, 0.0, 0.0, 0, 0};
    gib_speed_variation_output out;
    gib_speed_variation *gib = gib_speed_variation_new();
    sc.coulomb_nm = c->coulomb_nm;
    sc.viscous_nm_s = c->viscous_nm_s;
    sc.cutting_nm = c->cutting_nm;
    sc.ripple_nm = 0.0;
    sc.torque_limit_nm = 1e6; /* what is drawn, not what a drive would cut off */
    spindle_init(&s, &sc);
    for (int i = 0; i < 5000; i++) {
        spindle_cycle(&s, c->speed_rpm, 0.0);
    }
    s.peak_w = 0.0;
    check(gib_speed_variation_start(gib, c), "start");
    for (int i = 0; i < (int)(4.0 * c->period_s / c->cycle_s); i++) {
        check(gib_speed_variation_step(gib, &in, &out), "step");
        spindle_cycle(&s, out.speed_command_rpm, out.torque_nm);
    }
    gib_speed_variation_free(gib);
    return s.peak_w;
}

static void power_table(void)
{
    printf("\nPower drawn at the limit: J 0.5 kg.m2, 1000 rpm, motor 10 kW; the meter is the spindle's\n");
    printf("%-34s %8s %10s %10s\n", "", "period", "amplitude", "drawn/P");
    static const char *const names[] = {"published, free spindle", "exact triangle, free spindle",
                                        "exact triangle, friction and cut", "exact sine, friction and cut"};
    static const double periods[] = {1.0, 2.0, 4.0};
    for (int n = 0; n < 4; n++) {
        for (int p = 0; p < 3; p++) {
            gib_speed_variation_config c = example();
            gib_speed_variation_limits limits;
            c.period_s = periods[p];
            c.waveform = n == 3;
            c.formula = n == 0;
            if (n >= 2) {
                c.coulomb_nm = 8.0;
                c.viscous_nm_s = 0.05;
                c.cutting_nm = 20.0;
            }
            check(gib_speed_variation_possible(&c, &limits), "limits");
            c.amplitude_ratio = n == 0 ? fmin(limits.published_amplitude_ratio, 0.99) : limits.amplitude_ratio;
            printf("%-34s %7.1fs %9.1f%% %10.3f\n", p == 0 ? names[n] : "", periods[p], 100.0 * c.amplitude_ratio,
                   power_meter(&c) / c.power_w);
        }
    }
}

/* Stable depth of cut of a slender tool at constant speed, and with gib's speed command. */
static void chatter_table(void)
{
    enum { CYCLES = 6000 };
    static double speeds[CYCLES];
    const chatter_config tool = {120.0, 0.03, 2e7, 2e9};
    const double most = 5e-3;
    printf("\nStable depth of cut: tool of 120 Hz, 3 %% damping, 20 N/um, cutting 2000 N/mm2, J 0.5 kg.m2, 10 kW\n");
    printf("%8s %14s %16s %14s %8s\n", "speed", "constant", "variation", "varied", "gain");
    static const double mean[] = {600.0, 640.0, 680.0, 720.0};
    for (int m = 0; m < 4; m++) {
        for (int i = 0; i < CYCLES; i++) {
            speeds[i] = spindle_rad_s(mean[m]);
        }
        double constant = chatter_stable_depth_m(&tool, most, speeds, CYCLES, 0.001);
        gib_speed_variation_config c = example();
        gib_speed_variation_limits limits;
        c.speed_rpm = mean[m];
        c.amplitude_ratio = 0.0;
        c.period_s = 0.0;
        c.cutting_nm = 20.0;
        c.coulomb_nm = 6.0;
        c.chatter_hz = tool.frequency_hz;
        check(gib_speed_variation_possible(&c, &limits), "limits");
        c.amplitude_ratio = limits.recommended_amplitude_ratio;
        c.period_s = limits.recommended_period_s;
        gib_speed_variation_input in = {mean[m], 0.0, 0.0, 0.0, 0, 0};
        gib_speed_variation_output out;
        gib_speed_variation *gib = gib_speed_variation_new();
        check(gib_speed_variation_start(gib, &c), "start");
        for (int i = 0; i < CYCLES; i++) {
            check(gib_speed_variation_step(gib, &in, &out), "step");
            speeds[i] = spindle_rad_s(out.speed_command_rpm);
        }
        gib_speed_variation_free(gib);
        double varied = chatter_stable_depth_m(&tool, most, speeds, CYCLES, 0.001);
        printf("%8.0f %11.2f mm  +-%4.1f%% in %4.2fs %11.2f mm %7.2fx\n", mean[m], 1e3 * constant,
               100.0 * c.amplitude_ratio, c.period_s, 1e3 * varied, varied / constant);
    }
}

int main(void)
{
    inertia_table();
    power_table();
    chatter_table();
    return 0;
}
