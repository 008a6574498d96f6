/* See tilt_matrices.h. */
#include "tilt_matrices.h"

#include <math.h>
#include <string.h>

static const matrix ONE = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};

matrix matrix_product(const matrix *a, const matrix *b)
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
static matrix turn(const tilt_axis *a, double degrees)
{
    matrix r = ONE;
    double q = a->sense * degrees * 3.14159265358979323846 / 180.0, c = cos(q), s = sin(q);
    int i = a->letter % 3, j = (a->letter + 1) % 3; /* about x: y toward z, and so on */
    r.m[i][i] = r.m[j][j] = c;
    r.m[i][j] = -s;
    r.m[j][i] = s;
    matrix there = shift(a->pivot, 1.0), back = shift(a->pivot, -1.0), half = matrix_product(&there, &r);
    return matrix_product(&half, &back);
}

matrix matrix_undone(const matrix *a)
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

void matrix_apply(const matrix *a, const double v[3], double w, double out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = a->m[i][0] * v[0] + a->m[i][1] * v[1] + a->m[i][2] * v[2] + a->m[i][3] * w;
    }
}

matrix tilt_axes_chain(const tilt_axis axes[2], const double angles[3], int tool)
{
    matrix all = ONE;
    for (int i = 0; i < 2; i++) {
        if (axes[i].letter && axes[i].turns_tool == tool) {
            matrix t = turn(&axes[i], angles[axes[i].letter - 1]);
            all = matrix_product(&all, &t);
        }
    }
    return all;
}

/* How that side has moved since the measurement. */
static matrix moved(const tilt_axis axes[2], const double before[3], const double after[3], int tool)
{
    matrix was = tilt_axes_chain(axes, before, tool), is = tilt_axes_chain(axes, after, tool), back = matrix_undone(&was);
    return matrix_product(&is, &back);
}

void tilt_axes_configure(gib_tilt_config *g, const tilt_axis axes[2], const double angles[3])
{
    for (int i = 0; i < 2; i++) {
        double p[3] = {axes[i].pivot[0], axes[i].pivot[1], axes[i].pivot[2]};
        if (i == 1 && axes[0].letter && axes[0].turns_tool == axes[1].turns_tool) {
            matrix carried = turn(&axes[0], angles[axes[0].letter - 1]);
            matrix_apply(&carried, axes[1].pivot, 1.0, p);
        }
        g->rotary[i].axis = axes[i].letter;
        g->rotary[i].turns_tool = axes[i].turns_tool;
        g->rotary[i].sense = axes[i].sense;
        memcpy(g->rotary[i].pivot_mm, p, sizeof p);
    }
}

double tilt_axes_depth(const tilt_axis axes[2], const tilt_plane *plane, const double offset_mm[3], const double offset_deg[3], double x,
                       double y, double *apart)
{
    double after[3];
    for (int i = 0; i < 3; i++) {
        after[i] = plane->angles[i] + offset_deg[i];
    }
    matrix work = moved(axes, plane->angles, after, 0), tool = moved(axes, plane->angles, after, 1);
    double length = sqrt(1.0 + plane->gx * plane->gx + plane->gy * plane->gy);
    double up[3] = {-plane->gx / length, -plane->gy / length, 1.0 / length}, z[3] = {0, 0, 1}, zero[3] = {0};
    double on[3] = {plane->start[0], plane->start[1], plane->start[2] + plane->depth}, normal[3], spindle[3], tip[3], point[3];
    matrix_apply(&work, up, 0.0, normal);
    matrix_apply(&tool, z, 0.0, spindle);
    matrix_apply(&tool, zero, 1.0, tip); /* the pivots of the tool's side are given from its tip */
    matrix_apply(&work, on, 1.0, point);
    double at[3] = {x + offset_mm[0] + tip[0], y + offset_mm[1] + tip[1], plane->start[2] + offset_mm[2] + tip[2]};
    if (apart) {
        double cross[3] = {normal[1] * spindle[2] - normal[2] * spindle[1], normal[2] * spindle[0] - normal[0] * spindle[2],
                           normal[0] * spindle[1] - normal[1] * spindle[0]};
        *apart = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    }
    return point[2] - (normal[0] * (at[0] - point[0]) + normal[1] * (at[1] - point[1])) / normal[2] - at[2];
}
