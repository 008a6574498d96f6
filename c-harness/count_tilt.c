/*
 * Runs a tilt from the first cut to the offsets taken out under callgrind and dumps the cost after every step, labelled
 * with the phase, so that `counts` can print instructions per step: mean and largest in each phase. See Makefile.
 */
#include "tilt_run.h"

#include <stdio.h>
#include <valgrind/callgrind.h>

static const char *const PHASES[] = {"idle",   "measuring", "evaluate", "warning", "ramp on",
                                     "active", "ramp off",  "done",     "failed"};

static int32_t labelled_step(tilt_kernel *k, const gib_tilt_input *in)
{
    char label[32];
    int phase = k->out.phase;
    CALLGRIND_ZERO_STATS;
    int32_t status = gib_tilt_step(k->gib, in, &k->out);
    int in_the_air = phase == GIB_TILT_MEASURING && !(in->flags & GIB_TILT_INPUT_CUTTING);
    snprintf(label, sizeof label, "%s", in_the_air ? "in the air" : PHASES[phase]);
    CALLGRIND_DUMP_STATS_AT(label);
    return status;
}

int main(void)
{
    static tilt_plant p;
    static gib_tilt_table table;
    tilt_plant_config c = tilt_plant_default();
    c.feed_mm_s = 40.0;
    c.tool_diameter_mm = 6.0;
    c.noise_ratio = 0.01;
    gib_tilt_config g = tilt_config(&c);
    g.rotary[0].axis = GIB_TILT_AXIS_B;
    tilt_kernel k = {.plant = &p, .gib = gib_tilt_new(), .accept = 1};
    tilt_pass passes[TILT_PASSES];
    tilt_raster(&c, passes);
    if (tilt_teach(c, k.gib, 1.0, 5.0, 1.0, &table) != GIB_DONE) {
        return 1;
    }
    gib_tilt_free(k.gib);
    k.gib = gib_tilt_new();
    c.about_x_deg = 0.5;
    c.about_y_deg = -0.5;
    tilt_plant_init(&p, &c);
    tilt_rewind(&k);
    gib_tilt_input in = {0};
    for (int i = 0; i < 50; i++) {
        labelled_step(&k, &in);
    }
    if (gib_tilt_start(k.gib, &g, &table) != GIB_OK) {
        return 1;
    }
    /* Idle in the output until the first step of the measurement, which is counted as one of its own. */
    k.out.phase = GIB_TILT_MEASURING;
    int32_t status = GIB_BUSY;
    for (int active = 0; status == GIB_BUSY;) {
        in = tilt_sense(&k, passes, 2);
        if (k.out.phase == GIB_TILT_ACTIVE && active++ == 0) {
            tilt_rewind(&k); /* cuts again, with the offsets */
        }
        in.flags |= active > 1000 ? GIB_TILT_INPUT_OFF : 0;
        status = labelled_step(&k, &in);
    }
    for (int i = 0; i < 50; i++) {
        labelled_step(&k, &in);
    }
    gib_tilt_free(k.gib);
    return status == GIB_DONE ? 0 : 1;
}
