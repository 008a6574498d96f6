/*
 * Somebody who means homing ill: on a random axis, with a random configuration, up to four troubles come at any time, together or
 * one after the other, stay or pass; a kernel that answers late, twice or before it was asked; sensors that lie for a while.
 * Whatever comes, the laws of `homing_adversary_run` hold.
 */
#ifndef HOMING_ADVERSARY_H
#define HOMING_ADVERSARY_H

#include "homing_faults.h"

/* What may happen beside the faults of homing_plant.h; it lies between plant and gib. */
typedef enum {
    ANSWERS_LATE = FAULTS, /* by up to twice the time allowed */
    ANSWERS_TWICE,         /* the number before comes again and again */
    ANSWERS_EARLY,         /* with the number that comes next */
    ANSWERS_WILDLY,
    NUMBERS_BURST, /* of what is no number, one reading or another */
    TORQUE_SPIKES, /* finite, up to the largest there is */
    TORQUE_OFFSET,
    LIMIT_FLICKERS, /* as the kernel tells it */
    COMMAND_LATE,   /* by some cycles, as over a field bus */
    OTHER_CONFIG,   /* a start with another configuration, and scribbling over the first */
    CALLED_TO_ABORT,
    TROUBLES
} homing_trouble_kind;

typedef struct {
    int kind, side;
    homing_state state; /* begins so many cycles after this state was entered, ends so many later */
    int after, lasts;
    int begun; /* cycle, or 0 */
    int over;
} homing_trouble;

#define HOMING_TROUBLES 4

typedef struct {
    homing_world world;
    gib_homing_config scribbled;
    homing_trouble trouble[HOMING_TROUBLES];
    int troubles;
    uint64_t random;
    int in_state;
    homing_state state;
    /* of the cycle before and of the run */
    gib_homing_output before;
    double told[2][2]; /* positions of the last two cycles */
    int limited, set; /* the torque limit was in force; was given back */
    double lie_mm[2]; /* most that the encoder has hidden toward the stop */
    double torque_nm[2]; /* of the real motors in the cycle before */
    double slipped_mm;   /* by the end of the last touch */
    double late[8][2];
    int named, ended, cycles;
    uint32_t events;
    double stop_mm, home_error_um;
    const char *broken; /* first law broken, or NULL */
    int broken_at;
} homing_adversary;

const char *homing_trouble_name(int kind);
/* Sets up axis, configuration and troubles from one seed. */
void homing_adversary_init(homing_adversary *a, uint64_t seed);
/* Runs it to its end, watches it come to rest, mends all and homes anew; `broken` says which law did not hold. */
void homing_adversary_run(homing_adversary *a);

#endif
