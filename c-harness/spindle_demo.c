/*
 * Spindle inertia and speed variation on a simulated spindle, printed as tables: how close the inertia comes, what the
 * published limit would draw from the motor and what gib's does, and what the variation is good for.
 */
#include "spindle_run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void check(int32_t status, const char *what)
{
    if (status < 0) {
        fprintf(stderr, "%s: %s\n", what, gib_status_text(status));
        exit(1);
    }
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
                gib_inertia_config c = spindle_ramps(&sc, 2000.0, 0.6);
                check(spindle_measure(&sc, &c, &r), "inertia");
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

static void power_table(void)
{
    printf("\nPower drawn at the limit: J 0.5 kg.m2, 1000 rpm, motor 10 kW; the meter is the spindle's\n");
    printf("%-34s %8s %10s %10s\n", "", "period", "amplitude", "drawn/P");
    static const char *const names[] = {"published, free spindle", "exact triangle, free spindle",
                                        "exact triangle, friction and cut", "exact sine, friction and cut"};
    static const double periods[] = {1.0, 2.0, 4.0};
    for (int n = 0; n < 4; n++) {
        for (int p = 0; p < 3; p++) {
            gib_speed_variation_config c = variation_example();
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
                   variation_power(&c));
        }
    }
}

/* Any spindle and motor: what they draw at the limit that gib gives. */
static void random_power_table(void)
{
    enum { RUNS = 150 };
    static double drawn[RUNS];
    uint64_t seed = 1;
    int tried = drawn_by_random(seed, drawn, RUNS), inside = 0;
    for (int i = 0; i < RUNS; i++) {
        inside += drawn[i] >= 0.97 && drawn[i] <= 1.0;
    }
    printf("\nDrawn at gib's limit by %d random spindles (seed %d; of %d, the others are not limited by power)\n", RUNS,
           (int)seed, tried);
    printf("least %.4f P, 1 in 20 below %.4f P, median %.4f P, 1 in 20 above %.4f P, most %.4f P; %d of %d in 0.97 to 1\n",
           drawn[0], drawn[RUNS / 20], drawn[RUNS / 2], drawn[RUNS - 1 - RUNS / 20], drawn[RUNS - 1], inside, RUNS);
}

/* Any spindle: how close the inertia comes, also where the signals are worse than a drive's should be. */
static void random_inertia_table(void)
{
    enum { RUNS = 40 };
    static double errors[RUNS];
    printf("\nInertia of random spindles, J 0.01 to 5 kg.m2, friction 5 to 50 %%, ripple 0.5 to 3 %%, noise 3 %%, %d each\n",
           RUNS);
    printf("%-44s %10s %12s %12s\n", "", "median", "worst error", "in interval");
    for (int k = 0; k < SIGNAL_KINDS; k++) {
        int inside = errors_of_random(1, (signal_kind)k, errors, RUNS);
        printf("%-44s %9.2f%% %11.2f%% %8d/%d\n", SIGNAL_NAMES[k], 100.0 * errors[RUNS / 2], 100.0 * errors[RUNS - 1],
               inside, RUNS);
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
        gib_speed_variation_config c = variation_example();
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

/* One measurement as a recording, for `gib inertia`: 0.62 kg.m2, of which 0.12 are the spindle's own. */
static int record(const char *path)
{
    const double torque_constant = 0.81; /* N.m/A */
    spindle_config sc = spindle_default();
    sc.inertia_kg_m2 = 0.62;
    gib_inertia_config c = spindle_ramps(&sc, 2000.0, 0.6);
    spindle s;
    gib_inertia_output out;
    gib_inertia_report report;
    gib_inertia *gib = gib_inertia_new();
    FILE *file = fopen(path, "w");
    int32_t status = gib_inertia_start(gib, &c);
    if (!file || status != GIB_OK) {
        fprintf(stderr, "spindle_demo: %s: not written\n", path);
        gib_inertia_free(gib);
        return 1;
    }
    spindle_init(&s, &sc);
    fprintf(file, "time_s,spindle.speed_rpm,spindle.torque_nm,spindle.current_a\n");
    for (int i = 0; status == GIB_OK || status == GIB_BUSY; i++) {
        spindle_reading r = spindle_sense(&s);
        gib_inertia_input in = {r.speed_rpm, r.torque, 0, 0};
        fprintf(file, "%.3f,%.3f,%.3f,%.3f\n", i * sc.cycle_s, r.speed_rpm, r.torque, r.torque / torque_constant);
        status = gib_inertia_step(gib, &in, &out);
        spindle_cycle(&s, out.speed_command_rpm, 0.0);
    }
    status = gib_inertia_result(gib, &report);
    gib_inertia_free(gib);
    printf("\nRecording of one measurement: %s; the control found %.4f +- %.4f kg.m2.\n", path, report.total_kg_m2,
           report.total_uncertainty_kg_m2);
    return fclose(file) != 0 || status != GIB_OK;
}

/* spindle_demo [RECORDING.csv] */
int main(int argc, char **argv)
{
    inertia_table();
    random_inertia_table();
    power_table();
    random_power_table();
    chatter_table();
    return argc > 1 ? record(argv[1]) : 0;
}
