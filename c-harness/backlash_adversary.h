/*
 * Somebody who means a lost-motion measurement ill: on a random axis, with a random configuration, up to three troubles come at any
 * time, together or one after the other, stay or pass. Whatever comes, the laws of `backlash_adversary_run` hold; then all is mended,
 * and the same instance measures once more, as an instance does that never saw a trouble.
 */
#ifndef BACKLASH_ADVERSARY_H
#define BACKLASH_ADVERSARY_H

#include "gib.h"
#include "plant.h"
#include "adversary.h"

typedef enum {
    BACKLASH_TORQUE_STUCK,
    BACKLASH_TORQUE_DEAD, /* only its noise is left */
    BACKLASH_TORQUE_INVERTED,
    BACKLASH_TORQUE_NO_NUMBER,
    BACKLASH_TORQUE_HUGE,
    BACKLASH_TORQUE_LATE, /* by up to fifteen cycles */
    BACKLASH_TORQUE_NOISY,
    BACKLASH_TORQUE_OFFSET,
    BACKLASH_POSITION_STUCK,
    BACKLASH_POSITION_INVERTED,
    BACKLASH_POSITION_NO_NUMBER,
    BACKLASH_POSITION_HUGE,
    BACKLASH_POSITION_JUMPS, /* once, by up to 2 mm */
    BACKLASH_POSITION_NOISY,
    BACKLASH_AMOUNT_NO_NUMBER, /* the compensation in force, as the kernel tells it */
    BACKLASH_AMOUNT_FOREIGN,   /* somebody else changes it */
    BACKLASH_DRIVE_TRIPS,      /* and says so */
    BACKLASH_DRIVE_DIES,       /* and says nothing */
    BACKLASH_JAMMED,           /* the table */
    BACKLASH_FRICTION,         /* more or less of it */
    BACKLASH_LOAD,             /* a constant force, as of a counterweight that is let go */
    BACKLASH_DEAF,             /* requests are neither carried out nor acknowledged */
    BACKLASH_LATE,             /* they are, after up to a second */
    BACKLASH_LIAR,             /* they are acknowledged and not carried out */
    BACKLASH_ANSWERS_WILDLY,
    BACKLASH_COMMAND_LATE,     /* by up to seven cycles, as over a field bus */
    BACKLASH_CYCLES_LOST,      /* gib is not called */
    BACKLASH_FLAG_UNKNOWN,
    BACKLASH_STARTED_ANEW, /* while busy, with another configuration */
    BACKLASH_ABORT_FLAG,
    BACKLASH_ABORT_CALL,
    BACKLASH_SWITCHED_OFF, /* by the operator */
    BACKLASH_TROUBLES
} backlash_trouble_kind;
extern const char *const backlash_trouble_names[BACKLASH_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    BACKLASH_NO_MISTAKE,
    BACKLASH_JUMPS,        /* of the command, once */
    BACKLASH_NO_NUMBER,    /* as a command, once */
    BACKLASH_SAYS_NOTHING, /* of a fault */
    BACKLASH_NEVER_ENDS,
    BACKLASH_KEEPS,   /* what it changed, after a fault */
    BACKLASH_OFF,     /* an amount a third off */
    BACKLASH_FORGETS, /* its way out: the reversal acceleration stays off */
    BACKLASH_REMEMBERS, /* something of the run before */
    BACKLASH_MISTAKES
} backlash_mistake;

enum { BACKLASH_MOST_TROUBLES = 3, BACKLASH_MEMORY = 131072, BACKLASH_LATEST = 16 };

typedef struct {
    adversary base;
    plant_config c;
    gib_backlash_config config;
    int answer_cycles;
    double truth_um, old_um, longest; /* lost motion; amount at the start; cycles that a run may take */
    backlash_mistake mistake;
    /* of a run */
    plant axis;
    int named;
    uint32_t asked_id, done_id, counted; /* requests asked for, carried out, made before this run */
    int asked_at;
    double foreign_um; /* amount that somebody else set */
    double command_mm, late_mm[BACKLASH_LATEST];
    plant_reading stuck, past[BACKLASH_LATEST];
    gib_backlash_input told;
    gib_backlash_output out, before;
    _Alignas(16) unsigned char memory[2][BACKLASH_MEMORY];
    /* of each run: how it ended, and what it found */
    int32_t status[2];
    gib_backlash_report report[2];
} backlash_adversary;

/* Sets up axis, configuration and troubles from one seed. */
void backlash_adversary_init(backlash_adversary *a, uint64_t seed, backlash_mistake mistake);
void backlash_adversary_run(backlash_adversary *a);
/* Whether a run met no trouble: it must come to a value that holds as it says. */
int backlash_adversary_clean(const backlash_adversary *a, int run);

#endif
