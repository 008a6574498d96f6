/*
 * Somebody who means a calibration of accelerometers ill: on a random machine, with a random configuration, up to three troubles come
 * at any time, together or one after the other, stay or pass. Whatever comes, the laws of `calibration_adversary_run` hold; then all is
 * mended, and the same instance calibrates once more, as an instance does that never saw a trouble.
 */
#ifndef CALIBRATION_ADVERSARY_H
#define CALIBRATION_ADVERSARY_H

#include "gib.h"
#include "adversary.h"

typedef enum {
    CALIBRATION_SENSOR_STUCK, /* one of seat, bearing and ball bar; so for all of a sensor */
    CALIBRATION_SENSOR_DEAD,
    CALIBRATION_SENSOR_INVERTED,
    CALIBRATION_SENSOR_NO_NUMBER,
    CALIBRATION_SENSOR_HUGE,
    CALIBRATION_SENSOR_JUMPS, /* its offset */
    CALIBRATION_SENSOR_NOISY,
    CALIBRATION_SENSOR_SCALED,
    CALIBRATION_SENSORS_SWAPPED,
    CALIBRATION_TORQUE_HUGE,
    CALIBRATION_TORQUE_NO_NUMBER,
    CALIBRATION_TORQUE_STUCK,
    CALIBRATION_POSITION_STUCK,
    CALIBRATION_POSITION_INVERTED,
    CALIBRATION_POSITION_NO_NUMBER,
    CALIBRATION_POSITION_JUMPS,
    CALIBRATION_DRIVE_TRIPS, /* and says so */
    CALIBRATION_DRIVE_DIES,  /* and says nothing */
    CALIBRATION_DRIVE_WEAK,  /* follows a part of the command */
    CALIBRATION_SHAKEN,      /* from outside */
    CALIBRATION_FLAG_UNKNOWN,
    CALIBRATION_ABORT_FLAG,
    CALIBRATION_ABORT_CALL,
    CALIBRATION_STARTED_ANEW, /* while busy */
    CALIBRATION_CALLED_TWICE,
    CALIBRATION_CALLS_LOST,
    CALIBRATION_TROUBLES
} calibration_trouble_kind;
extern const char *const calibration_trouble_names[CALIBRATION_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    CALIBRATION_NO_MISTAKE,
    CALIBRATION_JUMPS,     /* of the command, once */
    CALIBRATION_TOO_FAR,   /* a command */
    CALIBRATION_NO_NUMBER, /* as a command */
    CALIBRATION_SAYS_NOTHING, /* of a fault */
    CALIBRATION_NEVER_ENDS,
    CALIBRATION_NO_DOUBT,  /* a gain without an uncertainty */
    CALIBRATION_OFF,       /* a gain a third off */
    CALIBRATION_REMEMBERS, /* something of the run before */
    CALIBRATION_MISTAKES
} calibration_mistake;

enum { CALIBRATION_MOST_TROUBLES = 3, CALIBRATION_MEMORY = 32768 };

typedef struct {
    adversary base;
    gib_calibration_config config;
    calibration_mistake mistake;
    /* Servo, 1/s; seat and bearing: their springs, what of the slide's acceleration they take; gains of the sensors and their noise. */
    double bandwidth, spring[2], damping[2], takes[2], gain[2], noise[3], mass, torque_unit;
    /* of a run */
    int named, in_phase;
    double start_mm, origin_mm, command, slide[3], part[2][2], acceleration[2], seen[2], stuck[5], goal_mm[2];
    gib_calibration_input told;
    gib_calibration_output out, before, earlier;
    _Alignas(16) unsigned char memory[2][CALIBRATION_MEMORY];
    int32_t status[2];
    gib_calibration_table table[2];
    double worst[2]; /* error of a gain over what is allowed */
    int held[2], known[2];
} calibration_adversary;

/* Sets up machine, configuration and troubles from one seed. */
void calibration_adversary_init(calibration_adversary *a, uint64_t seed, calibration_mistake mistake);
void calibration_adversary_run(calibration_adversary *a);
/* Whether a run met no trouble. */
int calibration_adversary_clean(const calibration_adversary *a, int run);

#endif
