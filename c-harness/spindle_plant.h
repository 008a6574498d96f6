/*
 * A small spindle in C, to try gib on: drive, rotor, friction, ripple, sensors, a power meter; and a turning tool that
 * can chatter. It shares nothing with gib but the header.
 *
 *   spindle  J·w' = T + ripple − Tc·sign(w) − B·w − Tcut
 *   drive    PI speed loop and torque feed-forward once a cycle, first-order current loop, torque limit
 *   turning  m·x'' + c·x' + k·x = Kf·depth·(h0 + x(one revolution ago) − x(now)), Altintas, Manufacturing Automation
 */
#ifndef SPINDLE_PLANT_H
#define SPINDLE_PLANT_H

#include <stdint.h>

enum { SPINDLE_LATEST = 3 };

typedef struct {
    double cycle_s;
    double inertia_kg_m2;
    double coulomb_nm;
    double viscous_nm_s;
    double cutting_nm;
    double ripple_nm; /* torque ripple that the drive does not report */
    double ripples_per_turn;
    double torque_limit_nm;
    double torque_noise_nm; /* standard deviation of one torque sample */
    double outlier_ratio;   /* share of torque samples that are wild */
    double speed_grid_rpm;
    double torque_grid_nm;
    double counts_per_turn; /* the speed is the difference of an encoder's counts over a cycle; 0: it is not */
    double torque_constant_nm_a; /* the drive reports a current; 0: it reports torque */
    int torque_late_cycles;      /* the torque reported is this old, up to SPINDLE_LATEST */
    double weakening_rpm; /* above: the drive reports w/w_b times the torque delivered; 0: never */
    double saturation_nm; /* above: it reports T/T_s times that; 0: never */
    double bandwidth_1_s; /* of the speed loop */
    int substeps;         /* of the integration in a cycle */
    uint64_t seed;
} spindle_config;

typedef struct {
    spindle_config c;
    double w, angle; /* rad/s, rad */
    double torque;   /* delivered, N·m */
    double past[SPINDLE_LATEST + 1]; /* torque of this cycle and those before */
    double due; /* speed that was commanded for the end of the cycle before, rad/s */
    double integral;
    double counts; /* read in the cycle before */
    double peak_w; /* power meter: largest of the motor's shaft power since it was cleared, W */
    uint64_t random;
} spindle;

typedef struct {
    double speed_rpm;
    double torque; /* N·m, or A where there is a torque constant */
} spindle_reading;

spindle_config spindle_default(void);
void spindle_init(spindle *s, const spindle_config *c);
/* What the drive reports now. */
spindle_reading spindle_sense(spindle *s);
/* One cycle toward a speed, with torque feed-forward. */
void spindle_cycle(spindle *s, double command_rpm, double feed_forward_nm);

double spindle_rad_s(double rpm);
double spindle_rpm(double rad_s);

/* A tool on a flexible holder, cutting the wave of the revolution before. */
typedef struct {
    double frequency_hz, damping_ratio, stiffness_n_m, cutting_n_m2;
} chatter_config;

/*
 * Whether a depth of cut (m) is stable while the speed follows `speeds` (rad/s, one a cycle of `cycle_s`): the
 * amplitude in the last third has not grown beyond that of the first disturbance.
 */
int chatter_is_stable(const chatter_config *c, double depth_m, const double *speeds, int count, double cycle_s);
/* Largest stable depth, m, by bisection to a hundredth of `most_m`. */
double chatter_stable_depth_m(const chatter_config *c, double most_m, const double *speeds, int count, double cycle_s);

#endif
