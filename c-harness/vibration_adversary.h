/*
 * Somebody who means a corrected tool position ill: on a random machine, with a random configuration, up to three troubles come at any
 * time, together or one after the other, stay or pass. Whatever comes, the laws of `vibration_adversary_run` hold; then all is mended,
 * and the same instance corrects once more, as an instance does that never saw a trouble.
 *
 *   part n     xn'' = takesn·a(t) − wn²·xn − 2·dampingn·wn·xn'      seat and bearing; a: the slide's, and unbalance on the bearing
 *   slide      form(angle), whose acceleration is form''·speed² + form'·change of speed
 *   sensor n   gainn of (xn'', with a second slide also its acceleration) through a lag of first order; offset, drift, noise, grid
 *
 * The tool is at scale + second slide + x0 − x1 against the workpiece.
 */
#ifndef VIBRATION_ADVERSARY_H
#define VIBRATION_ADVERSARY_H

#include "gib.h"
#include "adversary.h"

typedef enum {
    VIBRATION_SENSOR_STUCK, /* one of seat and bearing; so for all of a sensor */
    VIBRATION_SENSOR_DEAD,
    VIBRATION_SENSOR_INVERTED,
    VIBRATION_SENSOR_NO_NUMBER,
    VIBRATION_SENSOR_HUGE,
    VIBRATION_SENSOR_JUMPS, /* its offset */
    VIBRATION_SENSOR_NOISY,
    VIBRATION_SENSOR_SCALED,
    VIBRATION_SENSORS_SWAPPED,
    VIBRATION_SENSORS_SLOW, /* told anew in every second cycle only */
    VIBRATION_ANGLE_STUCK,
    VIBRATION_ANGLE_NO_NUMBER,
    VIBRATION_ANGLE_JUMPS, /* for good */
    VIBRATION_ANGLE_WILD,
    VIBRATION_ANGLE_INVERTED,
    VIBRATION_SCALE_NO_NUMBER,
    VIBRATION_SCALE_HUGE,
    VIBRATION_SECOND_NO_NUMBER,
    VIBRATION_SECOND_HUGE,
    VIBRATION_SECOND_JUMPS,
    VIBRATION_SPEED_CHANGES,
    VIBRATION_SPINDLE_STOPS,
    VIBRATION_SPINDLE_TURNS_BACK,
    VIBRATION_BLOWS, /* on the machine */
    VIBRATION_SHAKEN, /* from outside */
    VIBRATION_DRIVE_TRIPS,
    VIBRATION_FLAG_UNKNOWN,
    VIBRATION_ABORT_FLAG,
    VIBRATION_ABORT_CALL,
    VIBRATION_STARTED_ANEW, /* as soon as that is possible, with another configuration */
    VIBRATION_CALLED_TWICE,
    VIBRATION_CALLS_LOST,
    VIBRATION_TROUBLES
} vibration_trouble_kind;
extern const char *const vibration_trouble_names[VIBRATION_TROUBLES];

/* Mistakes put in on purpose, as if gib had made them, to see that the laws can fail. */
typedef enum {
    VIBRATION_NO_MISTAKE,
    VIBRATION_LEAPS,       /* of the correction, once */
    VIBRATION_TOO_FAR,     /* a correction */
    VIBRATION_NO_NUMBER,   /* as a position */
    VIBRATION_OF_ANOTHER,  /* scale: the position of the cycle before */
    VIBRATION_SAYS_NOTHING, /* of a fault */
    VIBRATION_STAYS,       /* whatever is wrong */
    VIBRATION_NEVER_COMES, /* though all is well */
    VIBRATION_HALF,        /* a correction */
    VIBRATION_HARMS,       /* sometimes */
    VIBRATION_REMEMBERS,   /* something of the run before */
    VIBRATION_MISTAKES
} vibration_mistake;

enum { VIBRATION_MOST_TROUBLES = 3, VIBRATION_MEMORY = 8192, VIBRATION_FORM = 16 };

typedef struct {
    adversary base;
    gib_vibration_config config, given;
    gib_calibration_table table;
    int has_table, form;
    vibration_mistake mistake;
    double turn_cycles, revolutions, swing, swing_turns; /* the spindle: cycles of a revolution, what its speed swings by */
    double coefficient[VIBRATION_FORM][2], unbalance[2], second[2]; /* of the forms, in µm as the seat takes it */
    int second_multiple;
    double w[2], damping[2], takes[2], gain[2], lag_s[2], offset[2], drift[2], noise[2], grid, scale_grid, counts;
    int wrapped, steps;
    /* of a run */
    int cycles, bad, good_cycles;
    double angle, rate, told_angle, angle_added, part[2][2], seen[2], filtered[2], stuck[3], held[2], scale_mm;
    double truth, truths, errors, worst, peak;
    gib_vibration_input told, told_before;
    gib_vibration_output out, before;
    _Alignas(16) unsigned char memory[2][VIBRATION_MEMORY];
    int32_t status[2];
    double left[2], without[2], floor_um[2]; /* of the last revolutions: error with and without, what noise explains, µm rms */
} vibration_adversary;

/* Sets up machine, configuration and troubles from one seed. */
void vibration_adversary_init(vibration_adversary *a, uint64_t seed, vibration_mistake mistake);
void vibration_adversary_run(vibration_adversary *a);
/* Sum over the harmonics of the displacement times harmonic^power, of both parts or the larger, µm at the speed meant. */
double vibration_adversary_swings(const vibration_adversary *a, int power, int largest);
/* Whether a run met no trouble. */
int vibration_adversary_clean(const vibration_adversary *a, int run);

#endif
