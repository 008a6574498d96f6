/*
 * Every fault in every state of speed variation. A whole run is walked through once; in every cycle it is forked in memory for each
 * fault (spindle and gib are plain data, so a copy is a fork), the fault is put in, and the fork is followed to its end.
 * Prints which fault ends how, and after how many cycles at most, in each state.
 */
#include "spindle_faults.h"

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
        /* On the way back only the speed is asked for any more, and one out of range is no fault. */
        assert_int_equal(status, GIB_DONE);
    } else {
        assert_int_equal(status, VARIATION_CODES[fault]);
    }
    if (fault != VARIATION_DRIVE_FAULT) {
        assert_true(fabs(fork.out.speed_command_rpm - c->speed_rpm) < 1e-6 * fabs(c->speed_rpm));
    }
    gib_speed_variation_input quiet = {NAN, 0.0, 0.0, 0.0, 0, 0};
    gib_speed_variation_output out;
    assert_int_equal(gib_speed_variation_step((gib_speed_variation *)fork.memory, &quiet, &out), status);
    assert_true(out.speed_command_rpm == fork.out.speed_command_rpm && out.torque_nm == 0.0);
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

/* A fault in the first cycle: the speed asked for goes on, or, where that is no number or too fast, the last one within the limits, else the mean. */
static void variation_broken_at_once_does_not_stop_the_spindle(void **state)
{
    (void)state;
    for (int run = 0; run < 3 * VARIATION_FAULTS; run++) {
        int fault = run / 3, fresh = run % 3 == 0;
        variation_run now;
        gib_speed_variation *gib = NULL;
        gib_speed_variation_config c = variation_config(GIB_SPEED_VARIATION_TRIANGLE);
        gib_speed_variation_input before = {run % 3 == 1 ? 1100.0 : 0.0, 0.0, 0.0, 0.0, 0, 0};
        memset(&now, 0, sizeof now);
        assert_int_equal(gib_speed_variation_init_in(now.memory, sizeof now.memory, &gib), GIB_OK);
        if (!fresh) {
            assert_int_equal(gib_speed_variation_step(gib, &before, &now.out), GIB_OK);
        }
        assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
        assert_int_equal(variation_cycle(&now, &c, fault, 1, 0), VARIATION_CODES[fault]);
        int unsaid = fault == SPEED_ASKED_NAN || fault == SPEED_ASKED_INFINITE || fault == SPEED_TOO_HIGH, other = fault == SPEED_OTHER_SENSE;
        double asked = fault == SPEED_TOO_LOW ? 0.3 * c.speed_rpm : c.speed_rpm;
        double command = unsaid && run % 3 == 1 ? before.speed_rpm : other ? -asked : asked;
        assert_true(fabs(now.out.speed_command_rpm - command) < 1e-9 * fabs(command));
        assert_true(now.out.torque_nm == 0.0);
    }
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
        cmocka_unit_test(variation_every_fault_in_every_cycle),
        cmocka_unit_test(variation_broken_at_once_does_not_stop_the_spindle),
        cmocka_unit_test(variation_everything_changes_in_every_cycle),
        cmocka_unit_test(variation_that_cannot_come_back_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
