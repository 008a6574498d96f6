/* Vibration, calibration and learning as families of test_realtime. */
#ifndef LATHE_REALTIME_H
#define LATHE_REALTIME_H

#include "lathe_run.h"
#include "realtime.h"

#include <math.h>
#include <string.h>

/* A lathe for the next three: the plant is not what is timed. */
static lathe turned;
static lathe_job turned_job;

static inline void turned_prepare(void)
{
    lathe_config c = lathe_default();
    c.substeps = 2;
    lathe_init(&turned, &c);
    turned_job = lathe_job_of(LATHE_OVAL, 600.0, 0.0, 12.0);
}

static inline double turned_target(void)
{
    return turned_job.stroke_mm * (lathe_form(LATHE_OVAL, turned.angle) - 1.0);
}

/* Vibration: runs one after the other by both methods; the spindle stops and turns back, sensors fail, aborts and faults. */
static struct {
    gib_vibration *gib;
    gib_vibration_config config;
    uint64_t cycle;
    double outputs[7];
} vibration;

static inline void vibration_prepare(void)
{
    turned_prepare();
    vibration.cycle = 0;
    vibration.gib = gib_vibration_new();
    vibration.config = lathe_vibration(&turned.c, 0);
}

static inline int32_t vibration_cycle(void)
{
    uint64_t n = vibration.cycle++, run = n / 10000, at = n % 10000;
    lathe_reading r = lathe_sense(&turned);
    gib_vibration_input in = lathe_vibration_input(&r);
    gib_vibration_output out;
    if (at == 100) {
        vibration.config.method = (int32_t)(run % 2);
        vibration.config.harmonics = 1 + (int32_t)(run % 16);
        gib_vibration_start(vibration.gib, &vibration.config, NULL);
    }
    if (at > 5000 && at < 5400) {
        in.acceleration_m_s2[run % 2] = run % 3 == 0 ? 0.0 / 0.0 : run % 3 == 1 ? 0.25 : 1e300;
    }
    in.angle_deg = at == 6500 ? 0.0 / 0.0 : in.angle_deg;
    in.flags = at == 9500 && run % 4 == 0 ? GIB_INPUT_FAULT : 0;
    in.scale_mm = at == 9500 && run % 4 == 1 ? 1.0 / 0.0 : in.scale_mm;
    if (at == 9500 && run % 4 > 1) {
        gib_vibration_abort(vibration.gib);
    }
    gib_vibration_step(vibration.gib, &in, &out);
    double numbers[] = {out.position_mm,    out.correction_um, out.displacement_um[0], out.displacement_um[1],
                        out.relative_um, out.speed_rpm,     out.blend_ratio};
    memcpy(vibration.outputs, numbers, sizeof numbers);
    lathe_cycle(&turned, turned_target(), at < 7000 ? 600.0 : at < 8000 ? 0.0 : -450.0);
    return out.phase;
}

/* Calibration: short ones, some of them aborted, faulted or fed with NaN on the way. */
static struct {
    gib_calibration *gib;
    gib_calibration_config config;
    gib_calibration_output out;
    uint64_t run, cycle, waits;
    double outputs[4];
} calibration;

static inline void calibration_prepare(void)
{
    turned_prepare();
    memset(&calibration, 0, sizeof calibration);
    calibration.gib = gib_calibration_new();
    calibration.config = lathe_calibration(&turned.c);
    calibration.config.frequencies = 2;
    calibration.config.frequency_hz[0] = 30.0;
    calibration.config.frequency_hz[1] = 50.0;
    calibration.config.measure_s = 0.2;
}

static inline int32_t calibration_cycle(void)
{
    gib_calibration_input in = lathe_calibration_input(&turned);
    gib_calibration_output *out = &calibration.out;
    uint64_t kind = calibration.run % 6;
    if (kind >= 3 && calibration.cycle == 300 + 997 * (calibration.run % 11)) {
        in.flags = kind == 3 ? GIB_INPUT_ABORT : 0;
        in.acceleration_m_s2[0] = kind == 4 ? 0.0 / 0.0 : in.acceleration_m_s2[0];
        in.torque = kind == 5 ? 1.0 / 0.0 : in.torque;
    }
    calibration.cycle++;
    int32_t status = gib_calibration_step(calibration.gib, &in, out);
    double numbers[] = {out->target_position_mm, out->target_speed_mm_s, out->frequency_hz, out->amplitude_mm};
    memcpy(calibration.outputs, numbers, sizeof numbers);
    lathe_cycle(&turned, out->target_position_mm, 0.0);
    if (status != GIB_BUSY && ++calibration.waits > 100) {
        calibration.waits = calibration.cycle = 0;
        calibration.run++;
        calibration.config.method = calibration.run % 5 == 4;
        calibration.config.add = calibration.run % 6 == 2;
        if (gib_calibration_start(calibration.gib, &calibration.config) != GIB_OK) {
            calibration.config.add = 0;
            gib_calibration_start(calibration.gib, &calibration.config);
        }
    }
    return out->phase;
}

/* Learning: runs by both methods, kept for a while, aborted, faulted, without a spindle or a position on the way. */
static struct {
    gib_learning *gib;
    gib_learning_config config;
    uint64_t cycle;
    double outputs[2];
} learning;

static inline void learning_prepare(void)
{
    turned_prepare();
    learning.cycle = 0;
    learning.gib = gib_learning_new();
    learning.config = lathe_learning(&turned.c, 0);
}

static inline int32_t learning_cycle(void)
{
    uint64_t n = learning.cycle++, run = n / 20000, at = n % 20000;
    double target = turned_target();
    lathe_reading r = lathe_sense(&turned);
    gib_learning_input in = {target, r.scale_mm, r.angle_deg, 0, 0};
    gib_learning_output out;
    if (at == 100) {
        learning.config.method = (int32_t)(run % 2);
        learning.config.resume = run % 5 == 4;
        gib_learning_start(learning.gib, &learning.config);
    }
    if (at > 3000 && at < 3100) {
        in.detected_mm = run % 2 ? 0.0 / 0.0 : 1.0 / 0.0;
    }
    in.angle_deg = at == 4000 ? 0.0 / 0.0 : in.angle_deg;
    in.flags = at == 19000 && run % 3 == 0 ? GIB_INPUT_FAULT : 0;
    in.target_mm = at == 19000 && run % 3 == 1 ? 0.0 / 0.0 : in.target_mm;
    if (at == 19000 && run % 3 == 2) {
        gib_learning_abort(learning.gib);
    }
    gib_learning_step(learning.gib, &in, &out);
    learning.outputs[0] = out.command_mm;
    learning.outputs[1] = out.correction_um;
    lathe_cycle(&turned, out.command_mm, at > 5000 && at < 6000 ? 0.0 : 600.0);
    return out.phase;
}

#endif
