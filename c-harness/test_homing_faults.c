/* Homing: aborted at every cycle of a whole run, broken at many, and called in every wrong order. */
#include "homing_faults.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

typedef struct {
    double sense;
    int motors, position_unit, lag_reduction;
} variant;

static const variant VARIANTS[] = {
    {1.0, 1, GIB_POSITION_MM, GIB_HOMING_CLEAR_DEVIATION},
    {-1.0, 1, GIB_POSITION_DEG, GIB_HOMING_INSTANT_LAG_REDUCTION},
    {1.0, 2, GIB_POSITION_DEG, GIB_HOMING_INSTANT_LAG_REDUCTION},
    {-1.0, 2, GIB_POSITION_MM, GIB_HOMING_CLEAR_DEVIATION},
};
#define VARIANT_COUNT (sizeof VARIANTS / sizeof *VARIANTS)

/* A short homing, so that every cycle of it can be tried. */
static void begin(homing_world *w, const variant *v)
{
    homing_plant_config c = homing_plant_default();
    c.sense = v->sense;
    c.motors = v->motors;
    c.beam_nm_mm = v->motors == 2 ? 20.0 : 0.0;
    c.stop_mm[0] = c.stop_mm[1] = 1.2;
    c.answer_cycles = 5;
    c.substeps = 8;
    gib_homing_config g = {.struct_size = sizeof g,
                           .direction = v->sense > 0.0 ? 1 : -1,
                           .motors = v->motors,
                           .position_unit = v->position_unit,
                           .lag_reduction = v->lag_reduction,
                           .cycle_s = c.cycle_s,
                           .torque_limit_nm = 5.0,
                           .distance_max_mm = 2.5,
                           .touches = 1,
                           .retract_mm = 0.5,
                           .zero_offset_mm = 0.3,
                           .ack_timeout_s = 0.1};
    assert_int_equal(homing_world_start(w, &c, &g), GIB_OK);
}

static void aborted_at_every_cycle(void **state)
{
    (void)state;
    static homing_world w, copy;
    for (size_t i = 0; i < VARIANT_COUNT; i++) {
        int longest = 0;
        begin(&w, &VARIANTS[i]);
        while (w.status == GIB_BUSY) {
            homing_world_step(&w);
            if (w.status != GIB_BUSY) {
                break;
            }
            memcpy(&copy, &w, sizeof copy);
            homing_branch b = homing_world_break(&copy, FAULT_ABORT);
            if (b.status != GIB_ERR_ABORTED || !b.safe) {
                fail_msg("variant %zu, cycle %d: status %d, %s", i, w.cycles, b.status, b.unsafe ? b.unsafe : "");
            }
            longest = b.out > longest ? b.out : longest;
        }
        assert_int_equal(w.status, GIB_DONE);
        printf("aborted at each of %d cycles, out within %d of %d\n", w.cycles, longest, homing_way_out(&w.config));
        assert_true(longest <= homing_way_out(&w.config));
    }
}

static void every_fault_is_named_and_safe(void **state)
{
    (void)state;
    static homing_world w, copy;
    for (size_t i = 0; i < VARIANT_COUNT; i++) {
        begin(&w, &VARIANTS[i]);
        int n = 0;
        while (w.status == GIB_BUSY) {
            homing_world_step(&w);
            for (int f = FAULT_ABORT; f < FAULTS && w.status == GIB_BUSY && w.cycles % 197 == 5; f++) {
                memcpy(&copy, &w, sizeof copy);
                homing_branch b = homing_world_break(&copy, (homing_fault)f);
                if (!b.safe || !homing_names((homing_fault)f, 0, &b)) {
                    fail_msg("variant %zu, cycle %d, %s: status %d, %s", i, w.cycles, homing_fault_names[f], b.status,
                             b.unsafe ? b.unsafe : "the wrong name");
                }
                n++;
            }
        }
        assert_int_equal(w.status, GIB_DONE);
        assert_true(n >= 15 * (FAULTS - 1));
    }
}

/* A torque in steps and without noise stands still at the drive's limit: held there, the axis has met a tight spot or a stop, and
 * no stuck torque. A torque that is stuck is still named so. */
static void a_torque_without_noise_is_not_stuck(void **state)
{
    (void)state;
    static homing_world w, copy;
    int tight = 0, stuck = 0, held = 0;
    for (size_t i = 0; i < 2; i++) {
        begin(&w, &VARIANTS[i]);
        gib_homing_config g = w.config;
        homing_plant_config c = w.plant.c;
        c.torque_noise_nm = 0.0;
        c.torque_grid_nm = 0.05;
        assert_int_equal(homing_world_start(&w, &c, &g), GIB_OK);
        while (w.status == GIB_BUSY) {
            homing_world_step(&w);
            if (w.status != GIB_BUSY || w.cycles % 23 != 5) {
                continue;
            }
            memcpy(&copy, &w, sizeof copy);
            homing_branch b = homing_world_break(&copy, FAULT_TIGHT_SPOT);
            held += b.status != GIB_DONE;
            if (!b.safe || b.status == GIB_ERR_HOMING_TORQUE_STUCK) {
                fail_msg("variant %zu, cycle %d: status %d, %s", i, w.cycles, b.status, b.unsafe ? b.unsafe : "not stuck");
            }
            tight += b.status == GIB_ERR_HOMING_TIGHT_SPOT;
            memcpy(&copy, &w, sizeof copy);
            b = homing_world_break(&copy, FAULT_TORQUE_STUCK);
            assert_true(b.safe);
            stuck += b.status == GIB_ERR_HOMING_TORQUE_STUCK;
        }
        assert_int_equal(w.status, GIB_DONE);
    }
    printf("held %d times, %d named a tight spot; stuck %d times\n", held, tight, stuck);
    assert_true(tight > held / 2 && stuck > held / 2);
}

/* Out at once after contact, with a restore that nobody acknowledges: meanwhile no torque winds up against the stop. */
static void no_torque_while_the_restore_is_waited_for(void **state)
{
    (void)state;
    static homing_world w, copy;
    for (size_t i = 0; i < VARIANT_COUNT; i++) {
        begin(&w, &VARIANTS[i]);
        gib_homing_config g = w.config;
        homing_plant_config c = w.plant.c;
        g.ack_timeout_s = 1.0;
        assert_int_equal(homing_world_start(&w, &c, &g), GIB_OK);
        while (homing_world_state(&w) != IN_PRESS) {
            homing_world_step(&w);
        }
        for (int k = 0; k < 40; k++) {
            memcpy(&copy, &w, sizeof copy);
            homing_plant_break(&copy.plant, FAULT_NO_ACKNOWLEDGEMENT, -1);
            gib_homing_abort(homing_world_gib(&copy));
            while (copy.status == GIB_BUSY) {
                homing_world_step(&copy);
            }
            assert_int_equal(copy.status, GIB_ERR_ABORTED);
            for (int m = 0; m < c.motors; m++) {
                if (fabs(copy.plant.side[m].torque) > 0.5 * g.torque_limit_nm) {
                    fail_msg("variant %zu, cycle %d: %.2f N.m at rest", i, w.cycles, copy.plant.side[m].torque);
                }
            }
            homing_world_step(&w);
        }
    }
}

/* The judge itself can say no. */
static void the_judge_sees_what_is_unsafe(void **state)
{
    (void)state;
    static homing_world w;
    begin(&w, &VARIANTS[0]);
    w.config.torque_limit_nm = 3.0; /* of the judge; gib has 5 */
    homing_branch b = homing_world_break(&w, FAULT_NONE);
    assert_string_equal(b.unsafe, "torque");
    begin(&w, &VARIANTS[0]);
    w.config.distance_max_mm = 1.0;
    b = homing_world_break(&w, FAULT_NONE);
    assert_string_equal(b.unsafe, "way");
    begin(&w, &VARIANTS[0]);
    w.config.zero_offset_mm = 0.29;
    b = homing_world_break(&w, FAULT_NONE);
    assert_string_equal(b.unsafe, "wrong home");
    begin(&w, &VARIANTS[0]);
    b = homing_world_break(&w, FAULT_NONE);
    assert_true(b.safe && homing_names(FAULT_NONE, 0, &b) && !homing_names(FAULT_DRIVE_TRIP, 0, &b));
    assert_false(homing_names(FAULT_STOP_SOFT, GIB_ERR_ABORTED, &b));
}

static void calls_in_the_wrong_order(void **state)
{
    (void)state;
    static homing_world w;
    _Alignas(16) static unsigned char memory[80 * 1024];
    gib_homing *gib;
    gib_homing_output out;
    gib_homing_input in;
    gib_homing_report report;
    gib_error_detail detail;
    memset(&in, 0, sizeof in);
    memset(memory, 0x5a, sizeof memory);
    in.position_mm[0] = 7.25;
    /* Memory that never was one. */
    assert_int_equal(gib_homing_step((gib_homing *)(void *)memory, &in, &out), GIB_ERR_HANDLE);
    assert_true(out.target_position_mm[0] == 7.25 && out.owns_motion == 0);
    assert_int_equal(gib_homing_abort((gib_homing *)(void *)memory), GIB_ERR_HANDLE);
    assert_int_equal(gib_homing_init_in(memory, gib_homing_size() - 1, &gib), GIB_ERR_MEMORY);
    assert_int_equal(gib_homing_init_in(memory + 1, sizeof memory - 1, &gib), GIB_ERR_MEMORY);
    assert_int_equal(gib_homing_init_in(memory, sizeof memory, &gib), GIB_OK);
    /* Before a start: idle follows the axis, an abort is nothing, a result is empty. */
    assert_int_equal(gib_homing_abort(gib), GIB_OK);
    assert_int_equal(gib_homing_step(gib, &in, &out), GIB_OK);
    assert_true(out.target_position_mm[0] == 7.25 && out.owns_motion == 0 && out.request_id == 0 && out.events == 0);
    assert_int_equal(gib_homing_result(gib, &report), GIB_OK);
    assert_true(report.status == GIB_OK && report.touches == 0);
    assert_int_equal(gib_homing_last_error(gib, &detail), GIB_OK);
    assert_int_equal(detail.code, GIB_OK);
    /* A start while busy is refused and changes nothing; aborted twice is aborted once. */
    begin(&w, &VARIANTS[0]);
    for (int i = 0; i < 500; i++) {
        homing_world_step(&w);
    }
    assert_int_equal(gib_homing_start(homing_world_gib(&w), &w.config), GIB_ERR_STATE);
    homing_world_step(&w);
    assert_int_equal(w.status, GIB_BUSY);
    gib_homing_abort(homing_world_gib(&w));
    gib_homing_abort(homing_world_gib(&w));
    for (int i = 0; i < 1000 && w.status == GIB_BUSY; i++) {
        homing_world_step(&w);
    }
    assert_int_equal(w.status, GIB_ERR_ABORTED);
    /* And from there it homes again. */
    assert_int_equal(gib_homing_start(homing_world_gib(&w), &w.config), GIB_OK);
    w.status = GIB_BUSY;
    homing_branch b = homing_world_break(&w, FAULT_NONE);
    assert_int_equal(b.status, GIB_DONE);
    /* While the old torque limit is owed nothing starts; once the kernel has put it back, it does. */
    begin(&w, &VARIANTS[0]);
    for (int i = 0; i < 300; i++) {
        homing_world_step(&w);
    }
    b = homing_world_break(&w, FAULT_NO_ACKNOWLEDGEMENT);
    assert_int_equal(b.status, GIB_ERR_ACK_TIMEOUT);
    assert_int_equal(gib_homing_start(homing_world_gib(&w), &w.config), GIB_ERR_RESTORE_UNCONFIRMED);
    homing_plant_mend(&w.plant, FAULT_NONE);
    for (int i = 0; i < 10; i++) {
        homing_world_step(&w);
    }
    assert_int_equal(gib_homing_start(homing_world_gib(&w), &w.config), GIB_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(aborted_at_every_cycle),
        cmocka_unit_test(every_fault_is_named_and_safe),
        cmocka_unit_test(a_torque_without_noise_is_not_stuck),
        cmocka_unit_test(no_torque_while_the_restore_is_waited_for),
        cmocka_unit_test(the_judge_sees_what_is_unsafe),
        cmocka_unit_test(calls_in_the_wrong_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
