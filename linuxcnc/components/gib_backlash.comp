component gib_backlash "measures the lost motion of one axis from motor torque and compensates it";
description
"""
Stands between \\fBjoint.N.motor-pos-cmd\\fR and the drive (after gib_homing, where there is one), and between the drive and
\\fBjoint.N.motor-pos-fb\\fR. Net \\fBcompensation\\fR to \\fBini.N.backlash\\fR and set \\fBamount\\fR from [JOINT_N]BACKLASH.

While \\fBstart\\fR is true and the axis stands, the component takes it, goes back and forth by a few millimetres, evaluates
the torque, puts the new amount on \\fBcompensation\\fR, brings the axis back, and raises \\fBdone\\fR. While it has the axis,
motion sees its own command as feedback. When \\fBstart\\fR falls before, or anything goes wrong, the axis brakes and the old
amount is in force again; \\fBerror\\fR says why (see gib.h).

LinuxCNC applies an amount at the next move of the joint: \\fBactive\\fR is true when it has.
A parameter left at 0 takes the default of gib_backlash_config in gib.h.
""";
include "gib.h";
include "gib_hal.h";

pin in float position_cmd "from joint.N.motor-pos-cmd, mm";
pin out float position_fb "to joint.N.motor-pos-fb, mm";
pin out float drive_cmd "position that the drive shall follow, mm";
pin in float drive_fb "motor position from the drive, mm";
pin in float motor_torque "motor torque from the drive, N m, positive toward positive positions";
pin in float backlash_corr "from joint.N.backlash-corr, mm";
pin in bit drive_fault "the drive is faulted";
pin in bit enable "the machine is on: from joint.N.amp-enable-out";
pin in bit start "rising: measure; falling while busy: abort";
pin in bit restore "rising: put the amount of before the last measurement back in force";
pin in bit ok_in = true "of the component before in the chain";
pin out bit ok = false "false: a fault; chain it to motion.enable";
pin out bit busy = false "the measurement has the axis, or brings it back";
pin out bit done = false "the last measurement ended well";
pin out bit active = false "LinuxCNC applies the amount";
pin out s32 error = 0 "0, or the gib status that ended the last measurement";
pin out s32 state = 0 "GIB_BACKLASH_ phase";
pin out float progress "share of the measurement done, 0 to 1";
pin out float compensation "amount to be in force, to ini.N.backlash, mm";
pin out float lost_motion "measured lost motion, um";
pin out float uncertainty "its uncertainty, k = 2, um";
pin out float clearance "part of it that is clearance, um";
pin out float windup "part of it that is elastic wind-up, um";
pin out float old_amount "amount in force before the last measurement, um";

param rw float amount = 0 "amount in force, mm: set it from the INI file, read it after a measurement";
param rw float travel = 8 "way that a measurement may use on each side of where it starts, mm";
param rw float travel_min = -1e6 "lowest motor position allowed, mm";
param rw float travel_max = 1e6 "highest motor position allowed, mm";
param rw float torque_bound = 10 "largest torque allowed, N m";
param rw float detection_limit = 0 "travel after a reversal within which the table must move, um";
param rw float feed = 0 "speed of the slow feed, mm/s";
param rw float slide = 0 "travel over which the sliding torque is read, mm";
param rw s32 reversals = 0 "reversals measured in each sense";
param rw s32 dry_run = 0 "1: measure, and leave the amount as it is";
param rw float lag_limit = 0 "largest difference of command and position, mm";
param rw float return_speed = 5 "speed at which the axis comes back afterwards, mm/s";

variable gib_backlash *gib;
variable gib_backlash_output out;
variable double drive_safe = 0.0;
variable double cmd_safe = 0.0;
variable double back = 0.0;
variable double told_amount = NAN; /* what the pins say */
variable double told_corr = NAN;
variable int wait = 0;
variable unsigned asked = 0;
variable int fault = 0;
variable int running = 0;
variable int owed = 0; /* gib waits for an acknowledgement */
variable int awake = 0; /* something goes on, or did in the last cycle */
variable int unusual = 0; /* awake, or a fault lasts */
variable int started = 0;
variable int restored = 0;

option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, after motion-controller, before the drive";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <string.h>

/* LinuxCNC reads ini.N.backlash in its task cycle, 10 ms by default, and tells nobody: this long is safe. */
#define TAKEN_UP_S 0.2

EXTRA_SETUP()
{
    (void)prefix;
    (void)extra_arg;
    gib = gib_backlash_new();
    return gib ? 0 : -1;
}

EXTRA_CLEANUP()
{
    struct __comp_state *__comp_inst;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) {
        gib_backlash_free(gib);
    }
}

static int32_t begin(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_backlash_config config;
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    config.cycle_s = cycle_s;
    config.measure_only = dry_run;
    config.travel_min_mm = fmax(travel_min, drive_safe - travel);
    config.travel_max_mm = fmin(travel_max, drive_safe + travel);
    config.torque_bound_nm = torque_bound;
    config.detection_limit_um = detection_limit;
    config.feed_mm_s = feed;
    config.slide_mm = slide;
    config.repeats = reversals;
    config.lag_limit_mm = lag_limit;
    return gib_backlash_start(gib, &config);
}

/* The end of a measurement: what it found. */
static void report_it(struct __comp_state *__comp_inst, int32_t status)
{
    gib_backlash_report report;
    gib_backlash_result(gib, &report);
    lost_motion = report.mean.lost_motion_um;
    uncertainty = report.mean.uncertainty_um;
    clearance = report.mean.clearance_um;
    windup = report.mean.windup_um;
    old_amount = report.old_value_um;
    error = status == GIB_DONE ? 0 : status;
}

/* A cycle in which something is asked for, or goes on. */
static void work(struct __comp_state *__comp_inst, long period)
{
    int32_t status;
    if (start && !started && enable && !busy && !fault) {
        status = begin(__comp_inst, period * 1e-9);
        done = 0;
        error = status;
        running = busy = status == GIB_OK;
    }
    started = start;
    if (restore && !restored && !busy) {
        error = gib_backlash_restore(gib);
    }
    restored = restore;

    gib_backlash_input in = {
        .position_mm = drive_fb,
        .torque = motor_torque,
        .compensation_um = 1e3 * amount,
        .acknowledged_id = wait == 0 ? asked : 0,
        .flags = (drive_fault ? GIB_INPUT_FAULT : 0) | (running && !(start && enable) ? GIB_INPUT_ABORT : 0),
    };
    status = gib_backlash_step(gib, &in, &out);
    owed = status == GIB_BUSY;
    if (out.request_id != asked) {
        asked = out.request_id;
        amount = 1e-3 * out.compensation_um;
        wait = (int)(TAKEN_UP_S * 1e9 / period);
    } else if (wait > 0) {
        wait--;
    }
    if (running && status != GIB_BUSY) {
        running = 0;
        done = status == GIB_DONE;
        fault = status == GIB_ERR_NON_FINITE ? status : fault;
        report_it(__comp_inst, status);
    }

    if (out.owns_motion) {
        drive_cmd = out.target_position_mm;
        back = out.target_position_mm - cmd_safe;
        position_fb = cmd_safe;
    } else if (back != 0.0) {
        /* The axis stands elsewhere than motion knows: it glides back. */
        double step = return_speed * period * 1e-9;
        back = fabs(back) <= step || !enable ? 0.0 : back - copysign(step, back);
        drive_cmd = cmd_safe + back;
        position_fb = enable ? cmd_safe : drive_safe;
    } else {
        drive_cmd = cmd_safe;
        position_fb = drive_safe;
        busy = running;
    }
    state = out.phase;
    progress = out.progress_ratio;
    awake = start || restore || running || owed || busy || back != 0.0;
}

/* Tells the amount in force, and whether LinuxCNC applies it. */
__attribute__((noinline, cold)) static void tell(struct __comp_state *__comp_inst)
{
    compensation = told_amount = amount;
    told_corr = backlash_corr;
    active = fabs(2.0 * fabs(told_corr) - told_amount) < 1e-6;
}

/* A cycle that is not as usual: a fault, the machine off, or work. */
__attribute__((noinline, cold)) static void any(struct __comp_state *__comp_inst, int good, long period)
{
    fault = !good ? GIB_ERR_NON_FINITE : enable ? fault : 0;
    if (awake || start || restore) {
        work(__comp_inst, period);
    } else {
        drive_cmd = cmd_safe;
        position_fb = drive_safe;
    }
    ok = ok_in && !fault;
    unusual = awake | (fault != 0);
    tell(__comp_inst);
}

FUNCTION(_)
{
    double cmd = position_cmd, fb = drive_fb;
    /* What is no number goes nowhere: the last safe value stays, and motion is told. */
    int good = gib_hal_both_held(cmd, fb, &cmd_safe, &drive_safe);
    if (!good | !enable | start | restore | unusual) {
        any(__comp_inst, good, period);
        return;
    }
    drive_cmd = cmd;
    position_fb = fb;
    ok = ok_in;
    if (amount != told_amount || backlash_corr != told_corr) {
        tell(__comp_inst);
    }
}
