component gib_tilt "measures the tilt of the workpiece from the spindle load, and undoes it by z or by rotary axes";
description
"""
With three axes z follows the workpiece's plane. The component stands between \\fBjoint.2.motor-pos-cmd\\fR and what follows it in the
chain to the z drive, and takes the offset off again on the way back, so that the planner knows nothing of it.

\\fBstart\\fR rising arms a measurement. While \\fBcutting\\fR is true, with spindle and feed as in the table, the load along the path
is read; \\fBfinish\\fR rising evaluates it. A tilt beyond its uncertainty raises \\fBwarn\\fR: \\fBaccept\\fR brings z's offset in,
\\fBoff\\fR declines, and later takes it out again.

With rotary axes, named by \\fBrotary-axis-N\\fR, these turn the tilt away, and what a pivot's distance asks of x, y and z comes
with it. Net each of \\fBoffset-x\\fR to \\fBoffset-c\\fR to an \\fBoffset\\fR(9) between its joint and the drive; z's is in
\\fBdrive-cmd\\fR already.

The table of loads, \\fBdepth-NN\\fR and \\fBload-NN\\fR, holds for one tool, material, speed and feed; rows up to the first depth of 0.
A parameter left at 0 takes the default of gib_tilt_config in gib.h.
""";
include "gib.h";
include "gib_hal.h";

pin in float x "commanded position from joint.0.pos-cmd, mm";
pin in float y "commanded position from joint.1.pos-cmd, mm";
pin in float z "commanded position from joint.2.pos-cmd, mm";
pin in float angle_a "commanded angle from the joint of a, degrees; only read with rotary axes";
pin in float angle_b "the same of b";
pin in float angle_c "the same of c";
pin in float position_cmd "from joint.2.motor-pos-cmd, mm";
pin out float position_fb "to joint.2.motor-pos-fb, mm";
pin out float drive_cmd "the same with the offset, mm";
pin in float drive_fb "position from what follows, mm";
pin in float spindle_load "spindle load, A or %";
pin in float speed "spindle speed, rpm";
pin in bit enable "the machine is on";
pin in bit drive_fault "a drive is faulted";
pin in bit start "rising: arm a measurement";
pin in bit cutting "the tool cuts at feed";
pin in bit finish "rising: the path is finished";
pin in bit accept "rising: bring the offset in";
pin in bit off "rising: decline, or take the offset out";
pin in bit ok_in = true "of the component before in the chain";
pin out bit ok = false "false: a fault; chain it to motion.enable";
pin out bit busy = false "measuring, or an offset is in force or moving";
pin out bit warn = false "a tilt was found: accept, or off";
pin out bit active = false "the offset is in force";
pin out s32 error = 0 "0, or the gib status that ended the last measurement";
pin out s32 state = 0 "GIB_TILT_ phase";
pin out s32 verdict = 0 "GIB_TILT_ decision: 1 in band, 2 not significant, 3 significant, 5 declined";
pin out float tilt "angle of the workpiece's plane, degrees";
pin out float uncertainty "its uncertainty, k = 2, degrees";
pin out float offset_z "offset of z now, mm";
pin out float offset_x "offset of x now, mm; it and the next four move with rotary axes only";
pin out float offset_y "of y, mm";
pin out float offset_a "of a, degrees";
pin out float offset_b "of b, degrees";
pin out float offset_c "of c, degrees";

param rw float depth_##[8] = 0 "table: depth of cut, rising, mm";
param rw float load_##[8] = 0 "table: load at that depth, rising, A or %";
param rw float table_speed = 600 "spindle speed of the table, rpm";
param rw float table_feed = 600 "feed of the table, mm/min";
param rw s32 dc_load = 0 "1: the load is a DC signal in %; 0: the rectified current of a motor phase";
param rw s32 motor_pole_pairs = 0 "of the spindle motor, for a current";
param rw float entry = 0 "length at both ends of a pass that does not count, mm";
param rw float band = 0 "a tilt up to this is left alone, degrees";
param rw float offset_most = 0 "largest offset of x, y or z, mm";
param rw float turn_most = 0 "largest offset of a, b or c, degrees";
param rw s32 rotary_axis_#[2] = 0 "rotary axis that may turn, the one that carries the other first: 1 a, 2 b, 3 c; 0: none";
param rw bit rotary_tool_#[2] = 0 "it turns the tool, not the workpiece";
param rw s32 rotary_sense_#[2] = 1 "-1: a positive command turns by the left hand";
param rw float rotary_x_#[2] = 0 "a point on its axis, mm: of the machine, or from the tool tip where it turns the tool";
param rw float rotary_y_#[2] = 0 "the same";
param rw float rotary_z_#[2] = 0 "the same";
param rw bit rtcp = 0 "the control keeps the tool at the workpiece when rotary axes turn";

variable gib_tilt *gib;
variable gib_tilt_input in;
variable gib_tilt_output out;
variable gib_tilt_output told; /* what the pins say */
variable double cmd_safe = 0.0;
variable double fb_safe = 0.0;
variable double shift = 0.0; /* z's offset, mm */
variable int turns = 0; /* axes that may turn */
variable int awake = 0;
variable int started = 0;
variable int fault = 0;

option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, after motion-controller, before gib_backlash of z";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <string.h>

EXTRA_SETUP()
{
    gib = gib_tilt_new();
    return gib ? 0 : -1;
}

EXTRA_CLEANUP()
{
    struct __comp_state *__comp_inst;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) {
        gib_tilt_free(gib);
    }
}

static int32_t begin(struct __comp_state *__comp_inst, double cycle_s)
{
    static const gib_tilt_config defaults = {.struct_size = sizeof defaults};
    gib_tilt_config config = defaults;
    gib_tilt_table table;
    int i;
    memset(&table, 0, sizeof table);
    table.struct_size = sizeof table;
    table.condition = (gib_tilt_condition){1, 1, table_speed, table_feed};
    table.signal = dc_load ? GIB_TILT_DC_LOAD : GIB_TILT_AC_CURRENT;
    for (i = 0; i < 8 && depth(i) > 0.0; i++) {
        table.depth_mm[i] = depth(i);
        table.load[i] = load(i);
        table.rows = i + 1;
    }
    config.cycle_s = cycle_s;
    config.signal = table.signal;
    config.condition = table.condition;
    config.pole_pairs = motor_pole_pairs;
    config.entry_mm = entry;
    config.band_deg = band;
    config.offset_max_mm = offset_most;
    config.offset_max_deg = turn_most;
    config.tool_centre_point = rtcp;
    for (i = 0; i < 2; i++) {
        config.rotary[i] = (gib_tilt_rotary){rotary_axis(i), rotary_tool(i), rotary_sense(i), 0,
                                             {rotary_x(i), rotary_y(i), rotary_z(i)}};
    }
    turns = rotary_axis(0) || rotary_axis(1);
    config.ack_timeout_s = 3600.0;
    return gib_tilt_start(gib, &config, &table);
}

/* Tells what has changed, and what the measurement found, once it is evaluated. In a ramp something does in every cycle. */
__attribute__((noinline, cold)) static void tell(struct __comp_state *__comp_inst, int32_t status)
{
    gib_tilt_report report;
    if (gib_tilt_result(gib, &report) == GIB_OK) {
        tilt = report.tilt_deg;
        uncertainty = report.uncertainty_deg;
        verdict = report.decision;
    }
    offset_x = out.offset_mm[0];
    offset_y = out.offset_mm[1];
    offset_a = out.offset_deg[0];
    offset_b = out.offset_deg[1];
    offset_c = out.offset_deg[2];
    state = out.phase;
    told = out;
    told.phase = out.phase == GIB_TILT_RAMP_ON || out.phase == GIB_TILT_RAMP_OFF ? -1 : out.phase;
    active = out.phase == GIB_TILT_ACTIVE;
    warn = out.warning;
    awake = status == GIB_BUSY;
    busy = awake;
    error = status < 0 ? status : 0;
    fault = status == GIB_ERR_NON_FINITE ? status : fault;
    ok = ok_in & !fault;
}

/* One cycle of a measurement, or of an offset that comes, stays or goes. */
static void work(struct __comp_state *__comp_inst)
{
    in.position_mm[0] = x;
    in.position_mm[1] = y;
    in.position_mm[2] = z;
    in.flags = (drive_fault ? GIB_INPUT_FAULT : 0) | (off ? GIB_TILT_INPUT_OFF : 0);
    if (out.phase != GIB_TILT_ACTIVE) { /* an offset in force does not depend on the cut */
        in.load = spindle_load;
        in.speed_rpm = speed;
        in.flags |= (cutting ? GIB_TILT_INPUT_CUTTING : 0) | (finish ? GIB_TILT_INPUT_END : 0);
    }
    if (turns) {
        in.rotary_deg[0] = angle_a;
        in.rotary_deg[1] = angle_b;
        in.rotary_deg[2] = angle_c;
    }
    int32_t status = gib_tilt_step(gib, &in, &out);
    if (out.warning && accept) {
        in.acknowledged_id = out.request_id;
    }
    if (gib_hal_differ(out, told, status, phase)) {
        tell(__comp_inst, status);
    }
    offset_z = shift = out.offset_mm[2];
}

/* A measurement may be asked for. */
__attribute__((noinline, cold)) static void ask(struct __comp_state *__comp_inst, long period)
{
    if (start && !started && enable && !fault) {
        error = begin(__comp_inst, period * 1e-9);
        awake = error == GIB_OK;
        busy = awake;
        verdict = 0;
    }
    started = start;
}

/* A fault lasts until the machine is off. */
__attribute__((noinline, cold)) static void doubt(struct __comp_state *__comp_inst, int good)
{
    fault = !good ? GIB_ERR_NON_FINITE : enable ? fault : 0;
    ok = ok_in & !fault;
}

FUNCTION(_)
{
    /* What is no number goes nowhere: the last safe value stays, and motion is told. */
    int good = gib_hal_both_held(position_cmd, drive_fb, &cmd_safe, &fb_safe);
    if (!good | !enable | fault) {
        doubt(__comp_inst, good);
    } else {
        ok = ok_in;
    }
    if (awake) {
        work(__comp_inst);
    } else if (start | started) {
        ask(__comp_inst, period);
    }
    drive_cmd = cmd_safe + shift;
    position_fb = fb_safe - shift;
}
