/*
 * Somebody who means a learnt command ill: on a random servo, with a random configuration, up to three troubles come at any time,
 * together or one after the other, stay or pass. Whatever comes, the laws of `learning_adversary_run` hold; then all is mended, and the
 * same instance learns once more, as an instance does that never saw a trouble.
 *
 *   tool     x'' = w²·(command − x) − 2·damping·w·x'       detected a cycle later: a gain near 1, noise, grid
 *   target   a form over the spindle's angle, whose stroke grows over two turns
 */
#ifndef LEARNING_ADVERSARY_H
#define LEARNING_ADVERSARY_H

#include "gib.h"
#include "adversary.h"

typedef enum {
    LEARNING_DETECTED_STUCK,
    LEARNING_DETECTED_NO_NUMBER,
    LEARNING_DETECTED_HUGE,
    LEARNING_DETECTED_FAR,
    LEARNING_DETECTED_JUMPS, /* now and then */
    LEARNING_DETECTED_NOISY,
    LEARNING_DETECTED_SCALED,
    LEARNING_ANGLE_STUCK,
    LEARNING_ANGLE_NO_NUMBER,
    LEARNING_ANGLE_JUMPS, /* for good */
    LEARNING_ANGLE_WILD,
    LEARNING_ANGLE_INVERTED,
    LEARNING_TARGET_NO_NUMBER,
    LEARNING_TARGET_JUMPS,
    LEARNING_SPEED_CHANGES,
    LEARNING_SPINDLE_STOPS,
    LEARNING_SPINDLE_TURNS_BACK,
    LEARNING_DRIVE_WEAK, /* follows a part of the command */
    LEARNING_SHAKEN,
    LEARNING_DRIVE_TRIPS,
    LEARNING_FLAG_UNKNOWN,
    LEARNING_ABORT_FLAG,
    LEARNING_ABORT_CALL,
    LEARNING_STARTED_ANEW, /* as soon as that is possible */
    LEARNING_RESUMED,      /* the same, from what is held */
    LEARNING_CALLED_TWICE,
    LEARNING_CALLS_LOST,
    LEARNING_TROUBLES
} learning_trouble_kind;
extern const char *const learning_trouble_names[LEARNING_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    LEARNING_NO_MISTAKE,
    LEARNING_LEAPS,        /* of the correction, once in a while */
    LEARNING_TOO_FAR,      /* a correction */
    LEARNING_NO_NUMBER,    /* as a command */
    LEARNING_OF_ANOTHER,   /* target: the command of the cycle before */
    LEARNING_SAYS_NOTHING, /* of a fault */
    LEARNING_STAYS,        /* the correction, after a fault */
    LEARNING_NEVER_ENDS,
    LEARNING_TURNED_ROUND, /* a correction that is kept */
    LEARNING_REMEMBERS,    /* something of the run before */
    LEARNING_MISTAKES
} learning_mistake;

enum { LEARNING_MOST_TROUBLES = 3, LEARNING_MEMORY = 131072, LEARNING_FORM = 16 };

typedef struct {
    adversary base;
    gib_learning_config config;
    learning_mistake mistake;
    double turn_cycles, w, damping, gain, noise_mm, grid_mm, counts, lag_um; /* a cycle; of the servo; the sensor; what it lags behind */
    double coefficient[LEARNING_FORM][2];
    int form, wrapped;
    /* of a run */
    int cycles, waits, out_cycles, after, in_phase;
    double angle, rate, angle_added, tool[2], seen, command, stuck[2], target, squares[3], held_from;
    gib_learning_input told;
    gib_learning_output out, before;
    _Alignas(16) unsigned char memory[2][LEARNING_MEMORY];
    int32_t status[2];
    gib_learning_report report[2];
    gib_learning_point points[2][1024];
    double first[2], last[2]; /* deviation without and with what was learnt, µm rms over two turns */
} learning_adversary;

/* Sets up servo, configuration and troubles from one seed. */
void learning_adversary_init(learning_adversary *a, uint64_t seed, learning_mistake mistake);
void learning_adversary_run(learning_adversary *a);
/* Whether a run met no trouble. */
int learning_adversary_clean(const learning_adversary *a, int run);

#endif
