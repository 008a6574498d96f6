/*
 * Every family's step in real time: a million cycles without a system call, an allocation, a subnormal or a number that
 * is not finite; and each of these gates catches a fault put in on purpose.
 */
#include "homing_plant.h"
#include "kernel.h"
#include "lathe_realtime.h"
#include "realtime.h"
#include "spindle_plant.h"
#include "tilt_realtime.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define STEPS 1000000u

/* Lost motion: measurements one after the other, some of them aborted, faulted or fed with NaN on the way. */
static struct {
    plant axis;
    kernel kernel;
    gib_backlash *gib;
    gib_backlash_config config;
    uint64_t run, cycle_of_run, waits;
    double outputs[5];
} backlash;

static void backlash_prepare(void)
{
    plant_config c = plant_default();
    c.substeps = 10; /* the plant is not what is timed */
    memset(&backlash, 0, sizeof backlash);
    plant_init(&backlash.axis, &c);
    kernel_init(&backlash.kernel, &backlash.axis);
    backlash.gib = gib_backlash_new();
    gib_backlash_config config = {.struct_size = sizeof config,
                                  .cycle_s = c.cycle_s,
                                  .travel_min_mm = -50.0,
                                  .travel_max_mm = 50.0,
                                  .torque_bound_nm = 12.0,
                                  .repeats = 1,
                                  .slide_mm = 0.2,
                                  .detection_limit_um = 150.0};
    backlash.config = config;
}

static int32_t backlash_cycle(void)
{
    gib_backlash_input in = kernel_sense(&backlash.kernel);
    uint64_t kind = backlash.run % 6, at = 200 + 97 * (backlash.run % 31);
    if (kind >= 3 && backlash.cycle_of_run == at) {
        if (kind == 3) {
            in.flags = GIB_INPUT_ABORT;
        } else if (kind == 4) {
            in.flags = GIB_INPUT_FAULT;
        } else {
            in.torque = 0.0 / 0.0;
        }
    }
    backlash.cycle_of_run++;
    gib_backlash_output *out = &backlash.kernel.out;
    int32_t status = gib_backlash_step(backlash.gib, &in, out);
    double numbers[] = {out->target_position_mm, out->target_speed_mm_s, out->compensation_um, out->remaining_mm,
                        out->progress_ratio};
    memcpy(backlash.outputs, numbers, sizeof numbers);
    /* Idle or ended for a while, then the next measurement in the other mode or sense. */
    if (status != GIB_BUSY && ++backlash.waits > 100) {
        backlash.waits = backlash.cycle_of_run = 0;
        backlash.run++;
        backlash.config.mode = backlash.run % 4 == 1 ? GIB_BACKLASH_STEP : GIB_BACKLASH_SLOW_FEED;
        backlash.config.first_direction = backlash.run % 2 ? -1 : 1;
        gib_backlash_start(backlash.gib, &backlash.config);
    }
    return out->phase;
}

/* Homing: one after the other, of one motor and of two, some of them aborted, faulted or fed with NaN on the way. */
static struct {
    homing_plant axis;
    gib_homing *gib;
    uint64_t run, cycle_of_run, waits;
    double outputs[7];
} homing;

static void homing_begin(void)
{
    homing_plant_config c = homing_plant_default();
    c.substeps = 8;
    c.answer_cycles = 3;
    c.stop_mm[0] = c.stop_mm[1] = 1.2;
    c.motors = homing.run % 5 == 4 ? 2 : 1;
    c.sense = homing.run % 2 ? -1.0 : 1.0;
    c.beam_nm_mm = c.motors == 2 ? 20.0 : 0.0;
    gib_homing_output out = homing.axis.out;
    homing_plant_init(&homing.axis, &c);
    homing.axis.out = out;
    homing.axis.done_id = out.request_id;
    gib_homing_config config = {.struct_size = sizeof config,
                                .direction = homing.run % 2 ? -1 : 1,
                                .motors = c.motors,
                                .cycle_s = c.cycle_s,
                                .torque_limit_nm = 5.0,
                                .distance_max_mm = 2.5,
                                .touches = 1,
                                .retract_mm = 0.5,
                                .zero_offset_mm = 0.3};
    homing.waits = homing.cycle_of_run = 0;
    gib_homing_start(homing.gib, &config);
}

static void homing_prepare(void)
{
    memset(&homing, 0, sizeof homing);
    homing_plant_config c = homing_plant_default();
    homing_plant_init(&homing.axis, &c);
    homing.gib = gib_homing_new();
}

static int32_t homing_cycle(void)
{
    gib_homing_input in = *homing_plant_cycle(&homing.axis);
    uint64_t kind = homing.run % 7, at = 200 + 197 * (homing.run % 31);
    if (kind >= 4 && homing.cycle_of_run == at) {
        if (kind == 4) {
            in.flags = GIB_INPUT_ABORT;
        } else if (kind == 5) {
            in.flags = GIB_INPUT_FAULT;
        } else {
            in.torque[0] = 0.0 / 0.0;
        }
    }
    homing.cycle_of_run++;
    gib_homing_output *out = &homing.axis.out;
    int32_t status = gib_homing_step(homing.gib, &in, out);
    double numbers[] = {out->target_position_mm[0], out->target_position_mm[1], out->target_speed_mm_s[0],
                        out->target_speed_mm_s[1], out->shift_mm[0], out->shift_mm[1], out->torque_limit};
    memcpy(homing.outputs, numbers, sizeof numbers);
    int32_t phase = out->phase;
    if (status != GIB_BUSY && ++homing.waits > 100) {
        homing.run++;
        homing_begin();
    }
    return phase;
}

/* Recorder: rows on and on, some of them refused, and one ring after the other ended. */
static struct {
    gib_recorder *gib[4];
    uint64_t cycle;
    double outputs[12];
} recorder;

static void recorder_prepare(void)
{
    recorder.cycle = 0;
    for (int i = 0; i < 4; i++) {
        char name[32];
        snprintf(name, sizeof name, "realtime-%d-%d", (int)getpid(), i);
        gib_recorder_config config = {.struct_size = sizeof config,
                                      .channels = 12,
                                      .every_cycles = 1 + (uint32_t)i,
                                      .cycle_s = 0.001,
                                      .name = name,
                                      .machine = "rig",
                                      .columns = "a,b,c,d,e,f,g,h,i,j,k,l"};
        recorder.gib[i] = gib_recorder_new();
        gib_recorder_start(recorder.gib[i], &config);
        /* The child is not to tidy up after itself, it is killed or ends at once: the name goes now, the memory later. */
        char path[48];
        snprintf(path, sizeof path, "/dev/shm/gib-%s", name);
        unlink(path);
    }
}

static int32_t recorder_cycle(void)
{
    uint64_t n = recorder.cycle++, i = n / 250 % 4;
    const double *sources[12];
    for (int k = 0; k < 12; k++) {
        recorder.outputs[k] = (double)n + 0.5 * k;
        sources[k] = &recorder.outputs[k];
    }
    uint32_t channels = n % 97 ? 12 : 11;
    int32_t status = n & 1 ? gib_recorder_step(recorder.gib[i], recorder.outputs, channels)
                           : gib_recorder_step_from(recorder.gib[i], sources, channels);
    if (n == 900000) {
        gib_recorder_abort(recorder.gib[1]);
    }
    return status == GIB_BUSY ? 1 : status == GIB_ERR_RECORDER_COUNT ? 2 : status == GIB_ERR_ABORTED ? 3 : 0;
}

/* Inertia: short measurements one after the other, commanded or listened to, some aborted, faulted or fed with NaN. */
static struct {
    spindle spindle;
    gib_inertia *gib;
    gib_inertia_config config;
    gib_inertia_output out;
    uint64_t run, cycle_of_run, waits;
    double outputs[2];
} inertia;

static void inertia_prepare(void)
{
    spindle_config c = spindle_default();
    c.substeps = 4; /* the plant is not what is timed */
    c.outlier_ratio = 0.01;
    memset(&inertia, 0, sizeof inertia);
    spindle_init(&inertia.spindle, &c);
    inertia.gib = gib_inertia_new();
    gib_inertia_config config = {.struct_size = sizeof config,
                                 .cycle_s = c.cycle_s,
                                 .speed_high_rpm = 500.0,
                                 .acceleration_rpm_s = 1000.0,
                                 .lag_limit_rpm = 450.0, /* it is put to flight by faults */
                                 .listen_s = 1.5};
    inertia.config = config;
}

static int32_t inertia_cycle(void)
{
    static const uint32_t kinds = 7;
    spindle_reading r = spindle_sense(&inertia.spindle);
    gib_inertia_input in = {r.speed_rpm, r.torque, 0, 0};
    uint64_t kind = inertia.run % kinds, at = 10 + 61 * (inertia.run % 41);
    int listens = inertia.config.mode == GIB_INERTIA_LISTEN;
    if (inertia.cycle_of_run == at) {
        in.flags = kind == 2 ? GIB_INPUT_ABORT : kind == 3 ? GIB_INPUT_FAULT : listens ? GIB_INERTIA_FINISH : 0;
        in.torque = kind == 4 ? 0.0 / 0.0 : in.torque;
        in.speed_rpm = kind == 5 ? 1.0 / 0.0 : in.speed_rpm;
    }
    inertia.cycle_of_run++;
    int32_t status = gib_inertia_step(inertia.gib, &in, &inertia.out);
    inertia.outputs[0] = inertia.out.speed_command_rpm;
    inertia.outputs[1] = inertia.out.progress_ratio;
    double swinging = 200.0 + 150.0 * ((double)(inertia.cycle_of_run % 1000) - 500.0) / 500.0;
    spindle_cycle(&inertia.spindle, listens && status == GIB_BUSY ? swinging : inertia.out.speed_command_rpm, 0.0);
    if (status != GIB_BUSY && ++inertia.waits > 50) {
        inertia.waits = inertia.cycle_of_run = 0;
        inertia.run++;
        inertia.config.mode = inertia.run % 3 == 2 ? GIB_INERTIA_LISTEN : GIB_INERTIA_RAMP;
        inertia.config.speed_high_rpm = inertia.run % 2 ? -500.0 : 500.0;
        gib_inertia_start(inertia.gib, &inertia.config);
    }
    return inertia.out.phase;
}

/* Speed variation: both shapes, everything changed at random, stopped, aborted, faulted, fed with NaN. */
static struct {
    gib_speed_variation *gib;
    gib_speed_variation_config config;
    gib_speed_variation_input in;
    uint64_t random, run, cycle_of_run, waits;
    double outputs[5];
} variation;

static double variation_random(double low, double high)
{
    variation.random = variation.random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(variation.random >> 11) / 9007199254740992.0;
}

static void variation_prepare(void)
{
    memset(&variation, 0, sizeof variation);
    variation.gib = gib_speed_variation_new();
    gib_speed_variation_config config = {.struct_size = sizeof config,
                                         .cycle_s = 0.001,
                                         .speed_rpm = 1000.0,
                                         .amplitude_ratio = 0.1,
                                         .period_s = 2.0,
                                         .inertia_kg_m2 = 0.5,
                                         .power_w = 10000.0,
                                         .torque_nm = 120.0,
                                         .coulomb_nm = 5.0,
                                         .viscous_nm_s = 0.02,
                                         .speed_min_rpm = 100.0,
                                         .speed_max_rpm = 3000.0};
    variation.config = config;
    variation.in.speed_rpm = 1000.0;
}

static int32_t variation_cycle(void)
{
    gib_speed_variation_input in = variation.in;
    gib_speed_variation_output out;
    uint64_t kind = variation.run % 6;
    if (variation.cycle_of_run == 2000) {
        in.flags = kind == 0 ? GIB_INPUT_ABORT : kind == 1 ? GIB_INPUT_FAULT : kind < 5 ? GIB_SPEED_VARIATION_STOP : 0;
        in.cutting_nm = kind == 5 ? 0.0 / 0.0 : in.cutting_nm;
    } else if (variation_random(0.0, 1.0) < 0.01) {
        variation.in.speed_rpm = variation_random(300.0, 2500.0);
        variation.in.amplitude_ratio = variation_random(0.0, 0.9);
        variation.in.period_s = variation_random(0.1, 5.0);
        variation.in.cutting_nm = variation_random(0.0, 30.0);
    }
    variation.cycle_of_run++;
    int32_t status = gib_speed_variation_step(variation.gib, &in, &out);
    double numbers[] = {out.speed_command_rpm, out.torque_nm, out.amplitude_ratio, out.amplitude_limit_ratio,
                        out.period_limit_s};
    memcpy(variation.outputs, numbers, sizeof numbers);
    if (status != GIB_BUSY && ++variation.waits > 50) {
        variation.waits = variation.cycle_of_run = 0;
        variation.run++;
        variation.config.waveform = (int32_t)(variation.run / 2 % 2);
        gib_speed_variation_start(variation.gib, &variation.config);
    }
    return out.phase;
}

/* Further families go here. `phases`: those that the million cycles must have been in, one bit each. */
static const struct {
    realtime_family family;
    uint32_t phases;
} FAMILIES[] = {
    {{"backlash", backlash_prepare, backlash_cycle, backlash.outputs, 5}, (1u << (GIB_BACKLASH_FAILED + 1)) - 1u},
    {{"homing", homing_prepare, homing_cycle, homing.outputs, 7}, (1u << (GIB_HOMING_FAILED + 1)) - 1u},
    {{"recorder", recorder_prepare, recorder_cycle, recorder.outputs, 12}, 1u << 1 | 1u << 2 | 1u << 3},
    {{"inertia", inertia_prepare, inertia_cycle, inertia.outputs, 2}, (1u << (GIB_INERTIA_FAILED + 1)) - 1u},
    {{"speed_variation", variation_prepare, variation_cycle, variation.outputs, 5},
     (1u << (GIB_SPEED_VARIATION_FAILED + 1)) - 1u},
    {{"vibration", vibration_prepare, vibration_cycle, vibration.outputs, 7}, (1u << (GIB_VIBRATION_FAILED + 1)) - 1u},
    {{"calibration", calibration_prepare, calibration_cycle, calibration.outputs, 4},
     (1u << (GIB_CALIBRATION_FAILED + 1)) - 1u},
    {{"learning", learning_prepare, learning_cycle, learning.outputs, 2}, (1u << (GIB_LEARNING_FAILED + 1)) - 1u},
    {{"tilt", tilt_prepare, tilt_realtime_cycle, tilt.outputs, 6}, (1u << (GIB_TILT_FAILED + 1)) - 1u},
};
#define FAMILY_COUNT (sizeof FAMILIES / sizeof *FAMILIES)

static realtime_tally run(size_t family, uint64_t steps, realtime_seed seed)
{
    realtime_tally tally;
    assert_int_equal(realtime_run(&FAMILIES[family].family, steps, seed, &tally), 0);
    return tally;
}

static void a_million_steps_touch_nothing(void **state)
{
    (void)state;
    for (size_t i = 0; i < FAMILY_COUNT; i++) {
        realtime_tally tally = run(i, STEPS, SEED_NONE);
        printf("%s: %llu steps, %llu allocations, %llu subnormals, signal %d; steps by phase:",
               FAMILIES[i].family.name, (unsigned long long)tally.steps, (unsigned long long)tally.allocations,
               (unsigned long long)tally.subnormals, tally.signal);
        for (int p = 0; p < REALTIME_PHASES; p++) {
            if (FAMILIES[i].phases >> p & 1) {
                printf(" %llu", (unsigned long long)tally.phases[p]);
            }
        }
        printf("\n");
        assert_int_equal(tally.signal, 0);
        assert_true(tally.finished);
        assert_int_equal(tally.steps, STEPS);
        assert_int_equal(tally.allocations, 0);
        assert_int_equal(tally.subnormals, 0);
        assert_int_equal(tally.non_finite, 0);
        /* The claim is worth little for a phase that was never entered. */
        for (int p = 0; p < REALTIME_PHASES; p++) {
            if (FAMILIES[i].phases >> p & 1 && tally.phases[p] == 0) {
                fail_msg("%s was never in phase %d", FAMILIES[i].family.name, p);
            }
        }
    }
}

static void an_allocation_is_caught(void **state)
{
    (void)state;
    for (size_t i = 0; i < FAMILY_COUNT; i++) {
        assert_true(run(i, 1000, SEED_ALLOCATES).allocations > 0);
    }
}

static void a_system_call_is_caught(void **state)
{
    (void)state;
    for (size_t i = 0; i < FAMILY_COUNT; i++) {
        realtime_tally tally = run(i, 1000, SEED_CALLS_SYSTEM);
        assert_int_equal(tally.signal, SIGKILL);
        assert_false(tally.finished);
    }
}

static void a_subnormal_is_caught(void **state)
{
    (void)state;
    for (size_t i = 0; i < FAMILY_COUNT; i++) {
        assert_int_equal(run(i, 1000, SEED_SUBNORMAL).subnormals, 1);
        assert_int_equal(run(i, 1000, SEED_NON_FINITE).non_finite, 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_million_steps_touch_nothing),
        cmocka_unit_test(an_allocation_is_caught),
        cmocka_unit_test(a_system_call_is_caught),
        cmocka_unit_test(a_subnormal_is_caught),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
