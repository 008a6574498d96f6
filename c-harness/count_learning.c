/*
 * Runs learning under callgrind, 256 points and 8 harmonics or as many as its arguments say, and dumps the cost after every step,
 * labelled with the phase, so that `counts` can print instructions per step. See Makefile.
 */
#include "lathe_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <valgrind/callgrind.h>

static int32_t run(gib_learning *gib, int cycles, double rpm)
{
    static const char *const phases[] = {"idle", "waiting", "settle", "measure", "evaluate", "blend", "done", "stopping", "failed"};
    static lathe p;
    lathe_config c = lathe_default();
    lathe_job job = lathe_job_of(LATHE_OVAL, rpm, 0.0, 12.0);
    gib_learning_output out = {0};
    c.substeps = 2; /* the plant is slow under callgrind, and only gib is counted */
    lathe_init(&p, &c);
    for (int i = 0; i < cycles; i++) {
        double target = job.stroke_mm * (lathe_form(LATHE_OVAL, p.angle) - 1.0);
        lathe_reading r = lathe_sense(&p);
        gib_learning_input in = {target, r.scale_mm, r.angle_deg, 0, 0};
        CALLGRIND_ZERO_STATS;
        gib_learning_step(gib, &in, &out);
        CALLGRIND_DUMP_STATS_AT(phases[out.phase]);
        lathe_cycle(&p, out.command_mm, rpm);
    }
    return out.status;
}

int main(int argc, char **argv)
{
    lathe_config c = lathe_default();
    gib_learning *gib = gib_learning_new();
    gib_learning_config g = lathe_learning(&c, GIB_LEARNING_FILTERED);
    g.points = argc > 1 ? atoi(argv[1]) : 256;
    g.harmonics = argc > 2 ? atoi(argv[2]) : g.harmonics;
    run(gib, 100, 600.0);
    if (gib_learning_start(gib, &g) != GIB_OK) {
        return 1;
    }
    int32_t status = run(gib, 12000 * (1 + g.points / 512), 600.0); /* more points take more cycles to evaluate */
    gib_learning_abort(gib);
    run(gib, 300, 600.0);
    gib_learning_free(gib);
    return status == GIB_DONE ? 0 : 1;
}
