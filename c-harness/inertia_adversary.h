/*
 * Somebody who means an inertia measurement ill: on a random spindle, with a random configuration, up to three troubles come at any
 * time, together or one after the other, stay or pass. Whatever comes, the laws of `inertia_adversary_run` hold; then all is mended,
 * and the same instance measures the spindle's next process step, as an instance does that never saw a trouble.
 */
#ifndef INERTIA_ADVERSARY_H
#define INERTIA_ADVERSARY_H

#include "spindle_run.h"
#include "adversary.h"

typedef enum {
    INERTIA_TORQUE_STUCK,
    INERTIA_TORQUE_DEAD, /* only its noise is left */
    INERTIA_TORQUE_INVERTED,
    INERTIA_TORQUE_NAN,
    INERTIA_TORQUE_INFINITE,
    INERTIA_TORQUE_HUGE,
    INERTIA_TORQUE_LATE, /* by up to fifteen cycles */
    INERTIA_TORQUE_NOISY,
    INERTIA_TORQUE_SCALED,
    INERTIA_TORQUE_OFFSET,
    INERTIA_SPEED_STUCK,
    INERTIA_SPEED_INVERTED,
    INERTIA_SPEED_NAN,
    INERTIA_SPEED_INFINITE,
    INERTIA_SPEED_HUGE,
    INERTIA_SPEED_LATE,
    INERTIA_SPEED_NOISY,
    INERTIA_SPEED_SCALED,
    INERTIA_DRIVE_SATURATES, /* gives no more than a part of its torque, and says so */
    INERTIA_DRIVE_TRIPS,     /* and says so */
    INERTIA_DRIVE_DIES,      /* and says nothing */
    INERTIA_DRIVE_REFUSES,   /* stays at the command it had */
    INERTIA_JAMMED,
    INERTIA_LOAD, /* cuts */
    INERTIA_CYCLES_LONG,
    INERTIA_FLAG_UNKNOWN,
    INERTIA_STARTED_ANEW, /* while busy, with another configuration */
    INERTIA_ABORT_FLAG,
    INERTIA_ABORT_CALL,
    INERTIA_FINISHED, /* as the end of listening */
    INERTIA_TROUBLES
} inertia_trouble_kind;
extern const char *const inertia_trouble_names[INERTIA_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    INERTIA_NO_MISTAKE,
    INERTIA_JUMPS,     /* of the command, once */
    INERTIA_TOO_FAST,  /* a command beyond the ramp's end */
    INERTIA_NO_NUMBER, /* as a command, once */
    INERTIA_SAYS_NOTHING, /* of a fault */
    INERTIA_NEVER_ENDS,
    INERTIA_OFF,      /* a value a fifth off */
    INERTIA_REMEMBERS, /* something of the run before */
    INERTIA_MISTAKES
} inertia_mistake;

enum { INERTIA_MOST_TROUBLES = 3, INERTIA_MEMORY = 32768, INERTIA_LATEST = 16 };

typedef struct {
    adversary base;
    spindle_config plant[2]; /* of the first process step and the next */
    gib_inertia_config config[2];
    double start_rpm;
    inertia_mistake mistake;
    /* of a run */
    spindle s;
    int named;
    spindle_reading stuck, late[INERTIA_LATEST];
    double first_rpm, refused_rpm, command_rpm;
    double extra; /* time that was longer than its cycles, over that of the cycles */
    gib_inertia_input told;
    gib_inertia_output out, before;
    _Alignas(16) unsigned char memory[2][INERTIA_MEMORY];
    /* of each run: how it ended, its result, the value's error and its uncertainty over the truth */
    int32_t status[2], result[2];
    gib_inertia_report report[2];
    double error[2];
    gib_error_detail detail[2];
} inertia_adversary;

/* Sets up spindle, configuration and troubles from one seed. */
void inertia_adversary_init(inertia_adversary *a, uint64_t seed, inertia_mistake mistake);
void inertia_adversary_run(inertia_adversary *a);
/* Whether a run met no trouble, and nothing that only the configuration could tell: its interval must hold as it says. */
int inertia_adversary_clean(const inertia_adversary *a, int run);

#endif
