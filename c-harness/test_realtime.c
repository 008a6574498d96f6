/*
 * Every family's step in real time: a million cycles without a system call, an allocation, a subnormal or a number that
 * is not finite; and each of these gates catches a fault put in on purpose.
 */
#include "kernel.h"
#include "realtime.h"

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
    for (int k = 0; k < 12; k++) {
        recorder.outputs[k] = (double)n + 0.5 * k;
    }
    int32_t status = gib_recorder_step(recorder.gib[i], recorder.outputs, n % 97 ? 12 : 11);
    if (n == 900000) {
        gib_recorder_abort(recorder.gib[1]);
    }
    return status == GIB_BUSY ? 1 : status == GIB_ERR_RECORDER_COUNT ? 2 : status == GIB_ERR_ABORTED ? 3 : 0;
}

/* Further families go here. `phases`: those that the million cycles must have been in, one bit each. */
static const struct {
    realtime_family family;
    uint32_t phases;
} FAMILIES[] = {
    {{"backlash", backlash_prepare, backlash_cycle, backlash.outputs, 5}, (1u << (GIB_BACKLASH_FAILED + 1)) - 1u},
    {{"recorder", recorder_prepare, recorder_cycle, recorder.outputs, 12}, 1u << 1 | 1u << 2 | 1u << 3},
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
