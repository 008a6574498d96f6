component gib_sim_axis "simulates a machine axis: servo, motor, drive with clearance, table with friction, dead stops";
description
"""
A plant to try gib on without a machine. Positions in mm of load travel, torques in N m, everything referred to the motor:

  motor   Jm x'' = T - Tm sign(x') - Tspring - d (x' - y')
  table   Jt y'' = Tspring + d (x' - y') - Ts sign(y') - Tcable(y) - stops     Tspring = k deadzone(x - y, clearance)
  servo   P position, PI velocity with feed-forward, first-order current loop, on the quantised motor encoder

A body at rest stays there until the break-away torque is exceeded. At rest the table creeps until only part of the
wind-up is held. Both ends of the table's way have an elastic dead stop.
""";
include "gib_sim.h";

pin in float drive_cmd "commanded position, mm";
pin in bit enable "power";
pin in float torque_limit_cmd = 16 "torque limit, N m";
pin in bit break_encoder "true: the encoder reads no number, to see what happens";
pin out float drive_fb "motor encoder, mm";
pin out float motor_torque "motor torque with its noise, N m";
pin out float torque_limit_fb "torque limit in force, N m";
pin out float table "true position of the table, mm";

param rw float start_mm = 0 "where the axis stands when power comes, mm";
param rw float clearance = 0.018 "mm";
param rw float stiffness = 137 "N m/mm";
param rw float friction = 3.0 "sliding friction, motor and table side together, N m";
param rw float motor_share = 0.2 "share of it on the motor's side";
param rw float breakaway = 1.1 "break-away over sliding friction of the table";
param rw float hold = 0.8 "share of the wind-up held at standstill";
param rw float cable = 0 "torque per way of a cable chain or a spring, N m/mm";
param rw float stop_min = -10 "dead stop, mm";
param rw float stop_max = 210 "dead stop, mm";
param rw float stop_stiffness = 400 "N m/mm";
param rw float noise = 0.1 "standard deviation of a torque reading, N m";
param rw float encoder = 0.0001 "grid of the encoder, mm";

variable double x;
variable double vx;
variable double y;
variable double vy;
variable double t;
variable double integral;
variable double last_cmd;
variable double last_fb;
variable int motor_sticks;
variable int table_sticks;
variable int awake;
variable unsigned random;

function _ fp "once per servo cycle, after all that commands it";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <math.h>

#define SUBSTEPS 20
#define MOTOR_INERTIA 0.0010
#define TABLE_INERTIA 0.0008
#define DAMPING 0.05
#define STOP_DAMPING 0.1
#define CURRENT_S 0.0005
#define HOLD_S 0.05
#define KP 40.0
#define KV 0.33
#define TI 0.02

/* One body with Coulomb friction: sticks at rest, slides beyond break-away. Semi-implicit Euler. */
static void move(double *place, double *v, int *sticks, double force, double sliding, double most, double inertia, double dt)
{
    double sense, faster;
    if (*sticks && fabs(force) <= most) {
        return;
    }
    *sticks = 0;
    sense = copysign(1.0, *v != 0.0 ? *v : force);
    faster = *v + dt * (force - sense * sliding) / inertia;
    if (*v != 0.0 && faster * *v <= 0.0) {
        *v = 0.0;
        *sticks = 1;
        return;
    }
    *v = faster;
    *place += dt * faster;
}

static double deadzone(double wound, double play)
{
    double half = 0.5 * play;
    return wound > half ? wound - half : wound < -half ? wound + half : 0.0;
}

static void substep(struct __comp_state *__comp_inst, double wanted, double dt)
{
    double wound = deadzone(x - y, clearance);
    double through = wound != 0.0 ? stiffness * wound + DAMPING * (vx - vy) : 0.0;
    double against = cable * y, on_motor = motor_share * friction, on_table = friction - on_motor;
    double held = hold * on_table, load = stiffness * wound - against;
    t += (wanted - t) * (1.0 - exp(-dt / CURRENT_S));
    if (y > stop_max) {
        against += fmax(0.0, stop_stiffness * (y - stop_max) + STOP_DAMPING * vy);
    } else if (y < stop_min) {
        against += fmin(0.0, stop_stiffness * (y - stop_min) + STOP_DAMPING * vy);
    } else if (table_sticks && fabs(vx) < 0.01 && fabs(load) > held) {
        y += (load - copysign(held, load)) / stiffness * (1.0 - exp(-dt / HOLD_S));
    }
    move(&x, &vx, &motor_sticks, t - through, on_motor, on_motor, MOTOR_INERTIA, dt);
    move(&y, &vy, &table_sticks, through - against, on_table, breakaway * on_table, TABLE_INERTIA, dt);
}

FUNCTION(_)
{
    double cycle = period * 1e-9, fb, step, velocity, error, wanted, limited;
    int i;
    if (!awake) {
        x = y = start_mm;
        random = 1u + (unsigned)(1e3 * fabs(start_mm + clearance + friction));
        motor_sticks = table_sticks = awake = 1;
        last_cmd = last_fb = x;
    }
    fb = encoder * floor(x / encoder + 0.5);
    velocity = (fb - last_fb) / cycle;
    step = drive_cmd - last_cmd;
    last_fb = fb;
    last_cmd = drive_cmd;
    error = KP * (drive_cmd - fb) + step / cycle - velocity;
    wanted = KV * (error + integral);
    limited = fmin(fmax(wanted, -torque_limit_cmd), torque_limit_cmd);
    if (!enable) {
        limited = integral = 0.0;
    } else if (limited == wanted) {
        integral += error * cycle / TI;
    }
    drive_fb = break_encoder ? NAN : fb;
    motor_torque = t + noise * gib_sim_normal(&random);
    torque_limit_fb = torque_limit_cmd;
    table = y;
    for (i = 0; i < SUBSTEPS; i++) {
        substep(__comp_inst, limited, cycle / SUBSTEPS);
    }
}
