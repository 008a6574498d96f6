/*
 * Whatever a kernel hands over, a step gives finite numbers back: no number, infinity, the largest and the smallest, at random
 * in every field of every cycle, from the first on; and a start takes any configuration or refuses it with a name.
 * GIB_SEED repeats a run.
 */
#include "gib.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define RUNS 200
#define CYCLES 400

static uint64_t state;

static uint64_t random_bits(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static double share(void)
{
    return (double)(random_bits() >> 11) * 0x1p-53;
}

/* A number as it should be, of any size; or one that should not be. */
static double number(int garbage)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY, 1.7e308, -1.7e308, 1e-300, 0.0, -0.0, 1e15, 1e-12};
    size_t i = random_bits() % 16;
    double value = (share() - 0.5) * pow(10.0, 6.0 * share() - 3.0);
    return garbage && i < sizeof ODD / sizeof *ODD ? ODD[i] : value;
}

/* Some of the values, with that probability, anew. */
static void spoil(void *fields, size_t bytes, double often, int garbage)
{
    double *values = fields;
    for (size_t i = 0; i < bytes / sizeof *values; i++) {
        values[i] = share() < often ? number(garbage) : values[i];
    }
}

static void must_be_finite(const char *family, const void *fields, size_t bytes, long cycle, double often)
{
    const double *values = fields;
    for (size_t i = 0; i < bytes / sizeof *values; i++) {
        if (!isfinite(values[i])) {
            fail_msg("%s: value %zu of the output is %g in cycle %ld (share %g)", family, i, values[i], cycle, often);
        }
    }
}

/* Inputs and outputs hold their numbers first; whole numbers follow, the first of which is named. START(handle, config). */
#define FAMILY(NAME, FIRST_IN, START, ...)                                                                                \
    static void NAME(void **unused)                                                                                       \
    {                                                                                                                     \
        static const double OFTEN[] = {0.0, 0.02, 0.3, 1.0};                                                              \
        long begun = 0, refused = 0;                                                                                      \
        (void)unused;                                                                                                     \
        for (int run = 0; run < RUNS; run++) {                                                                            \
            gib_##NAME *gib = gib_##NAME##_new();                                                                         \
            gib_##NAME##_config config = {.struct_size = sizeof config, __VA_ARGS__};                                     \
            gib_##NAME##_input in;                                                                                        \
            gib_##NAME##_output out;                                                                                      \
            double often = OFTEN[random_bits() % 4];                                                                      \
            if (run % 2) {                                                                                                \
                size_t head = offsetof(gib_##NAME##_config, cycle_s);                                                     \
                spoil((char *)&config + head, sizeof config - head, 0.1, 1);                                              \
            }                                                                                                             \
            int32_t status = START(gib, &config);                                                                         \
            assert_true(status == GIB_OK || (run % 2 && status < 0));                                                     \
            begun += status == GIB_OK;                                                                                    \
            refused += status != GIB_OK;                                                                                  \
            memset(&in, 0, sizeof in);                                                                                    \
            for (long cycle = 0; cycle < CYCLES; cycle++) {                                                               \
                spoil(&in, offsetof(gib_##NAME##_input, FIRST_IN), often, share() < 0.5);                                 \
                in.flags = share() < 0.01 * often ? (uint32_t)random_bits() : 0u;                                         \
                memset(&out, 0x7f, sizeof out);                                                                           \
                status = gib_##NAME##_step(gib, &in, &out);                                                               \
                assert_int_equal(status, out.status);                                                                     \
                must_be_finite(#NAME, &out, offsetof(gib_##NAME##_output, status), cycle, often);                                 \
                if (cycle == 300 && run % 5 == 0) {                                                                       \
                    gib_##NAME##_abort(gib);                                                                              \
                }                                                                                                         \
            }                                                                                                             \
            gib_##NAME##_free(gib);                                                                                       \
        }                                                                                                                 \
        printf("%s: %ld configurations taken, %ld refused\n", #NAME, begun, refused);                                     \
        assert_true(begun >= RUNS / 2 && refused > 0);                                                                    \
    }

#define VIBRATION(gib, config) gib_vibration_start(gib, config, NULL)
static int32_t TILT(gib_tilt *gib, const gib_tilt_config *config)
{
    gib_tilt_table table;
    memset(&table, 0, sizeof table);
    table.struct_size = sizeof table;
    return gib_tilt_start(gib, config, &table);
}

FAMILY(backlash, acknowledged_id, gib_backlash_start, .cycle_s = 0.001, .travel_min_mm = -20.0, .travel_max_mm = 20.0,
       .torque_bound_nm = 12.0)
FAMILY(homing, acknowledged_id, gib_homing_start, .cycle_s = 0.001, .direction = -1, .torque_limit_nm = 8.0,
       .approach_speed_mm_s = 3.0, .distance_max_mm = 200.0)
FAMILY(inertia, flags, gib_inertia_start, .cycle_s = 0.001, .torque_bound_nm = 100.0, .speed_high_rpm = 1000.0,
       .acceleration_rpm_s = 500.0)
FAMILY(speed_variation, flags, gib_speed_variation_start, .cycle_s = 0.001, .speed_rpm = 1000.0, .amplitude_ratio = 0.1,
       .period_s = 1.0, .inertia_kg_m2 = 0.5, .power_w = 10000.0, .torque_nm = 100.0, .speed_max_rpm = 4000.0)
FAMILY(tilt, acknowledged_id, TILT, .cycle_s = 0.001, .purpose = GIB_TILT_TEACH, .signal = GIB_TILT_DC_LOAD,
       .condition = {.speed_rpm = 600.0, .feed_mm_min = 600.0})
FAMILY(vibration, flags, VIBRATION, .cycle_s = 0.001, .acceleration_range_m_s2 = 50.0)
FAMILY(calibration, flags, gib_calibration_start, .cycle_s = 0.001, .frequencies = 3, .frequency_hz = {5.0, 10.0, 20.0},
       .stroke_mm = 1.0, .speed_mm_s = 100.0, .acceleration_mm_s2 = 1000.0, .torque_bound_nm = 10.0,
       .acceleration_range_m_s2 = 50.0, .ball_bar_range_um = 500.0)
FAMILY(learning, flags, gib_learning_start, .cycle_s = 0.001, .tolerance_um = 0.5, .correction_max_um = 50.0)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(backlash),        cmocka_unit_test(homing),   cmocka_unit_test(inertia),
        cmocka_unit_test(speed_variation), cmocka_unit_test(tilt),     cmocka_unit_test(vibration),
        cmocka_unit_test(calibration),     cmocka_unit_test(learning),
    };
    const char *given = getenv("GIB_SEED");
    uint64_t seed = given ? strtoull(given, NULL, 0) : (uint64_t)time(NULL);
    printf("GIB_SEED=%llu\n", (unsigned long long)seed);
    state = seed * 2654435761u + 1u;
    for (int i = 0; i < 20; i++) {
        random_bits();
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
