/*
 * A small lathe for noncircular turning in C, to try gib on: a slide that a linear motor drives against its seat, the
 * bed that rocks under both, and the headstock with the workpiece. It shares nothing with gib but the header.
 *
 *   slide      ms·xs'' = F − d·(xs' − x1')
 *   seat       m1·x1'' = −F + d·(xs' − x1') − F1        F1 = k1·(x1 − xb − a·p) + c1·(...)'
 *   bed        mb·xb'' = F1 + Fh − kb·xb − cb·xb' + hall
 *   rocking    I·p''   = a·F1 − b·Fh − kp·p − cp·p'
 *   headstock  mh·xh'' = −Fh + U·w²·cos(angle)          Fh = kh·(xh − xb + b·p) + ch·(...)'
 *   servo      force asked for = ms·acceleration + P and D on the scale, held for a cycle; F follows it, first order
 *   sensor     acceleration through a filter of second order, critically damped, against aliasing; then gain and the rest
 *
 * Integrated by Runge and Kutta's method of fourth order, `substeps` times a cycle. The scale reads xs − x1; where the tool
 * is against the workpiece is xs − xh. m, kg, N, rad inside; what the sensors give is in mm, µm, m/s².
 */
#ifndef LATHE_PLANT_H
#define LATHE_PLANT_H

#include <stdint.h>

/* One accelerometer: what it makes of the truth. */
typedef struct {
    double gain_ratio;     /* 1: right */
    double lag_s;          /* time constant of its filter, twice */
    double offset_m_s2;
    double drift_m_s2_s;   /* of the offset, a second */
    double wander_m_s2;    /* of the offset, random walk, in the root of a second */
    double noise_m_s2;     /* standard deviation of a sample */
    double range_m_s2;     /* full scale, 16 bit */
} lathe_accelerometer;

typedef struct {
    double cycle_s;
    int substeps;
    double slide_kg, seat_kg, bed_kg, head_kg, rocking_kg_m2;
    double seat_n_m, bed_n_m, head_n_m, rocking_nm;
    double seat_arm_m, head_arm_m; /* a, b */
    double damping_ratio;          /* of each spring with the mass on it */
    double guide_n_s_m;            /* viscous friction of the slide */
    double unbalance_kg_m;
    double hall_n, hall_hz;        /* what shakes the bed from outside, at no multiple of the spindle */
    double position_gain_1_s;      /* of the servo, critically damped */
    double current_s;              /* time constant of the motor's force */
    double scale_um;               /* grid of the scale */
    double ball_bar_noise_um, ball_bar_gain_ratio;
    double newton_per_nm;          /* of the motor, to tell its force as a torque */
    lathe_accelerometer seat, head;
    uint64_t seed;
} lathe_config;

enum { LATHE_STATES = 11 };

/* What the sensors give at the start of a cycle. */
typedef struct {
    double scale_mm, angle_deg, torque_nm, ball_bar_um;
    double acceleration_m_s2[2]; /* seat, headstock */
} lathe_reading;

typedef struct {
    lathe_config c;
    double state[LATHE_STATES]; /* xs x1 xb p xh, their speeds, F */
    double angle, speed;        /* rad, rad/s of the spindle */
    double asked, time;
    double last_target[2];
    double filtered[2][3], wandered[2];
    uint64_t random;
} lathe;

lathe_config lathe_default(void);
void lathe_init(lathe *p, const lathe_config *c);
/* What the sensors give now. */
lathe_reading lathe_sense(lathe *p);
/* One cycle of the servo and the machine toward a position of the slide on its seat, at a spindle speed. */
void lathe_cycle(lathe *p, double target_mm, double speed_rpm);
/* Where the tool is against the workpiece, and seat against headstock. */
double lathe_tool_mm(const lathe *p);
double lathe_relative_um(const lathe *p);
/* Uniform in [0, 1). */
double lathe_uniform(uint64_t *state);

/* Forms to turn: the tool's way over the spindle's angle, between about -1 and 1. */
typedef enum { LATHE_OVAL, LATHE_CAM, LATHE_POLYGON, LATHE_SHAPES } lathe_shape;
extern const char *const lathe_shape_name[LATHE_SHAPES];
double lathe_form(lathe_shape shape, double angle);

#endif
