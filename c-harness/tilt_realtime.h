/* Tilt as a family of test_realtime. */
#ifndef TILT_REALTIME_H
#define TILT_REALTIME_H

#include "tilt_run.h"

/* Tilt: workpieces one after the other, some left alone, declined, aborted, faulted or fed with NaN on the way. */
static struct {
    tilt_plant plant;
    tilt_kernel kernel;
    gib_tilt_config config;
    gib_tilt_table table;
    tilt_pass passes[TILT_PASSES];
    uint64_t run, cycle_of_run, waits, active;
    double outputs[6];
} tilt;

static inline void tilt_prepare(void)
{
    tilt_plant_config c = tilt_plant_default();
    memset(&tilt, 0, sizeof tilt);
    c.length_mm = 80.0;
    c.tool_diameter_mm = 6.0;
    c.feed_mm_s = 40.0;
    c.noise_ratio = 0.01;
    tilt.config = tilt_config(&c);
    tilt.config.rotary[0].axis = GIB_TILT_AXIS_B;
    tilt.config.ack_timeout_s = 0.1;
    tilt.kernel.gib = gib_tilt_new();
    tilt_teach(c, tilt.kernel.gib, 1.0, 5.0, 1.0, &tilt.table);
    gib_tilt_free(tilt.kernel.gib);
    tilt.kernel.gib = gib_tilt_new();
    tilt.kernel.plant = &tilt.plant;
    c.about_x_deg = 0.5;
    c.about_y_deg = -0.5;
    tilt_plant_init(&tilt.plant, &c);
    tilt_raster(&c, tilt.passes);
    tilt_rewind(&tilt.kernel);
}

static inline int32_t tilt_realtime_cycle(void)
{
    tilt_kernel *k = &tilt.kernel;
    uint64_t kind = tilt.run % 8, at = 500 + 431 * (tilt.run % 23);
    k->accept = kind != 6;
    gib_tilt_input in = tilt_sense(k, tilt.passes, 2);
    if (kind >= 3 && tilt.cycle_of_run++ == at) {
        in.flags |= kind == 3 ? GIB_INPUT_ABORT : kind == 4 ? GIB_INPUT_FAULT : 0;
        in.load = kind == 5 ? 0.0 / 0.0 : in.load;
    }
    tilt.active += k->out.phase == GIB_TILT_ACTIVE;
    if (k->out.phase == GIB_TILT_ACTIVE && tilt.active == 1) {
        tilt_rewind(k); /* cuts again, with the offsets */
    }
    in.flags |= tilt.active > 3000 ? GIB_TILT_INPUT_OFF : 0;
    int32_t status = gib_tilt_step(k->gib, &in, &k->out);
    memcpy(tilt.outputs, k->out.offset_mm, sizeof k->out.offset_mm);
    memcpy(tilt.outputs + 3, k->out.offset_deg, sizeof k->out.offset_deg);
    if (status != GIB_BUSY && ++tilt.waits > 100) {
        tilt.waits = tilt.cycle_of_run = tilt.active = 0;
        tilt.run++;
        tilt.config.band_deg = tilt.run % 8 == 7 ? 2.0 : 0.0;
        tilt_rewind(k);
        gib_tilt_start(k->gib, &tilt.config, &tilt.table);
    }
    return k->out.phase;
}

#endif
