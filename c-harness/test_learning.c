/* Learning on the simulated lathe: the form gets right, and whatever goes wrong ends without a jump. */
#include "lathe_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

/* A lathe that turns an oval; its scale is what is detected. */
typedef struct {
    lathe lathe;
    lathe_job job;
    gib_learning *gib;
    gib_learning_input in;
    gib_learning_output out;
    uint64_t cycle;
    double speed_rpm;
    double deviation_um;
} rig;

static rig *rig_start(const gib_learning_config *g)
{
    rig *r = calloc(1, sizeof *r);
    lathe_config c = lathe_default();
    lathe_init(&r->lathe, &c);
    r->job = lathe_job_of(LATHE_OVAL, 600.0, 0.0, 12.0);
    r->speed_rpm = 600.0;
    r->gib = gib_learning_new();
    /* The stroke is full before learning begins. */
    for (int i = 0; i < 3000; i++) {
        double grown = fmin(i / 2000.0, 1.0), angle = r->lathe.angle;
        lathe_sense(&r->lathe);
        lathe_cycle(&r->lathe, grown * grown * (3.0 - 2.0 * grown) * r->job.stroke_mm * (lathe_form(LATHE_OVAL, angle) - 1.0),
                    600.0);
    }
    assert_int_equal(gib_learning_start(r->gib, g), GIB_OK);
    return r;
}

static gib_learning_config usual(int32_t method)
{
    lathe_config c = lathe_default();
    return lathe_learning(&c, method);
}

static void rig_end(rig *r)
{
    gib_learning_free(r->gib);
    free(r);
}

typedef void (*spoil)(gib_learning_input *in);

static int32_t rig_cycle(rig *r, spoil spoilt)
{
    double speed = r->lathe.speed / 6.283185307179586 * 60.0;
    speed += fmin(fmax(r->speed_rpm - speed, -1.0), 1.0);
    double target = r->job.stroke_mm * (lathe_form(LATHE_OVAL, r->lathe.angle) - 1.0), before = r->out.correction_um;
    lathe_reading reading = lathe_sense(&r->lathe);
    gib_learning_input in = {target, reading.scale_mm, reading.angle_deg, 0, 0};
    r->deviation_um = 1e3 * (target - reading.scale_mm);
    if (spoilt) {
        spoilt(&in);
    }
    r->in = in;
    int32_t status = gib_learning_step(r->gib, &in, &r->out);
    assert_int_equal(status, r->out.status);
    assert_true(isfinite(r->out.command_mm) && isfinite(r->out.correction_um));
    /* Bounded, and by 100 mm/s at most; that is 50 um a cycle. */
    assert_true(fabs(r->out.correction_um) <= 500.5 && fabs(r->out.correction_um - before) <= 50.001);
    if (isfinite(in.target_mm)) {
        assert_true(fabs(r->out.command_mm - in.target_mm - 1e-3 * r->out.correction_um) < 1e-9);
    }
    lathe_cycle(&r->lathe, r->out.command_mm, speed);
    r->cycle++;
    return status;
}

static void rig_run(rig *r, int cycles, spoil spoilt)
{
    for (int i = 0; i < cycles; i++) {
        rig_cycle(r, spoilt);
    }
}

static double rig_rms(rig *r)
{
    double squares = 0.0;
    for (int i = 0; i < 2000; i++) {
        rig_cycle(r, NULL);
        squares += r->deviation_um * r->deviation_um / 2000.0;
    }
    return sqrt(squares);
}

static int32_t rig_finish(rig *r)
{
    int32_t status = GIB_BUSY;
    for (int i = 0; i < 200000 && status == GIB_BUSY; i++) {
        status = rig_cycle(r, NULL);
    }
    return status;
}

static void both_methods_reach_the_tolerance(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) {
        gib_learning_config g = usual(method);
        rig *r = rig_start(&g);
        gib_learning_report report;
        assert_int_equal(rig_finish(r), GIB_DONE);
        gib_learning_result(r->gib, &report);
        double left = rig_rms(r);
        printf("method %d: %.2f um at first, %.3f um after %d updates\n", method, report.first_um, left, report.updates);
        assert_true(report.first_um > 10.0 && report.last_um <= 0.2 && left < 0.5 && report.updates < 20);
        /* Kept as long as it is asked for. */
        rig_run(r, 20000, NULL);
        assert_true(rig_rms(r) < 0.5 && r->out.status == GIB_DONE && r->out.phase == GIB_LEARNING_DONE);
        gib_learning_abort(r->gib);
        rig_run(r, 400, NULL);
        assert_true(r->out.correction_um == 0.0 && r->out.status == GIB_ERR_ABORTED);
        rig_end(r);
    }
}

/* A servo whose lag was told wrong by more than half a period of the form. */
static void a_wrong_model_makes_nothing_worse(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) {
        gib_learning_config g = usual(method);
        g.lag_s = 0.03;
        g.points = 200;
        g.updates = 60;
        rig *r = rig_start(&g);
        int32_t status = rig_finish(r);
        gib_learning_report report;
        gib_learning_result(r->gib, &report);
        rig_run(r, 2000, NULL);
        double left = rig_rms(r);
        printf("method %d: %.2f um at first, best %.3f, %.3f um in the end, %s\n", method, report.first_um, report.best_um,
               left, gib_status_text(status));
        assert_true(status != GIB_BUSY);
        assert_true(left < 1.2 * report.best_um + 0.3 && left < 1.1 * report.first_um);
        /* The published update leads the wrong way and is taken back; the filtered one measures the machine. */
        assert_int_equal(status, method == GIB_LEARNING_FILTERED ? GIB_DONE : GIB_ERR_LEARNING_GROWS);
        assert_true(method == GIB_LEARNING_PUBLISHED || left < 0.1 * report.first_um);
        rig_end(r);
    }
}

static void nan_target(gib_learning_input *in) { in->target_mm = NAN; }
static void infinite_target(gib_learning_input *in) { in->target_mm = -INFINITY; }
static void nan_detected(gib_learning_input *in) { in->detected_mm = NAN; }
static void huge_detected(gib_learning_input *in) { in->detected_mm = 1e300; }
static void infinite_detected(gib_learning_input *in) { in->detected_mm = INFINITY; }
static void lost_detected(gib_learning_input *in) { in->detected_mm = 5.0; }
static void nan_angle(gib_learning_input *in) { in->angle_deg = NAN; }
static void stuck_angle(gib_learning_input *in) { in->angle_deg = 33.0; }
static void aborted(gib_learning_input *in) { in->flags = GIB_INPUT_ABORT; }
static void tripped(gib_learning_input *in) { in->flags = GIB_INPUT_FAULT; }

static const struct {
    spoil spoilt;
    int32_t message, ends; /* ends: the error when it lasts a second */
} FAULTS[] = {
    {nan_target, GIB_ERR_NON_FINITE, GIB_ERR_NON_FINITE},
    {infinite_target, GIB_ERR_NON_FINITE, GIB_ERR_NON_FINITE},
    {nan_detected, GIB_ERR_LEARNING_DETECTED, GIB_ERR_DEADLINE},
    {infinite_detected, GIB_ERR_LEARNING_DETECTED, GIB_ERR_DEADLINE},
    {huge_detected, GIB_ERR_LEARNING_DETECTED, GIB_ERR_DEADLINE},
    {lost_detected, GIB_ERR_LEARNING_DEVIATION, GIB_ERR_LEARNING_DEVIATION},
    {nan_angle, GIB_ERR_LEARNING_ANGLE, GIB_ERR_DEADLINE},
    {stuck_angle, GIB_OK, GIB_ERR_DEADLINE},
    {aborted, GIB_ERR_ABORTED, GIB_ERR_ABORTED},
    {tripped, GIB_ERR_DRIVE_FAULT, GIB_ERR_DRIVE_FAULT},
};
enum { FAULT_COUNT = sizeof FAULTS / sizeof *FAULTS };

static void every_fault_in_every_state_is_named_and_ends(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) {
        for (int phase = GIB_LEARNING_SETTLE; phase <= GIB_LEARNING_BLEND; phase++) {
            for (int f = 0; f < FAULT_COUNT; f++) {
                gib_learning_config g = usual(method);
                g.wait_s = 0.5;
                rig *r = rig_start(&g);
                int named = 0, cycles = 0;
                /* In the second round, with a correction in force. */
                rig_run(r, 1500, NULL);
                while (r->out.phase != phase) {
                    rig_cycle(r, NULL);
                    assert_true(++cycles < 5000);
                }
                for (int i = 0; i < 2000; i++) {
                    rig_cycle(r, FAULTS[f].spoilt);
                    named |= r->out.message == FAULTS[f].message;
                }
                assert_true(named);
                assert_int_equal(r->out.status, FAULTS[f].ends);
                assert_int_equal(r->out.phase, GIB_LEARNING_FAILED);
                rig_run(r, 10, NULL);
                assert_true(r->out.correction_um == 0.0 && r->out.command_mm == r->in.target_mm);
                /* And it can begin anew. */
                assert_int_equal(gib_learning_start(r->gib, &g), GIB_OK);
                assert_int_equal(rig_finish(r), GIB_DONE);
                rig_end(r);
            }
        }
    }
}

/* Faults that pass: learning waits, and goes on. */
static void what_passes_is_waited_for(void **state)
{
    (void)state;
    for (int f = 2; f <= 7; f++) {
        if (f == 5) {
            continue;
        }
        gib_learning_config g = usual(0);
        rig *r = rig_start(&g);
        rig_run(r, 2500, NULL);
        rig_run(r, 100, FAULTS[f].spoilt);
        assert_int_equal(r->out.status, GIB_BUSY);
        assert_true(r->out.reasons != 0);
        assert_int_equal(rig_finish(r), GIB_DONE);
        assert_true(rig_rms(r) < 0.5);
        rig_end(r);
    }
}

static void the_spindle_may_stop_turn_back_and_change_speed(void **state)
{
    (void)state;
    gib_learning_config g = usual(0);
    rig *r = rig_start(&g);
    rig_run(r, 4000, NULL);
    r->speed_rpm = 0.0;
    rig_run(r, 4000, NULL);
    assert_true(r->out.phase == GIB_LEARNING_WAITING && r->out.correction_um == 0.0);
    r->speed_rpm = -500.0;
    assert_int_equal(rig_finish(r), GIB_DONE);
    assert_true(rig_rms(r) < 0.5);
    rig_end(r);
}

static void an_abort_in_any_cycle_takes_the_correction_out(void **state)
{
    (void)state;
    size_t size = gib_learning_size();
    void *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    gib_learning_config g = usual(0);
    rig *r = rig_start(&g);
    for (int at = 0; at < 4000; at++) {
        rig_cycle(r, NULL);
        memcpy(memory, r->gib, size);
        gib_learning *copy = memory;
        gib_learning_input in = r->in;
        gib_learning_output out;
        double last = r->out.correction_um;
        int32_t status = GIB_BUSY;
        int cycles = 0;
        assert_int_equal(gib_learning_abort(copy), GIB_OK);
        while (status == GIB_BUSY) {
            in.angle_deg += 1.8;
            status = gib_learning_step(copy, &in, &out);
            assert_true(fabs(out.correction_um - last) <= 50.001 && ++cycles <= 210);
            last = out.correction_um;
        }
        assert_int_equal(status, GIB_ERR_ABORTED);
        assert_true(out.correction_um == 0.0 && out.command_mm == in.target_mm);
    }
    free(memory);
    rig_end(r);
}

static void what_is_learnt_is_kept_in_a_file(void **state)
{
    (void)state;
    char path[64], broken[64];
    snprintf(path, sizeof path, "/tmp/gib-learning-%d.json", (int)getpid());
    snprintf(broken, sizeof broken, "/tmp/gib-broken-%d.json", (int)getpid());
    gib_learning_config g = usual(0);
    rig *r = rig_start(&g);
    gib_error_detail detail;
    static gib_learning_point points[100], again[100];
    size_t count = 0;
    assert_int_equal(gib_learning_save(r->gib, path), GIB_ERR_STATE);
    assert_int_equal(rig_finish(r), GIB_DONE);
    assert_int_equal(gib_learning_save(r->gib, path), GIB_OK);
    assert_int_equal(gib_learning_points(r->gib, points, 99, &count), GIB_ERR_BUFFER);
    assert_int_equal(count, 100);
    assert_int_equal(gib_learning_points(r->gib, points, 100, &count), GIB_OK);
    rig_end(r);

    g.resume = 1;
    gib_learning *other = gib_learning_new();
    assert_int_equal(gib_learning_start(other, &g), GIB_ERR_CONFIG);
    assert_int_equal(gib_learning_load(other, "/nowhere/at/all"), GIB_ERR_IO);
    FILE *f = fopen(broken, "w");
    fputs("{\"schema\": \"gib.learning/1\", \"target_mm\": [1, 2]}", f);
    fclose(f);
    assert_int_equal(gib_learning_load(other, broken), GIB_ERR_FORMAT);
    assert_int_equal(gib_learning_last_error(other, &detail), GIB_OK);
    assert_string_equal(detail.field, "command_mm");
    assert_int_equal(gib_learning_load(other, path), GIB_OK);
    assert_int_equal(gib_learning_points(other, again, 100, &count), GIB_OK);
    for (int i = 0; i < 100; i++) {
        assert_true(fabs(again[i].command_mm - points[i].command_mm) < 1e-7 && again[i].angle_deg == points[i].angle_deg);
    }
    gib_learning_config plain = usual(0);
    r = rig_start(&plain);
    gib_learning_free(r->gib);
    r->gib = other;
    assert_int_equal(gib_learning_start(r->gib, &g), GIB_OK);
    assert_int_equal(rig_finish(r), GIB_DONE);
    gib_learning_report report;
    gib_learning_result(r->gib, &report);
    assert_true(report.updates <= 2);
    rig_end(r);
    unlink(path);
    unlink(broken);
}

/* Without an input the command is the last one, and what is said of it is what is in it; then all goes on. */
static void a_step_without_input_says_what_is_in_the_command(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) {
        gib_learning_config g = usual(method);
        rig *r = rig_start(&g);
        int32_t status = GIB_BUSY;
        double most = 0.0;
        for (int i = 0; i < 200000 && status == GIB_BUSY; i++) {
            status = rig_cycle(r, NULL);
            if (i % 7 == 3) {
                gib_learning_output out;
                memset(&out, 0xee, sizeof out);
                assert_int_equal(gib_learning_step(r->gib, NULL, &out), GIB_ERR_NULL);
                assert_true(out.command_mm == r->out.command_mm);
                assert_true(fabs(out.correction_um - r->out.correction_um) < 1e-6);
                most = fmax(most, fabs(out.correction_um));
            }
        }
        assert_int_equal(status, GIB_DONE);
        assert_true(most > 10.0 && rig_rms(r) < 0.5);
        rig_end(r);
    }
}

static void pointers_and_handles_are_checked(void **state)
{
    (void)state;
    size_t size = gib_learning_size();
    unsigned char *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    gib_learning_config g = usual(0);
    gib_learning_input in = {.target_mm = 3.0, .detected_mm = 3.0};
    gib_learning_output out;
    gib_learning_report report;
    gib_learning *gib = NULL;
    size_t count = 7;
    assert_int_equal(gib_learning_init_in(memory, 16, &gib), GIB_ERR_MEMORY);
    assert_int_equal(gib_learning_init_in(memory, size, &gib), GIB_OK);
    assert_int_equal(gib_learning_start(NULL, &g), GIB_ERR_NULL);
    assert_int_equal(gib_learning_start(gib, NULL), GIB_ERR_NULL);
    g.struct_size = 12;
    assert_int_equal(gib_learning_start(gib, &g), GIB_ERR_STRUCT_SIZE);
    assert_int_equal(gib_learning_step(gib, &in, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_learning_step(gib, NULL, &out), GIB_ERR_NULL);
    assert_int_equal(gib_learning_step(NULL, &in, &out), GIB_ERR_NULL);
    assert_true(out.command_mm == 3.0);
    assert_int_equal(gib_learning_step(gib, &in, &out), GIB_OK);
    assert_true(out.command_mm == 3.0 && out.phase == GIB_LEARNING_IDLE);
    assert_int_equal(gib_learning_points(gib, NULL, 0, &count), GIB_OK);
    assert_int_equal(count, 0);
    assert_int_equal(gib_learning_result(gib, &report), GIB_OK);
    assert_int_equal(gib_learning_save(gib, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_learning_load(gib, NULL), GIB_ERR_NULL);
    memset(memory, 0, size);
    assert_int_equal(gib_learning_step(gib, &in, &out), GIB_ERR_HANDLE);
    assert_true(out.command_mm == 3.0);
    gib_learning_free(NULL);
    free(memory);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_methods_reach_the_tolerance),
        cmocka_unit_test(a_wrong_model_makes_nothing_worse),
        cmocka_unit_test(every_fault_in_every_state_is_named_and_ends),
        cmocka_unit_test(what_passes_is_waited_for),
        cmocka_unit_test(the_spindle_may_stop_turn_back_and_change_speed),
        cmocka_unit_test(an_abort_in_any_cycle_takes_the_correction_out),
        cmocka_unit_test(what_is_learnt_is_kept_in_a_file),
        cmocka_unit_test(a_step_without_input_says_what_is_in_the_command),
        cmocka_unit_test(pointers_and_handles_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
