/*
 * Runs the vibration correction under callgrind, 8 harmonics on two sensors, and dumps the cost after every step, labelled
 * with the phase, so that `counts` can print instructions per step. "Coming in" is the first half second after a start or a
 * fault, "swinging" a speed that changes in every cycle. See Makefile.
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
    for (int i = 0; i < 6000; i++) {
        char label[48];
        lathe_reading r = lathe_sense(&p);
        gib_vibration_input in = lathe_vibration_input(&r);
        in.acceleration_m_s2[1] = i >= 2000 && i < 2300 ? spoilt : in.acceleration_m_s2[1];
        if (i == 5800) {
            gib_vibration_abort(gib);
        }
        CALLGRIND_ZERO_STATS;
        gib_vibration_step(gib, &in, &out);
        const char *phase = phases[out.phase];
        if (out.phase == GIB_VIBRATION_CORRECTING) {
            phase = i >= 4000 ? "swinging" : i < 1000 || (i >= 2000 && i < 3300) ? "coming in" : phase;
        }
        snprintf(label, sizeof label, "%s%s", name, phase);
        CALLGRIND_DUMP_STATS_AT(label);
        double rpm = 600.0 * (i < 4000 ? 1.0 : 1.0 + 0.1 * sin(2e-3 * (i - 4000)));
        double angle = p.angle + 6.283185307179586 / 60.0 * rpm * c.cycle_s, grown = fmin(1e-3 * i, 1.0);
        lathe_cycle(&p, grown * grown * job.stroke_mm * (lathe_form(LATHE_OVAL, angle) - 1.0), rpm);
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
