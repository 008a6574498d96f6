/*
 * Family `inertia` from C: measured on a simulated spindle, refused where it should be, and every pointer checked.
 */
#include "gib.h"
#include "spindle_plant.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static gib_inertia_config usual(void)
{
    gib_inertia_config c;
    memset(&c, 0, sizeof c);
    c.struct_size = sizeof c;
    c.cycle_s = 0.001;
    c.speed_high_rpm = 2000.0;
    c.acceleration_rpm_s = 1000.0;
    return c;
}

/* Runs until gib is no longer busy; `input_flags` are given in cycle `at`. */
static int32_t run(gib_inertia *gib, spindle *s, int at, uint32_t input_flags)
{
    gib_inertia_output out;
    int32_t status = GIB_BUSY;
    for (int i = 0; i < 200000 && status == GIB_BUSY; i++) {
        spindle_reading r = spindle_sense(s);
        gib_inertia_input in = {r.speed_rpm, r.torque, i == at ? input_flags : 0, 0};
        status = gib_inertia_step(gib, &in, &out);
        assert_true(isfinite(out.speed_command_rpm));
        assert_int_equal(out.status, status);
        if (out.owns_motion) {
            spindle_cycle(s, out.speed_command_rpm, 0.0);
        }
    }
    return status;
}

static void measured_on_a_spindle(void **state)
{
    (void)state;
    for (int i = 0; i < 5; i++) {
        static const double inertia[] = {0.01, 0.05, 0.5, 2.0, 5.0};
        double scale = inertia[i] / 0.5;
        spindle_config sc = spindle_default();
        spindle s;
        sc.inertia_kg_m2 = inertia[i];
        sc.coulomb_nm *= scale;
        sc.viscous_nm_s *= scale;
        sc.ripple_nm *= scale;
        sc.torque_noise_nm *= scale;
        sc.torque_limit_nm *= scale;
        sc.outlier_ratio = 0.01;
        spindle_init(&s, &sc);
        gib_inertia_config c = usual();
        gib_inertia_report report;
        c.own_inertia_kg_m2 = 0.2 * inertia[i];
        c.process_step = 2;
        gib_inertia *gib = gib_inertia_new();
        assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
        assert_int_equal(gib_inertia_start(gib, &c), GIB_ERR_STATE);
        assert_int_equal(gib_inertia_result(gib, &report), GIB_ERR_STATE);
        assert_int_equal(run(gib, &s, -1, 0), GIB_DONE);
        assert_int_equal(gib_inertia_result(gib, &report), GIB_OK);
        assert_true(fabs(report.total_kg_m2 / inertia[i] - 1.0) < 0.01);
        assert_true(fabs(report.workpiece_kg_m2 / (0.8 * inertia[i]) - 1.0) < 0.0125);
        assert_true(fabs(report.coulomb_nm / sc.coulomb_nm - 1.0) < 0.2);
        assert_true(report.naive_kg_m2 > 1.08 * inertia[i]);
        assert_int_equal(report.process_step, 2);
        assert_int_equal(report.both_ways, 1);
        gib_inertia_free(gib);
    }
}

static void steady_speed_is_refused_with_a_ramp(void **state)
{
    (void)state;
    spindle_config sc = spindle_default();
    spindle s;
    spindle_init(&s, &sc);
    gib_inertia_config c = usual();
    gib_inertia_report report;
    gib_error_detail detail;
    c.mode = GIB_INERTIA_LISTEN;
    c.listen_s = 3.0;
    gib_inertia *gib = gib_inertia_new();
    for (int i = 0; i < 2000; i++) {
        spindle_cycle(&s, 1000.0, 0.0);
    }
    assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
    int32_t status = GIB_BUSY;
    while (status == GIB_BUSY) {
        spindle_reading r = spindle_sense(&s);
        gib_inertia_input in = {r.speed_rpm, r.torque, 0, 0};
        gib_inertia_output out;
        status = gib_inertia_step(gib, &in, &out);
        assert_int_equal(out.owns_motion, 0);
        spindle_cycle(&s, 1000.0, 0.0);
    }
    assert_int_equal(status, GIB_DONE);
    assert_int_equal(gib_inertia_result(gib, &report), GIB_ERR_INERTIA_EXCITATION);
    assert_int_equal(report.verdict, GIB_ERR_INERTIA_EXCITATION);
    assert_true(report.ramp_acceleration_rpm_s > 0.0 && report.ramp_high_rpm > report.ramp_low_rpm);
    assert_int_equal(gib_inertia_last_error(gib, &detail), GIB_OK);
    assert_int_equal(detail.code, GIB_ERR_INERTIA_EXCITATION);
    gib_inertia_free(gib);
}

static void aborts_and_faults_end_by_the_door(void **state)
{
    (void)state;
    for (int at = 0; at < 5000; at += 489) {
        static const uint32_t flags[] = {GIB_INPUT_ABORT, GIB_INPUT_FAULT};
        static const int32_t wanted[] = {GIB_ERR_ABORTED, GIB_ERR_DRIVE_FAULT};
        for (int f = 0; f < 2; f++) {
            spindle_config sc = spindle_default();
            spindle s;
            spindle_init(&s, &sc);
            gib_inertia_config c = usual();
            gib_inertia *gib = gib_inertia_new();
            assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
            assert_int_equal(run(gib, &s, at, flags[f]), wanted[f]);
            assert_int_equal(gib_inertia_start(gib, &c), GIB_OK);
            gib_inertia_free(gib);
        }
    }
}

static void pointers_and_handles_are_checked(void **state)
{
    (void)state;
    _Alignas(16) static unsigned char memory[65536];
    gib_inertia *gib = NULL;
    gib_inertia_config c = usual();
    gib_inertia_input in = {1234.0, 1.0, 0, 0};
    gib_inertia_output out;
    gib_inertia_report report;
    gib_error_detail detail;
    assert_true(gib_inertia_size() <= sizeof memory);
    assert_int_equal(gib_inertia_init_in(memory, 16, &gib), GIB_ERR_MEMORY);
    assert_null(gib);
    assert_int_equal(gib_inertia_init_in(memory, sizeof memory, &gib), GIB_OK);
    assert_int_equal(gib_inertia_start(gib, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_inertia_start(NULL, &c), GIB_ERR_NULL);
    c.struct_size = 8;
    assert_int_equal(gib_inertia_start(gib, &c), GIB_ERR_STRUCT_SIZE);
    assert_int_equal(gib_inertia_last_error(gib, &detail), GIB_OK);
    assert_string_equal(detail.field, "struct_size");
    assert_true(detail.value == 8.0 && detail.low > 8.0);
    c = usual();
    c.acceleration_rpm_s = NAN;
    assert_int_equal(gib_inertia_start(gib, &c), GIB_ERR_CONFIG);
    assert_int_equal(gib_inertia_last_error(gib, &detail), GIB_OK);
    assert_string_equal(detail.field, "acceleration_rpm_s");
    assert_int_equal(gib_inertia_step(gib, &in, &out), GIB_OK);
    assert_true(out.speed_command_rpm == 1234.0 && out.owns_motion == 0);
    assert_int_equal(gib_inertia_step(NULL, &in, &out), GIB_ERR_NULL);
    assert_true(out.speed_command_rpm == 1234.0);
    assert_int_equal(gib_inertia_step(gib, NULL, &out), GIB_ERR_NULL);
    assert_int_equal(gib_inertia_step(gib, &in, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_inertia_result(gib, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_inertia_result(gib, &report), GIB_ERR_STATE);
    assert_int_equal(gib_inertia_abort(gib), GIB_OK);
    memset(memory, 0, sizeof memory);
    assert_int_equal(gib_inertia_step(gib, &in, &out), GIB_ERR_HANDLE);
    assert_int_equal(gib_inertia_abort(gib), GIB_ERR_HANDLE);
    gib_inertia_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(measured_on_a_spindle),
        cmocka_unit_test(steady_speed_is_refused_with_a_ramp),
        cmocka_unit_test(aborts_and_faults_end_by_the_door),
        cmocka_unit_test(pointers_and_handles_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
