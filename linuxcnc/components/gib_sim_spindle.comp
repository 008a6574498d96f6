component gib_sim_spindle "simulates a spindle with a workpiece: speed servo, torque limit, inertia, friction";
description
"""
A plant to try gib on without a machine:

  J dw/dt = T - Tc sign(w) - B w - cutting      T from a PI speed servo, limited by torque and by power
""";
include "gib_sim.h";

pin in float speed_cmd "commanded speed, rpm, signed";
pin in float torque_ff "feed-forward, N m";
pin in bit enable "power";
pin in float cutting "torque that a cut takes, N m";
pin out float speed "measured speed, rpm, signed";
pin out float speed_rps "the same in revolutions per second, to spindle.0.speed-in";
pin out float revs "revolutions since the start, to spindle.0.revs";
pin out float motor_torque "torque with its noise, N m";
pin out float load "motor current in percent of rated";
pin out float angle "angle, degrees";

param rw float inertia = 0.5 "of spindle and workpiece, kg m2";
param rw float coulomb = 2.0 "friction, N m";
param rw float viscous = 0.01 "friction, N m per rad/s";
param rw float torque_limit = 120 "N m";
param rw float power_limit = 10000 "W";
param rw float rated_torque = 60 "N m";
param rw float noise = 0.2 "standard deviation of a torque reading, N m";

variable double w;
variable double turned;
variable double t;
variable double integral;
variable unsigned random = 1;

function _ fp "once per servo cycle, after all that commands it";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <math.h>

#define SUBSTEPS 10
#define TURN 6.283185307179586
#define BANDWIDTH 30.0 /* of the speed servo, 1/s */
#define CURRENT_S 0.001
#define GRID_RAD (TURN / 65536.0)

FUNCTION(_)
{
    double cycle = period * 1e-9, dt = cycle / SUBSTEPS, limit, error, wanted, limited, before;
    int i;
    error = speed_cmd * TURN / 60.0 - w;
    wanted = inertia * BANDWIDTH * (error + integral) + torque_ff;
    limit = fmin(torque_limit, power_limit / fmax(fabs(w), 1.0));
    limited = fmin(fmax(wanted, -limit), limit);
    if (!enable) {
        limited = integral = 0.0;
    } else if (limited == wanted) {
        integral += error * cycle * 0.25 * BANDWIDTH;
    }
    before = floor(turned / GRID_RAD);
    motor_torque = t + noise * gib_sim_normal(&random);
    load = 100.0 * fabs(t) / rated_torque;
    for (i = 0; i < SUBSTEPS; i++) {
        double drag = coulomb + viscous * fabs(w) + cutting, next;
        t += (limited - t) * (1.0 - exp(-dt / CURRENT_S));
        if (w == 0.0 && fabs(t) <= drag) {
            continue;
        }
        next = w + dt * (t - copysign(drag, w != 0.0 ? w : t)) / inertia;
        w = w * next < 0.0 ? 0.0 : next;
        turned += dt * w;
    }
    speed = (floor(turned / GRID_RAD) - before) * GRID_RAD / cycle * 60.0 / TURN;
    speed_rps = speed / 60.0;
    revs = turned / TURN;
    angle = 360.0 * (revs - floor(revs));
}
