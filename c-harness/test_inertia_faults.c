/*
 * Every fault in every state of inertia. A whole run is walked through once; in every cycle it is forked in memory for each
 * fault (spindle and gib are plain data, so a copy is a fork), the fault is put in, and the fork is followed to its end.
 * With clang, and so under its sanitizers, in one cycle of five. Prints which fault ends how, and after how many cycles at
 * most, in each state.
 */
#include "fewer.h"
#include "spindle_faults.h"

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
                if (!listens_to_it && cycle % (fault <= TORQUE_BOUND ? ONE_IN : 13 * ONE_IN) == 0) {
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inertia_every_fault_in_every_cycle),
        cmocka_unit_test(inertia_calls_in_wrong_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
