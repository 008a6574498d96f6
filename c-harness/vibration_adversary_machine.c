/* See vibration_adversary.h: what machine, configuration and troubles are drawn from. */
#include "vibration_adversary.h"

#include <math.h>
#include <string.h>

static const double TWO_PI = 6.283185307179586;

static double within(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

/* What harmonic k of a part takes of the slide's acceleration, µm at the speed meant. */
static double swing_um(const vibration_adversary *a, int n, int k)
{
    double turning = TWO_PI / (a->turn_cycles * a->config.cycle_s), at = k * turning, w = a->w[n];
    double size = hypot(a->coefficient[k - 1][0], a->coefficient[k - 1][1]) * at * at * fabs(a->takes[n]);
    size += n == 1 && k == 1 ? hypot(a->unbalance[0], a->unbalance[1]) * turning * turning : 0.0;
    return size / hypot(w * w - at * at, 2.0 * a->damping[n] * w * at);
}

double vibration_adversary_swings(const vibration_adversary *a, int power, int largest)
{
    double sums[2] = {0.0, 0.0};
    for (int n = 0; n < 2; n++) {
        for (int k = 1; k <= a->form; k++) {
            sums[n] += swing_um(a, n, k) * pow(k, power);
        }
    }
    return largest ? fmax(sums[0], sums[1]) : sums[0] + sums[1];
}

static void draw_table(vibration_adversary *a, double hz)
{
    gib_calibration_table *t = &a->table;
    a->has_table = chance(&a->base, 0.7);
    t->struct_size = sizeof *t;
    t->count = (uint32_t)between(&a->base, 12.0, 33.0);
    double from = hz * between(&a->base, 0.3, 0.9), to = fmin(hz * a->form * over(&a->base, 1.2, 30.0), 9e4);
    for (int n = 0; n < 2; n++) {
        a->gain[n] = 1.0 + between(&a->base, -0.01, 0.01) * (a->has_table ? 15.0 : 1.0);
        a->lag_s[n] = a->has_table ? over(&a->base, 0.003, 0.3) / (TWO_PI * hz * a->form) : 0.0;
    }
    for (uint32_t i = 0; i < t->count; i++) {
        double f = from * pow(to / from, (double)i / (t->count - 1));
        t->point[i].frequency_hz = f;
        for (int n = 0; n < 2; n++) {
            double lag = TWO_PI * f * a->lag_s[n];
            t->point[i].gain_ratio[n] = hypot(1.0, lag) / a->gain[n];
            t->point[i].phase_deg[n] = 360.0 / TWO_PI * atan(lag);
        }
    }
}

/* Slide, seat and bearing whose swing the sensors can show; a speed that the encoder can. */
static void draw_machine(vibration_adversary *a)
{
    gib_vibration_config *g = &a->config;
    double rpm;
    do {
        g->cycle_s = over(&a->base, 5e-5, 0.02);
        a->turn_cycles = over(&a->base, 10.0, 500.0);
        rpm = 60.0 / (a->turn_cycles * g->cycle_s);
    } while (rpm < 8.0 || rpm > 30000.0);
    double hz = rpm / 60.0;
    g->harmonics = chance(&a->base, 0.3) ? 0 : 1 + (int)between(&a->base, 0.0, 16.0);
    a->form = (int)fmax(1.0, fmin(g->harmonics ? g->harmonics : 8, 0.33 * a->turn_cycles));
    for (int i = 0; i < 3; i++) {
        int k = (int)between(&a->base, 0.0, a->form);
        a->coefficient[k][i & 1] = between(&a->base, -1.0, 1.0) / ((k + 1.0) * (k + 1.0));
    }
    for (int n = 0; n < 2; n++) {
        a->w[n] = TWO_PI * hz * a->form * (chance(&a->base, 0.8) ? over(&a->base, 1.3, 5.0) : over(&a->base, 0.4, 1.3));
        a->damping[n] = over(&a->base, 0.04, 0.5);
        a->takes[n] = over(&a->base, 0.1, 1.0) * (n ? 1.0 : -1.0);
        a->unbalance[n] = between(&a->base, -0.1, 0.1);
        a->offset[n] = between(&a->base, -0.05, 0.05);
    }
    double turning = TWO_PI * hz, size = over(&a->base, 0.1, 500.0) / vibration_adversary_swings(a, 0, 1),
           most = 1e-6 * vibration_adversary_swings(a, 2, 1) * turning * turning;
    size = fmin(within(size, 0.01 / most, 1000.0 / most), 2000.0 / vibration_adversary_swings(a, 0, 1));
    for (int k = 0; k < VIBRATION_FORM; k++) {
        a->coefficient[k][0] *= size;
        a->coefficient[k][1] *= size;
    }
    a->unbalance[0] *= size;
    a->unbalance[1] *= size;
    most *= size;
    g->second_slide = chance(&a->base, 0.25);
    a->second_multiple = 1 + (int)between(&a->base, 0.0, fmin(a->form, 3.0));
    for (int i = 0; i < 2 && g->second_slide; i++) {
        a->second[i] = between(&a->base, -1.0, 1.0) * vibration_adversary_swings(a, 0, 1);
    }
    most += 1e-6 * hypot(a->second[0], a->second[1]) * pow(a->second_multiple * turning, 2.0);
    g->displacement_max_um = within(vibration_adversary_swings(a, 0, 1) * over(&a->base, 2.0, 30.0), 0.1, 1e4);
    g->acceleration_range_m_s2 = within(most * over(&a->base, 3.0, 50.0), 0.1, 1e4);
    g->acceleration_max_m_s2 = chance(&a->base, 0.5) ? 0.0 : g->acceleration_range_m_s2 * between(&a->base, 0.8, 1.0);
    a->grid = g->acceleration_range_m_s2 / (chance(&a->base, 0.5) ? 32768.0 : 8388608.0);
    for (int n = 0; n < 2; n++) {
        a->noise[n] = fmax(most * over(&a->base, 1e-5, 0.03), 0.3 * a->grid);
        a->drift[n] = 1e-3 * most * between(&a->base, -1.0, 1.0) / a->turn_cycles;
        a->offset[n] *= g->acceleration_range_m_s2;
    }
    a->scale_grid = over(&a->base, 1e-6, 1e-3);
    draw_table(a, hz);
    double fastest = fmax(fmax(a->w[0], a->w[1]), 2.0 * turning * a->form);
    fastest = fmax(fastest, a->has_table ? 0.3 / fmin(a->lag_s[0], a->lag_s[1]) : 0.0);
    a->steps = (int)ceil(fastest * g->cycle_s / 0.15);
    a->steps = a->steps > 100 ? 100 : a->steps;
}

static void draw(vibration_adversary *a)
{
    gib_vibration_config *g = &a->config;
    g->struct_size = sizeof *g;
    draw_machine(a);
    double turn_s = a->turn_cycles * g->cycle_s, rpm = 60.0 / turn_s;
    g->method = chance(&a->base, 0.25) ? GIB_VIBRATION_INTEGRATE : GIB_VIBRATION_HARMONIC;
    g->main_harmonic = (int)between(&a->base, 0.0, 3.0);
    g->speed_min_rpm = within(rpm * over(&a->base, 0.05, 0.6), 1.0, 1e4);
    g->speed_max_rpm = within(rpm * over(&a->base, 1.7, 4.0), g->speed_min_rpm, 15.0 / g->cycle_s);
    g->frequency_min_hz = within(over(&a->base, 0.05, 0.6) / turn_s, 0.1, 1000.0);
    g->averaging_revolutions = chance(&a->base, 0.3) ? 0.0 : over(&a->base, 1.0, 60.0);
    g->fade_s = within(turn_s * over(&a->base, 0.05, 6.0), 0.001, 10.0);
    g->speed_filter_s = within(turn_s * over(&a->base, 0.01, 1.0), g->cycle_s, 1.0);
    a->swing = chance(&a->base, 0.7) ? 0.0 : between(&a->base, 0.0, 0.1);
    a->swing_turns = over(&a->base, 15.0, 100.0);
    a->counts = chance(&a->base, 0.4) ? 0.0 : over(&a->base, 2000.0, 1e6);
    a->wrapped = (int)between(&a->base, 0.0, 3.0);
    a->revolutions = 40.0 + 2.0 * fmax(g->fade_s, 3.0 * g->speed_filter_s) / turn_s;
    a->cycles = (int)(a->revolutions * a->turn_cycles);
    /* What is integrated must not drift too far within a revolution, by noise or by its offset; that it may, is the method's own. */
    for (int n = 0; n < 2 && g->method == GIB_VIBRATION_INTEGRATE; n++) {
        double few = 0.02e-6 * g->displacement_max_um / (turn_s * turn_s);
        a->noise[n] = fmin(a->noise[n], few * sqrt(a->turn_cycles));
        a->grid = fmin(a->grid, a->noise[n]);
        a->drift[n] = within(a->drift[n], -few / a->turn_cycles, few / a->turn_cycles);
    }
}

void vibration_adversary_init(vibration_adversary *a, uint64_t seed, vibration_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    draw(a);
    int count = chance(&a->base, 0.3) ? 0 : (int)between(&a->base, 1.0, VIBRATION_MOST_TROUBLES + 1.0);
    troubles_draw(&a->base.troubles, &a->base.random, count, VIBRATION_TROUBLES, a->cycles, 0.1, 0.3);
}
