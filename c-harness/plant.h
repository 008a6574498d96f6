/*
 * A small machine axis in C, to try gib on: servo, motor, elastic drive with clearance, table with friction, and
 * sensors. It shares nothing with gib but the header.
 *
 * Everything is referred to the motor, positions in mm of load travel, torques in N·m:
 *
 *   motor    Jm·x'' = T − Tm·sign(x') − Tspring − d·(x' − y')
 *   table    Jt·y'' = Tspring + d·(x' − y') − Ts·sign(y') − B·y' − T0      Tspring = k·deadzone(x − y, clearance)
 *   servo    P position, PI velocity, first-order current loop, on the quantised motor encoder
 *
 * Friction sticks: a body at rest stays there until the break-away torque is exceeded. While motor and table stand,
 * the table creeps until only `hold_ratio` of the sliding torque is held: the partial release of the wind-up.
 *
 * With `presliding_mm` the table's friction gives way before it slides: elements in parallel, each of which takes its share at the
 * stiffness of its contact and slips on. There is no break-away above sliding then, and no creep.
 */
#ifndef PLANT_H
#define PLANT_H

#include <stdint.h>

enum { PLANT_ELEMENTS = 8 };

typedef struct {
    double cycle_s;                /* servo period */
    int substeps;                  /* plant steps in a servo period */
    double motor_inertia_nm_s2_mm; /* N·m per mm/s² */
    double table_inertia_nm_s2_mm;
    double stiffness_nm_mm;
    double damping_nm_s_mm;
    double clearance_mm;
    double friction_nm;     /* sliding friction, motor and table side together */
    double motor_share;     /* of it on the motor's side */
    double breakaway_ratio; /* break-away over sliding friction of the table, 1 or more */
    double viscous_nm_s_mm;
    double constant_nm; /* constant torque on the table */
    double hold_ratio;  /* share of the wind-up held at standstill, 0 to 1; 1: no release */
    double hold_time_s;
    double presliding_mm;       /* way at which the last element of the table's friction slips; 0: it does not give way */
    double presliding_exponent; /* element i of N slips at presliding·((i + ½)/N)^exponent */
    double position_gain_1_s;
    double velocity_gain_nm_s_mm;
    double velocity_integral_time_s; /* 0: none */
    double velocity_feedforward;
    double torque_time_constant_s;
    double torque_limit_nm;
    double encoder_mm;       /* grid of the motor encoder */
    double torque_noise_nm;  /* standard deviation of one torque sample */
    double reversal_kick_nm; /* the control's reversal acceleration: torque added for a moment at a reversal */
    double reversal_kick_s;
    uint64_t seed;
} plant_config;

typedef struct {
    plant_config c;
    double x, vx, y, vy; /* motor and table */
    int table_sticks, motor_sticks;
    double stretch[PLANT_ELEMENTS]; /* of each element of the table's friction, as a share of where it slips */
    double torque; /* what the motor delivers */
    double integral, last_encoder, last_target;
    double command_sense; /* sense of the last commanded motion */
    double kick_left_s;
    double compensation_um; /* the kernel's parameters */
    int reversal_acceleration_on;
    uint64_t random;
    double time_s;
} plant;

/* What a drive reports in a cycle. */
typedef struct {
    double position_mm; /* motor encoder */
    double table_mm;    /* load side, exact */
    double torque_nm;   /* with noise */
} plant_reading;

plant_config plant_default(void);
void plant_init(plant *p, const plant_config *c);
/* Reads the sensors, then runs one servo cycle toward `target_mm`. */
plant_reading plant_cycle(plant *p, double target_mm);
/* Change of (motor - table) between steady slow motion one way and the other, µm, from the table's own motion. */
double plant_true_lost_motion_um(const plant_config *c);
/* The same between rest after one way and rest after the other: what a laser at standstill sees. */
double plant_true_standstill_um(const plant_config *c);
/* Uniform in [0, 1) and standard normal numbers. */
double plant_uniform(uint64_t *state);
double plant_normal(uint64_t *state);

#endif
