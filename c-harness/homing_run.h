/*
 * Runs one homing on a plant from start to end, and watches that torque and motion stay within bounds and come to rest.
 */
#ifndef HOMING_RUN_H
#define HOMING_RUN_H

#include "homing_plant.h"

#include <math.h>
#include <string.h>

typedef struct {
    int32_t status;
    int cycles;               /* of the whole homing */
    double most_torque_nm;    /* of the real motor */
    double most_travel_mm;    /* of the real table */
    double rest_torque_nm;    /* largest motor torque in a second after the end */
    double rest_way_mm;       /* way of the table in that second */
    double touched_mm[2];     /* where each motor was when its table met the stop last, as the plant has it */
    double limit_nm;          /* limit in force at the end */
    uint32_t order[16];       /* events as they came */
    int events;
    double home_error_um;     /* machine coordinate of the contact point of motor 1, as the kernel would show it */
    gib_homing_report report;
    gib_error_detail detail;
} homing_outcome;

static inline gib_homing_config homing_config(const homing_plant_config *c)
{
    gib_homing_config g;
    memset(&g, 0, sizeof g);
    g.struct_size = sizeof g;
    g.direction = c->sense > 0.0 ? 1 : -1;
    g.motors = c->motors;
    g.cycle_s = c->cycle_s;
    g.torque_limit_nm = 5.0;
    g.distance_max_mm = 8.0;
    g.zero_offset_mm = 2.0;
    return g;
}

static inline homing_outcome homing_run(const homing_plant_config *c, const gib_homing_config *g)
{
    static homing_plant p;
    homing_outcome o;
    int32_t status;
    memset(&o, 0, sizeof o);
    homing_plant_init(&p, c);
    gib_homing *gib = gib_homing_new();
    o.status = gib_homing_start(gib, g);
    if (o.status != GIB_OK) {
        gib_homing_free(gib);
        return o;
    }
    do {
        const gib_homing_input *in = homing_plant_cycle(&p);
        status = gib_homing_step(gib, in, &p.out);
        o.cycles++;
        for (uint32_t bit = 1; bit != 0; bit <<= 1) {
            if ((p.out.new_events & bit) && o.events < 16) {
                o.order[o.events++] = bit;
            }
        }
    } while (status == GIB_BUSY && o.cycles < 2000000);
    o.status = status;
    o.touched_mm[0] = p.side[0].touched_mm;
    o.touched_mm[1] = p.side[1].touched_mm;
    o.most_torque_nm = p.most_torque_nm;
    o.most_travel_mm = p.most_travel_mm;
    gib_homing_result(gib, &o.report);
    gib_homing_last_error(gib, &o.detail);
    /* Half a second to swing out, then a second of rest. */
    double from = 0.0;
    for (int i = 0; i < 1500; i++) {
        gib_homing_step(gib, homing_plant_cycle(&p), &p.out);
        if (i == 500) {
            from = p.side[0].y;
        }
        if (i > 500) {
            o.rest_torque_nm = fmax(o.rest_torque_nm, fabs(p.side[0].torque));
            o.rest_way_mm = fmax(o.rest_way_mm, fabs(p.side[0].y - from));
        }
    }
    o.limit_nm = p.limit_nm;
    double approach = g->approach_speed_mm_s > 0.0 ? g->approach_speed_mm_s : 1.0;
    double touch = g->touch_speed_mm_s > 0.0 ? g->touch_speed_mm_s : fmin(approach, 1.0);
    double contact = c->sense * (c->stop_mm[0] + homing_plant_lead(c, touch));
    double wanted = g->set_position_mm + c->sense * g->zero_offset_mm;
    o.home_error_um = 1e3 * c->sense * (contact + p.shift_mm[0] - wanted);
    gib_homing_free(gib);
    return o;
}

#endif
