/*
 * What every cycle of tilt must keep, whatever happens in it: offsets are numbers, within their size, speed and
 * acceleration; none comes before the operator has accepted; status and phase agree.
 */
#ifndef TILT_LAWS_H
#define TILT_LAWS_H

#include "gib.h"

#include <math.h>
#include <string.h>

typedef struct {
    double most[2], speed[2], acceleration[2]; /* of mm and of degrees, per cycle */
    double value[6], rate[6];
    int accepted; /* the present warning was accepted */
    uint32_t request;
    const char *broken; /* first law broken; NULL: none */
} tilt_laws;

/* The bounds of a configuration whose fields are all set or all left at their defaults. */
static inline void tilt_laws_init(tilt_laws *l, const gib_tilt_config *g)
{
    double t = g->cycle_s;
    tilt_laws empty = {{g->offset_max_mm > 0.0 ? g->offset_max_mm : 5.0, g->offset_max_deg > 0.0 ? g->offset_max_deg : 5.0},
                       {(g->offset_speed_mm_s > 0.0 ? g->offset_speed_mm_s : 20.0) * t,
                        (g->offset_speed_deg_s > 0.0 ? g->offset_speed_deg_s : 1.0) * t},
                       {(g->offset_acceleration_mm_s2 > 0.0 ? g->offset_acceleration_mm_s2 : 100.0) * t * t,
                        (g->offset_acceleration_deg_s2 > 0.0 ? g->offset_acceleration_deg_s2 : 10.0) * t * t},
                       {0},
                       {0},
                       0,
                       0,
                       NULL};
    *l = empty;
}

static inline void tilt_law(tilt_laws *l, int kept, const char *law)
{
    if (!kept && !l->broken) {
        l->broken = law;
    }
}

/* A step with `in` returned `status` and put out `out`. */
static inline void tilt_laws_watch(tilt_laws *l, const gib_tilt_input *in, int32_t status, const gib_tilt_output *out)
{
    const double slack = 1e-9;
    int any = 0;
    for (int i = 0; i < 6; i++) {
        int kind = i / 3;
        double value = i < 3 ? out->offset_mm[i] : out->offset_deg[i - 3], rate = value - l->value[i];
        any |= value != 0.0;
        tilt_law(l, isfinite(value), "an offset is no number");
        tilt_law(l, fpclassify(value) != FP_SUBNORMAL, "an offset is subnormal");
        tilt_law(l, fabs(value) <= l->most[kind] + slack, "an offset is too large");
        tilt_law(l, fabs(rate) <= l->speed[kind] + slack, "an offset is too fast");
        tilt_law(l, fabs(rate - l->rate[i]) <= l->acceleration[kind] * (1.0 + 1e-6) + slack * slack + 1e-12,
                 "an offset accelerates too much");
        l->value[i] = value;
        l->rate[i] = rate;
    }
    if (out->request_id != l->request) {
        tilt_law(l, out->warning, "a request without a warning");
        l->request = out->request_id;
        l->accepted = 0;
    }
    l->accepted |= l->request != 0 && in->acknowledged_id == l->request;
    int p = out->phase;
    tilt_law(l, !any || l->accepted, "an offset before it was accepted");
    tilt_law(l, (p == GIB_TILT_WARNING) == (out->warning == 1), "warning and phase disagree");
    tilt_law(l, status == out->status, "two statuses");
    tilt_law(l, (status == GIB_BUSY) == (p >= GIB_TILT_MEASURING && p <= GIB_TILT_RAMP_OFF), "busy and phase disagree");
    tilt_law(l, (status == GIB_DONE) == (p == GIB_TILT_DONE), "done and phase disagree");
    tilt_law(l, (status < 0) == (p == GIB_TILT_FAILED), "error and phase disagree");
    tilt_law(l, status == GIB_BUSY || !any, "offsets left behind");
}

#endif
