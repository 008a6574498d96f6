component gib_sim_vibration "simulates how seat and spindle bearing swing with the spindle's turn, and their accelerometers";
description
"""
A plant to try gib on without a machine. Seat and bearing swing at the first and the third harmonic of the spindle's turn w:

  seat    = seat-um    (sin wt + 0.3 sin(3 wt + 1))
  bearing = bearing-um (sin(wt + phase) + 0.3 sin(3 wt + 2))

The accelerometers read the second derivative, their offset, and noise.
""";
include "gib_sim.h";

pin in float scale "position of the slide from its scale, mm";
pin in float revs "revolutions of the spindle";
pin in float speed "of the spindle, rpm";
pin out float seat "acceleration, m/s2";
pin out float bearing "acceleration, m/s2";
pin out float position "where the tool truly is against the workpiece, mm";

param rw float seat_um = 12 "amplitude, um; grows with the speed up to 600 rpm";
param rw float bearing_um = 9 "the same";
param rw float phase = 2.6 "between the two, rad";
param rw float offset = 0.15 "of the accelerometers, m/s2";
param rw float noise = 0.02 "standard deviation of a reading, m/s2";

variable unsigned random = 11;

function _ fp "once per servo cycle, after the spindle";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <math.h>

#define TURN 6.283185307179586

FUNCTION(_)
{
    double at = TURN * (revs - floor(revs)), w = TURN * speed / 60.0, share = fmin(1.0, fabs(speed) / 600.0);
    double one = share * seat_um, other = share * bearing_um;
    double of_seat = one * (sin(at) + 0.3 * sin(3.0 * at + 1.0));
    double of_bearing = other * (sin(at + phase) + 0.3 * sin(3.0 * at + 2.0));
    seat = -1e-6 * w * w * one * (sin(at) + 2.7 * sin(3.0 * at + 1.0)) + offset + noise * gib_sim_normal(&random);
    bearing = -1e-6 * w * w * other * (sin(at + phase) + 2.7 * sin(3.0 * at + 2.0)) - offset + noise * gib_sim_normal(&random);
    position = scale + 1e-3 * (of_seat - of_bearing);
}
