/* Tilt of the workpiece plane: whole runs on the plant of tilt_plant.h, and what is decided, said and refused. */
#include "tilt_laws.h"
#include "tilt_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* A workpiece that is soon cut, and its table. */
static tilt_plant_config usual;
static gib_tilt_table table;
static tilt_pass passes[TILT_PASSES];

static int prepare(void **state)
{
    (void)state;
    usual = tilt_plant_default();
    usual.feed_mm_s = 20.0;
    usual.tool_diameter_mm = 8.0;
    usual.noise_ratio = 0.01;
    tilt_raster(&usual, passes);
    gib_tilt *gib = gib_tilt_new();
    int32_t status = tilt_teach(usual, gib, 0.5, 6.0, 0.5, &table);
    gib_tilt_free(gib);
    return status == GIB_DONE ? 0 : -1;
}

/* One run from start to end: `cut` passes, offsets in force for `cut_again` passes more, then taken out. */
typedef struct {
    tilt_plant plant;
    tilt_kernel kernel;
    tilt_laws laws;
    gib_tilt_report report;
    int32_t status;
    uint32_t seen;          /* phases, one bit each */
    double before_mm, after_mm; /* plane error */
} run;

static void watch(run *r, int count)
{
    gib_tilt_input in = tilt_sense(&r->kernel, passes, count);
    if (r->status == GIB_BUSY && r->kernel.out.phase == GIB_TILT_ACTIVE && r->kernel.pass == count) {
        in.flags |= GIB_TILT_INPUT_OFF;
    }
    r->status = gib_tilt_step(r->kernel.gib, &in, &r->kernel.out);
    r->seen |= 1u << r->kernel.out.phase;
    tilt_laws_watch(&r->laws, &in, r->status, &r->kernel.out);
}

static void whole(run *r, const tilt_plant_config *c, const gib_tilt_config *g, int accept)
{
    memset(r, 0, sizeof *r);
    tilt_plant_init(&r->plant, c);
    r->kernel.plant = &r->plant;
    r->kernel.gib = gib_tilt_new();
    r->kernel.accept = accept;
    tilt_laws_init(&r->laws, g);
    r->status = gib_tilt_start(r->kernel.gib, g, &table);
    tilt_rewind(&r->kernel);
    r->before_mm = r->after_mm = NAN;
    int again = 0;
    for (int i = 0; i < 1000000 && (r->status == GIB_OK || r->status == GIB_BUSY); i++) {
        watch(r, TILT_PASSES);
        if (r->kernel.out.phase == GIB_TILT_ACTIVE && !again) {
            again = 1;
            r->before_mm = r->kernel.most_mm - r->kernel.least_mm;
            tilt_rewind(&r->kernel);
        } else if (r->kernel.out.phase == GIB_TILT_ACTIVE) {
            r->after_mm = r->kernel.most_mm - r->kernel.least_mm;
        }
    }
    gib_tilt_result(r->kernel.gib, &r->report);
    gib_tilt_free(r->kernel.gib);
    if (r->laws.broken) {
        fail_msg("%s", r->laws.broken);
    }
}

static void tilted(tilt_plant_config *c, double about_x_deg, double about_y_deg)
{
    *c = usual;
    c->about_x_deg = about_x_deg;
    c->about_y_deg = about_y_deg;
    c->seed = 5;
}

/* Measured, warned, ramped in, flat, ramped out: every phase once, and every law in every cycle. */
static void a_tilt_is_found_said_and_undone(void **state)
{
    (void)state;
    run r;
    tilt_plant_config c;
    gib_tilt_config g = tilt_config(&usual);
    tilted(&c, 0.3, -0.8);
    whole(&r, &c, &g, 1);
    assert_int_equal(r.status, GIB_DONE);
    assert_int_equal(r.seen, 1u << GIB_TILT_MEASURING | 1u << GIB_TILT_EVALUATE | 1u << GIB_TILT_WARNING |
                                 1u << GIB_TILT_RAMP_ON | 1u << GIB_TILT_ACTIVE | 1u << GIB_TILT_RAMP_OFF |
                                 1u << GIB_TILT_DONE);
    assert_int_equal(r.report.decision, GIB_TILT_SIGNIFICANT);
    assert_int_equal(r.report.axes, GIB_TILT_ABOUT_X | GIB_TILT_ABOUT_Y);
    assert_true(fabs(r.report.about_x_deg - 0.3) < 0.015 && fabs(r.report.about_y_deg + 0.8) < 0.04);
    assert_true(fabs(r.report.tilt_deg - tilt_plant_truth(&r.plant)) < 0.05 * r.report.tilt_deg);
    assert_true(r.report.uncertainty_deg > 0.0005 && r.report.uncertainty_deg < 0.04);
    assert_true(r.before_mm > 1.0 && r.after_mm < 0.1 * r.before_mm);
    /* As promised in the report: z along the plane, no other axis. */
    assert_true(r.report.offset_deg[0] == 0.0 && r.report.offset_deg[1] == 0.0 && r.report.offset_mm[0] == 0.0);
    assert_true(fabs(r.report.z_slope_ratio[0] - tan(0.8 * 0.0174533)) < 6e-4);
}

/* A nominal depth makes z cut it everywhere, not only parallel. */
static void a_nominal_depth_is_cut(void **state)
{
    (void)state;
    run r;
    tilt_plant_config c;
    gib_tilt_config g = tilt_config(&usual);
    tilted(&c, 0.0, 0.5);
    g.nominal_depth_mm = 2.5;
    whole(&r, &c, &g, 1);
    assert_int_equal(r.status, GIB_DONE);
    assert_true(r.kernel.least_mm > 2.4 && r.kernel.most_mm < 2.6);
}

/* Within the band of degrees or of load nothing is done, nobody is warned; a band too small for the tilt changes nothing. */
static void the_band_is_left_alone(void **state)
{
    (void)state;
    static const struct {
        double deg, load;
        int acts;
    } BANDS[] = {{0.6, 0.0, 0}, {0.0, 4.0, 0}, {0.4, 0.0, 1}, {0.0, 0.5, 1}};
    run r;
    tilt_plant_config c;
    tilted(&c, 0.0, 0.5);
    for (size_t i = 0; i < sizeof BANDS / sizeof *BANDS; i++) {
        gib_tilt_config g = tilt_config(&usual);
        g.band_deg = BANDS[i].deg;
        g.band_load = BANDS[i].load;
        whole(&r, &c, &g, 1);
        assert_int_equal(r.status, GIB_DONE);
        assert_int_equal(r.report.decision, BANDS[i].acts ? GIB_TILT_SIGNIFICANT : GIB_TILT_IN_BAND);
        assert_int_equal((r.seen & 1u << GIB_TILT_WARNING) != 0, BANDS[i].acts);
        assert_true(fabs(r.report.tilt_deg - 0.5) < 0.025); /* it is still said */
        assert_int_equal(r.kernel.out.request_id != 0, BANDS[i].acts);
    }
}

/* No tilt, only noise: nothing is done, and the noise is not called a tilt. */
static void noise_is_no_tilt(void **state)
{
    (void)state;
    int acted = 0, runs = 20;
    for (int i = 0; i < runs; i++) {
        run r;
        tilt_plant_config c;
        gib_tilt_config g = tilt_config(&usual);
        tilted(&c, 0.0, 0.0);
        c.seed = 300u + (uint64_t)i;
        c.noise_ratio = 0.03;
        g.purpose = GIB_TILT_MEASURE_ONLY;
        whole(&r, &c, &g, 1);
        assert_int_equal(r.status, GIB_DONE);
        acted += r.report.decision == GIB_TILT_SIGNIFICANT;
    }
    assert_true(acted <= 3); /* 1 in 20 is what k = 2 promises */
}

static void declined_unanswered_or_wrongly_answered(void **state)
{
    (void)state;
    tilt_plant_config c;
    gib_tilt_config g = tilt_config(&usual);
    tilted(&c, 0.0, 0.5);
    for (int answer = 0; answer < 3; answer++) {
        tilt_plant p;
        tilt_kernel k = {.plant = &p, .gib = gib_tilt_new()};
        g.ack_timeout_s = 0.5;
        tilt_plant_init(&p, &c);
        int32_t status = gib_tilt_start(k.gib, &g, &table);
        int warned = 0;
        tilt_rewind(&k);
        while (status == GIB_OK || status == GIB_BUSY) {
            gib_tilt_input in = tilt_sense(&k, passes, TILT_PASSES);
            warned += k.out.warning;
            if (k.out.warning && answer == 0) {
                in.flags |= GIB_TILT_INPUT_OFF;
            }
            in.acknowledged_id = answer == 1 ? k.out.request_id + 1u : 0u;
            status = gib_tilt_step(k.gib, &in, &k.out);
            for (int i = 0; i < 3; i++) {
                assert_true(k.out.offset_mm[i] == 0.0 && k.out.offset_deg[i] == 0.0);
            }
        }
        gib_tilt_report report;
        gib_tilt_result(k.gib, &report);
        assert_int_equal(status, answer == 0 ? GIB_DONE : GIB_ERR_ACK_TIMEOUT);
        assert_int_equal(report.decision, answer == 0 ? GIB_TILT_DECLINED : GIB_TILT_SIGNIFICANT);
        assert_int_equal(warned, answer == 0 ? 1 : 501);
        gib_tilt_free(k.gib);
    }
}

/* A path in one direction tells one axis, an oblique line neither. */
static void the_axis_follows_from_the_path(void **state)
{
    (void)state;
    const double w = usual.width_mm, l = usual.length_mm;
    const struct {
        tilt_pass way[2];
        int seen, axes;
    } PATHS[] = {
        {{{{-4.0, 30.0}, {l + 4.0, 30.0}}, {{l + 4.0, 30.0}, {-4.0, 30.0}}}, GIB_TILT_ABOUT_Y, GIB_TILT_ABOUT_Y},
        {{{{50.0, 2.0}, {50.0, w - 2.0}}, {{50.0, w - 2.0}, {50.0, 2.0}}}, GIB_TILT_ABOUT_X, GIB_TILT_ABOUT_X},
        {{{{20.0, 5.0}, {70.0, 55.0}}, {{70.0, 55.0}, {20.0, 5.0}}}, GIB_TILT_ABOUT_EITHER, GIB_TILT_ABOUT_EITHER},
    };
    for (size_t i = 0; i < 3; i++) {
        tilt_plant_config c;
        tilt_plant p;
        tilt_kernel k = {.plant = &p, .gib = gib_tilt_new()};
        gib_tilt_config g = tilt_config(&usual);
        gib_tilt_report r;
        tilted(&c, 0.7, -0.4);
        g.purpose = GIB_TILT_MEASURE_ONLY;
        tilt_plant_init(&p, &c);
        assert_int_equal(tilt_measure(&k, &g, &table, PATHS[i].way, 2), GIB_DONE);
        gib_tilt_result(k.gib, &r);
        assert_int_equal(r.axes_seen, PATHS[i].seen);
        assert_int_equal(r.axes, PATHS[i].axes);
        assert_int_equal(r.wear_separated, 1);
        assert_true(r.about_x_uncertainty_deg == 90.0 || i == 1);
        assert_true(r.about_y_uncertainty_deg == 90.0 || i == 0);
        assert_true(fabs(i == 1 ? r.about_x_deg - 0.7 : i == 0 ? r.about_y_deg + 0.4 : 0.0) < 0.035);
        /* One way only: wear cannot be told from tilt, and the uncertainty says so. */
        double known = r.uncertainty_deg;
        tilt_plant_init(&p, &c);
        assert_int_equal(tilt_measure(&k, &g, &table, PATHS[i].way, 1), GIB_DONE);
        gib_tilt_result(k.gib, &r);
        assert_int_equal(r.wear_separated, 0);
        assert_true(r.wear_ratio_m == 0.0 && r.uncertainty_deg > known);
        gib_tilt_free(k.gib);
    }
}

/* The published rule as the method: it is what is reported and undone. */
static void two_points_as_the_method(void **state)
{
    (void)state;
    run r;
    tilt_plant_config c;
    gib_tilt_config g = tilt_config(&usual);
    tilted(&c, 0.0, 0.5);
    g.method = GIB_TILT_TWO_POINT;
    whole(&r, &c, &g, 1);
    assert_int_equal(r.status, GIB_DONE);
    assert_int_equal(r.report.method, GIB_TILT_TWO_POINT);
    assert_true(fabs(r.report.tilt_deg - r.report.two_point_deg) < 1e-9);
    assert_true(fabs(r.report.tilt_deg - 0.5) < 0.2);
}

/* The table holds for its condition: another is refused by name, or flagged where that is asked for. */
static void another_condition_is_refused_or_flagged(void **state)
{
    (void)state;
    static const char *const FIELDS[] = {"condition.tool_id", "condition.material_id", "condition.speed_rpm",
                                         "condition.feed_mm_min"};
    tilt_plant_config c;
    tilted(&c, 0.0, 0.5);
    gib_tilt *gib = gib_tilt_new();
    for (int i = 0; i < 4; i++) {
        gib_tilt_config g = tilt_config(&usual);
        gib_error_detail detail;
        g.condition.tool_id += i == 0;
        g.condition.material_id += i == 1;
        g.condition.speed_rpm *= i == 2 ? 1.2 : 1.0;
        g.condition.feed_mm_min *= i == 3 ? 0.8 : 1.0;
        assert_int_equal(gib_tilt_start(gib, &g, &table), GIB_ERR_TILT_CONDITION);
        gib_tilt_last_error(gib, &detail);
        assert_int_equal(detail.code, GIB_ERR_TILT_CONDITION);
        assert_string_equal(detail.field, FIELDS[i]);
        g.other_condition = GIB_TILT_FLAG;
        g.purpose = GIB_TILT_MEASURE_ONLY;
        run r;
        whole(&r, &c, &g, 1);
        assert_int_equal(r.status, GIB_DONE);
        assert_int_equal(r.report.flagged, 1);
    }
    gib_tilt_free(gib);
    /* What was said to be the condition is not what was cut. */
    for (int flag = 0; flag < 2; flag++) {
        run r;
        gib_tilt_config g = tilt_config(&usual);
        g.other_condition = flag ? GIB_TILT_FLAG : GIB_TILT_REFUSE;
        g.purpose = GIB_TILT_MEASURE_ONLY;
        c.speed_rpm = 1.2 * usual.speed_rpm;
        whole(&r, &c, &g, 1);
        assert_int_equal(r.status, flag ? GIB_DONE : GIB_ERR_TILT_CONDITION);
        assert_true(r.report.off_condition > 50);
        assert_int_equal(r.report.flagged, flag);
    }
    /* The same condition has no flag. */
    run r;
    gib_tilt_config g = tilt_config(&usual);
    tilted(&c, 0.0, 0.5);
    g.purpose = GIB_TILT_MEASURE_ONLY;
    whole(&r, &c, &g, 1);
    assert_int_equal(r.report.flagged, 0);
}

/* What cannot be read is refused: samples that see one phase of the current, a load outside the table, air, a huge tilt. */
static void what_cannot_be_read_is_refused(void **state)
{
    (void)state;
    tilt_plant_config c;
    run r;
    tilted(&c, 0.0, 0.5);
    gib_tilt_config g = tilt_config(&usual);
    c.speed_rpm = g.condition.speed_rpm = 15000.0; /* 500 Hz, sampled at 1 kHz */
    gib_tilt_table fast = table, kept = table;
    fast.condition.speed_rpm = 15000.0;
    table = fast;
    whole(&r, &c, &g, 1);
    table = kept;
    assert_int_equal(r.status, GIB_ERR_TILT_ALIAS);
    g = tilt_config(&usual);
    tilted(&c, 0.0, 0.0);
    c.depth_mm = 9.0;
    whole(&r, &c, &g, 1);
    assert_int_equal(r.status, GIB_ERR_TILT_RANGE);
    tilted(&c, 0.0, 1.5);
    g.offset_max_mm = 0.5;
    whole(&r, &c, &g, 1);
    assert_int_equal(r.status, GIB_ERR_TILT_SIZE);
    assert_int_equal(r.seen & 1u << GIB_TILT_WARNING, 0);
    g = tilt_config(&usual);
    g.time_limit_s = 5.0; /* the passes take longer */
    whole(&r, &c, &g, 1);
    assert_int_equal(r.status, GIB_ERR_DEADLINE);
    /* A path that ends before it has begun. */
    gib_tilt *gib = gib_tilt_new();
    gib_tilt_input in = {.flags = GIB_TILT_INPUT_END};
    gib_tilt_output out;
    g = tilt_config(&usual);
    assert_int_equal(gib_tilt_start(gib, &g, &table), GIB_OK);
    int32_t status = GIB_BUSY;
    for (int i = 0; i < 10000 && status == GIB_BUSY; i++) {
        status = gib_tilt_step(gib, &in, &out);
    }
    assert_int_equal(status, GIB_ERR_TILT_DATA);
    gib_tilt_free(gib);
}

/* The DC load has a table of its own, and measures as well. */
static void a_load_in_percent_is_read_too(void **state)
{
    (void)state;
    tilt_plant_config c;
    gib_tilt_table kept = table;
    run r;
    tilted(&c, 0.4, 0.0);
    c.dc_load = 1;
    gib_tilt_config g = tilt_config(&c);
    gib_tilt *gib = gib_tilt_new();
    /* A current is no load in percent: no policy makes one of the other. */
    g.other_condition = GIB_TILT_FLAG;
    assert_int_equal(gib_tilt_start(gib, &g, &table), GIB_ERR_TILT_CONDITION);
    g.other_condition = GIB_TILT_REFUSE;
    assert_int_equal(tilt_teach(c, gib, 0.5, 6.0, 0.5, &table), GIB_DONE);
    whole(&r, &c, &g, 1);
    table = kept;
    assert_int_equal(r.status, GIB_DONE);
    assert_true(fabs(r.report.about_x_deg - 0.4) < 0.02 && r.after_mm < 0.1 * r.before_mm);
    gib_tilt_free(gib);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tilt_is_found_said_and_undone),
        cmocka_unit_test(a_nominal_depth_is_cut),
        cmocka_unit_test(the_band_is_left_alone),
        cmocka_unit_test(noise_is_no_tilt),
        cmocka_unit_test(declined_unanswered_or_wrongly_answered),
        cmocka_unit_test(the_axis_follows_from_the_path),
        cmocka_unit_test(two_points_as_the_method),
        cmocka_unit_test(another_condition_is_refused_or_flagged),
        cmocka_unit_test(what_cannot_be_read_is_refused),
        cmocka_unit_test(a_load_in_percent_is_read_too),
    };
    return cmocka_run_group_tests(tests, prepare, NULL);
}
