/*
 * Somebody who means a tilt measurement and its offsets ill: on a random machine, with a random configuration, up to three troubles
 * come at any time, together or one after the other, stay or pass. Whatever comes, the laws of `tilt_adversary_run` hold; then all is
 * mended, and the same instance measures once more, as an instance does that never saw a trouble.
 */
#ifndef TILT_ADVERSARY_H
#define TILT_ADVERSARY_H

#include "tilt_laws.h"
#include "tilt_matrices.h"
#include "adversary.h"

typedef enum {
    TILT_LOAD_STUCK,
    TILT_LOAD_DEAD, /* nothing, or only noise */
    TILT_LOAD_NO_NUMBER,
    TILT_LOAD_HUGE,
    TILT_LOAD_JUMPS, /* by a share, and stays there */
    TILT_LOAD_NOISY,
    TILT_LOAD_SATURATED,
    TILT_LOAD_LATE, /* by up to two blocks */
    TILT_LOAD_FOREIGN, /* that of another drive */
    TILT_LOAD_MISSING, /* in some cycles */
    TILT_SPEED_STUCK,
    TILT_SPEED_DEAD,
    TILT_SPEED_NO_NUMBER,
    TILT_SPEED_SCALED,
    TILT_POSITION_STUCK,
    TILT_POSITION_NO_NUMBER,
    TILT_POSITION_JUMPS,
    TILT_POSITION_CLOSED, /* the kernel gives back coordinates with the offsets in them */
    TILT_POSITION_SWAPPED,
    TILT_ANGLE_TURNS, /* a rotary axis turns while the workpiece is cut */
    TILT_ANGLE_NO_NUMBER,
    TILT_CUTTING_ALWAYS, /* the flag */
    TILT_CUTTING_NEVER,
    TILT_CUTTING_FLICKERS,
    TILT_FEED_CHANGED, /* by an override */
    TILT_FEED_HELD,
    TILT_TOOL_BREAKS,
    TILT_SKIN, /* a harder part of the workpiece */
    TILT_ENDS_EARLY,
    TILT_TAKEN_OFF,
    TILT_DRIVE_TRIPS,
    TILT_FLAG_UNKNOWN,
    TILT_ABORT_FLAG,
    TILT_ABORT_CALL,
    TILT_STARTED_ANEW, /* while busy, with another configuration */
    TILT_NO_ANSWER,
    TILT_ANSWERS_WILDLY,
    TILT_ANSWERS_AGAIN, /* an old acknowledgement */
    TILT_CALLED_TWICE,
    TILT_CALLS_LOST,
    TILT_TROUBLES
} tilt_trouble_kind;
extern const char *const tilt_trouble_names[TILT_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    TILT_NO_MISTAKE,
    TILT_JUMPS,        /* an offset, once */
    TILT_TOO_FAR,      /* an offset */
    TILT_NO_NUMBER,    /* as an offset, once */
    TILT_ASKS_NOBODY,  /* before offsets come */
    TILT_SAYS_NOTHING, /* of a fault */
    TILT_NEVER_ENDS,
    TILT_KEEPS,     /* an offset at the end */
    TILT_NO_DOUBT,  /* a value without an uncertainty */
    TILT_OFF,       /* a value a third off */
    TILT_WRONG_WAY, /* offsets with the other sign */
    TILT_REMEMBERS, /* something of the run before */
    TILT_MISTAKES
} tilt_mistake;

enum { TILT_MOST_TROUBLES = 3, TILT_MEMORY = 196608, TILT_LATEST = 128, TILT_MOST_PASSES = 6 };

typedef struct {
    adversary base;
    gib_tilt_config config;
    gib_tilt_table table;
    tilt_mistake mistake;
    tilt_axis axes[2];
    tilt_plane plane;
    double load_at_0, rise, knee, knee_mm; /* load of a depth: at none, a mm, and what it bends by */
    double noise, slow, slow_cycles, chips, wear_1_m, entry_mm;
    double way[TILT_MOST_PASSES][4]; /* x y from and to, from the start */
    int passes, pass_cycles, air, answers, after;
    double extent_mm, needed_mm;
    /* of a run */
    int pass, n, named, in_phase, corner, waited, slowed, tried, rested;
    double at[2], share, cut_m, drift, phase, stuck[3], late[TILT_LATEST], depth[3], fastest[2];
    int jammed, sign;
    uint32_t made; /* requests of the runs before */
    tilt_laws laws;
    gib_tilt_input told;
    gib_tilt_output out, before;
    _Alignas(16) unsigned char memory[2][TILT_MEMORY];
    /* of each run: how it ended, and what it found; the largest difference of depth with the offsets in force, below 0: none */
    int32_t status[2];
    gib_tilt_report report[2];
    gib_error_detail detail[2];
    double left_mm[2], before_mm;
} tilt_adversary;

/* Sets up machine, configuration and troubles from one seed. */
void tilt_adversary_init(tilt_adversary *a, uint64_t seed, tilt_mistake mistake);
void tilt_adversary_run(tilt_adversary *a);
/* Whether a run met no trouble: it must come to a value that holds as it says. */
int tilt_adversary_clean(const tilt_adversary *a, int run);
/* Angle of the surface about x (axis 0) and y (1), degrees, and to the path's plane (-1); of a line what is along it. */
double tilt_adversary_truth(const tilt_adversary *a, int run, int axis);

/* Between its parts: what the kernel tells. */
void tilt_adversary_tell(tilt_adversary *a);

#endif
