/*
 * Every way out of a lost-motion measurement restores what was changed. A whole run is walked through once; at every
 * cycle the run is forked in memory for each kind of fault (plant and gib are plain data, so a copy is a fork), the
 * fault is put in, and the fork is followed to its end.
 */
#include "kernel.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { OLD_UM = 7, PHASES = 14, ACK_CYCLES = 50, LONGEST_EXIT = 400 };

enum fault {
    ABORT_CALL,
    ABORT_FLAG,
    DRIVE_FAULT,
    POSITION_NAN,
    POSITION_INFINITE,
    TORQUE_NAN,
    COMPENSATION_NAN,
    TORQUE_BOUND,
    TRAVEL_BOUND,
    FROZEN_ENCODER,
    DEAF_KERNEL,
    FAULTS
};

static const struct {
    const char *name;
    int32_t code;
} EXPECTED[FAULTS] = {
    {"abort call", GIB_ERR_ABORTED},           {"abort flag", GIB_ERR_ABORTED},
    {"drive fault", GIB_ERR_DRIVE_FAULT},      {"position NaN", GIB_ERR_NON_FINITE},
    {"position infinite", GIB_ERR_NON_FINITE}, {"torque NaN", GIB_ERR_NON_FINITE},
    {"compensation NaN", GIB_ERR_NON_FINITE},  {"torque bound", GIB_ERR_TORQUE_BOUND},
    {"travel bound", GIB_ERR_TRAVEL_BOUND},    {"frozen encoder", GIB_ERR_LAG},
    {"deaf kernel", GIB_ERR_ACK_TIMEOUT},
};

static gib_backlash_config short_config(int mode)
{
    gib_backlash_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = 0.001;
    c.mode = mode;
    c.travel_min_mm = -20.0;
    c.travel_max_mm = 20.0;
    c.torque_bound_nm = 12.0;
    c.detection_limit_um = 120.0;
    c.slide_mm = 0.2;
    c.slide_speed_mm_s = 2.0;
    c.lag_limit_mm = 0.2;
    c.feed_mm_s = 0.4;
    c.dwell_s = 0.006;
    c.repeats = 1;
    c.ack_timeout_s = ACK_CYCLES * c.cycle_s;
    return c;
}

typedef struct {
    plant axis;
    kernel k;
    gib_backlash *gib;
    double frozen_mm;
} rig;

/* One cycle with the fault in the input; `first` in the cycle in which it appears. */
static int32_t faulty_cycle(rig *r, enum fault fault, int first)
{
    gib_backlash_input in = kernel_sense(&r->k);
    switch (fault) {
    case ABORT_CALL:
        if (first) {
            assert_int_equal(gib_backlash_abort(r->gib), GIB_OK);
        }
        break;
    case ABORT_FLAG: in.flags = first ? GIB_INPUT_ABORT : 0; break;
    case DRIVE_FAULT: in.flags = GIB_INPUT_FAULT; break;
    case POSITION_NAN: in.position_mm = NAN; break;
    case POSITION_INFINITE: in.position_mm = -INFINITY; break;
    case TORQUE_NAN: in.torque = first ? NAN : in.torque; break;
    case COMPENSATION_NAN: in.compensation_um = first ? NAN : in.compensation_um; break;
    case TORQUE_BOUND: in.torque = 12.1; break;
    case TRAVEL_BOUND: in.position_mm = 20.1; break;
    case FROZEN_ENCODER: in.position_mm = r->frozen_mm; break;
    case DEAF_KERNEL:
    case FAULTS: break;
    }
    return gib_backlash_step(r->gib, &in, &r->k.out);
}

static void output_is_safe(const gib_backlash_output *out, const gib_backlash_output *before)
{
    assert_true(isfinite(out->target_position_mm) && isfinite(out->target_speed_mm_s));
    assert_true(isfinite(out->compensation_um) && isfinite(out->remaining_mm) && isfinite(out->progress_ratio));
    assert_true(out->progress_ratio >= 0.0 && out->progress_ratio <= 1.0);
    assert_true(fabs(out->target_speed_mm_s) <= 5.0 + 1e-9);
    /* The command never jumps: at most the fastest move's way in a cycle, or one motor step. */
    if (before->owns_motion && out->owns_motion) {
        assert_true(fabs(out->target_position_mm - before->target_position_mm) <= 5.0e-3 + 1e-9);
    }
    /* Braking goes on from the speed of the cycle before; the last cycle of a stop takes up to half as much more. */
    if (out->phase == GIB_BACKLASH_STOPPING) {
        const double cycle_s = 0.001, change = 50.0 * cycle_s;
        double moved = out->target_position_mm - before->target_position_mm;
        assert_true(fabs(out->target_speed_mm_s - before->target_speed_mm_s) <= 1.5 * change + 1e-9);
        assert_true(fabs(moved / cycle_s - out->target_speed_mm_s) <= change + 1e-9);
    }
    /* A drive that follows no command is asked for no motion. */
    if (out->message == GIB_ERR_DRIVE_FAULT && before->owns_motion && out->owns_motion) {
        assert_true(out->target_position_mm == before->target_position_mm && out->target_speed_mm_s == 0.0);
    }
}

/* Follows a fork from the fault to its end and checks what is left behind. */
static int follow(rig *r, enum fault fault, size_t size, const void *saved)
{
    static plant axis;
    rig fork = *r;
    int phase = r->k.out.phase, cycles = 0, leaving = 0;
    int32_t status;
    axis = r->axis;
    fork.axis = axis;
    fork.k.axis = &fork.axis;
    fork.k.recording = NULL;
    memcpy(fork.gib, saved, size);
    fork.frozen_mm = r->k.reading.position_mm;
    fork.k.deaf = fault == DEAF_KERNEL;
    uint32_t asked = r->k.out.request_id;
    do {
        gib_backlash_output before = fork.k.out;
        status = faulty_cycle(&fork, fault, cycles == 0);
        output_is_safe(&fork.k.out, &before);
        /* A kernel that is deaf, or an axis that is frozen, matters only once something is asked of it. */
        int waits = fault == DEAF_KERNEL ? fork.k.out.request_id == asked : fault == FROZEN_ENCODER;
        cycles++;
        leaving = waits ? 0 : leaving + 1;
        if (leaving > LONGEST_EXIT || cycles > 40000) {
            fail_msg("%s in phase %d: still busy after %d cycles", EXPECTED[fault].name, phase, cycles);
        }
    } while (status == GIB_BUSY);
    /* In the probe, which goes slowly, the command has gone its way before it is that far from the axis. */
    int32_t other = phase == GIB_BACKLASH_PROBE ? GIB_ERR_BACKLASH_MOTOR_FRICTION : GIB_ERR_LAG;
    if (fault == FROZEN_ENCODER && status != GIB_ERR_LAG && status != other) {
        return 0; /* the axis stood anyway, and was asked for nothing that needed it to move */
    }
    if (status != EXPECTED[fault].code && !(fault == FROZEN_ENCODER && status == other)) {
        fail_msg("%s in phase %d: ended with %s", EXPECTED[fault].name, phase, gib_status_text(status));
    }
    assert_int_equal(fork.k.out.phase, GIB_BACKLASH_FAILED);
    assert_int_equal(fork.k.out.owns_motion, 0);
    if (fault == DEAF_KERNEL) {
        /* Nobody listened: the restore is still asked for, and the operator is told. When the kernel is back it
           finds the request and is put right. */
        assert_int_equal(fork.k.out.message, GIB_ERR_RESTORE_UNCONFIRMED);
        fork.k.deaf = 0;
        for (int i = 0; i < 3; i++) {
            kernel_cycle(&fork.k, fork.gib);
        }
    }
    gib_backlash_report report;
    assert_int_equal(gib_backlash_result(fork.gib, &report), GIB_OK);
    assert_int_equal(report.restore_owed, 0);
    assert_int_equal(report.written, 0);
    if (fork.axis.compensation_um != (double)OLD_UM || !fork.axis.reversal_acceleration_on) {
        fail_msg("%s in phase %d: left %g um, reversal acceleration %s", EXPECTED[fault].name, phase,
                 fork.axis.compensation_um, fork.axis.reversal_acceleration_on ? "on" : "off");
    }
    return 1;
}

/* Walks a whole run; forks it at every `stride`-th cycle for `fault`, and in every phase at least once. */
static void walk(enum fault fault, int mode, int stride)
{
    size_t size = gib_backlash_size();
    void *own = aligned_alloc(16, (size + 15) / 16 * 16), *saved = aligned_alloc(16, (size + 15) / 16 * 16);
    gib_backlash *gib = NULL;
    plant_config c = plant_default();
    gib_backlash_config config = short_config(mode);
    int seen[PHASES] = {0};
    static rig r;
    c.substeps = 8;
    plant_init(&r.axis, &c);
    r.axis.compensation_um = OLD_UM;
    kernel_init(&r.k, &r.axis);
    assert_int_equal(gib_backlash_init_in(own, size, &gib), GIB_OK);
    r.gib = gib;
    assert_int_equal(gib_backlash_start(gib, &config), GIB_OK);
    int32_t status;
    long cycle = 0;
    do {
        int phase = r.k.out.phase, fresh = !seen[phase] && phase != GIB_BACKLASH_IDLE;
        if (phase != GIB_BACKLASH_IDLE && (fresh || cycle % stride == 0)) {
            plant axis = r.axis;
            kernel k = r.k;
            memcpy(saved, own, size);
            seen[phase] |= follow(&r, fault, size, saved);
            memcpy(own, saved, size);
            r.axis = axis;
            r.k = k;
        }
        status = kernel_cycle(&r.k, gib);
        cycle++;
    } while (status == GIB_BUSY);
    assert_int_equal(status, GIB_DONE);
    static const int must[] = {GIB_BACKLASH_CLEAR,  GIB_BACKLASH_APPROACH, GIB_BACKLASH_SLIDE_BACK, GIB_BACKLASH_SLIDE_IN,
                               GIB_BACKLASH_SETTLE, GIB_BACKLASH_SCAN,     GIB_BACKLASH_PROBE,      GIB_BACKLASH_EVALUATE,
                               GIB_BACKLASH_WRITE};
    for (size_t i = 0; i < sizeof must / sizeof must[0]; i++) {
        int stands = must[i] == GIB_BACKLASH_CLEAR || must[i] == GIB_BACKLASH_WRITE || must[i] == GIB_BACKLASH_APPROACH;
        if (!seen[must[i]] && !(fault == FROZEN_ENCODER && stands)) {
            fail_msg("%s was never tried in phase %d", EXPECTED[fault].name, must[i]);
        }
    }
    print_message("%-18s mode %d: a run of %ld cycles, forked every %d\n", EXPECTED[fault].name, mode, cycle, stride);
    free(own);
    free(saved);
}

static void aborted_at_every_cycle(void **state)
{
    (void)state;
    walk(ABORT_CALL, GIB_BACKLASH_SLOW_FEED, 1);
}

static void every_fault_in_every_phase(void **state)
{
    (void)state;
    for (int fault = 0; fault < FAULTS; fault++) {
        int slow = fault == DEAF_KERNEL || fault == FROZEN_ENCODER;
        walk((enum fault)fault, GIB_BACKLASH_SLOW_FEED, slow ? 401 : 23);
        walk((enum fault)fault, GIB_BACKLASH_STEP, slow ? 997 : 97);
    }
}

/* Runs one plant to its end and returns the status; everything must be as before unless it is done. */
static int32_t end_of(plant_config c, gib_backlash_config config)
{
    static rig r;
    plant_init(&r.axis, &c);
    r.axis.compensation_um = OLD_UM;
    kernel_init(&r.k, &r.axis);
    r.gib = gib_backlash_new();
    int32_t status = gib_backlash_start(r.gib, &config);
    while (status == GIB_OK || status == GIB_BUSY) {
        gib_backlash_output before = r.k.out;
        status = kernel_cycle(&r.k, r.gib);
        output_is_safe(&r.k.out, &before);
    }
    assert_true(r.axis.reversal_acceleration_on);
    assert_true(status == GIB_DONE || r.axis.compensation_um == (double)OLD_UM);
    gib_backlash_free(r.gib);
    return status;
}

static void refuses_by_name(void **state)
{
    (void)state;
    const plant_config fine = plant_default();
    gib_backlash_config config = short_config(GIB_BACKLASH_SLOW_FEED);
    config.feed_mm_s = 0.1;
    config.slide_mm = 1.0;
    config.slide_speed_mm_s = 1.0;
    config.detection_limit_um = 300.0;
    config.repeats = 2;
    assert_int_equal(end_of(fine, config), GIB_DONE);

    plant_config c = fine;
    gib_backlash_config g = config;
    g.detection_limit_um = 40.0; /* the table moves after 53 um */
    int32_t status = end_of(c, g);
    assert_true(status == GIB_ERR_BACKLASH_LIMIT || status == GIB_ERR_BACKLASH_NO_RISE);

    c.clearance_mm = 0.4; /* nothing but clearance within the limit */
    assert_int_equal(end_of(c, config), GIB_ERR_BACKLASH_NO_RISE);

    c = fine;
    c.torque_noise_nm = 3.0;
    c.torque_limit_nm = 16.0;
    g = config;
    g.torque_bound_nm = 40.0;
    status = end_of(c, g);
    assert_true(status == GIB_ERR_BACKLASH_NOISE || status == GIB_ERR_BACKLASH_MOTOR_FRICTION ||
                status == GIB_ERR_BACKLASH_SHAPE);

    c = fine;
    c.motor_share = 0.85;
    assert_int_equal(end_of(c, config), GIB_ERR_BACKLASH_MOTOR_FRICTION);

    c = fine;
    c.clearance_mm = 0.0;
    c.stiffness_nm_mm = 3000.0; /* 1.6 um of wind-up on an encoder of 2 um */
    c.encoder_mm = 0.002;
    status = end_of(c, config);
    assert_true(status <= GIB_ERR_BACKLASH_NO_RISE && status >= GIB_ERR_BACKLASH_TORQUE_SIGN);
}

/* Torque with the wrong sign, and a torque that never changes. */
static void a_wrong_torque_is_refused(void **state)
{
    (void)state;
    static const int32_t expected[] = {GIB_ERR_BACKLASH_TORQUE_SIGN, GIB_ERR_BACKLASH_NOISE};
    for (int i = 0; i < 2; i++) {
        static rig r;
        plant_config c = plant_default();
        gib_backlash_config config = short_config(GIB_BACKLASH_SLOW_FEED);
        plant_init(&r.axis, &c);
        r.axis.compensation_um = OLD_UM;
        kernel_init(&r.k, &r.axis);
        r.gib = gib_backlash_new();
        assert_int_equal(gib_backlash_start(r.gib, &config), GIB_OK);
        int32_t status;
        do {
            gib_backlash_input in = kernel_sense(&r.k);
            in.torque = i == 0 ? -in.torque : 0.25;
            status = gib_backlash_step(r.gib, &in, &r.k.out);
        } while (status == GIB_BUSY);
        assert_int_equal(status, expected[i]);
        assert_true(r.axis.compensation_um == (double)OLD_UM && r.axis.reversal_acceleration_on);
        gib_backlash_free(r.gib);
    }
}

/* The check that everything is restored can fail: a kernel that ignores the restore is caught. */
static void a_kernel_that_does_not_restore_is_seen(void **state)
{
    (void)state;
    static rig r;
    plant_config c = plant_default();
    gib_backlash_config config = short_config(GIB_BACKLASH_SLOW_FEED);
    plant_init(&r.axis, &c);
    r.axis.compensation_um = OLD_UM;
    kernel_init(&r.k, &r.axis);
    r.gib = gib_backlash_new();
    assert_int_equal(gib_backlash_start(r.gib, &config), GIB_OK);
    for (int i = 0; i < 500; i++) {
        kernel_cycle(&r.k, r.gib);
    }
    r.k.deaf = 1;
    gib_backlash_abort(r.gib);
    int32_t status;
    do {
        status = kernel_cycle(&r.k, r.gib);
    } while (status == GIB_BUSY);
    gib_backlash_report report;
    gib_backlash_result(r.gib, &report);
    assert_int_equal(status, GIB_ERR_ABORTED);
    assert_int_equal(r.k.out.message, GIB_ERR_RESTORE_UNCONFIRMED);
    assert_true(report.restore_owed == 1 && r.axis.compensation_um == 0.0);
    assert_int_equal(gib_backlash_start(r.gib, &config), GIB_ERR_RESTORE_UNCONFIRMED);
    gib_backlash_free(r.gib);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(aborted_at_every_cycle),
        cmocka_unit_test(every_fault_in_every_phase),
        cmocka_unit_test(refuses_by_name),
        cmocka_unit_test(a_wrong_torque_is_refused),
        cmocka_unit_test(a_kernel_that_does_not_restore_is_seen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
