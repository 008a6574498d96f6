/*
 * Runs the vibration correction under callgrind, 8 harmonics on two sensors, and dumps the cost after every step, labelled
 * with the phase, so that `counts` can print instructions per step. See Makefile.
 */
#include "lathe_run.h"

#include <stdio.h>
#include <valgrind/callgrind.h>

static void run(gib_vibration *gib, const char *name, double spoilt)
{
    static const char *const phases[] = {"idle", "waiting", "correcting", "degraded", "stopping", "failed"};
    static lathe p;
    lathe_config c = lathe_default();
    lathe_job job = lathe_job_of(LATHE_OVAL, 600.0, 0.0, 12.0);
    gib_vibration_output out = {0};
    c.substeps = 2; /* the plant is slow under callgrind, and only gib is counted */
    lathe_init(&p, &c);
    for (int i = 0; i < 3000; i++) {
        char label[48];
        lathe_reading r = lathe_sense(&p);
        gib_vibration_input in = lathe_vibration_input(&r);
        in.acceleration_m_s2[1] = i >= 2000 && i < 2300 ? spoilt : in.acceleration_m_s2[1];
        if (i == 2800) {
            gib_vibration_abort(gib);
        }
        CALLGRIND_ZERO_STATS;
        gib_vibration_step(gib, &in, &out);
        snprintf(label, sizeof label, "%s%s", name, phases[out.phase]);
        CALLGRIND_DUMP_STATS_AT(label);
        double angle = p.angle + 6.283185307179586 * 10.0 * c.cycle_s, grown = fmin(1e-3 * i, 1.0);
        lathe_cycle(&p, grown * grown * job.stroke_mm * (lathe_form(LATHE_OVAL, angle) - 1.0), 600.0);
    }
}

int main(void)
{
    lathe_config c = lathe_default();
    gib_vibration *gib = gib_vibration_new();
    gib_vibration_config g = lathe_vibration(&c, GIB_VIBRATION_HARMONIC);
    run(gib, "", 0.0);
    if (gib_vibration_start(gib, &g, NULL) != GIB_OK) {
        return 1;
    }
    run(gib, "", NAN);
    g.method = GIB_VIBRATION_INTEGRATE;
    if (gib_vibration_start(gib, &g, NULL) != GIB_OK) {
        return 1;
    }
    run(gib, "integrated ", NAN);
    gib_vibration_free(gib);
    return 0;
}
