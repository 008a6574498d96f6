/* Calibration of the accelerometers on the simulated lathe: the truth within the uncertainty told, and every way out. */
#include "lathe_run.h"

#include <complex.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

/* What the plant's accelerometer makes of a sinusoid, turned round: the gain that puts it right. */
static double complex truth(const lathe_accelerometer *a, double frequency_hz)
{
    double complex lag = 1.0 + I * 6.283185307179586 * frequency_hz * a->lag_s;
    return lag * lag / a->gain_ratio;
}

static void gains_are_right_within_their_uncertainty(void **state)
{
    (void)state;
    int inside = 0, known = 0;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        lathe_config c = lathe_default();
        gib_calibration_table t;
        c.seed = seed;
        assert_int_equal(lathe_calibrate(&c, GIB_CALIBRATION_LEAST_SQUARES, 2, &t), GIB_OK);
        assert_int_equal(t.count, LATHE_FREQUENCIES);
        for (uint32_t i = 0; i < t.count; i++) {
            const gib_calibration_point *q = &t.point[i];
            const lathe_accelerometer *sensors[2] = {&c.seat, &c.head};
            for (int n = 0; n < 2; n++) {
                double complex right = truth(sensors[n], q->frequency_hz);
                double off = fabs(q->gain_ratio[n] - cabs(right));
                double turned = fabs(q->phase_deg[n] - 57.29577951308232 * carg(right));
                inside += (off <= q->gain_uncertainty_ratio[n]) + (turned <= q->phase_uncertainty_deg[n]);
                known += 2;
                /* Where the experiments tell the two apart, the gain is known well. */
                assert_true(q->condition_ratio > 3.0 || (off < 0.01 && turned < 1.0));
                assert_true(off < 2.0 * q->gain_uncertainty_ratio[n] + 0.005);
            }
            assert_true(q->experiments == 2.0 && q->residual_um < 0.2);
        }
    }
    printf("%d of %d gains and phases within their uncertainty (k = 2)\n", inside, known);
    assert_true(inside > 0.85 * known);
}

static void opposite_phases_refuse_the_published_formula(void **state)
{
    (void)state;
    lathe_config c = lathe_default();
    gib_calibration_table t;
    assert_int_equal(lathe_calibrate(&c, GIB_CALIBRATION_PUBLISHED, 1, &t), GIB_ERR_CALIBRATION_CONDITION);
    /* One workpiece alone: told by the condition and the uncertainty. */
    assert_int_equal(lathe_calibrate(&c, GIB_CALIBRATION_LEAST_SQUARES, 1, &t), GIB_OK);
    for (uint32_t i = 0; i < t.count; i++) {
        assert_true(t.point[i].condition_ratio > 100.0 && t.point[i].gain_uncertainty_ratio[1] > 0.02);
    }
}

/* A short calibration on a lathe. */
typedef struct {
    lathe lathe;
    gib_calibration *gib;
    gib_calibration_config g;
    gib_calibration_input in;
    gib_calibration_output out;
    int braked;
} rig;

static rig *rig_start(void)
{
    rig *r = calloc(1, sizeof *r);
    lathe_config c = lathe_default();
    lathe_init(&r->lathe, &c);
    r->g = lathe_calibration(&c);
    r->g.frequencies = 2;
    r->g.frequency_hz[0] = 30.0;
    r->g.frequency_hz[1] = 50.0;
    r->g.measure_s = 0.5;
    r->g.ramp_s = 0.1;
    r->gib = gib_calibration_new();
    assert_int_equal(gib_calibration_start(r->gib, &r->g), GIB_OK);
    return r;
}

static void rig_end(rig *r)
{
    gib_calibration_free(r->gib);
    free(r);
}

typedef void (*spoil)(gib_calibration_input *in);

static int32_t rig_cycle(rig *r, spoil spoilt)
{
    gib_calibration_output before = r->out;
    r->in = lathe_calibration_input(&r->lathe);
    if (spoilt) {
        spoilt(&r->in);
    }
    int32_t status = gib_calibration_step(r->gib, &r->in, &r->out);
    const gib_calibration_output *o = &r->out;
    assert_int_equal(status, o->status);
    assert_true(isfinite(o->target_position_mm) && isfinite(o->target_speed_mm_s) && isfinite(o->amplitude_mm));
    if (o->owns_motion && before.owns_motion) {
        /* Within the stroke, and never faster than the speed allowed by more than the ramp of the amplitude. */
        assert_true(fabs(o->target_position_mm) <= r->g.stroke_mm * 1.001);
        assert_true(fabs(o->target_position_mm - before.target_position_mm) <= r->g.speed_mm_s * r->g.cycle_s * 1.2);
    }
    if (o->stop_drive) {
        r->braked = 1;
    } else {
        lathe_cycle(&r->lathe, o->target_position_mm, 0.0);
    }
    return status;
}

static void nan_position(gib_calibration_input *in) { in->position_mm = NAN; }
static void jumped(gib_calibration_input *in) { in->position_mm += 30.0; }
static void nan_torque(gib_calibration_input *in) { in->torque = NAN; }
static void strong(gib_calibration_input *in) { in->torque = 11.0; }
static void nan_seat(gib_calibration_input *in) { in->acceleration_m_s2[0] = NAN; }
static void infinite_head(gib_calibration_input *in) { in->acceleration_m_s2[1] = -INFINITY; }
static void full_seat(gib_calibration_input *in) { in->acceleration_m_s2[0] = 20.0; }
static void nan_bar(gib_calibration_input *in) { in->ball_bar_um = NAN; }
static void full_bar(gib_calibration_input *in) { in->ball_bar_um = 1000.0; }
static void aborted(gib_calibration_input *in) { in->flags = GIB_INPUT_ABORT; }
static void tripped(gib_calibration_input *in) { in->flags = GIB_INPUT_FAULT; }

static const struct {
    spoil spoilt;
    int32_t ends;
    int brakes; /* the axis is lost: nothing is commanded any more */
} FAULTS[] = {
    {nan_position, GIB_ERR_NON_FINITE, 1},
    {jumped, GIB_ERR_TRAVEL_BOUND, 1},
    {nan_torque, GIB_ERR_NON_FINITE, 0},
    {strong, GIB_ERR_TORQUE_BOUND, 0},
    {nan_seat, GIB_ERR_NON_FINITE, 0},
    {infinite_head, GIB_ERR_NON_FINITE, 0},
    {full_seat, GIB_ERR_CALIBRATION_SATURATED, 0},
    {nan_bar, GIB_ERR_NON_FINITE, 0},
    {full_bar, GIB_ERR_CALIBRATION_SATURATED, 0},
    {aborted, GIB_ERR_ABORTED, 0},
    {tripped, GIB_ERR_DRIVE_FAULT, 0},
};
enum { FAULT_COUNT = sizeof FAULTS / sizeof *FAULTS };

static void every_fault_in_every_phase_is_named_and_ends_at_rest(void **state)
{
    (void)state;
    for (int phase = GIB_CALIBRATION_RISE; phase <= GIB_CALIBRATION_FALL; phase++) {
        for (int f = 0; f < FAULT_COUNT; f++) {
            for (int lasts = 1; lasts <= 5000; lasts += 4999) {
                rig *r = rig_start();
                int cycles = 0;
                while (r->out.phase != phase || cycles < 100) {
                    rig_cycle(r, NULL);
                    assert_true(++cycles < 100000);
                }
                for (int i = 0; i < 5000; i++) {
                    rig_cycle(r, i < lasts ? FAULTS[f].spoilt : NULL);
                }
                assert_int_equal(r->out.status, FAULTS[f].ends);
                assert_int_equal(r->out.message, FAULTS[f].ends);
                assert_int_equal(r->out.owns_motion, 0);
                assert_int_equal(r->braked, FAULTS[f].brakes);
                gib_error_detail detail;
                assert_int_equal(gib_calibration_last_error(r->gib, &detail), GIB_OK);
                assert_int_equal(detail.code, FAULTS[f].ends);
                gib_calibration_table t = {.struct_size = sizeof t};
                assert_int_equal(gib_calibration_result(r->gib, &t), GIB_ERR_STATE);
                rig_end(r);
            }
        }
    }
}

/* Dead sensors give no gain. */
static double held[3];
static void stuck(gib_calibration_input *in, int which)
{
    double *reading = which == 2 ? &in->ball_bar_um : &in->acceleration_m_s2[which];
    *reading = held[which];
}
static void stuck_seat(gib_calibration_input *in) { stuck(in, 0); }
static void stuck_head(gib_calibration_input *in) { stuck(in, 1); }
static void stuck_bar(gib_calibration_input *in) { stuck(in, 2); }

static void a_stuck_sensor_is_refused(void **state)
{
    (void)state;
    static const spoil sensors[] = {stuck_seat, stuck_head, stuck_bar};
    for (int i = 0; i < 3; i++) {
        rig *r = rig_start();
        int32_t status = GIB_BUSY;
        for (int n = 0; n < 100000 && status == GIB_BUSY; n++) {
            status = rig_cycle(r, sensors[i]);
        }
        assert_int_equal(status, GIB_ERR_CALIBRATION_STUCK);
        rig_end(r);
    }
}

static void an_abort_in_any_cycle_ends_where_the_axis_stood(void **state)
{
    (void)state;
    size_t size = gib_calibration_size();
    void *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    rig *r = rig_start();
    int32_t status = GIB_BUSY;
    for (int at = 0; status == GIB_BUSY; at++) {
        status = rig_cycle(r, NULL);
        if (status != GIB_BUSY || !r->out.owns_motion) {
            continue;
        }
        memcpy(memory, r->gib, size);
        gib_calibration *copy = memory;
        gib_calibration_output out = r->out;
        gib_calibration_input in = r->in;
        int32_t ended = GIB_BUSY;
        double last = out.target_position_mm;
        int cycles = 0;
        gib_calibration_abort(copy);
        while (ended == GIB_BUSY) {
            in.position_mm = last;
            ended = gib_calibration_step(copy, &in, &out);
            assert_true(fabs(out.target_position_mm - last) <= r->g.speed_mm_s * r->g.cycle_s * 1.2 && ++cycles < 1000);
            last = out.target_position_mm;
        }
        assert_int_equal(ended, GIB_ERR_ABORTED);
        assert_true(fabs(out.target_position_mm) < 1e-4 && !out.owns_motion && !out.stop_drive);
    }
    assert_int_equal(status, GIB_DONE);
    free(memory);
    rig_end(r);
}

static void gains_are_kept_in_a_file(void **state)
{
    (void)state;
    char path[64], broken[64];
    snprintf(path, sizeof path, "/tmp/gib-calibration-%d.json", (int)getpid());
    snprintf(broken, sizeof broken, "/tmp/gib-broken-%d.json", (int)getpid());
    rig *r = rig_start();
    gib_calibration_table t = {.struct_size = sizeof t}, again = {.struct_size = sizeof again};
    gib_error_detail detail;
    assert_int_equal(gib_calibration_save(r->gib, path), GIB_ERR_STATE);
    while (rig_cycle(r, NULL) == GIB_BUSY) {
    }
    assert_int_equal(r->out.status, GIB_DONE);
    assert_int_equal(gib_calibration_result(r->gib, &t), GIB_OK);
    assert_int_equal(gib_calibration_save(r->gib, path), GIB_OK);
    assert_int_equal(gib_calibration_save(r->gib, "/nowhere/at/all"), GIB_ERR_IO);
    gib_calibration *other = gib_calibration_new();
    FILE *f = fopen(broken, "w");
    fputs("{\"schema\": \"gib.calibration/1\", \"points\": [{\"frequency_hz\": 5}]}", f);
    fclose(f);
    assert_int_equal(gib_calibration_load(other, broken), GIB_ERR_FORMAT);
    assert_int_equal(gib_calibration_last_error(other, &detail), GIB_OK);
    assert_string_equal(detail.field, "gain_ratio");
    assert_int_equal(gib_calibration_load(other, path), GIB_OK);
    assert_int_equal(gib_calibration_result(other, &again), GIB_OK);
    assert_memory_equal(&t, &again, sizeof t);
    t.struct_size = 8;
    assert_int_equal(gib_calibration_result(other, &t), GIB_ERR_STRUCT_SIZE);
    gib_calibration_free(other);
    rig_end(r);
    unlink(path);
    unlink(broken);
}

static void pointers_and_handles_are_checked(void **state)
{
    (void)state;
    size_t size = gib_calibration_size();
    unsigned char *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    lathe_config c = lathe_default();
    gib_calibration_config g = lathe_calibration(&c);
    gib_calibration_input in = {.position_mm = 3.0};
    gib_calibration_output out;
    gib_calibration *gib = NULL;
    gib_error_detail detail;
    assert_int_equal(gib_calibration_init_in(memory, 16, &gib), GIB_ERR_MEMORY);
    assert_int_equal(gib_calibration_init_in(memory, size, &gib), GIB_OK);
    assert_int_equal(gib_calibration_start(NULL, &g), GIB_ERR_NULL);
    assert_int_equal(gib_calibration_start(gib, NULL), GIB_ERR_NULL);
    g.frequency_hz[3] = NAN;
    assert_int_equal(gib_calibration_start(gib, &g), GIB_ERR_CONFIG);
    assert_int_equal(gib_calibration_last_error(gib, &detail), GIB_OK);
    assert_string_equal(detail.field, "frequency_hz");
    g = lathe_calibration(&c);
    g.add = 1;
    assert_int_equal(gib_calibration_start(gib, &g), GIB_ERR_CALIBRATION_ADD);
    assert_int_equal(gib_calibration_step(gib, &in, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_calibration_step(gib, NULL, &out), GIB_ERR_NULL);
    assert_int_equal(gib_calibration_step(NULL, &in, &out), GIB_ERR_NULL);
    assert_true(out.target_position_mm == 3.0 && out.owns_motion == 0);
    assert_int_equal(gib_calibration_step(gib, &in, &out), GIB_OK);
    memset(memory, 0, size);
    assert_int_equal(gib_calibration_step(gib, &in, &out), GIB_ERR_HANDLE);
    gib_calibration_free(NULL);
    free(memory);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gains_are_right_within_their_uncertainty),
        cmocka_unit_test(opposite_phases_refuse_the_published_formula),
        cmocka_unit_test(every_fault_in_every_phase_is_named_and_ends_at_rest),
        cmocka_unit_test(a_stuck_sensor_is_refused),
        cmocka_unit_test(an_abort_in_any_cycle_ends_where_the_axis_stood),
        cmocka_unit_test(gains_are_kept_in_a_file),
        cmocka_unit_test(pointers_and_handles_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
