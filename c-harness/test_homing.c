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

/* Of a ball or a pad, which stiffens with the force, home is found late, and gib says how late at most, where the bend of the line
 * stands out of the noise. */
static void a_stop_that_stiffens_is_said_to(void **state)
{
    (void)state;
    for (int power = 0; power < 3; power++) {
        for (int i = 0; i < 8; i++) {
            static const double SOFT[2] = {60.0, 200.0};
            homing_plant_config c = homing_plant_default();
            c.seed = 300u + (uint64_t)i;
            c.torque_noise_nm = 0.03;
            c.stop_power = 1.0 + 0.5 * power;
            c.stop_stiffness_nm_mm = SOFT[i % 2];
            gib_homing_config g = homing_config(&c);
            homing_outcome o = homing_run(&c, &g);
            const gib_homing_side *s = &o.report.side[0];
            assert_int_equal(o.status, GIB_DONE);
            print_message("power %.1f, %3.0f N.m/mm: home %.2f um late, says %.2f\n", c.stop_power, c.stop_stiffness_nm_mm,
                          -o.home_error_um, s->uncertainty_um);
            assert_true(fabs(o.home_error_um) <= s->uncertainty_um);
            assert_true(power > 0 || s->uncertainty_um < 5.0);
        }
    }
}

/* A rotary axis is the same axis in degrees, and the lag may be dropped without the kernel. */
static void degrees_and_instant_lag_reduction(void **state)
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

/* Torque in per mille of rated, and with its sign turned, is the same torque; unless gib is not told. */
static void torque_unit_and_polarity(void **state)
{
    (void)state;
    homing_outcome plain, other;
    for (int sense = -1; sense <= 1; sense += 2) {
        for (int k = 0; k < 4; k++) {
            homing_plant_config c = homing_plant_default();
            const int permille = k & 1, inverted = k >> 1;
            c.sense = sense;
            c.torque_unit_nm = (permille ? 0.008 : 1.0) * (inverted ? -1.0 : 1.0); /* rated 8 N.m */
            gib_homing_config g = homing_config(&c);
            g.torque_unit = permille ? GIB_TORQUE_PERMILLE : GIB_TORQUE_NM;
            g.rated_torque_nm = permille ? 8.0 : 0.0;
            g.torque_inverted = inverted;
            other = homing_run(&c, &g);
            assert_int_equal(other.status, GIB_DONE);
            plain = k == 0 ? other : plain;
            const gib_homing_side *a = &plain.report.side[0], *b = &other.report.side[0];
            assert_true(fabs(a->contact_mm - b->contact_mm) < 1e-6);
            assert_true(fabs(a->stiffness_nm_mm / b->stiffness_nm_mm - 1.0) < 1e-6);
            assert_true(fabs(a->sliding_nm - b->sliding_nm) < 1e-6 && a->sliding_nm > 1.0);
            assert_true(fabs(other.report.old_torque_limit * fabs(c.torque_unit_nm) - c.torque_limit_nm) < 1e-9);
            assert_true(fabs(other.limit_nm - c.torque_limit_nm) < 1e-9);
            g.torque_inverted = !inverted;
            other = homing_run(&c, &g);
            assert_int_equal(other.status, GIB_ERR_HOMING_TORQUE_SIGN);
            assert_true(other.most_travel_mm <= g.distance_max_mm && other.most_torque_nm <= g.torque_limit_nm + 1e-9);
        }
    }
}

/*
 * A servo without integral drops its torque with its deviation, and the stop pushes the motor back faster than any encoder
 * may run otherwise: no fault.
 */
static void springs_back_when_the_deviation_is_dropped(void **state)
{
    (void)state;
    for (int instant = 0; instant <= 1; instant++) {
        homing_plant_config c = homing_plant_default();
        c.cycle_s = 0.002;
        c.velocity_gain_nm_s_mm = 0.23;
        c.velocity_integral_time_s = 0.0;
        gib_homing_config g = homing_config(&c);
        g.torque_limit_nm = 10.0;
        g.press_max_mm = 0.4;
        g.lag_reduction = instant;
        homing_outcome o = homing_run(&c, &g);
        assert_int_equal(o.status, GIB_DONE);
        assert_true(fabs(o.home_error_um) < 2.0);
    }
}

/* Which home is: where the line starts unless the plain threshold is asked for; both are reported. */
static void method(void **state)
{
    (void)state;
    homing_plant_config c = homing_plant_default();
    gib_homing_config g = homing_config(&c);
    homing_outcome line = homing_run(&c, &g);
    g.method = GIB_HOMING_THRESHOLD;
    homing_outcome threshold = homing_run(&c, &g);
    assert_true(line.status == GIB_DONE && threshold.status == GIB_DONE);
    const gib_homing_side *a = &line.report.side[0], *b = &threshold.report.side[0];
    assert_true(line.report.method == GIB_HOMING_LINE && threshold.report.method == GIB_HOMING_THRESHOLD);
    assert_true(fabs(a->contact_mm - b->contact_mm) < 1e-9 && fabs(a->threshold_mm - b->threshold_mm) < 1e-9);
    /* Machine coordinates differ by just what lies between the two. */
    assert_true(fabs(a->shift_mm - b->shift_mm - (a->threshold_mm - a->contact_mm)) < 1e-9);
    assert_true(a->threshold_mm - a->contact_mm > 0.01);
}

/*
 * A gantry is squared to its stops, whichever side is first, or it is refused: one that is too far out, and one whose
 * crossbeam alone holds the other side before its stop.
 */
static void gantry(void **state)
{
    (void)state;
    const double apart[] = {0.0, 0.02, 0.05, 0.12, 0.3, 0.5}, beam[] = {0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0};
    for (size_t i = 0; i < sizeof apart / sizeof *apart; i++) {
        for (size_t k = 0; k < sizeof beam / sizeof *beam; k++) {
            homing_plant_config c = homing_plant_default();
            const double out = i % 2 ? apart[i] : -apart[i];
            c.motors = 2;
            c.beam_nm_mm = beam[k];
            c.stop_mm[1] = c.stop_mm[0] + out;
            gib_homing_config g = homing_config(&c);
            homing_outcome o = homing_run(&c, &g);
            int squared = o.status == GIB_DONE && fabs(o.report.skew_mm + out) < 0.02;
            /* A beam about as stiff as the drives also makes a touch that is too unsure by itself. */
            int unsure = o.status == GIB_ERR_HOMING_NOISE && beam[k] >= 20.0;
            int refused = o.status == GIB_ERR_HOMING_SQUARE || unsure;
            int must_home = apart[i] <= 0.12 && beam[k] <= 10.0, must_refuse = apart[i] > 0.2;
            if (!(squared || refused) || (must_home && !squared) || (must_refuse && !refused)) {
                fail_msg("%.2f mm apart, beam %.0f Nm/mm: status %d, skew %.3f", out, beam[k], (int)o.status,
                         o.report.skew_mm);
            }
            assert_true(!refused || o.detail.value < o.detail.low || o.detail.value > o.detail.high);
            assert_true(o.most_torque_nm <= g.torque_limit_nm + 1e-9);
        }
    }
}

/* Under a servo without feedforward the axis lags a millimetre behind its command: the way is gone when the axis has gone it. */
static void a_stop_on_the_way_that_the_axis_lags_behind(void **state)
{
    (void)state;
    homing_plant_config c = homing_plant_default();
    c.velocity_feedforward = 0.0;
    c.position_gain_1_s = 8.0;
    for (int k = 0; k < 2; k++) {
        gib_homing_config g = homing_config(&c);
        g.approach_speed_mm_s = 8.0;
        g.distance_max_mm = k ? 5.9 : 6.4;
        homing_outcome o = homing_run(&c, &g);
        assert_int_equal(o.status, k ? GIB_ERR_HOMING_NO_STOP : GIB_DONE);
        assert_true(o.most_travel_mm <= g.distance_max_mm && o.limit_nm == c.torque_limit_nm);
        assert_true(k || fabs(o.home_error_um) < 1.5);
        /* What is too short is named, and where a stop would have been met. */
        assert_true(!k || (o.detail.value == 5.9 && o.detail.low == 0.0 && fabs(o.detail.high - 5.85) < 1e-9));
    }
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
    assert_int_equal(gib_homing_last_error(gib, &detail), GIB_OK);
    assert_string_equal(detail.field, "struct_size");
    assert_true(detail.value == 8.0 && detail.low > 8.0);
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
        cmocka_unit_test(a_stop_that_stiffens_is_said_to),
        cmocka_unit_test(degrees_and_instant_lag_reduction),
        cmocka_unit_test(torque_unit_and_polarity),
        cmocka_unit_test(springs_back_when_the_deviation_is_dropped),
        cmocka_unit_test(method),
        cmocka_unit_test(gantry),
        cmocka_unit_test(a_stop_on_the_way_that_the_axis_lags_behind),
        cmocka_unit_test(refuses_what_it_cannot_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
