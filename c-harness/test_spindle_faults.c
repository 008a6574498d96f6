/*
 * Every fault in every state of inertia and speed variation. A whole run is walked through once; in every cycle it is
 * forked in memory for each fault (spindle and gib are plain data, so a copy is a fork), the fault is put in, and the fork
 * is followed to its end. Prints which fault ends how, and after how many cycles at most, in each state.
 */
#include "spindle_run.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { MEMORY = 32768, STATES = 10 };
static const double CYCLE_S = 0.001;

/* Cells of the table: most cycles from the fault to the end, 0: the state was never met. */
typedef struct {
    int cycles[STATES];
} row;

/* Columns are the states from `first` to `last`. */
static void print_table(const char *title, const char *const *states, int first, int last, const char *const *faults,
                        const int32_t *codes, const row *rows, int fault_count)
{
    print_message("\n%s: cycles from a fault to its end, at most\n%-24s %6s", title, "", "status");
    for (int s = first; s <= last; s++) {
        print_message(" %9s", states[s]);
    }
    print_message("\n");
    for (int f = 0; f < fault_count; f++) {
        print_message("%-24s %6d", faults[f], (int)codes[f]);
        for (int s = first; s <= last; s++) {
            print_message(" %9d", rows[f].cycles[s]);
        }
        print_message("\n");
    }
}

/* ---- inertia ---- */

enum inertia_fault {
    ABORT_CALL,
    ABORT_FLAG,
    DRIVE_FAULT,
    UNKNOWN_FLAG,
    SPEED_NAN,
    SPEED_INFINITE,
    TORQUE_NAN,
    TORQUE_INFINITE,
    TORQUE_BOUND,
    SPEED_STUCK,
    JAMMED,
    TORQUE_STUCK,
    TORQUE_DEAD,
    TORQUE_INVERTED,
    INERTIA_FAULTS
};
static const char *const INERTIA_NAMES[INERTIA_FAULTS] = {
    "abort call",        "abort flag",     "drive fault",   "unknown flag",        "speed NaN",
    "speed infinite",    "torque NaN",     "torque infinite", "torque above its bound", "speed stuck",
    "spindle jammed",    "torque stuck",   "torque dead",   "torque inverted"};
static const int32_t INERTIA_CODES[INERTIA_FAULTS] = {
    GIB_ERR_ABORTED,    GIB_ERR_ABORTED,    GIB_ERR_DRIVE_FAULT,  GIB_ERR_CONFIG, GIB_ERR_NON_FINITE,
    GIB_ERR_NON_FINITE, GIB_ERR_NON_FINITE, GIB_ERR_NON_FINITE,   GIB_ERR_TORQUE_BOUND, GIB_ERR_LAG,
    GIB_ERR_LAG,        GIB_ERR_INERTIA_TORQUE, GIB_ERR_INERTIA_TORQUE, GIB_ERR_INERTIA_SIGN};
static const char *const INERTIA_STATES[STATES] = {"idle",  "approach", "up",     "hold high", "down",
                                                   "hold low", "listening", "return", "done",      "failed"};

typedef struct {
    spindle s;
    _Alignas(16) unsigned char memory[MEMORY];
    gib_inertia_output out;
    spindle_reading stuck;
} inertia_run;

static gib_inertia *gib_of(inertia_run *r)
{
    return (gib_inertia *)r->memory;
}

static gib_inertia_config inertia_config(int mode)
{
    gib_inertia_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.mode = mode;
    c.cycle_s = CYCLE_S;
    c.speed_high_rpm = 500.0;
    c.speed_low_rpm = 100.0;
    c.acceleration_rpm_s = 1000.0;
    c.hold_s = 0.15;
    c.lag_limit_rpm = 120.0;
    c.torque_bound_nm = 190.0;
    c.listen_s = 1.0;
    return c;
}

/* How the kernel turns the spindle while gib listens. */
static double listened_rpm(const spindle *s)
{
    return 300.0 + 200.0 * sin(0.05 * s->angle);
}

/* One cycle; `fault` is in it, for the first time when `first`. Checks what must hold in every cycle. */
static int32_t inertia_cycle(inertia_run *r, int fault, int first)
{
    spindle_reading reading = spindle_sense(&r->s);
    if (first) {
        r->stuck = reading;
    }
    gib_inertia_input in = {reading.speed_rpm, reading.torque, 0, 0};
    gib_inertia_output before = r->out;
    switch (fault) {
    case ABORT_CALL:
        if (first) {
            assert_int_equal(gib_inertia_abort(gib_of(r)), GIB_OK);
        }
        break;
    case ABORT_FLAG: in.flags = first ? GIB_INPUT_ABORT : 0; break;
    case DRIVE_FAULT: in.flags = GIB_INPUT_FAULT; break;
    case UNKNOWN_FLAG: in.flags = first ? 1u << 20 : 0; break;
    case SPEED_NAN: in.speed_rpm = NAN; break;
    case SPEED_INFINITE: in.speed_rpm = first ? INFINITY : in.speed_rpm; break;
    case TORQUE_NAN: in.torque = first ? NAN : in.torque; break;
    case TORQUE_INFINITE: in.torque = -INFINITY; break;
    case TORQUE_BOUND: in.torque = first ? -190.1 : in.torque; break;
    case SPEED_STUCK: in.speed_rpm = r->stuck.speed_rpm; break;
    case TORQUE_STUCK: in.torque = r->stuck.torque; break;
    case TORQUE_DEAD: in.torque -= r->s.past[0]; break; /* only its noise is left */
    case TORQUE_INVERTED: in.torque = -in.torque; break;
    default: break;
    }
    int32_t status = gib_inertia_step(gib_of(r), &in, &r->out);
    assert_int_equal(r->out.status, status);
    assert_true(isfinite(r->out.speed_command_rpm));
    assert_true(r->out.progress_ratio >= 0.0 && r->out.progress_ratio <= 1.0);
    assert_int_equal(r->out.owns_motion != 0, status == GIB_BUSY && r->out.owns_motion);
    if (before.owns_motion && r->out.owns_motion) {
        /* The command never jumps, and stays between standstill and the ramp's end. */
        assert_true(fabs(r->out.speed_command_rpm - before.speed_command_rpm) <= 1000.0 * CYCLE_S * (1.0 + 1e-9));
        assert_true(fabs(r->out.speed_command_rpm) <= 500.0 + 1e-6);
    }
    if (fault == JAMMED) {
        r->s.w = 0.0;
    } else if (r->out.owns_motion) {
        spindle_cycle(&r->s, r->out.speed_command_rpm, 0.0);
    } else if (r->out.phase == GIB_INERTIA_LISTENING) {
        spindle_cycle(&r->s, listened_rpm(&r->s), 0.0);
    }
    return status;
}

/* What became of the forks that came to a result: right, or refused; and refused by the fault's own name. */
static int judged[INERTIA_FAULTS][2], named[INERTIA_FAULTS];

/* Follows a fork from the fault to its end and judges it. */
static void follow_inertia(const inertia_run *now, int fault, int at, row *cell)
{
    static inertia_run fork;
    fork = *now;
    int state = fork.out.phase, cycles = 0;
    int32_t status;
    do {
        status = inertia_cycle(&fork, fault, cycles == 0);
        cycles++;
        assert_true(cycles < 5000); /* the whole run takes some 2700 */
    } while (status == GIB_BUSY);
    gib_inertia_report report;
    int32_t result = gib_inertia_result(gib_of(&fork), &report);
    if (fault <= TORQUE_BOUND) {
        assert_int_equal(status, INERTIA_CODES[fault]);
        assert_true(cycles <= 520); /* back from the fastest speed at the ramps' own pace */
    } else if (fault == SPEED_STUCK || fault == JAMMED) {
        /* Where the speed was not to change any more, or nothing was commanded, no fault can be seen. */
        if (status != GIB_ERR_LAG && status != GIB_DONE && (fault != JAMMED || status != GIB_ERR_TORQUE_BOUND)) {
            fail_msg("%s in cycle %d, state %d: status %d", INERTIA_NAMES[fault], at, state, (int)status);
        }
    } else {
        assert_int_equal(status, GIB_DONE); /* torque is judged by the result */
    }
    if (status == GIB_DONE) {
        /* A value is right, or it is refused. */
        double error = fabs(report.total_kg_m2 - 0.5);
        /* Intervals hold 95 of 100; half as much again none may miss. */
        if (result == GIB_OK && error > 0.02 * 0.5 && error > 1.5 * report.total_uncertainty_kg_m2) {
            fail_msg("%s in cycle %d, state %d: %.3f +- %.3f, %d dropped of %d", INERTIA_NAMES[fault], at, state,
                     report.total_kg_m2, report.total_uncertainty_kg_m2, report.blocks_dropped, report.blocks_used);
        }
        judged[fault][result < 0]++;
        if (result == INERTIA_CODES[fault]) {
            named[fault]++;
        }
    } else {
        assert_int_equal(result, GIB_ERR_STATE);
    }
    assert_int_equal(fork.out.owns_motion, 0);
    /* The first error is kept, whatever comes; and a start is taken again. */
    gib_inertia_input quiet = {0.0, 0.0, 0, 0};
    gib_inertia_output out;
    for (int i = 0; i < 3; i++) {
        assert_int_equal(gib_inertia_step(gib_of(&fork), &quiet, &out), status);
    }
    gib_inertia_config c = inertia_config(GIB_INERTIA_RAMP);
    assert_int_equal(gib_inertia_start(gib_of(&fork), &c), GIB_OK);
    if (cycles > cell->cycles[state]) {
        cell->cycles[state] = cycles;
    }
}

static void inertia_every_fault_in_every_cycle(void **state)
{
    (void)state;
    static inertia_run now;
    row rows[INERTIA_FAULTS];
    memset(rows, 0, sizeof rows);
    for (int mode = GIB_INERTIA_RAMP; mode <= GIB_INERTIA_LISTEN; mode++) {
        spindle_config sc = spindle_default();
        sc.substeps = 4;
        sc.outlier_ratio = 0.0;
        memset(&now, 0, sizeof now);
        spindle_init(&now.s, &sc);
        for (int i = 0; mode == GIB_INERTIA_LISTEN && i < 2000; i++) {
            spindle_cycle(&now.s, fmin(0.5 * i, listened_rpm(&now.s)), 0.0);
        }
        gib_inertia *gib = NULL;
        gib_inertia_config c = inertia_config(mode);
        assert_int_equal(gib_inertia_init_in(now.memory, sizeof now.memory, &gib), GIB_OK);
        assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
        int32_t status = inertia_cycle(&now, INERTIA_FAULTS, 0);
        for (int cycle = 0; status == GIB_BUSY; cycle++) {
            for (int fault = 0; fault < INERTIA_FAULTS; fault++) {
                /* What lasts to the end costs a whole run each time. */
                /* A speed that is stuck while gib only listens cannot be told from one that is held. */
                int listens_to_it = mode == GIB_INERTIA_LISTEN && (fault == SPEED_STUCK || fault == JAMMED);
                if (!listens_to_it && (fault <= TORQUE_BOUND || cycle % 13 == 0)) {
                    follow_inertia(&now, fault, cycle, &rows[fault]);
                }
            }
            status = inertia_cycle(&now, INERTIA_FAULTS, 0);
        }
        assert_int_equal(status, GIB_DONE);
    }
    print_table("inertia", INERTIA_STATES, GIB_INERTIA_APPROACH, GIB_INERTIA_RETURN, INERTIA_NAMES, INERTIA_CODES, rows,
                INERTIA_FAULTS);
    for (int f = SPEED_STUCK; f < INERTIA_FAULTS; f++) {
        print_message("%s, from any moment of a run: %d results right, %d refused, %d of them by %d\n", INERTIA_NAMES[f],
                      judged[f][0], judged[f][1], named[f], (int)INERTIA_CODES[f]);
    }
}

static void inertia_calls_in_wrong_order(void **state)
{
    (void)state;
    gib_inertia *gib = gib_inertia_new();
    gib_inertia_config c = inertia_config(GIB_INERTIA_RAMP);
    gib_inertia_input in = {321.0, 1.0, 0, 0};
    gib_inertia_output out;
    gib_inertia_report report;
    assert_int_equal(gib_inertia_abort(gib), GIB_OK);
    assert_int_equal(gib_inertia_result(gib, &report), GIB_ERR_STATE);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(gib_inertia_step(gib, &in, &out), GIB_OK);
        assert_true(out.speed_command_rpm == 321.0 && out.owns_motion == 0);
    }
    assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
    assert_int_equal(gib_inertia_start(gib, &c), GIB_ERR_STATE);
    assert_int_equal(gib_inertia_result(gib, &report), GIB_ERR_STATE);
    /* Aborted before its first cycle: nothing was commanded, so nothing has to go back. */
    assert_int_equal(gib_inertia_abort(gib), GIB_OK);
    assert_int_equal(gib_inertia_abort(gib), GIB_OK);
    assert_int_equal(gib_inertia_step(gib, &in, &out), GIB_ERR_ABORTED);
    assert_true(out.speed_command_rpm == 321.0 && out.owns_motion == 0);
    /* Too fast to have been measured: refused in the first cycle, before anything is commanded. */
    assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
    in.speed_rpm = 1e9;
    assert_int_equal(gib_inertia_step(gib, &in, &out), GIB_ERR_LAG);
    assert_int_equal(out.owns_motion, 0);
    gib_inertia_free(gib);
}

/* ---- speed variation ---- */

enum variation_fault {
    VARIATION_ABORT_CALL,
    VARIATION_ABORT_FLAG,
    VARIATION_DRIVE_FAULT,
    VARIATION_UNKNOWN_FLAG,
    SPEED_ASKED_NAN,
    SPEED_ASKED_INFINITE,
    AMPLITUDE_NAN,
    PERIOD_INFINITE,
    CUTTING_NAN,
    SPEED_OTHER_SENSE,
    SPEED_TOO_HIGH,
    SPEED_TOO_LOW,
    AMPLITUDE_NEGATIVE,
    PERIOD_TOO_SHORT,
    CUTTING_NEGATIVE,
    VARIATION_FAULTS
};
static const char *const VARIATION_NAMES[VARIATION_FAULTS] = {
    "abort call",  "abort flag",          "drive fault",      "unknown flag",   "speed NaN",
    "speed infinite", "amplitude NaN",    "period infinite",  "cutting NaN",    "speed of other sense",
    "speed above largest", "speed below least", "amplitude negative", "period too short", "cutting negative"};
static const int32_t VARIATION_CODES[VARIATION_FAULTS] = {
    GIB_ERR_ABORTED,    GIB_ERR_ABORTED,    GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG,     GIB_ERR_NON_FINITE,
    GIB_ERR_NON_FINITE, GIB_ERR_NON_FINITE, GIB_ERR_NON_FINITE,  GIB_ERR_NON_FINITE, GIB_ERR_SPEED_VARIATION_SPEED,
    GIB_ERR_SPEED_VARIATION_SPEED, GIB_ERR_SPEED_VARIATION_SPEED, GIB_ERR_CONFIG, GIB_ERR_CONFIG, GIB_ERR_CONFIG};
static const char *const VARIATION_STATES[] = {"idle", "triangle", "stopping", "sine", "stopping"};

static gib_speed_variation_config variation_config(int waveform)
{
    gib_speed_variation_config c = variation_example();
    c.waveform = waveform;
    c.period_s = 0.8;
    c.amplitude_ratio = 0.2;
    c.torque_nm = 120.0;
    c.coulomb_nm = 5.0;
    c.viscous_nm_s = 0.02;
    c.cutting_nm = 3.0;
    c.speed_min_rpm = 400.0;
    c.speed_max_rpm = 1600.0;
    return c;
}

/* What the motor can do, by the balance of torque and nothing of gib's: judges a change of the command in a cycle. */
static void within_the_motor(const gib_speed_variation_config *c, double cutting_nm, double before_rpm, double now_rpm,
                             double reported_nm)
{
    double w0 = spindle_rad_s(fabs(before_rpm)), w1 = spindle_rad_s(fabs(now_rpm)), faster = fmax(w0, w1);
    double inertia = c->inertia_kg_m2 * (w1 - w0) / c->cycle_s, friction = c->coulomb_nm + c->viscous_nm_s * faster;
    double sense = c->speed_rpm < 0.0 ? -1.0 : 1.0;
    if (inertia > 1e-6) {
        double torque = inertia + friction + fmax(cutting_nm, c->cutting_nm);
        assert_true(torque <= c->torque_nm * (1.0 + 1e-9) && torque * faster <= c->power_w * (1.0 + 1e-9));
    } else if (inertia < -1e-6) {
        double brake = -inertia - friction; /* cutting may end at any moment */
        assert_true(brake <= c->torque_nm * (1.0 + 1e-9) && brake * faster <= c->power_w * (1.0 + 1e-9));
    }
    assert_true(fabs(sense * reported_nm - inertia) < 1e-5);
    assert_true(fabs(now_rpm) <= c->speed_max_rpm + 1e-6 && fabs(now_rpm) >= c->speed_min_rpm - 1e-6);
    assert_true(now_rpm * before_rpm > 0.0);
}

typedef struct {
    _Alignas(16) unsigned char memory[4096];
    gib_speed_variation_output out;
} variation_run;

static int32_t variation_cycle(variation_run *r, const gib_speed_variation_config *c, int fault, int first, uint32_t flags)
{
    gib_speed_variation *gib = (gib_speed_variation *)r->memory;
    gib_speed_variation_input in = {c->speed_rpm, 0.0, 0.0, 0.0, flags, 0};
    gib_speed_variation_output before = r->out;
    switch (fault) {
    case VARIATION_ABORT_CALL:
        if (first) {
            assert_int_equal(gib_speed_variation_abort(gib), GIB_OK);
        }
        break;
    case VARIATION_ABORT_FLAG: in.flags |= first ? GIB_INPUT_ABORT : 0; break;
    case VARIATION_DRIVE_FAULT: in.flags |= first ? GIB_INPUT_FAULT : 0; break;
    case VARIATION_UNKNOWN_FLAG: in.flags |= first ? 1u << 30 : 0; break;
    case SPEED_ASKED_NAN: in.speed_rpm = NAN; break;
    case SPEED_ASKED_INFINITE: in.speed_rpm = -INFINITY; break;
    case AMPLITUDE_NAN: in.amplitude_ratio = first ? NAN : 0.0; break;
    case PERIOD_INFINITE: in.period_s = INFINITY; break;
    case CUTTING_NAN: in.cutting_nm = first ? NAN : 0.0; break;
    case SPEED_OTHER_SENSE: in.speed_rpm = first ? -in.speed_rpm : in.speed_rpm; break;
    case SPEED_TOO_HIGH: in.speed_rpm *= first ? 1.7 : 1.0; break;
    case SPEED_TOO_LOW: in.speed_rpm *= first ? 0.3 : 1.0; break;
    case AMPLITUDE_NEGATIVE: in.amplitude_ratio = first ? -0.1 : 0.0; break;
    case PERIOD_TOO_SHORT: in.period_s = first ? 0.003 : 0.0; break;
    case CUTTING_NEGATIVE: in.cutting_nm = first ? -1.0 : 0.0; break;
    default: break;
    }
    int32_t status = gib_speed_variation_step(gib, &in, &r->out);
    assert_int_equal(r->out.status, status);
    assert_true(isfinite(r->out.speed_command_rpm) && isfinite(r->out.torque_nm) && isfinite(r->out.amplitude_ratio));
    assert_true(isfinite(r->out.amplitude_limit_ratio) && isfinite(r->out.period_limit_s));
    if (before.phase == GIB_SPEED_VARIATION_RUNNING || before.phase == GIB_SPEED_VARIATION_STOPPING) {
        if (status == GIB_BUSY) {
            within_the_motor(c, 0.0, before.speed_command_rpm, r->out.speed_command_rpm, r->out.torque_nm);
        }
    }
    return status;
}

static void follow_variation(const variation_run *now, const gib_speed_variation_config *c, int fault, int stopping,
                             row *cell)
{
    variation_run fork = *now;
    int cycles = 0;
    int32_t status;
    do {
        status = variation_cycle(&fork, c, fault, cycles == 0, 0);
        cycles++;
        assert_true(cycles <= 500); /* half a swing, a quarter of the period's 800 cycles, is left at most */
    } while (status == GIB_BUSY);
    if (stopping && fault >= SPEED_OTHER_SENSE) {
        /* On the way back nothing is asked for any more: what is asked out of range is not looked at. */
        assert_int_equal(status, GIB_DONE);
    } else {
        assert_int_equal(status, VARIATION_CODES[fault]);
    }
    if (fault != VARIATION_DRIVE_FAULT) {
        assert_true(fabs(fork.out.speed_command_rpm - c->speed_rpm) < 1e-6 * fabs(c->speed_rpm));
    }
    assert_true(fork.out.torque_nm == 0.0);
    gib_speed_variation_input quiet = {NAN, 0.0, 0.0, 0.0, 0, 0};
    gib_speed_variation_output out;
    assert_int_equal(gib_speed_variation_step((gib_speed_variation *)fork.memory, &quiet, &out), status);
    assert_true(out.speed_command_rpm == fork.out.speed_command_rpm);
    assert_int_equal(gib_speed_variation_start((gib_speed_variation *)fork.memory, c), GIB_OK);
    int column = 1 + 2 * c->waveform + stopping;
    cell->cycles[column] = cycles > cell->cycles[column] ? cycles : cell->cycles[column];
}

static void variation_every_fault_in_every_cycle(void **state)
{
    (void)state;
    row rows[VARIATION_FAULTS];
    memset(rows, 0, sizeof rows);
    for (int run = 0; run < 4; run++) {
        variation_run now;
        gib_speed_variation *gib = NULL;
        gib_speed_variation_config c = variation_config(run % 2);
        c.speed_rpm *= run < 2 ? 1.0 : -1.0;
        memset(&now, 0, sizeof now);
        assert_int_equal(gib_speed_variation_init_in(now.memory, sizeof now.memory, &gib), GIB_OK);
        assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
        int32_t status = variation_cycle(&now, &c, VARIATION_FAULTS, 0, 0);
        for (int cycle = 0; status == GIB_BUSY; cycle++) {
            for (int fault = 0; fault < VARIATION_FAULTS; fault++) {
                follow_variation(&now, &c, fault, now.out.phase == GIB_SPEED_VARIATION_STOPPING, &rows[fault]);
            }
            status = variation_cycle(&now, &c, VARIATION_FAULTS, 0, cycle == 1777 ? GIB_SPEED_VARIATION_STOP : 0);
        }
        assert_int_equal(status, GIB_DONE);
    }
    print_table("speed variation", VARIATION_STATES, 1, 4, VARIATION_NAMES, VARIATION_CODES, rows, VARIATION_FAULTS);
}

/* Speed, amplitude, period and cutting change in every cycle, at random, and the command stays within the motor. */
static void variation_everything_changes_in_every_cycle(void **state)
{
    (void)state;
    uint64_t random = 20260102;
    print_message("seed %llu\n", (unsigned long long)random);
    for (int run = 0; run < 40; run++) {
        gib_speed_variation *gib = gib_speed_variation_new();
        gib_speed_variation_config c = variation_config(run % 2);
        gib_speed_variation_output out;
        double before = c.speed_rpm, rare = run % 4 < 2 ? 1.0 : 0.02;
        gib_speed_variation_input in = {c.speed_rpm, 0.0, 0.0, 0.0, 0, 0};
        assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
        for (int cycle = 0; cycle < 5000; cycle++) {
            if (cycle > 0 && random_between(&random, 0.0, 1.0) < rare) {
                in.speed_rpm = random_between(&random, 400.0, 1600.0);
                in.amplitude_ratio = random_between(&random, 0.0, 0.999);
                in.period_s = random_over(&random, 0.02, 600.0);
                in.cutting_nm = random_between(&random, 0.0, 150.0); /* also more than the motor has */
            }
            assert_int_equal(gib_speed_variation_step(gib, &in, &out), GIB_BUSY);
            within_the_motor(&c, in.cutting_nm, before, out.speed_command_rpm, out.torque_nm);
            before = out.speed_command_rpm;
        }
        /* However it was left, it comes back to the speed asked for: the cut is over. */
        in.cutting_nm = 0.0;
        in.flags = GIB_SPEED_VARIATION_STOP;
        int32_t status = gib_speed_variation_step(gib, &in, &out);
        in.flags = 0;
        for (int cycle = 0; status == GIB_BUSY; cycle++) {
            status = gib_speed_variation_step(gib, &in, &out);
            assert_true(cycle < 40000);
        }
        assert_int_equal(status, GIB_DONE);
        assert_true(fabs(out.speed_command_rpm - in.speed_rpm) < 1e-5);
        gib_speed_variation_free(gib);
    }
}

/* A cut that takes all the motor has: the way back up cannot be had, and ends all the same, by name. */
static void variation_that_cannot_come_back_ends(void **state)
{
    (void)state;
    gib_speed_variation *gib = gib_speed_variation_new();
    gib_speed_variation_config c = variation_config(GIB_SPEED_VARIATION_TRIANGLE);
    gib_speed_variation_input in = {c.speed_rpm, 0.0, 0.0, 0.0, 0, 0};
    gib_speed_variation_output out;
    assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
    for (int i = 0; i < 600; i++) { /* to the bottom of the swing */
        assert_int_equal(gib_speed_variation_step(gib, &in, &out), GIB_BUSY);
    }
    assert_true(out.speed_command_rpm < 0.85 * c.speed_rpm);
    in.cutting_nm = 500.0;
    in.flags = GIB_SPEED_VARIATION_STOP;
    int32_t status = gib_speed_variation_step(gib, &in, &out);
    int cycles = 1;
    in.flags = 0;
    while (status == GIB_BUSY && cycles < 10000) {
        double before = out.speed_command_rpm;
        status = gib_speed_variation_step(gib, &in, &out);
        assert_true(out.speed_command_rpm <= before + 1e-9);
        cycles++;
    }
    print_message("the way back is given up after %d cycles\n", cycles);
    assert_int_equal(status, GIB_ERR_SPEED_VARIATION_NONE);
    gib_speed_variation_free(gib);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inertia_every_fault_in_every_cycle),
        cmocka_unit_test(inertia_calls_in_wrong_order),
        cmocka_unit_test(variation_every_fault_in_every_cycle),
        cmocka_unit_test(variation_everything_changes_in_every_cycle),
        cmocka_unit_test(variation_that_cannot_come_back_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
