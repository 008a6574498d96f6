/*
 * A machine with rotary axes written out in 4 x 4 matrices: a rotary axis is a turn about a line through its pivot; what it carries
 * comes after it. Any letters, order, side, sense, angles and pivots.
 *
 *   workpiece: W = T1(q1)*T2(q2)     tool: S likewise     a fixed surface moves by W(new)*W(measured)^-1, the tip by S
 */
#ifndef TILT_MATRICES_H
#define TILT_MATRICES_H

#include "gib.h"

typedef struct {
    double m[4][4];
} matrix;

typedef struct {
    int letter, turns_tool, sense; /* letter 1, 2, 3: about x, y, z; 0: none */
    double pivot[3];               /* with all axes at 0 */
} tilt_axis;

matrix matrix_product(const matrix *a, const matrix *b);
/* Inverse of a rigid motion. */
matrix matrix_undone(const matrix *a);
/* A point (w = 1) or a direction (w = 0), moved. */
void matrix_apply(const matrix *a, const double v[3], double w, double out[3]);
/* All axes of one side, the one nearest the bed first. */
matrix tilt_axes_chain(const tilt_axis axes[2], const double angles[3], int tool);
/* Puts the axes into a configuration: pivots as they lie at the angles of the measurement. */
void tilt_axes_configure(gib_tilt_config *g, const tilt_axis axes[2], const double angles[3]);

/* A plane with slopes gx, gy that was measured at `angles`, and lies so deep under the tip that stood at `start`. */
typedef struct {
    double gx, gy, depth, start[3], angles[3];
} tilt_plane;

/*
 * What the machine cuts with offsets in force: the depth under the tip that is told to be at x, y, and, where it is asked for, the
 * sine between the tool's axis and the surface's normal.
 */
double tilt_axes_depth(const tilt_axis axes[2], const tilt_plane *plane, const double offset_mm[3], const double offset_deg[3], double x,
                       double y, double *apart);

#endif
