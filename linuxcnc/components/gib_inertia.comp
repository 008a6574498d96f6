component gib_inertia "measures the inertia on a spindle, and varies the spindle speed within what its motor can do";
description
"""
Stands between \\fBspindle.N.speed-out\\fR and the spindle drive.

While \\fBmeasure\\fR is true and the spindle is not turning by command, the component ramps it up and down and puts the
moment of inertia of the workpiece on \\fBinertia\\fR: the value for INA in the program's head. When \\fBmeasure\\fR falls
before, the spindle goes back to rest.

While \\fBvary\\fR is true, the spindle is at speed and \\fBina\\fR is known, the speed swings by \\fBamplitude\\fR with the
period \\fBswing-time\\fR, or as far as power and torque allow at that inertia. A stop acts at once, a new speed or an override
within twenty cycles.
A parameter left at 0 takes the default of gib_inertia_config or gib_speed_variation_config in gib.h.
""";
include "gib.h";
include "gib_hal.h";

pin in float speed_cmd "from spindle.N.speed-out, rpm, signed";
pin out float drive_speed_cmd "speed that the drive shall follow, rpm, signed";
pin out float torque_ff "torque that the commanded change of speed takes, to the drive's feed-forward where it has one, N m";
pin in float drive_speed "measured speed, rpm, signed";
pin in float motor_torque "spindle torque from the drive, N m, positive toward positive speed";
pin in bit drive_fault "the drive is faulted";
pin in bit enable "the machine is on";
pin in bit ok_in = true "of the component before in the chain";
pin out bit ok = false "false: a fault; chain it to motion.enable";

pin in bit measure "rising: measure the inertia; falling while busy: abort";
pin out bit busy = false "the measurement has the spindle";
pin out bit done = false "the last measurement ended well";
pin out s32 error = 0 "0, or the gib status that ended the last measurement";
pin out float inertia "measured inertia of the workpiece, kg m2";
pin out float uncertainty "its uncertainty, k = 2, kg m2";

pin in float ina "inertia of the workpiece in force, kg m2: INA of the program, from motion.analog-out-NN";
pin in bit vary "vary the speed";
pin in float amplitude = 0.1 "share of the speed by which it swings to each side";
pin in float swing_time = 2 "period of the variation, s";
pin out bit varying = false "the speed varies";
pin out float amplitude_now "amplitude in effect, share of the speed";
pin out float amplitude_most "largest amplitude that the motor can do at this period";
pin out s32 vary_message = 0 "0, or the gib status that says why less or nothing is varied";

param rw float speed_high = 1000 "top speed of the ramps, rpm";
param rw float ramp = 500 "acceleration of the ramps, rpm/s";
param rw s32 ramp_count = 0 "times up and down";
param rw float own_inertia = 0 "of spindle and rotor, taken off the measured one and added for the limits, kg m2";
param rw float power = 5000 "largest power of the motor, W";
param rw float torque_most = 0 "largest torque of the motor at the spindle, N m";
param rw float speed_most = 0 "highest speed allowed, rpm";
param rw float coulomb = 0 "friction of the spindle, N m; measured with the inertia";
param rw float viscous = 0 "friction of the spindle, N m s/rad; measured with the inertia";

variable gib_inertia *gib;
variable gib_speed_variation *variation;
variable gib_inertia_output out;
variable gib_speed_variation_input asked;
variable gib_speed_variation_output swing;
variable int running = 0;
variable int measured = 0;
variable int awake = 0; /* a measurement goes on, or is still asked for */
variable int started = 0; /* to vary, since vary rose */
variable int swinging = 0;
variable int fault = 0;
variable double speed_safe = 0.0;

option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, after motion-controller, before the drive";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <math.h>
#include <string.h>

EXTRA_SETUP()
{
    (void)prefix;
    (void)extra_arg;
    gib = gib_inertia_new();
    variation = gib_speed_variation_new();
    return gib && variation ? 0 : -1;
}

EXTRA_CLEANUP()
{
    struct __comp_state *__comp_inst;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) {
        gib_inertia_free(gib);
        gib_speed_variation_free(variation);
    }
}

static int32_t begin(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_inertia_config config;
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    config.cycle_s = cycle_s;
    config.ramps = ramp_count;
    config.speed_high_rpm = speed_high;
    config.acceleration_rpm_s = ramp;
    config.own_inertia_kg_m2 = own_inertia;
    config.torque_bound_nm = torque_most;
    return gib_inertia_start(gib, &config);
}

/* Begins with next to nothing: the cycles then ask for the amplitude wanted, and get what the motor can do. */
static int32_t begin_to_vary(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_speed_variation_config config;
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    config.cycle_s = cycle_s;
    config.speed_rpm = speed_cmd;
    config.amplitude_ratio = 1e-4;
    config.period_s = swing_time;
    config.inertia_kg_m2 = ina;
    config.own_inertia_kg_m2 = own_inertia;
    config.power_w = power;
    config.torque_nm = torque_most;
    config.speed_max_rpm = speed_most;
    config.coulomb_nm = coulomb;
    config.viscous_nm_s = viscous;
    return gib_speed_variation_start(variation, &config);
}

/* One cycle of the measurement; whether it has the spindle. */
__attribute__((noinline, cold)) static int measuring(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_inertia_report report;
    int32_t status;
    if (measure && !measured && enable && !fault && speed_cmd == 0.0 && !running) {
        error = begin(__comp_inst, cycle_s);
        done = 0;
        running = error == GIB_OK;
    } else if (measure && !measured) {
        error = GIB_ERR_STATE;
        done = 0;
    }
    measured = measure;
    /* A speed that is commanded meanwhile ends the measurement: the operator wants something else. */
    gib_inertia_input in = {
        .speed_rpm = drive_speed,
        .torque = motor_torque,
        .flags = (drive_fault ? GIB_INPUT_FAULT : 0) |
                 (running && !(measure && enable && speed_cmd == 0.0) ? GIB_INPUT_ABORT : 0),
    };
    status = gib_inertia_step(gib, &in, &out);
    if (running && status != GIB_BUSY) {
        running = 0;
        error = status == GIB_DONE ? gib_inertia_result(gib, &report) : status;
        done = error == GIB_OK; /* what the motion does not determine is no value */
        if (done) {
            inertia = report.workpiece_kg_m2;
            uncertainty = report.workpiece_uncertainty_kg_m2;
            coulomb = report.coulomb_nm;
            viscous = report.viscous_nm_s;
        }
    }
    busy = running;
    awake = running | measured;
    return running && out.owns_motion;
}

/* Begins to vary, once the spindle is at speed and all that is needed is known. */
__attribute__((noinline, cold)) static void wait_to_vary(struct __comp_state *__comp_inst, double cycle_s)
{
    int at_speed = fabs(speed_cmd) > 1.0 && fabs(drive_speed - speed_cmd) < 0.05 * fabs(speed_cmd);
    if (vary && !(ina > 0.0)) {
        vary_message = GIB_ERR_PROGRAM_ABSENT;
    } else if (vary && at_speed && enable && !fault && !started) {
        vary_message = begin_to_vary(__comp_inst, cycle_s);
        swinging = vary_message == GIB_OK;
        varying = swinging;
        started = 1;
    }
    started = swinging || (started && vary && speed_safe != 0.0);
}

/* The variation has ended. */
__attribute__((noinline, cold)) static void end_of_variation(struct __comp_state *__comp_inst)
{
    swinging = 0;
    varying = 0;
    torque_ff = amplitude_now = 0.0;
    started = vary && speed_safe != 0.0;
}

/* One cycle of the variation: the speed to be commanded. A stop is a stop, whatever is still to be wound down. */
static inline double varied(struct __comp_state *__comp_inst, int sound)
{
    int go_on = vary && sound && ina * fabs(speed_safe) > 0.0;
    asked.speed_rpm = speed_safe;
    asked.amplitude_ratio = amplitude;
    asked.period_s = swing_time;
    asked.flags = (drive_fault ? GIB_INPUT_FAULT : 0) | (go_on ? 0 : GIB_SPEED_VARIATION_STOP);
    int32_t status = gib_speed_variation_step(variation, &asked, &swing);
    vary_message = swing.message;
    amplitude_most = swing.amplitude_limit_ratio;
    if (status != GIB_BUSY) {
        end_of_variation(__comp_inst);
        return speed_safe;
    }
    torque_ff = swing.torque_nm;
    amplitude_now = swing.amplitude_ratio;
    return asked.flags && speed_safe == 0.0 ? speed_safe : swing.speed_command_rpm;
}

/* The speed to be commanded; sound: the machine is on, and there is no fault. */
static inline double commanded(struct __comp_state *__comp_inst, int sound, long period)
{
    if ((measure | awake) && measuring(__comp_inst, period * 1e-9)) {
        return out.speed_command_rpm;
    }
    if (swinging) {
        return varied(__comp_inst, sound);
    }
    if (vary | started) {
        wait_to_vary(__comp_inst, period * 1e-9);
    }
    return speed_safe;
}

/* A cycle with a fault, which lasts until the machine is off, or with the machine off. */
__attribute__((noinline, cold)) static void unsound(struct __comp_state *__comp_inst, long period)
{
    int good = gib_hal_held(speed_cmd, &speed_safe) & isfinite(drive_speed);
    fault = !good ? GIB_ERR_NON_FINITE : enable ? fault : 0;
    double wanted = commanded(__comp_inst, enable && !fault, period);
    drive_speed_cmd = enable ? wanted : 0.0;
    ok = ok_in & !fault;
}

FUNCTION(_)
{
    double wanted = speed_cmd, sum = wanted + drive_speed;
    /* What is no number goes nowhere: the last safe value stays, and motion is told. */
    if (isnan(sum - sum) | !enable | fault) {
        unsound(__comp_inst, period);
        return;
    }
    speed_safe = wanted;
    wanted = commanded(__comp_inst, 1, period);
    drive_speed_cmd = wanted;
    ok = ok_in;
}
