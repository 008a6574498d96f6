/*
 * Runs one homing on a plant from start to end, with a fault injected at a chosen moment, and watches that torque and
 * motion stay within bounds and come to rest.
 */
#ifndef HOMING_RUN_H
#define HOMING_RUN_H

#include "homing_plant.h"

#include <math.h>
#include <string.h>

/* Moments at which a fault is injected. */
typedef enum { AT_LIMIT, AT_APPROACH, AT_PRESS, AT_RETRACT, AT_TOUCH, AT_CLEAR, AT_EVALUATE, AT_OFFSET, AT_SET, MOMENTS } moment;

typedef struct {
    int32_t status;
    int cycles;               /* of the whole homing */
    int reaction;             /* cycles from the fault to the end of homing */
    double most_torque_nm;    /* of the real motor */
    double most_travel_mm;    /* of the real table */
    double rest_torque_nm;    /* largest motor torque in a second after the end */
    double rest_way_mm;       /* way of the table in that second */
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

/* Whether the homing is at the moment now. */
static inline int homing_is_at(const gib_homing_output *o, moment m, int in_phase, int touches)
{
    switch (m) {
    case AT_LIMIT: return o->phase == GIB_HOMING_LIMIT && o->request_id != 0;
    case AT_APPROACH: return o->phase == GIB_HOMING_TOUCH && touches == 1 && in_phase > 1500;
    case AT_PRESS: return o->phase == GIB_HOMING_TOUCH && (o->events & GIB_HOMING_EVENT_CONTACT) && in_phase > 20;
    case AT_RETRACT: return o->phase == GIB_HOMING_RETRACT && in_phase > 500;
    case AT_TOUCH: return o->phase == GIB_HOMING_TOUCH && touches == 2 && in_phase > 700;
    case AT_CLEAR: return o->phase == GIB_HOMING_CLEAR;
    case AT_EVALUATE: return o->phase == GIB_HOMING_EVALUATE && in_phase > 20;
    case AT_OFFSET: return o->phase == GIB_HOMING_OFFSET && in_phase > 500;
    case AT_SET: return o->phase == GIB_HOMING_SET;
    default: return 0;
    }
}

/* `truth_mm`: where motor 1 is at contact, toward the stop. */
static inline homing_outcome homing_run(const homing_plant_config *c, const gib_homing_config *g, moment m,
                                        homing_fault fault)
{
    static homing_plant p;
    homing_outcome o;
    int32_t status;
    int phase = -1, in_phase = 0, touches = 0, injected = 0;
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
        in_phase = p.out.phase == phase ? in_phase + 1 : 0;
        touches += p.out.phase == GIB_HOMING_TOUCH && phase != GIB_HOMING_TOUCH;
        phase = p.out.phase;
        for (uint32_t bit = 1; bit != 0; bit <<= 1) {
            if ((p.out.new_events & bit) && o.events < 16) {
                o.order[o.events++] = bit;
            }
        }
        if (!injected && fault != FAULT_NONE && homing_is_at(&p.out, m, in_phase, touches)) {
            injected = o.cycles;
            p.fault = fault;
        }
    } while (status == GIB_BUSY && o.cycles < 2000000);
    o.status = status;
    o.reaction = injected ? o.cycles - injected : 0;
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
    /* The motor leads the table by half the clearance and the wind-up of what the table takes to slide. */
    double slides = (1.0 - c->motor_share) * c->friction_nm + c->constant_nm;
    double lead = copysign(0.5 * c->clearance_mm, slides) + slides / c->stiffness_nm_mm;
    double contact = c->sense * (c->stop_mm[0] + lead);
    double wanted = g->set_position_mm + c->sense * g->zero_offset_mm;
    o.home_error_um = 1e3 * c->sense * (contact + p.shift_mm[0] - wanted);
    gib_homing_free(gib);
    return o;
}

#endif
