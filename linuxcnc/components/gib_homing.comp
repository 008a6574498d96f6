component gib_homing "homes one joint on a dead stop by torque limit";
description
"""
Stands between \\fBjoint.N.motor-pos-cmd\\fR and the drive, and between the drive and \\fBjoint.N.motor-pos-fb\\fR.

When motion raises \\fBindex-enable\\fR, the component takes the axis: it presses it against its dead stop several times
under a torque limit, finds where the line of torque against position starts, moves off by the zero offset, and drops
\\fBindex-enable\\fR. While it has the axis, motion sees its own command as feedback. In the INI file of the joint:

HOME_SEARCH_VEL = 0, HOME_LATCH_VEL = 0.001 with the sign of \\fBstop-direction\\fR, HOME_USE_INDEX = YES,
HOME_INDEX_NO_ENCODER_RESET = YES, HOME_OFFSET = coordinate of the place where the axis stands when homed.

When homing fails, \\fBok\\fR falls and \\fBerror\\fR says why (see gib.h); both are reset when \\fBenable\\fR falls.
A parameter left at 0 takes the default of gib_homing_config in gib.h.
""";
include "gib.h";
include "gib_hal.h";

pin in float position_cmd "from joint.N.motor-pos-cmd, mm";
pin out float position_fb "to joint.N.motor-pos-fb, mm";
pin out float drive_cmd "position that the drive shall follow, mm";
pin in float drive_fb "motor position from the drive, mm";
pin in float motor_torque "motor torque from the drive, N m, positive toward positive positions";
pin in bit drive_fault "the drive is faulted";
pin in bit enable "the machine is on: from joint.N.amp-enable-out";
pin io bit index_enable "with joint.N.index-enable: true starts homing, false says it is done";
pin out float torque_limit_cmd "torque limit that the drive shall have, N m";
pin in float torque_limit_fb "torque limit in force in the drive, N m; net it to torque-limit-cmd where the drive does not tell";
pin in bit ok_in = true "of the component before in the chain";
pin out bit ok = false "false: a fault; chain it to motion.enable";
pin out bit busy = false "homing has the axis";
pin out s32 error = 0 "0, or the gib status that ended the last homing";
pin out s32 state = 0 "GIB_HOMING_ phase";
pin out float uncertainty "of the contact point, k = 2, um";
pin out float contact_spread "largest minus smallest contact point of the measured touches, um";

param rw s32 stop_direction = -1 "toward the stop, +1 or -1";
param rw float torque_limit_normal = 10 "torque limit of the drive in operation, N m";
param rw float torque_limit_homing = 3 "torque limit while homing, N m";
param rw float approach_speed = 0 "speed toward the stop, mm/s";
param rw float touch_speed = 0 "speed of the measured touches, mm/s";
param rw float acceleration = 0 "largest commanded acceleration, mm/s2";
param rw float distance_max = 100 "largest way toward the stop, mm";
param rw float zero_offset = 1 "way from the contact point to where the axis stands when homed, mm";
param rw float retract = 0 "way back from the stop between touches, mm";
param rw s32 touch_count = 0 "measured touches";
param rw s32 home_method = 0 "home is: 0 where the torque line starts, 1 where the torque limit is reached (as published)";
param rw bit torque_turned = 0 "true: the drive's torque is negative toward positive positions";
param rw float distance_least = 0 "smallest way toward the stop, mm: a stop before it is a fault";
param rw float time_limit = 0 "time for the whole homing, s";

variable gib_homing *gib;
variable gib_homing_output out;
variable double offset = 0.0;
variable double drive_safe = 0.0;
variable double cmd_safe = 0.0;
variable int owned = 0;
variable int fault = 0;
variable int stop = 0; /* gib wants the torque off the motor */
variable int awake = 0; /* homing goes on, or did in the last cycle */
variable int unusual = 1; /* the next cycle must look at all of this */

option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, after motion-controller, before the drive";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <string.h>

EXTRA_SETUP()
{
    (void)prefix;
    (void)extra_arg;
    gib = gib_homing_new();
    return gib ? 0 : -1;
}

EXTRA_CLEANUP()
{
    struct __comp_state *__comp_inst;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) {
        gib_homing_free(gib);
    }
}

static int32_t begin(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_homing_config config;
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    config.cycle_s = cycle_s;
    config.direction = stop_direction;
    config.lag_reduction = GIB_HOMING_INSTANT_LAG_REDUCTION;
    config.unacknowledged = GIB_HOMING_REQUEST_CLEAR_DEVIATION | GIB_HOMING_REQUEST_SET_POSITION;
    config.torque_limit_nm = torque_limit_homing;
    config.approach_speed_mm_s = approach_speed;
    config.touch_speed_mm_s = touch_speed;
    config.acceleration_mm_s2 = acceleration;
    config.distance_max_mm = distance_max;
    config.zero_offset_mm = zero_offset;
    config.retract_mm = retract;
    config.touches = touch_count;
    config.method = home_method;
    config.torque_inverted = torque_turned;
    config.distance_min_mm = distance_least;
    config.time_limit_s = time_limit;
    return gib_homing_start(gib, &config);
}

/* A cycle of homing, or of what follows it. */
static void work(struct __comp_state *__comp_inst, long period)
{
    gib_homing_report report;
    int32_t status;
    if (index_enable && enable && !busy && !fault) {
        status = begin(__comp_inst, period * 1e-9);
        fault = status < 0 ? status : 0;
        busy = status == GIB_OK;
        error = status;
    }
    gib_homing_input in = {
        .position_mm = {drive_fb},
        .torque = {motor_torque},
        .torque_limit = torque_limit_fb,
        .acknowledged_id = fabs(torque_limit_fb - out.torque_limit) < 1e-6 ? out.request_id : 0,
        .flags = (drive_fault ? GIB_INPUT_FAULT : 0) | (busy && !(index_enable && enable) ? GIB_INPUT_ABORT : 0),
    };
    status = gib_homing_step(gib, &in, &out);

    if (out.owns_motion) {
        drive_cmd = out.target_position_mm[0];
        position_fb = cmd_safe;
        owned = 1;
    } else {
        if (owned) {
            /* Motion goes on where gib has put the axis. */
            offset = cmd_safe - out.target_position_mm[0];
            owned = 0;
        }
        drive_cmd = cmd_safe - offset;
        position_fb = drive_safe + offset;
    }
    if (busy && status != GIB_BUSY) {
        busy = 0;
        index_enable = 0;
        error = status == GIB_DONE ? 0 : status;
        fault = status == GIB_DONE ? 0 : status;
        gib_homing_result(gib, &report);
        uncertainty = report.side[0].uncertainty_um;
        contact_spread = report.side[0].spread_um;
    }
    state = out.phase;
    stop = out.stop_drive;
    awake = busy || owned || index_enable;
}

/* A cycle that is not as usual: a fault, the machine off, or work. */
__attribute__((noinline, cold)) static void any(struct __comp_state *__comp_inst, int good, long period)
{
    fault = !good ? GIB_ERR_NON_FINITE : enable ? fault : 0;
    stop = enable ? stop : 0;
    if (awake || index_enable) {
        work(__comp_inst, period);
    } else {
        drive_cmd = cmd_safe - offset;
        position_fb = drive_safe + offset;
    }
    torque_limit_cmd = out.request_id ? out.torque_limit : torque_limit_normal;
    ok = ok_in && !(fault | stop);
    /* Before the first homing the limit is the parameter, which may change. */
    unusual = awake | fault | stop | (out.request_id == 0);
}

FUNCTION(_)
{
    double cmd = position_cmd, fb = drive_fb;
    /* What is no number goes nowhere: the last safe value stays, and motion is told. */
    int good = gib_hal_both_held(cmd, fb, &cmd_safe, &drive_safe);
    if (!good | !enable | index_enable | unusual) {
        any(__comp_inst, good, period);
    } else {
        drive_cmd = cmd - offset;
        position_fb = fb + offset;
        ok = ok_in;
    }
}
