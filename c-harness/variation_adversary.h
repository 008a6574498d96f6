/*
 * Somebody who means a speed variation ill: on a random motor, with a random configuration, what is asked for changes at any time, to
 * anything, also in every cycle; flags, aborts, starts and nonsense come in between. A spindle follows under a power meter. Whatever
 * comes, the laws of `variation_adversary_run` hold; then the same instance varies once more, as one does that never saw a trouble.
 */
#ifndef VARIATION_ADVERSARY_H
#define VARIATION_ADVERSARY_H

#include "spindle_run.h"
#include "adversary.h"

typedef enum {
    VARIATION_OVERRIDE,   /* the mean speed goes up and down, within its bounds, in every cycle */
    VARIATION_CHANGES,    /* speed, amplitude, period and cutting change now and then */
    VARIATION_EVERY_CYCLE, /* the same in every cycle */
    VARIATION_CUT,        /* cutting torque comes and goes, up to more than the motor has */
    VARIATION_SPEED_OUT,  /* of bounds, of sense, or of all measure */
    VARIATION_NO_NUMBER,  /* one input or another */
    VARIATION_AMPLITUDE_OUT,
    VARIATION_PERIOD_OUT,
    VARIATION_CUTTING_OUT,
    VARIATION_DRIVE_FAULT,
    VARIATION_FLAG_UNKNOWN,
    VARIATION_ABORT_FLAG,
    VARIATION_ABORT_CALL,
    VARIATION_STOP,
    VARIATION_STARTED_ANEW,
    VARIATION_CYCLES_LONG,
    VARIATION_DRIVE_WEAK, /* gives no more than a part of its torque */
    VARIATION_TROUBLES
} variation_trouble_kind;
extern const char *const variation_trouble_names[VARIATION_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    VARIATION_NO_MISTAKE,
    VARIATION_JUMPS,
    VARIATION_TOO_FAST,
    VARIATION_NO_COMMAND,   /* no number */
    VARIATION_SAYS_NOTHING,
    VARIATION_NEVER_ENDS,
    VARIATION_TOO_MUCH,     /* a twentieth more torque in the feed-forward */
    VARIATION_TOO_STEEP, /* every change a fifth larger, with its feed-forward */
    VARIATION_TIMID,     /* nine tenths of the amplitude */
    VARIATION_REMEMBERS,
    VARIATION_MISTAKES
} variation_mistake;

enum { VARIATION_MOST_TROUBLES = 4, VARIATION_MEMORY = 4096 };

typedef struct {
    adversary base;
    gib_speed_variation_config config;
    int cycles;
    variation_mistake mistake;
    spindle s;
    /* of a run */
    int named, steady;
    gib_speed_variation_input in, last;
    gib_speed_variation_output out, before;
    double true_cutting_nm;
    double own_rpm; /* gib's command, where a mistake stands for it */
    double loose_nm; /* torque by which the loop may exceed its feed-forward now */
    double high_rpm, low_rpm, mean_rpm; /* of the second run's last period; the mean speed asked for last */
    double way_rpm; /* from the speed at the end of the variation to its mean, and all that this has moved since */
    _Alignas(16) unsigned char memory[2][VARIATION_MEMORY];
    int32_t status[2];
    double worst; /* largest share of power or torque that was demanded, as the meter read it */
} variation_adversary;

void variation_adversary_init(variation_adversary *a, uint64_t seed, variation_mistake mistake);
void variation_adversary_run(variation_adversary *a);

#endif
