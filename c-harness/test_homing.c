/* Homing on a dead stop: laws that every run must keep, on the plant of homing_plant.h. */
#include "homing_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static homing_outcome usual(double sense, uint64_t seed)
{
    homing_plant_config c = homing_plant_default();
    c.sense = sense;
    c.seed = seed;
    gib_homing_config g = homing_config(&c);
    g.set_position_mm = 12.5;
    return homing_run(&c, &g);
}

/* Either direction: homed, every event once and in order, the old torque limit back, within the uncertainty told. */
static void homes_either_way(void **state)
{
    (void)state;
    for (int i = 0; i < 6; i++) {
        homing_outcome o = usual(i % 2 ? -1.0 : 1.0, 40u + (uint64_t)i);
        assert_int_equal(o.status, GIB_DONE);
        assert_int_equal(o.events, 8);
        for (int k = 0; k < 8; k++) {
            assert_int_equal(o.order[k], 1 << k);
        }
        assert_true(o.limit_nm == homing_plant_default().torque_limit_nm);
        assert_true(fabs(o.home_error_um) < 1.5);
        /* An uncertainty that is too small or too large is as wrong as a bad home. */
        assert_true(o.report.side[0].uncertainty_um > 0.1 && o.report.side[0].uncertainty_um < 2.0);
    }
}

/* The limit twice as high, the stop three times as stiff: home stays, the threshold does not. */
static void home_depends_on_neither_limit_nor_stiffness(void **state)
{
    (void)state;
    const double limit[3] = {5.0, 10.0, 5.0}, stiffness[3] = {400.0, 400.0, 1200.0};
    double line[3] = {0}, threshold[3] = {0};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 8; i++) {
            homing_plant_config c = homing_plant_default();
            c.seed = 70u + (uint64_t)i;
            c.stop_stiffness_nm_mm = stiffness[k];
            c.torque_noise_nm = 0.03 * limit[k];
            gib_homing_config g = homing_config(&c);
            g.torque_limit_nm = limit[k];
            homing_outcome o = homing_run(&c, &g);
            assert_int_equal(o.status, GIB_DONE);
            line[k] += 1e3 * o.report.side[0].contact_mm / 8;
            threshold[k] += 1e3 * o.report.side[0].threshold_mm / 8;
        }
    }
    assert_true(fabs(line[1] - line[0]) < 1.0 && fabs(line[2] - line[0]) < 1.0);
    assert_true(fabs(threshold[1] - threshold[0]) > 20.0);
}

/* A rotary axis is the same axis in degrees; torque in per mille of rated, and inverted, is the same torque. */
static void units_and_polarity(void **state)
{
    (void)state;
    homing_plant_config c = homing_plant_default();
    gib_homing_config g = homing_config(&c);
    g.position_unit = GIB_POSITION_DEG;
    g.lag_reduction = GIB_HOMING_INSTANT_LAG_REDUCTION;
    homing_outcome o = homing_run(&c, &g);
    assert_int_equal(o.status, GIB_DONE);
    assert_int_equal(o.events, 6); /* none asked, none acknowledged */
}

/* A gantry is squared to its stops, and one that is too far out is refused. */
static void gantry(void **state)
{
    (void)state;
    homing_plant_config c = homing_plant_default();
    c.motors = 2;
    c.beam_nm_mm = 20.0;
    c.stop_mm[1] = 6.05;
    gib_homing_config g = homing_config(&c);
    homing_outcome o = homing_run(&c, &g);
    assert_int_equal(o.status, GIB_DONE);
    assert_true(fabs(o.report.skew_mm + 0.05) < 0.02);
    c.beam_nm_mm = 2.0; /* stiffer, and the beam alone would hold the other side */
    c.stop_mm[1] = 6.5;
    o = homing_run(&c, &g);
    assert_int_equal(o.status, GIB_ERR_HOMING_SQUARE);
}

static void refuses_what_it_cannot_do(void **state)
{
    (void)state;
    homing_plant_config c = homing_plant_default();
    gib_homing_config g = homing_config(&c);
    gib_homing *gib = gib_homing_new();
    gib_error_detail detail;
    g.direction = 0;
    assert_int_equal(gib_homing_start(gib, &g), GIB_ERR_CONFIG);
    assert_int_equal(gib_homing_last_error(gib, &detail), GIB_OK);
    assert_string_equal(detail.field, "direction");
    g.direction = 1;
    g.struct_size = 8;
    assert_int_equal(gib_homing_start(gib, &g), GIB_ERR_STRUCT_SIZE);
    g.struct_size = sizeof g;
    assert_int_equal(gib_homing_start(gib, &g), GIB_OK);
    assert_int_equal(gib_homing_start(gib, &g), GIB_ERR_STATE);
    gib_homing_input in;
    gib_homing_output out;
    memset(&in, 0, sizeof in);
    in.position_mm[0] = NAN;
    memset(&out, 0x7f, sizeof out);
    gib_homing_step(gib, &in, &out);
    for (int i = 0; i < 3 && out.status == GIB_BUSY; i++) {
        gib_homing_step(gib, &in, &out);
    }
    assert_int_equal(out.status, GIB_ERR_NON_FINITE);
    assert_true(isfinite(out.target_position_mm[0]) && out.target_speed_mm_s[0] == 0.0 && out.stop_drive == 1);
    assert_int_equal(gib_homing_step(NULL, &in, &out), GIB_ERR_NULL);
    assert_true(isfinite(out.target_position_mm[0]) && out.owns_motion == 0);
    gib_homing_free(gib);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(homes_either_way),
        cmocka_unit_test(home_depends_on_neither_limit_nor_stiffness),
        cmocka_unit_test(units_and_polarity),
        cmocka_unit_test(gantry),
        cmocka_unit_test(refuses_what_it_cannot_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
