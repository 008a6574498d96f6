/*
 * An axis that runs against dead stops, to try homing on: one motor, or a gantry of two joined by a crossbeam. Each
 * side is a motor, an elastic drive with clearance and a table with friction. It shares nothing with gib but the
 * header. Positions in mm of load travel, torques in N·m at the motor; positive is toward the stop.
 *
 *   motor    Jm·x'' = T − Tm·sign(x') − Tdrive
 *   table    Jt·y'' = Tdrive − Ts·sign(y') − B·y' − T0 − Tstop − Tchips − Tbeam      Ts = F·(1 + (b − 1)·exp(−(y'/vs)²))
 *   stop     Tstop = ks·(y − ystop) + ds·y' where that pushes back, else 0
 *   servo    P position, PI velocity, feed-forward, torque limit, first-order current loop, on the quantised encoder
 */
#ifndef HOMING_PLANT_H
#define HOMING_PLANT_H

#include "gib.h"
#include <stdint.h>

typedef struct {
    int motors;
    double sense; /* of the stop in the coordinates that gib sees, +1 or -1 */
    double cycle_s;
    int substeps;
    double motor_inertia_nm_s2_mm, table_inertia_nm_s2_mm;
    double stiffness_nm_mm, damping_nm_s_mm, clearance_mm; /* drive */
    double friction_nm, motor_share, breakaway_ratio, viscous_nm_s_mm, constant_nm;
    double stribeck_mm_s; /* below about this speed the table's friction rises to break-away; 0: only at rest */
    double stop_mm[2], stop_stiffness_nm_mm, stop_damping_nm_s_mm;
    double stop_power; /* of the way pressed in, to which the stop's force goes: 1.5 for a ball; 0: 1; the stiffness is at 20 um */
    double beam_nm_mm;                                             /* crossbeam of a gantry */
    double chips_mm, chips_stiffness_nm_mm, chips_crush_mm;        /* layer before the stop; what a press crushes */
    double tight_mm, tight_width_mm, tight_nm;                     /* extra friction there */
    double position_gain_1_s, velocity_gain_nm_s_mm, velocity_integral_time_s, velocity_feedforward;
    double torque_time_constant_s, torque_limit_nm;                /* the drive's own limit */
    double encoder_mm, torque_noise_nm;
    double torque_grid_nm; /* steps of what the drive reports; 0: none */
    double torque_unit_nm; /* of what the drive reports; negative: with its sign turned; 0: 1 */
    int answer_cycles; /* that the kernel takes to carry a request out */
    uint64_t seed;
} homing_plant_config;

/* What may go wrong, from some cycle on. */
typedef enum {
    FAULT_NONE,
    FAULT_ABORT,
    FAULT_DRIVE_TRIP, /* as after a following error */
    FAULT_FLAG_UNKNOWN,
    FAULT_TORQUE_NAN,
    FAULT_TORQUE_PLUS_INF,
    FAULT_TORQUE_MINUS_INF,
    FAULT_ENCODER_NAN,
    FAULT_ENCODER_INF,
    FAULT_LIMIT_NAN, /* of the limit in force, as the kernel tells it */
    FAULT_LIMIT_LOST, /* the drive goes back to its own limit, as after a reset, and tells */
    FAULT_TORQUE_STUCK,
    FAULT_TORQUE_STUCK_HIGH,
    FAULT_TORQUE_INVERTED,
    FAULT_TORQUE_NOISY,
    FAULT_ENCODER_FROZEN,
    FAULT_ENCODER_SLIPS, /* a little in every cycle on the way to the stop */
    FAULT_ENCODER_JUMPS,
    FAULT_NO_ACKNOWLEDGEMENT, /* and nothing carried out */
    FAULT_LIMIT_IGNORED,      /* acknowledged, but the drive does not limit */
    FAULT_NOT_FOLLOWED,       /* the kernel no longer passes the command on */
    FAULT_TIGHT_SPOT,         /* that holds the axis where it is */
    FAULT_STOP_GONE,
    FAULT_STOP_SOFT,
    FAULT_STOP_EARLY, /* something solid close before the axis */
    FAULT_CHIPS,      /* once the axis is away from the stop */
    FAULTS
} homing_fault;

typedef struct {
    double x, vx, y, vy;
    int motor_sticks, table_sticks;
    double torque, integral, last_encoder, last_target;
    double crushed; /* of the chips */
    int touches;    /* the table is on its stop, or has not been off it by more than 20 um since */
    double touched_mm; /* where the motor was when it met its stop last */
    double slipped, frozen_at, stuck_at;
    uint32_t faults; /* of this side alone */
} homing_plant_side;

typedef struct {
    homing_plant_config c;
    homing_plant_side side[2];
    /* the kernel */
    double limit_nm;
    uint32_t done_id;
    int waited;
    double shift_mm[2];
    gib_homing_output out;
    gib_homing_input in;
    uint32_t faults; /* of both sides and of the kernel: 1 << homing_fault */
    int first_cycle, owned;
    uint64_t random;
    double time_s;
    double most_torque_nm, most_travel_mm; /* of the real motor, table */
} homing_plant;

homing_plant_config homing_plant_default(void);
void homing_plant_init(homing_plant *p, const homing_plant_config *c);
/* By how much the motor leads its table, which slides at `speed` mm/s toward the stop: half the clearance and the wind-up. */
double homing_plant_lead(const homing_plant_config *c, double speed);
/* From now on `fault` is there, beside those that are; of motor `side` alone where it is 0 or 1, else of both. */
void homing_plant_break(homing_plant *p, homing_fault fault, int side);
/* Sensor, drive or kernel is well again; of FAULT_NONE all are. What has become of stop, chips and encoder stays. */
void homing_plant_mend(homing_plant *p, homing_fault fault);
/* The axis moves for one cycle as gib asked for in `out`, and the kernel carries out requests; fills `in`. */
const gib_homing_input *homing_plant_cycle(homing_plant *p);
/* Uniform in [0, 1). */
double homing_plant_uniform(uint64_t *state);

#endif
