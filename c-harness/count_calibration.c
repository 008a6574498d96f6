/*
 * Runs a calibration under callgrind and dumps the cost after every step, labelled with the phase, so that `counts` can
 * print instructions per step. See Makefile.
 */
#include "lathe_run.h"

#include <stdio.h>
#include <valgrind/callgrind.h>

int main(void)
{
    static const char *const phases[] = {"idle", "rise", "probe", "measure", "fall", "evaluate", "stopping", "done", "failed"};
    static lathe p;
    lathe_config c = lathe_default();
    gib_calibration_config g = lathe_calibration(&c);
    gib_calibration *gib = gib_calibration_new();
    gib_calibration_output out = {0};
    int32_t status = GIB_BUSY;
    c.substeps = 2; /* the plant is slow under callgrind, and only gib is counted */
    g.frequencies = 2;
    g.frequency_hz[0] = 30.0;
    g.frequency_hz[1] = 50.0;
    g.measure_s = 0.5;
    g.ramp_s = 0.1;
    lathe_init(&p, &c);
    for (int i = -50; status == GIB_BUSY; i++) {
        if (i == 0 && gib_calibration_start(gib, &g) != GIB_OK) {
            return 1;
        }
        gib_calibration_input in = lathe_calibration_input(&p);
        int phase = out.phase;
        CALLGRIND_ZERO_STATS;
        status = gib_calibration_step(gib, &in, &out);
        CALLGRIND_DUMP_STATS_AT(phases[phase]);
        lathe_cycle(&p, out.target_position_mm, 0.0);
        status = i < 0 ? GIB_BUSY : status;
    }
    gib_calibration_free(gib);
    return status == GIB_DONE ? 0 : 1;
}
