component gib_sim_cut "simulates a cut: depth under a tilted workpiece, spindle load, torque";
description
"""
A plant to try gib on without a machine. The workpiece's top is the plane \\fBtop\\fR + \\fBslope-x\\fR x + \\fBslope-y\\fR y; while the spindle
turns, the tool at x y z cuts as deep as it stands below it:

  load = idle + rise depth^0.8        torque = torque_per_mm depth
""";
include "gib_sim.h";

pin in float x "true position of the tool, mm";
pin in float y "the same";
pin in float z "the same";
pin in float speed "spindle speed, rpm";
pin out float depth "depth of cut, mm; 0 in the air";
pin out float load "spindle load with its noise, %";
pin out float torque "that the cut takes, N m";

param rw float top = 0 "height of the workpiece at x = y = 0, mm";
param rw float slope_x = 0 "mm/mm";
param rw float slope_y = 0 "mm/mm";
param rw float idle = 8 "load in the air, %";
param rw float rise = 14 "load of 1 mm, %";
param rw float torque_per_mm = 3 "N m/mm";
param rw float noise = 0.5 "standard deviation of a load reading, %";

variable unsigned random = 7;

function _ fp "once per servo cycle";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <math.h>

FUNCTION(_)
{
    double under = top + slope_x * x + slope_y * y - z;
    depth = fabs(speed) > 10.0 && under > 0.0 ? under : 0.0;
    load = (fabs(speed) > 10.0 ? idle + rise * pow(depth, 0.8) : 0.0) + noise * gib_sim_normal(&random);
    torque = torque_per_mm * depth;
}
