component gib_recorder "puts signals at servo rate into shared memory, for gib record";
description
"""
loadrt gib_recorder machine=mill columns=x.position_command_mm,x.position_mm,x.torque_nm

One column a channel, \\fBch-00\\fR first, in the names of gib's recordings: <channel>.<signal>_<unit>. Every servo cycle makes
one row. The program \\fBgib record\\fR writes them to a file, as an ordinary user; when it is too slow or dies, the control does
not feel it. Only who runs the control may read the memory, unless \\fBmode\\fR says otherwise.

Module parameters: \\fBcolumns\\fR (required), \\fBmachine\\fR (mill), \\fBname\\fR (linuxcnc), \\fBperiod_ns\\fR, the servo
period in ns (1000000), \\fBevery\\fR, servo cycles from row to row (1), \\fBrows_in_ring\\fR, rows in the ring (four seconds), \\fBmode\\fR,
permissions in decimal (384, which is 0600).
""";
include "gib.h";
include "gib_hal.h";

pin in float ch_##[32] "values of the columns, each in the unit of its name";
pin out bit recording = false "rows are written";
pin out s32 error = 0 "0, or the gib status of the last cycle";
pin out float rows "rows written since the start";

option singleton yes;
option extra_setup yes;
option extra_cleanup yes;
function _ fp "once per servo cycle, last";
license "MIT OR Apache-2.0";
author "the gib project";
;;
#include <string.h>

#define CHANNELS_MOST 32

static char *columns = "";
static char *machine = "mill";
static char *name = "linuxcnc";
static int period_ns = 1000000;
static int every = 1;
static int rows_in_ring = 0;
static int mode = 384;
RTAPI_MP_STRING(columns, "names of the columns, separated by commas");
RTAPI_MP_STRING(machine, "name of the machine");
RTAPI_MP_STRING(name, "name of the recorder");
RTAPI_MP_INT(period_ns, "servo period in ns");
RTAPI_MP_INT(every, "servo cycles from row to row");
RTAPI_MP_INT(rows_in_ring, "rows in the ring");
RTAPI_MP_INT(mode, "permissions, decimal");

static gib_recorder *recorder;
static int32_t told; /* what the pins say */
static uint32_t channels;

EXTRA_SETUP()
{
    gib_recorder_config config;
    gib_error_detail why;
    const char *c;
    (void)__comp_inst;
    (void)prefix;
    (void)extra_arg;
    for (channels = *columns != 0, c = columns; *c; c++) {
        channels += *c == ',';
    }
    if (channels < 1 || channels > CHANNELS_MOST) {
        rtapi_print_msg(RTAPI_MSG_ERR, "gib_recorder: columns= names %u columns, 1 to %d are allowed\n", channels,
                        CHANNELS_MOST);
        return -1;
    }
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    config.channels = channels;
    config.capacity_rows = (uint32_t)rows_in_ring;
    config.every_cycles = (uint32_t)every;
    config.mode = (uint32_t)mode;
    config.cycle_s = 1e-9 * period_ns;
    config.name = name;
    config.machine = machine;
    config.columns = columns;
    recorder = gib_recorder_new();
    if (gib_recorder_start(recorder, &config) == GIB_OK) {
        return 0;
    }
    gib_recorder_last_error(recorder, &why);
    rtapi_print_msg(RTAPI_MSG_ERR, "gib_recorder: %s: %s (%g)\n", why.field, gib_status_text(why.code), why.value);
    gib_recorder_free(recorder);
    recorder = NULL;
    return -1;
}

EXTRA_CLEANUP()
{
    gib_recorder_free(recorder);
}

FUNCTION(_)
{
    /* gib reads where the pins are; they are plain numbers. */
    int32_t status = gib_recorder_step_from(recorder, (const double *const *)__comp_inst->ch, channels);
    if (status == GIB_BUSY) {
        rows += 1.0;
    }
    if (status != told) {
        told = status;
        recording = status == GIB_BUSY;
        error = status < 0 ? status : 0;
    }
}
