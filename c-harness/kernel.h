/*
 * The part of an NC kernel that serves gib on a simulated axis: follows targets, carries out requests, acknowledges.
 * Shows in a few lines what a real kernel has to do.
 */
#ifndef KERNEL_H
#define KERNEL_H

#include "gib.h"
#include "plant.h"

#include <stdio.h>

typedef struct {
    plant *axis;
    double command_mm;       /* the kernel's own command while gib does not own the motion */
    uint32_t done_id;        /* last request carried out */
    gib_backlash_output out; /* what gib asked for in the last cycle */
    plant_reading reading;
    int deaf;        /* fault injection: requests are not carried out */
    FILE *recording; /* one row a cycle; NULL: none */
    double time_s;
} kernel;

static inline void kernel_init(kernel *k, plant *axis)
{
    kernel empty = {0};
    *k = empty;
    k->axis = axis;
}

/* The axis moves for one cycle; what gib is to see of it. */
static inline gib_backlash_input kernel_sense(kernel *k)
{
    double target = k->out.owns_motion ? k->out.target_position_mm : k->command_mm;
    k->command_mm = target;
    k->reading = plant_cycle(k->axis, target);
    if (k->out.request_id != k->done_id && !k->deaf) {
        k->axis->compensation_um = k->out.compensation_um;
        k->axis->reversal_acceleration_on = !k->out.reversal_acceleration_off;
        k->done_id = k->out.request_id;
    }
    if (k->recording) {
        fprintf(k->recording, "%.4f,%.6f,%.6f,%.6f,%.5f\n", k->time_s, target, k->reading.position_mm,
                k->reading.table_mm, k->reading.torque_nm);
    }
    k->time_s += k->axis->c.cycle_s;
    gib_backlash_input in = {0};
    in.position_mm = k->reading.position_mm;
    in.torque = k->reading.torque_nm;
    in.compensation_um = k->axis->compensation_um;
    in.acknowledged_id = k->done_id;
    return in;
}

/* One servo cycle: the axis moves, gib sees it and answers. Returns gib's status. */
static inline int32_t kernel_cycle(kernel *k, gib_backlash *gib)
{
    gib_backlash_input in = kernel_sense(k);
    return gib_backlash_step(gib, &in, &k->out);
}

#endif
