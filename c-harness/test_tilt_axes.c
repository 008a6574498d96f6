/*
 * Offsets of four and five axes against a machine written out in 4 x 4 matrices: a rotary axis is a turn about a line
 * through its pivot; what it carries comes after it. Any letters, order, side, sense, angles and pivots.
 *
 *   workpiece: W = T1(q1)*T2(q2)     tool: S likewise     a fixed surface moves by W(new)*W(measured)^-1, the tip by S
 *
 * The measurement is fed with the exact load of a plane, so what is left is what the offsets leave.
 */
#include "tilt_laws.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

typedef struct {
    double m[4][4];
} matrix;

typedef struct {
    int letter, turns_tool, sense; /* letter 1, 2, 3: about x, y, z; 0: none */
    double pivot[3];               /* with all axes at 0 */
} axis;

static const matrix ONE = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};

static matrix product(const matrix *a, const matrix *b)
{
    matrix c;
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            c.m[i][j] = 0.0;
            for (int k = 0; k < 4; k++) {
                c.m[i][j] += a->m[i][k] * b->m[k][j];
            }
        }
    }
    return c;
}

static matrix shift(const double by[3], double sign)
{
    matrix t = ONE;
    for (int i = 0; i < 3; i++) {
        t.m[i][3] = sign * by[i];
    }
    return t;
}

/* A turn about a line through the pivot, along the letter. */
static matrix turn(const axis *a, double degrees)
{
    matrix r = ONE;
    double q = a->sense * degrees * 3.14159265358979323846 / 180.0, c = cos(q), s = sin(q);
    int i = a->letter % 3, j = (a->letter + 1) % 3; /* about x: y toward z, and so on */
    r.m[i][i] = r.m[j][j] = c;
    r.m[i][j] = -s;
    r.m[j][i] = s;
    matrix there = shift(a->pivot, 1.0), back = shift(a->pivot, -1.0), half = product(&there, &r);
    return product(&half, &back);
}

/* Inverse of a rigid motion. */
static matrix undone(const matrix *a)
{
    matrix t = ONE;
    for (int i = 0; i < 3; i++) {
        t.m[i][3] = 0.0;
        for (int j = 0; j < 3; j++) {
            t.m[i][j] = a->m[j][i];
            t.m[i][3] -= a->m[j][i] * a->m[j][3];
        }
    }
    return t;
}

static void apply(const matrix *a, const double v[3], double w, double out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = a->m[i][0] * v[0] + a->m[i][1] * v[1] + a->m[i][2] * v[2] + a->m[i][3] * w;
    }
}

/* All axes of one side, the one nearest the bed first. */
static matrix chain(const axis axes[2], const double angles[3], int tool)
{
    matrix all = ONE;
    for (int i = 0; i < 2; i++) {
        if (axes[i].letter && axes[i].turns_tool == tool) {
            matrix t = turn(&axes[i], angles[axes[i].letter - 1]);
            all = product(&all, &t);
        }
    }
    return all;
}

/* How that side has moved since the measurement. */
static matrix moved(const axis axes[2], const double before[3], const double after[3], int tool)
{
    matrix was = chain(axes, before, tool), is = chain(axes, after, tool), back = undone(&was);
    return product(&is, &back);
}

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

/*
 * What the machine then cuts, by matrices: depth under the tip at corners of the path, and the sine between the tool's
 * axis and the surface's normal.
 */
static double judge(const axis axes[2], const double angles[3], double gx, double gy, const outcome *o, double depth[3])
{
    double after[3];
    for (int i = 0; i < 3; i++) {
        after[i] = angles[i] + o->out.offset_deg[i];
    }
    matrix work = moved(axes, angles, after, 0), tool = moved(axes, angles, after, 1);
    double length = sqrt(1.0 + gx * gx + gy * gy), up[3] = {-gx / length, -gy / length, 1.0 / length}, z[3] = {0, 0, 1},
           zero[3] = {0}, normal[3], spindle[3], tip[3], point[3], on[3] = {START[0], START[1], START[2] + DEPTH};
    apply(&work, up, 0.0, normal);
    apply(&tool, z, 0.0, spindle);
    apply(&tool, zero, 1.0, tip); /* the pivots of the tool's side are given from its tip */
    apply(&work, on, 1.0, point);
    for (int corner = 0; corner < 3; corner++) {
        double at[3] = {START[0] + (corner == 1 ? LENGTH : 0) + o->out.offset_mm[0] + tip[0],
                        START[1] + (corner == 2 ? WIDTH : 0) + o->out.offset_mm[1] + tip[1],
                        START[2] + o->plane[corner] + tip[2]};
        double surface = point[2] - (normal[0] * (at[0] - point[0]) + normal[1] * (at[1] - point[1])) / normal[2];
        depth[corner] = surface - at[2];
    }
    double cross[3] = {normal[1] * spindle[2] - normal[2] * spindle[1], normal[2] * spindle[0] - normal[0] * spindle[2],
                       normal[0] * spindle[1] - normal[1] * spindle[0]};
    return sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
}

/* Puts the machine's axes into a configuration: pivots as they lie at the angles of the measurement. */
static void configure(gib_tilt_config *g, const axis axes[2], const double angles[3])
{
    for (int i = 0; i < 2; i++) {
        double p[3] = {axes[i].pivot[0], axes[i].pivot[1], axes[i].pivot[2]};
        if (i == 1 && axes[0].letter && axes[0].turns_tool == axes[1].turns_tool) {
            matrix carried = turn(&axes[0], angles[axes[0].letter - 1]);
            apply(&carried, axes[1].pivot, 1.0, p);
        }
        g->rotary[i].axis = axes[i].letter;
        g->rotary[i].turns_tool = axes[i].turns_tool;
        g->rotary[i].sense = axes[i].sense;
        memcpy(g->rotary[i].pivot_mm, p, sizeof p);
    }
}

static void three_axes_follow_the_plane(void **state)
{
    (void)state;
    const axis none[2] = {{0}};
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
                axis axes[2] = {{first, sides & 1, between(0, 1) < 0.5 ? 1 : -1, {0}},
                                {second, sides >> 1, between(0, 1) < 0.5 ? 1 : -1, {0}}};
                double angles[3] = {between(-40, 40), between(-40, 40), between(-60, 60)}, depth[3];
                double gx = between(-0.03, 0.03), gy = between(-0.03, 0.03), before = hypot(gx, gy);
                for (int i = 0; i < 2; i++) {
                    for (int k = 0; k < 3; k++) {
                        axes[i].pivot[k] = between(-150, 150);
                    }
                }
                gib_tilt_config g = usual();
                configure(&g, axes, angles);
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
    const axis axes[2] = {{3, 0, 1, {0}}, {2, 0, 1, {10, 0, 0}}};
    const double angles[3] = {0, 90, 90}, p[3] = {11, 0, 0};
    double q[3];
    matrix w = chain(axes, angles, 0), back = undone(&w), one = product(&w, &back);
    apply(&w, p, 1.0, q); /* B takes (11,0,0) about x = 10 to (10,0,-1), C that to (0,10,-1) */
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
