/*
 * Runs a whole homing under callgrind, of one motor and of a gantry, and dumps the cost after every step, labelled with the
 * phase, so that `counts` can print instructions per step: mean and largest in each phase. See Makefile.
 */
#include "homing_run.h"

#include <stdio.h>
#include <valgrind/callgrind.h>

static const char *const PHASES[] = {"idle",   "limit", "touch",    "retract", "clear",   "evaluate", "offset",
                                     "set",    "stopping", "unload", "restore", "done",    "failed"};

static int32_t labelled_step(homing_plant *p, gib_homing *gib)
{
    char label[32];
    int phase = p->out.phase;
    const gib_homing_input *in = homing_plant_cycle(p);
    CALLGRIND_ZERO_STATS;
    int32_t status = gib_homing_step(gib, in, &p->out);
    /* The step that takes up a start does more than an idle one, once in a homing: it is listed by itself. */
    int starts = phase == GIB_HOMING_IDLE && p->out.phase != GIB_HOMING_IDLE;
    snprintf(label, sizeof label, "%s%s", p->c.motors == 2 ? "gantry " : "", starts ? "start" : PHASES[phase]);
    CALLGRIND_DUMP_STATS_AT(label);
    return status;
}

static int32_t whole_homing(int motors)
{
    static homing_plant p;
    homing_plant_config c = homing_plant_default();
    c.motors = motors;
    c.beam_nm_mm = motors == 2 ? 20.0 : 0.0;
    c.substeps = 5; /* the plant is slow under callgrind, and only gib is counted */
    homing_plant_init(&p, &c);
    gib_homing *gib = gib_homing_new();
    gib_homing_config g = homing_config(&c);
    for (int i = 0; i < 50; i++) {
        labelled_step(&p, gib);
    }
    int32_t status = gib_homing_start(gib, &g);
    while (status == GIB_OK || status == GIB_BUSY) {
        status = labelled_step(&p, gib);
    }
    for (int i = 0; i < 50; i++) {
        labelled_step(&p, gib);
    }
    gib_homing_free(gib);
    return status;
}

int main(void)
{
    return whole_homing(1) == GIB_DONE && whole_homing(2) == GIB_DONE ? 0 : 1;
}
