/*
 * Runs triangle and sine at the motor's limit under callgrind and dumps the cost after every step, labelled with what the
 * cycle was, so that `counts` can print instructions per step: mean and largest of each kind. See Makefile.
 */
#include "gib.h"

#include <string.h>
#include <valgrind/callgrind.h>

static gib_speed_variation_output out;

static int32_t labelled_step(gib_speed_variation *gib, gib_speed_variation_input *in, const char *label)
{
    CALLGRIND_ZERO_STATS;
    int32_t status = gib_speed_variation_step(gib, in, &out);
    CALLGRIND_DUMP_STATS_AT(label);
    return status;
}

static int count(int waveform, const char *label)
{
    gib_speed_variation_config c;
    gib_speed_variation_limits limits;
    gib_speed_variation_input in = {1000.0, 0.0, 0.0, 0.0, 0, 0};
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.waveform = waveform;
    c.cycle_s = 0.001;
    c.speed_rpm = 1000.0;
    c.period_s = 1.0;
    c.inertia_kg_m2 = 0.5;
    c.power_w = 10000.0;
    c.coulomb_nm = 8.0;
    c.viscous_nm_s = 0.05;
    c.cutting_nm = 20.0;
    gib_speed_variation *gib = gib_speed_variation_new();
    if (gib_speed_variation_possible(&c, &limits) != GIB_OK) {
        return 1;
    }
    c.amplitude_ratio = limits.amplitude_ratio;
    for (int i = 0; i < 20; i++) {
        labelled_step(gib, &in, "idle");
    }
    if (gib_speed_variation_start(gib, &c) != GIB_OK) {
        return 1;
    }
    /* Cycles until a change is in effect, the one that asks for it included. */
    int cycles = waveform == GIB_SPEED_VARIATION_SINE ? 11 : 6;
    for (int i = 0; i < cycles; i++) {
        labelled_step(gib, &in, "change");
    }
    for (int i = 0; i < 4000; i++) {
        labelled_step(gib, &in, label);
    }
    /* A change now and then, each worked out over the cycles after it; then one in every cycle, as an override on its ramp. */
    for (int i = 0; i < 40; i++) {
        in.speed_rpm = 1000.0 - 0.5 * i;
        in.period_s = 1.0 + 0.1 * (i % 7);
        in.cutting_nm = 20.0 + (i % 3);
        for (int k = 0; k < cycles; k++) {
            labelled_step(gib, &in, "change");
        }
        for (int k = 0; k < 50; k++) {
            labelled_step(gib, &in, "seldom");
        }
    }
    /* A live reading of the cutting torque, within what is reserved for it. */
    for (int i = 0; i < 1000; i++) {
        in.cutting_nm = 10.0 + (i * 7 % 11);
        labelled_step(gib, &in, "live cutting");
    }
    for (int i = 0; i < 1000; i++) {
        in.speed_rpm += i < 500 ? 0.5 : -0.5;
        labelled_step(gib, &in, "every cycle");
    }
    in.flags = GIB_SPEED_VARIATION_STOP;
    labelled_step(gib, &in, "stop");
    /* A kernel may hold the flag until the end. */
    in.flags = waveform == GIB_SPEED_VARIATION_SINE ? GIB_SPEED_VARIATION_STOP : 0;
    int32_t status;
    do {
        status = labelled_step(gib, &in, "stopping");
    } while (status == GIB_BUSY);
    for (int i = 0; i < 20; i++) {
        labelled_step(gib, &in, "idle");
    }
    gib_speed_variation_free(gib);
    return status == GIB_DONE ? 0 : 1;
}

int main(void)
{
    return count(GIB_SPEED_VARIATION_TRIANGLE, "triangle") || count(GIB_SPEED_VARIATION_SINE, "sine");
}
