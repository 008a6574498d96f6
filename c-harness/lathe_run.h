/*
 * Jobs on the simulated lathe that tests, demo and counts share: calibrating its accelerometers, and turning a form while
 * the position is corrected.
 */
#ifndef LATHE_RUN_H
#define LATHE_RUN_H

#include "gib.h"
#include "lathe_plant.h"

#include <math.h>
#include <string.h>

/* Frequencies of the calibration; they reach from the slowest spindle's first harmonic to the fastest one's highest. */
static const double LATHE_FREQUENCIES_HZ[] = {5.0, 8.0, 12.0, 17.0, 23.0, 30.0, 38.0, 46.0, 52.0, 58.0, 66.0, 76.0, 90.0, 110.0, 130.0};
enum { LATHE_FREQUENCIES = sizeof LATHE_FREQUENCIES_HZ / sizeof *LATHE_FREQUENCIES_HZ };

static inline gib_calibration_config lathe_calibration(const lathe_config *c)
{
    gib_calibration_config g;
    memset(&g, 0, sizeof g);
    g.struct_size = sizeof g;
    g.frequencies = LATHE_FREQUENCIES;
    memcpy(g.frequency_hz, LATHE_FREQUENCIES_HZ, sizeof LATHE_FREQUENCIES_HZ);
    g.cycle_s = c->cycle_s;
    g.stroke_mm = 5.0;
    g.speed_mm_s = 500.0;
    g.acceleration_mm_s2 = 15000.0;
    g.torque_bound_nm = 10.0;
    g.acceleration_range_m_s2 = c->seat.range_m_s2;
    return g;
}

/* One cycle: the lathe's sensors, gib, the axis. `in` may be spoilt in between; see lathe_calibrate. */
static inline gib_calibration_input lathe_calibration_input(lathe *p)
{
    lathe_reading r = lathe_sense(p);
    gib_calibration_input in;
    memset(&in, 0, sizeof in);
    in.position_mm = r.scale_mm;
    in.torque = r.torque_nm;
    in.ball_bar_um = r.ball_bar_um;
    memcpy(in.acceleration_m_s2, r.acceleration_m_s2, sizeof in.acceleration_m_s2);
    return in;
}

/* Calibrates with one workpiece, or with two of different mass; returns the last status. */
static inline int32_t lathe_calibrate(const lathe_config *c, int32_t method, int workpieces, gib_calibration_table *table)
{
    static const double more_kg[2] = {0.0, 400.0};
    gib_calibration *gib = gib_calibration_new();
    int32_t status = GIB_OK;
    for (int i = 0; i < workpieces && status >= 0; i++) {
        static lathe p;
        lathe_config with = *c;
        gib_calibration_config g = lathe_calibration(c);
        gib_calibration_output out;
        with.head_kg += more_kg[i];
        lathe_init(&p, &with);
        g.method = method;
        g.add = i;
        memset(&out, 0, sizeof out);
        status = gib_calibration_start(gib, &g);
        if (status == GIB_OK) {
            status = GIB_BUSY;
        }
        while (status == GIB_BUSY) {
            gib_calibration_input in = lathe_calibration_input(&p);
            status = gib_calibration_step(gib, &in, &out);
            lathe_cycle(&p, out.target_position_mm, 0.0);
        }
    }
    table->struct_size = sizeof *table;
    if (status == GIB_DONE) {
        status = gib_calibration_result(gib, table);
    }
    gib_calibration_free(gib);
    return status;
}

/* A form to turn: amplitude in mm at a spindle speed that swings by a share of itself, a triangle of two seconds. */
typedef struct {
    lathe_shape shape;
    double speed_rpm, swing_ratio, stroke_mm;
} lathe_job;

/* A job whose stroke asks for some acceleration of the slide, up to 3 mm. */
static inline lathe_job lathe_job_of(lathe_shape shape, double speed_rpm, double swing_ratio, double most_m_s2)
{
    double steepest = 0.0, h = 1e-3, turning = 6.283185307179586 / 60.0 * speed_rpm * (1.0 + swing_ratio);
    for (double a = 0.0; a < 6.3; a += 0.01) {
        double bend = (lathe_form(shape, a + h) - 2.0 * lathe_form(shape, a) + lathe_form(shape, a - h)) / (h * h);
        steepest = fmax(steepest, fabs(bend));
    }
    lathe_job job = {shape, speed_rpm, swing_ratio, fmin(3.0, 1e3 * most_m_s2 / (steepest * turning * turning))};
    return job;
}

static inline double lathe_speed_rpm(const lathe_job *job, double time_s)
{
    double part = 0.5 * time_s - floor(0.5 * time_s);
    return job->speed_rpm * (1.0 + job->swing_ratio * (part < 0.5 ? 4.0 * part - 1.0 : 3.0 - 4.0 * part));
}

static inline gib_vibration_config lathe_vibration(const lathe_config *c, int32_t method)
{
    gib_vibration_config g;
    memset(&g, 0, sizeof g);
    g.struct_size = sizeof g;
    g.method = method;
    g.cycle_s = c->cycle_s;
    g.acceleration_range_m_s2 = c->seat.range_m_s2;
    return g;
}

static inline gib_vibration_input lathe_vibration_input(const lathe_reading *r)
{
    gib_vibration_input in;
    memset(&in, 0, sizeof in);
    in.scale_mm = r->scale_mm;
    in.angle_deg = r->angle_deg;
    memcpy(in.acceleration_m_s2, r->acceleration_m_s2, sizeof in.acceleration_m_s2);
    return in;
}

static inline gib_learning_config lathe_learning(const lathe_config *c, int32_t method)
{
    gib_learning_config g;
    memset(&g, 0, sizeof g);
    g.struct_size = sizeof g;
    g.method = method;
    g.cycle_s = c->cycle_s;
    g.points = 100; /* fewer than a revolution has cycles */
    g.tolerance_um = 0.2;
    g.correction_max_um = 500.0;
    g.lag_s = 4.0 * c->cycle_s; /* of this servo, roughly */
    return g;
}

#endif
