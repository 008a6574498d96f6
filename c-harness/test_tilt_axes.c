/*
 * Offsets of four and five axes against a machine written out in matrices, see tilt_matrices.h. The measurement is fed with the exact
 * load of a plane, so what is left is what the offsets leave.
 */
#include "tilt_laws.h"
#include "tilt_matrices.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

static uint64_t seed = 42;

static double between(double low, double high)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(seed >> 11) / 9007199254740992.0);
}

enum { LENGTH = 60, WIDTH = 40, ROWS = 3 };
static const double DEPTH = 3.0, LOAD_PER_MM = 10.0, START[3] = {100.0, -50.0, 20.0};

typedef struct {
    gib_tilt_report report;
    gib_tilt_output out;    /* with the offsets in force, at the start of the path */
    double plane[3];     /* z offset at three corners */
    int32_t status;
} outcome;

/* Three rows, back and forth, of a plane with slopes gx, gy; accepted, ramped in, and read at three corners. */
static outcome measured(const gib_tilt_config *g, double gx, double gy, const double angles[3])
{
    outcome o;
    gib_tilt *gib = gib_tilt_new();
    gib_tilt_table t;
    tilt_laws laws;
    memset(&o, 0, sizeof o);
    memset(&t, 0, sizeof t);
    t.struct_size = sizeof t;
    t.condition = g->condition;
    t.signal = GIB_TILT_DC_LOAD;
    for (double d = 0.5; d < 6.1; d += 0.5) {
        assert_int_equal(gib_tilt_table_add(&t, d, LOAD_PER_MM * d, 0.0, NULL), GIB_OK);
    }
    tilt_laws_init(&laws, g);
    assert_int_equal(gib_tilt_start(gib, g, &t), GIB_OK);
    gib_tilt_input in;
    memset(&in, 0, sizeof in);
    memcpy(in.rotary_deg, angles, sizeof in.rotary_deg);
    in.speed_rpm = g->condition.speed_rpm;
    in.position_mm[2] = START[2];
    o.status = GIB_BUSY;
    for (int pass = 0; pass < 2 * ROWS; pass++) {
        for (int i = 0; i <= 20 * LENGTH; i++) {
            double u = pass % 2 ? LENGTH - 0.05 * i : 0.05 * i, v = (pass < ROWS ? pass : 2 * ROWS - 1 - pass) * 0.5 * WIDTH;
            in.position_mm[0] = START[0] + u;
            in.position_mm[1] = START[1] + v;
            in.load = LOAD_PER_MM * (DEPTH + gx * u + gy * v);
            in.flags = i < 20 * LENGTH ? GIB_TILT_INPUT_CUTTING : 0;
            o.status = gib_tilt_step(gib, &in, &o.out);
            tilt_laws_watch(&laws, &in, o.status, &o.out);
        }
    }
    in.position_mm[0] = START[0];
    in.position_mm[1] = START[1];
    for (int i = 0; i < 100000 && o.status == GIB_BUSY && o.out.phase != GIB_TILT_ACTIVE; i++) {
        in.flags = o.out.phase == GIB_TILT_MEASURING ? GIB_TILT_INPUT_END : 0;
        in.acknowledged_id = o.out.request_id;
        o.status = gib_tilt_step(gib, &in, &o.out);
        tilt_laws_watch(&laws, &in, o.status, &o.out);
    }
    for (int corner = 0; corner < 3; corner++) {
        in.position_mm[0] = START[0] + (corner == 1 ? LENGTH : 0);
        in.position_mm[1] = START[1] + (corner == 2 ? WIDTH : 0);
        gib_tilt_output out = o.out;
        for (int i = 0; i < 5000; i++) {
            o.status = gib_tilt_step(gib, &in, &out);
            tilt_laws_watch(&laws, &in, o.status, &out);
        }
        o.plane[corner] = out.offset_mm[2];
    }
    gib_tilt_result(gib, &o.report);
    gib_tilt_free(gib);
    assert_null(laws.broken);
    return o;
}

static gib_tilt_config usual(void)
{
    gib_tilt_config g;
    memset(&g, 0, sizeof g);
    g.struct_size = sizeof g;
    g.cycle_s = 0.001;
    g.signal = GIB_TILT_DC_LOAD;
    g.condition.speed_rpm = 2000.0;
    g.condition.feed_mm_min = 3000.0; /* 0.05 mm a cycle */
    g.block_s = 0.02;
    g.offset_max_deg = 20.0;
    g.offset_max_mm = 100.0;
    g.offset_speed_deg_s = 50.0;
    g.offset_acceleration_deg_s2 = 1000.0;
    g.offset_speed_mm_s = 500.0;
    g.offset_acceleration_mm_s2 = 10000.0;
    return g;
}

/* What the machine then cuts: depth under the tip at corners of the path, and the sine between the tool's axis and the normal. */
static double judge(const tilt_axis axes[2], const double angles[3], double gx, double gy, const outcome *o, double depth[3])
{
    tilt_plane plane = {gx, gy, DEPTH, {START[0], START[1], START[2]}, {angles[0], angles[1], angles[2]}};
    double apart = 0.0;
    for (int corner = 0; corner < 3; corner++) {
        double offset[3] = {o->out.offset_mm[0], o->out.offset_mm[1], o->plane[corner]};
        depth[corner] = tilt_axes_depth(axes, &plane, offset, o->out.offset_deg, START[0] + (corner == 1 ? LENGTH : 0),
                                        START[1] + (corner == 2 ? WIDTH : 0), &apart);
    }
    return apart;
}

static void three_axes_follow_the_plane(void **state)
{
    (void)state;
    const tilt_axis none[2] = {{0}};
    const double angles[3] = {0};
    for (int i = 0; i < 4; i++) {
        double gx = between(-0.03, 0.03), gy = between(-0.03, 0.03), depth[3];
        gib_tilt_config g = usual();
        outcome o = measured(&g, gx, gy, angles);
        assert_int_equal(o.status, GIB_BUSY);
        judge(none, angles, gx, gy, &o, depth);
        assert_true(fabs(depth[0] - DEPTH) < 1e-6 && fabs(depth[1] - DEPTH) < 1e-6 && fabs(depth[2] - DEPTH) < 1e-6);
        assert_true(fabs(o.plane[1] - o.plane[0] - gx * LENGTH) < 1e-6);
        assert_true(o.out.offset_mm[0] == 0.0 && o.out.offset_mm[1] == 0.0);
        for (int k = 0; k < 3; k++) {
            assert_true(o.out.offset_deg[k] == 0.0);
        }
    }
}

/* Every pair of axes on either side, at random angles: after the offsets the tool cuts the same depth everywhere. Where
 * the axes reach both directions it also stands square on the surface. */
static void five_axes_against_matrices(void **state)
{
    (void)state;
    int square = 0, cases = 0;
    printf("seed %llu\n", (unsigned long long)seed);
    for (int first = 1; first <= 3; first++) {
        for (int second = 1; second <= 3; second++) {
            for (int sides = 0; sides < 4; sides++) {
                if (first == second) {
                    continue;
                }
                tilt_axis axes[2] = {{first, sides & 1, between(0, 1) < 0.5 ? 1 : -1, {0}},
                                {second, sides >> 1, between(0, 1) < 0.5 ? 1 : -1, {0}}};
                double angles[3] = {between(-40, 40), between(-40, 40), between(-60, 60)}, depth[3];
                double gx = between(-0.03, 0.03), gy = between(-0.03, 0.03), before = hypot(gx, gy);
                for (int i = 0; i < 2; i++) {
                    for (int k = 0; k < 3; k++) {
                        axes[i].pivot[k] = between(-150, 150);
                    }
                }
                gib_tilt_config g = usual();
                tilt_axes_configure(&g, axes, angles);
                outcome o = measured(&g, gx, gy, angles);
                cases++;
                if (o.status == GIB_ERR_TILT_SIZE) {
                    continue; /* far around for little tilt: refused, which is right */
                }
                assert_int_equal(o.status, GIB_BUSY);
                double apart = judge(axes, angles, gx, gy, &o, depth);
                if (fabs(depth[1] - depth[0]) > 2e-5 || fabs(depth[2] - depth[0]) > 2e-5 || fabs(depth[0] - DEPTH) > 2e-3) {
                    fail_msg("axes %d %d sides %d: depths %.6f %.6f %.6f", first, second, sides, depth[0], depth[1], depth[2]);
                }
                assert_true(apart < 1.02 * before);
                square += apart < 1e-8;
            }
        }
    }
    printf("%d machines, in %d the tool is square on the surface\n", cases, square);
    assert_true(square >= cases / 2);
}

/* As published: an axis turns by the tilt, x y z unchanged, where the kernel keeps the tool at the workpiece. */
static void with_tool_centre_point_only_the_axis_turns(void **state)
{
    (void)state;
    const double angles[3] = {0}, tilt = 1.373764, g0 = tan(tilt * 3.14159265358979323846 / 180.0);
    for (int letter = 1; letter <= 2; letter++) {
        gib_tilt_config g = usual();
        g.rotary[0].axis = letter;
        g.rotary[0].pivot_mm[2] = -100.0;
        g.tool_centre_point = 1;
        outcome o = measured(&g, letter == 2 ? g0 : 0.0, letter == 1 ? g0 : 0.0, angles);
        assert_int_equal(o.status, GIB_BUSY);
        assert_true(fabs(fabs(o.out.offset_deg[letter - 1]) - tilt) < 1e-6);
        assert_true(fabs(o.report.tilt_deg - tilt) < 1e-6);
        for (int k = 0; k < 3; k++) {
            assert_true(fabs(o.out.offset_mm[k]) < 1e-9);
        }
    }
}

/* The matrices themselves: a quarter turn of B about a pivot, a carried axis, and an inverse. */
static void the_matrices_are_right(void **state)
{
    (void)state;
    const tilt_axis axes[2] = {{3, 0, 1, {0}}, {2, 0, 1, {10, 0, 0}}};
    const double angles[3] = {0, 90, 90}, p[3] = {11, 0, 0};
    double q[3];
    matrix w = tilt_axes_chain(axes, angles, 0), back = matrix_undone(&w), one = matrix_product(&w, &back);
    matrix_apply(&w, p, 1.0, q); /* B takes (11,0,0) about x = 10 to (10,0,-1), C that to (0,10,-1) */
    assert_true(fabs(q[0]) < 1e-12 && fabs(q[1] - 10) < 1e-12 && fabs(q[2] + 1) < 1e-12);
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            assert_true(fabs(one.m[i][j] - (i == j)) < 1e-12);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_matrices_are_right),
        cmocka_unit_test(three_axes_follow_the_plane),
        cmocka_unit_test(five_axes_against_matrices),
        cmocka_unit_test(with_tool_centre_point_only_the_axis_turns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
