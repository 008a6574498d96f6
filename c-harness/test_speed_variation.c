/*
 * Family `speed_variation` from C: the limits, the command on a simulated spindle with a power meter, and every pointer.
 */
#include "spindle_run.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void published_draws_too_much_and_ours_all_there_is(void **state)
{
    (void)state;
    gib_speed_variation_config c = variation_example();
    gib_speed_variation_limits limits;
    assert_int_equal(gib_speed_variation_possible(&c, &limits), GIB_OK);
    assert_true(fabs(limits.published_amplitude_ratio - 0.9) < 1e-9);
    assert_true(fabs(limits.published_power_w / 10000.0 - 1.88) < 0.01);
    assert_true(fabs(limits.amplitude_ratio - 0.578) < 0.001);
    assert_int_equal(limits.limited_by, GIB_ERR_SPEED_VARIATION_POWER);

    c.formula = GIB_SPEED_VARIATION_PUBLISHED;
    c.amplitude_ratio = limits.published_amplitude_ratio;
    double published = variation_power(&c);
    assert_true(published > 1.85 && published < 1.91);

    for (int waveform = 0; waveform < 2; waveform++) {
        for (int load = 0; load < 2; load++) {
            c = variation_example();
            c.waveform = waveform;
            c.coulomb_nm = 8.0 * load;
            c.viscous_nm_s = 0.05 * load;
            c.cutting_nm = 20.0 * load;
            assert_int_equal(gib_speed_variation_possible(&c, &limits), GIB_OK);
            c.amplitude_ratio = limits.amplitude_ratio;
            double ours = variation_power(&c);
            print_message("waveform %d, load %d: amplitude %.3f draws %.4f P\n", waveform, load,
                          limits.amplitude_ratio, ours);
            assert_true(ours <= 1.0 && ours >= 0.97);
        }
    }
}

static void more_than_possible_is_refused_with_what_is(void **state)
{
    (void)state;
    gib_speed_variation_config c = variation_example();
    gib_error_detail detail;
    gib_speed_variation *gib = gib_speed_variation_new();
    c.amplitude_ratio = 0.9;
    assert_int_equal(gib_speed_variation_start(gib, &c), GIB_ERR_SPEED_VARIATION_POWER);
    assert_int_equal(gib_speed_variation_last_error(gib, &detail), GIB_OK);
    assert_string_equal(detail.field, "amplitude_ratio");
    assert_true(fabs(detail.high - 0.578) < 0.001);
    c.amplitude_ratio = detail.high;
    assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
    gib_speed_variation_free(gib);
}

static void it_starts_and_stops_without_a_jump(void **state)
{
    (void)state;
    for (int waveform = 0; waveform < 2; waveform++) {
        gib_speed_variation_config c = variation_example();
        gib_speed_variation_input in = {1000.0, 0.0, 0.0, 0.0, 0, 0};
        gib_speed_variation_output out = {0};
        gib_speed_variation *gib = gib_speed_variation_new();
        c.waveform = waveform;
        assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
        double last = 1000.0, most = 0.0;
        int32_t status = GIB_BUSY;
        for (int i = 0; i < 20000 && status == GIB_BUSY; i++) {
            in.flags = i == 7321 ? GIB_SPEED_VARIATION_STOP : 0;
            status = gib_speed_variation_step(gib, &in, &out);
            most = fmax(most, fabs(out.speed_command_rpm - last));
            last = out.speed_command_rpm;
        }
        assert_int_equal(status, GIB_DONE);
        assert_true(fabs(last - 1000.0) < 1e-6);
        /* A triangle changes by 4·0.3·1000/2 rpm in a second, a sine by 2·pi/4 times as much. */
        assert_true(most < 0.6 * 1.8);
        gib_speed_variation_free(gib);
    }
}

static void pointers_and_handles_are_checked(void **state)
{
    (void)state;
    _Alignas(16) static unsigned char memory[4096];
    gib_speed_variation *gib = NULL;
    gib_speed_variation_config c = variation_example();
    gib_speed_variation_input in = {1234.0, 0.0, 0.0, 0.0, 0, 0};
    gib_speed_variation_output out;
    gib_speed_variation_limits limits;
    assert_true(gib_speed_variation_size() <= sizeof memory);
    assert_int_equal(gib_speed_variation_init_in(memory + 1, sizeof memory - 1, &gib), GIB_ERR_MEMORY);
    assert_int_equal(gib_speed_variation_init_in(memory, sizeof memory, &gib), GIB_OK);
    assert_int_equal(gib_speed_variation_result(gib, &limits), GIB_ERR_STATE);
    assert_int_equal(gib_speed_variation_start(gib, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_speed_variation_step(gib, &in, &out), GIB_OK);
    assert_true(out.speed_command_rpm == 1234.0);
    assert_int_equal(gib_speed_variation_start(gib, &c), GIB_OK);
    assert_int_equal(gib_speed_variation_start(gib, &c), GIB_ERR_STATE);
    assert_int_equal(gib_speed_variation_result(gib, &limits), GIB_OK);
    assert_int_equal(gib_speed_variation_step(NULL, &in, &out), GIB_ERR_NULL);
    assert_int_equal(gib_speed_variation_step(gib, NULL, &out), GIB_ERR_NULL);
    assert_int_equal(gib_speed_variation_step(gib, &in, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_speed_variation_possible(NULL, &limits), GIB_ERR_NULL);
    assert_int_equal(gib_speed_variation_possible(&c, NULL), GIB_ERR_NULL);
    c.inertia_kg_m2 = NAN;
    assert_int_equal(gib_speed_variation_possible(&c, &limits), GIB_ERR_CONFIG);
    assert_true(limits.amplitude_ratio == 0.0);
    assert_int_equal(gib_speed_variation_abort(gib), GIB_OK);
    memset(memory, 0, sizeof memory);
    assert_int_equal(gib_speed_variation_step(gib, &in, &out), GIB_ERR_HANDLE);
    gib_speed_variation_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_draws_too_much_and_ours_all_there_is),
        cmocka_unit_test(more_than_possible_is_refused_with_what_is),
        cmocka_unit_test(it_starts_and_stops_without_a_jump),
        cmocka_unit_test(pointers_and_handles_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
