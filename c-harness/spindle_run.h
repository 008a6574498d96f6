/*
 * gib at work on the simulated spindle: one measurement of inertia, one variation under the power meter, and random
 * spindles to try both on. For the tests and the demo.
 */
#ifndef SPINDLE_RUN_H
#define SPINDLE_RUN_H

#include "draws.h"
#include "gib.h"
#include "spindle_plant.h"

/* A spindle of 0.01 to 5 kg.m2 with friction up to half of its rated torque, ripple and 3 % noise; rated at half its limit. */
spindle_config spindle_random(uint64_t *state);
/* Ramps that fit it: from a tenth of the speed up at `share` of the rated torque, twice. */
gib_inertia_config spindle_ramps(const spindle_config *sc, double high_rpm, double share);

/* One measurement on a spindle at rest; the status of the cycle, or of the result once that is done. */
int32_t spindle_measure(const spindle_config *sc, const gib_inertia_config *c, gib_inertia_report *report);

/* What is wrong with a drive's signals beside noise, ripple and wild samples. */
typedef enum {
    SIGNAL_USUAL,
    SIGNAL_COARSE_SPEED, /* read in steps of 1 rpm */
    SIGNAL_COUNTS,       /* speed from the counts of an encoder, 4096 a turn: steps of 14.6 rpm */
    SIGNAL_CURRENT,      /* current, to be taken by the torque constant */
    SIGNAL_LATE_TORQUE,  /* the torque is one cycle old */
    SIGNAL_ALL,
    SIGNAL_KINDS
} signal_kind;
extern const char *const SIGNAL_NAMES[SIGNAL_KINDS];
/* Measures `runs` random spindles; relative errors in ascending order, and how many intervals hold the truth. */
int errors_of_random(uint64_t seed, signal_kind kind, double *errors, int runs);

/* The source's example: J 0.5, S 1000, P 10 kW, R 2 s, and an amplitude that the motor can do. */
gib_speed_variation_config variation_example(void);
/* Any motor, spindle, speed, period and load that leave something to vary with; the amplitude is not set. */
gib_speed_variation_config variation_random(uint64_t *state);
/*
 * Largest motor power while a variation runs for some periods, as a share of the motor's; negative: the status it was
 * refused with. The spindle has the configuration's inertia, friction and cutting torque, and a drive without a limit.
 */
double variation_power(const gib_speed_variation_config *c);
/*
 * What `runs` random spindles draw at gib's limit, in ascending order; of how many, since those are left out whose limit is
 * not the power, and those that could do less than 0.6 %: what that does against chatter is nothing, and the drive's own
 * overshoot at a corner is larger.
 */
#define LEAST_AMPLITUDE 0.006
int drawn_by_random(uint64_t seed, double *drawn, int runs);

#endif
