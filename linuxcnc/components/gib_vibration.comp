component gib_vibration "corrects a scale's position for the vibration of tool slide and spindle, by two accelerometers";
description
"""
A scale tells where the slide is against its seat. Where the tool is against the workpiece is \\fBposition\\fR: the scale plus the
displacement of the seat minus that of the spindle bearing, taken from the harmonics of the spindle's turn in their accelerations.

The correction comes in while \\fBon\\fR is true and the spindle turns; \\fBblend\\fR says how far. A bad sensor fades it out: then
\\fBposition\\fR is the plain scale, and \\fBwhy\\fR tells (GIB_VIBRATION_ in gib.h). \\fBposition\\fR is always a number.
A parameter left at 0 takes the default of gib_vibration_config in gib.h.
""";
include "gib.h";
include "gib_hal.h";

pin in float scale "position of the slide from its scale, mm";
pin in float angle "spindle angle, degrees";
pin in float seat "acceleration of the seat, m/s2, positive as the scale is";
pin in float bearing "acceleration of the spindle bearing, m/s2, positive as the scale is";
pin in bit on "correct the position";
pin out float position "where the tool is against the workpiece, mm";
pin out float correction "what is added to the scale, um";
pin out float blend "share of the correction in force, 0 to 1";
pin out bit in_force = false "the correction is wholly in force: position can be trusted";
pin out s32 state = 0 "GIB_VIBRATION_ phase";
pin out u32 why = 0 "why the plain scale is in force, a sum";
pin out s32 error = 0 "0, or the gib status of the last start or end";
pin in bit ok_in = true "of the component before in the chain";
pin out bit ok = false "false: the scale reads no number; chain it to motion.enable";

param rw float range = 0 "full scale of the accelerometers, m/s2";
param rw s32 harmonic_count = 0 "harmonics of a turn that are tracked";
param rw float averaging = 0 "turns over which they are averaged";

variable gib_vibration *gib;
variable gib_vibration_input in;
variable gib_vibration_output out;
variable gib_vibration_output told; /* what the pins say */
variable double safe = 0.0;
variable int asked = 0;
variable int running = 0;

option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, after what reads scale and accelerometers";
license "MIT OR Apache-2.0";
author "the gib project";
;;

EXTRA_SETUP()
{
    gib = gib_vibration_new();
    return gib ? 0 : -1;
}

EXTRA_CLEANUP()
{
    struct __comp_state *__comp_inst;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) {
        gib_vibration_free(gib);
    }
}

static int32_t begin(struct __comp_state *__comp_inst, double cycle_s)
{
    gib_vibration_config config = {
        .struct_size = sizeof config,
        .cycle_s = cycle_s,
        .acceleration_range_m_s2 = range,
        .harmonics = harmonic_count,
        .averaging_revolutions = averaging,
    };
    return gib_vibration_start(gib, &config, NULL);
}

/* Tells what has changed. */
__attribute__((noinline, cold)) static void tell(struct __comp_state *__comp_inst, int32_t status)
{
    running = status == GIB_BUSY;
    error = running || status == GIB_ERR_ABORTED ? 0 : status;
    told = out;
    state = out.phase;
    why = out.reasons;
    blend = out.blend_ratio;
    in_force = out.blend_ratio == 1.0;
}

/* A cycle in which the correction is in force, comes or goes. */
static void work(struct __comp_state *__comp_inst, double now)
{
    in.scale_mm = now;
    in.angle_deg = angle;
    in.acceleration_m_s2[0] = seat;
    in.acceleration_m_s2[1] = bearing;
    in.flags = on ? 0 : GIB_INPUT_ABORT;
    int32_t status = gib_vibration_step(gib, &in, &out);
    position = out.position_mm;
    correction = out.correction_um;
    if (gib_hal_differ(out, told, blend_ratio, reasons)) {
        tell(__comp_inst, status);
    }
}

/* Nothing is in force, and something may be asked for. */
__attribute__((noinline, cold)) static void ask(struct __comp_state *__comp_inst, long period)
{
    if (on && !asked) {
        error = begin(__comp_inst, period * 1e-9);
        running = error == GIB_OK;
    }
    asked = on;
    correction = blend = told.blend_ratio = 0.0;
    in_force = 0;
}

FUNCTION(_)
{
    double now = scale;
    ok = gib_hal_held(now, &safe) & ok_in;
    if (running) {
        work(__comp_inst, now);
    } else {
        if (on | asked) {
            ask(__comp_inst, period);
        }
        position = safe;
    }
}
