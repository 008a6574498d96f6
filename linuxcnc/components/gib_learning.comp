component gib_learning "learns from revolution to revolution the command that brings an axis to where it shall be against the workpiece";
description
"""
For what repeats with the spindle: the slide of noncircular turning, or a tool that the machine's own swinging takes away from its
place. Stands last in the chain from \\fBjoint.N.motor-pos-cmd\\fR to the drive, after gib_backlash and gib_homing, and takes its
correction off again on the way back, so that they and the planner know nothing of it. \\fBdetected\\fR is where the tool is, in the
drive's coordinates: \\fBgib-vibration.N.position\\fR with \\fBgib-vibration.N.in-force\\fR on \\fBvalid\\fR, or a scale.

While \\fBon\\fR is true and the spindle turns, the deviation of whole turns is measured and the correction improved, until
\\fBdone\\fR; it then stays in force. What makes it worse is taken back. When \\fBon\\fR falls, or anything goes wrong, the
correction fades out; \\fBerror\\fR says why (see gib.h).
A parameter left at 0 takes the default of gib_learning_config in gib.h.
""";
include "gib.h";
include "gib_hal.h";

pin in float position_cmd "from what stands before: where the tool shall be, mm";
pin out float position_fb "to what stands before, mm";
pin out float drive_cmd "the same with the correction, mm";
pin in float drive_fb "motor position from the drive, mm";
pin in float detected "where the tool is, mm";
pin in bit valid = true "detected can be trusted; false: learning waits";
pin in float angle "spindle angle, degrees";
pin in bit enable "the machine is on: from joint.N.amp-enable-out";
pin in bit drive_fault "a drive is faulted";
pin in bit on "rising: learn; falling: take the correction out";
pin in bit ok_in = true "of the component before in the chain";
pin out bit ok = false "false: a fault; chain it to motion.enable";
pin out bit busy = false "learning, or a correction is in force or fades out";
pin out bit done = false "within the tolerance: the correction stays in force";
pin out s32 error = 0 "0, or the gib status that ended learning";
pin out s32 state = 0 "GIB_LEARNING_ phase";
pin out u32 why = 0 "why learning waits or is held back, a sum";
pin out float correction "in force now, um";
pin out float deviation "root mean square over the last turns measured, um";
pin out float first "the same before anything was learnt, um";
pin out s32 update_count = 0 "updates so far";

param rw float tolerance = 0.5 "deviation at which learning is done, um";
param rw float correction_most = 50 "largest correction, um";
param rw float deviation_most = 0 "deviation that ends learning at once, um";
param rw s32 harmonic_count = 0 "harmonics of a turn that are learnt";
param rw s32 turns = 0 "turns over which the deviation is averaged";
param rw s32 settling = 0 "turns to settle after a change; as many as gib_vibration averages, where that detects";
param rw float lag = 0 "of the servo, s";

variable gib_learning *gib;
variable gib_learning_input in;
variable gib_learning_output out;
variable gib_learning_output told; /* what the pins say */
variable double cmd_safe = 0.0;
variable double fb_safe = 0.0;
variable double shift = 0.0; /* the correction, mm */
variable int awake = 0;
variable int asked = 0;
variable int fault = 0;

option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, after motion-controller, before gib_homing and gib_backlash";
license "MIT OR Apache-2.0";
author "the gib project";
;;

EXTRA_SETUP()
{
    gib = gib_learning_new();
    return gib ? 0 : -1;
}

EXTRA_CLEANUP()
{
    struct __comp_state *__comp_inst;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) {
        gib_learning_free(gib);
    }
}

static int32_t begin(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_learning_config config = {
        .struct_size = sizeof config,
        .cycle_s = cycle_s,
        .tolerance_um = tolerance,
        .correction_max_um = correction_most,
        .deviation_max_um = deviation_most,
        .harmonics = harmonic_count,
        .revolutions = turns,
        .settle_revolutions = settling,
        .lag_s = lag,
    };
    return gib_learning_start(gib, &config);
}

/* Tells what has changed, and how far learning has come. */
__attribute__((noinline, cold)) static void tell(struct __comp_state *__comp_inst, int32_t status)
{
    gib_learning_report report;
    gib_learning_result(gib, &report);
    deviation = report.last_um;
    first = report.first_um;
    update_count = report.updates;
    told = out;
    state = out.phase;
    why = out.reasons;
    done = status == GIB_DONE;
    error = status < 0 && status != GIB_ERR_ABORTED ? status : 0;
    /* What was learnt stays in force at the end of these. */
    awake = status == GIB_BUSY || status == GIB_DONE || status == GIB_ERR_LEARNING_GROWS || status == GIB_ERR_LEARNING_UPDATES;
    busy = awake;
}

/* One cycle of learning, or of what is left of it. */
static void learn(struct __comp_state *__comp_inst, unsigned flags)
{
    in.target_mm = cmd_safe;
    in.detected_mm = valid ? detected : NAN;
    in.angle_deg = angle;
    in.flags = (drive_fault ? GIB_INPUT_FAULT : 0) | (on ? 0 : GIB_INPUT_ABORT) | flags;
    int32_t status = gib_learning_step(gib, &in, &out);
    correction = out.correction_um;
    shift = 1e-3 * out.correction_um;
    if (gib_hal_differ(out, told, status, reasons)) {
        tell(__comp_inst, status);
    }
}

/* Nothing is in force, and something may be asked for. */
__attribute__((noinline, cold)) static void ask(struct __comp_state *__comp_inst, long period)
{
    if (on && !asked && enable && !fault) {
        error = begin(__comp_inst, period * 1e-9);
        awake = error == GIB_OK;
        busy = awake;
    }
    asked = on;
    done = 0;
}

/* A fault lasts until the machine is off; what learning must be told. */
__attribute__((noinline, cold)) static unsigned doubt(struct __comp_state *__comp_inst, int good)
{
    fault = !good ? GIB_ERR_NON_FINITE : enable ? fault : 0;
    ok = ok_in & !fault;
    return (fault ? GIB_INPUT_FAULT : 0) | (enable ? 0 : GIB_INPUT_ABORT);
}

FUNCTION(_)
{
    /* What is no number goes nowhere: the last safe value stays, and motion is told. */
    int good = gib_hal_both_held(position_cmd, drive_fb, &cmd_safe, &fb_safe);
    unsigned flags = 0;
    if (!good | !enable | fault) {
        flags = doubt(__comp_inst, good);
    } else {
        ok = ok_in;
    }
    if (awake) {
        learn(__comp_inst, flags);
    } else if (on | asked) {
        ask(__comp_inst, period);
    }
    drive_cmd = cmd_safe + shift;
    position_fb = fb_safe - shift;
}
