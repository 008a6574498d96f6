/*
 * Runs a whole inertia measurement under callgrind and dumps the cost after every step, labelled with the phase, so that
 * `counts` can print instructions per step: mean and largest in each phase. See Makefile.
 */
#include "gib.h"
#include "spindle_plant.h"

#include <string.h>
#include <valgrind/callgrind.h>

static const char *const PHASES[] = {"idle",     "approach",  "up",     "hold high", "down",
                                     "hold low", "listening", "return", "done",      "failed"};

static int32_t labelled_step(spindle *s, gib_inertia *gib, gib_inertia_output *out)
{
    spindle_reading r = spindle_sense(s);
    gib_inertia_input in = {r.speed_rpm, r.torque, 0, 0};
    int before = out->phase;
    CALLGRIND_ZERO_STATS;
    int32_t status = gib_inertia_step(gib, &in, out);
    /* The step that takes up a start or ends a state does more than the others, once each: it is listed by itself. */
    CALLGRIND_DUMP_STATS_AT(out->phase == before ? PHASES[out->phase] : "turns");
    spindle_cycle(s, out->speed_command_rpm, 0.0);
    return status;
}

int main(void)
{
    static spindle s;
    spindle_config sc = spindle_default();
    sc.outlier_ratio = 0.01;
    spindle_init(&s, &sc);
    gib_inertia_output out;
    memset(&out, 0, sizeof out);
    gib_inertia_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = sc.cycle_s;
    c.speed_high_rpm = 2000.0;
    c.acceleration_rpm_s = 2000.0;
    gib_inertia *gib = gib_inertia_new();
    for (int i = 0; i < 50; i++) {
        labelled_step(&s, gib, &out);
    }
    if (gib_inertia_start(gib, &c) != GIB_OK) {
        return 1;
    }
    int32_t status;
    do {
        status = labelled_step(&s, gib, &out);
    } while (status == GIB_BUSY);
    for (int i = 0; i < 50; i++) {
        labelled_step(&s, gib, &out);
    }
    gib_inertia_free(gib);
    return status == GIB_DONE ? 0 : 1;
}
