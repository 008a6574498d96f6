/*
 * Faults on homing at any cycle: a world is a plant and a gib that can be copied whole, so that from every cycle of one
 * homing another branch can be broken, run to its end and judged.
 */
#ifndef HOMING_FAULTS_H
#define HOMING_FAULTS_H

#include "homing_plant.h"

/* Where a homing is, as a machinist would say. */
typedef enum {
    IN_LIMIT,
    IN_APPROACH,
    IN_PRESS,
    IN_RETRACT,
    IN_TOUCH,
    IN_CLEAR,
    IN_EVALUATE,
    IN_OFFSET,
    IN_SET,
    IN_STOPPING,
    IN_UNLOAD,
    IN_RESTORE,
    STATES,
    IN_REST = STATES
} homing_state;

typedef struct {
    homing_plant plant;
    gib_homing_config config;
    int32_t status;
    int cycles, touches, phase;
    gib_homing_output before; /* what gib asked for in the cycle before the last */
    _Alignas(16) unsigned char memory[80 * 1024]; /* of the gib_homing */
} homing_world;

/* What became of a branch. */
typedef struct {
    int32_t status;
    int named;  /* cycles from the fault to the cycle in which gib names one; 0: never */
    int out;    /* cycles from there until homing has ended */
    int safe;   /* within torque, way and time all along, at rest and with the old limit afterwards */
    const char *unsafe; /* what was not */
} homing_branch;

extern const char *const homing_state_names[STATES];
extern const char *const homing_fault_names[FAULTS];

/* Returns the status of the start. */
int32_t homing_world_start(homing_world *w, const homing_plant_config *c, const gib_homing_config *g);
void homing_world_step(homing_world *w);
homing_state homing_world_state(const homing_world *w);
gib_homing *homing_world_gib(homing_world *w);
/* Breaks `w` now, or aborts it by a call for FAULT_ABORT, and runs it to its end. */
homing_branch homing_world_break(homing_world *w, homing_fault fault);
/* Cycles that the way out takes at most, as the documentation states it. */
int homing_way_out(const gib_homing_config *g);
/* Whether commands that brake go on from the speed of the cycle before, no harder than the acceleration allows. The last cycle of a
 * stop takes up to half as much more. */
int homing_brakes(const gib_homing_config *g, const gib_homing_output *before, const gib_homing_output *now, int motors);
/* Whether `status` is a right answer to `fault`; `first`: what had already been said. */
int homing_names(homing_fault fault, int32_t first, const homing_branch *b);

#endif
