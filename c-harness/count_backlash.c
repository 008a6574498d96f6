/*
 * Runs a whole measurement under callgrind and dumps the cost after every step, labelled with the phase, so that
 * `counts` can print instructions per step: mean and largest in each phase. See Makefile.
 */
#include "kernel.h"

#include <stdlib.h>
#include <string.h>
#include <valgrind/callgrind.h>

static const char *const PHASES[] = {"idle",  "clear", "approach", "slide back", "slide in", "settle",  "scan",
                                     "probe", "evaluate", "write",  "stopping",   "restore",  "done",    "failed"};

static void labelled_step(kernel *k, gib_backlash *gib, int32_t *status)
{
    char label[32];
    int phase = k->out.phase;
    gib_backlash_input in = kernel_sense(k);
    CALLGRIND_ZERO_STATS;
    *status = gib_backlash_step(gib, &in, &k->out);
    /* The step that takes up a start does more than an idle one, once in a measurement: it is listed by itself. */
    int starts = phase == GIB_BACKLASH_IDLE && k->out.phase != GIB_BACKLASH_IDLE;
    snprintf(label, sizeof label, "%s", starts ? "start" : PHASES[phase]);
    CALLGRIND_DUMP_STATS_AT(label);
}

int main(int argc, char **argv)
{
    plant_config c = plant_default();
    plant p;
    kernel k;
    int32_t status;
    c.substeps = 5; /* the plant is slow under callgrind, and only gib is counted */
    plant_init(&p, &c);
    kernel_init(&k, &p);
    gib_backlash *gib = gib_backlash_new();
    gib_backlash_config config;
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    config.mode = argc > 1 ? atoi(argv[1]) : GIB_BACKLASH_SLOW_FEED;
    config.cycle_s = c.cycle_s;
    config.travel_min_mm = -50.0;
    config.travel_max_mm = 50.0;
    config.torque_bound_nm = 12.0;
    config.repeats = 1;
    config.slide_mm = 0.2;
    config.detection_limit_um = 150.0;
    for (int i = 0; i < 50; i++) {
        labelled_step(&k, gib, &status);
    }
    if (gib_backlash_start(gib, &config) != GIB_OK) {
        return 1;
    }
    do {
        labelled_step(&k, gib, &status);
    } while (status == GIB_BUSY);
    for (int i = 0; i < 50; i++) {
        labelled_step(&k, gib, &status);
    }
    gib_backlash_free(gib);
    return status == GIB_DONE ? 0 : 1;
}
