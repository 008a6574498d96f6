/*
 * Face milling of a workpiece that is clamped out of true, to try tilt on: a plane surface under a tool, the load that
 * the cut puts on the spindle, and what the drive shows of it. It shares nothing with gib but the header.
 *
 *   surface   a plane through a point, turned about x and y by rotation matrices; a table A/B may turn it back
 *   torque    T = (K1·d + K2·(1 − exp(−d/d0)))·engagement·(1 + wear·cut), d the depth at the tool; noise, chips
 *   current   I = √(Im² + (T + Tidle)²/kt²), shown as √2·I·|sin φ| on a grid; or the load in %, filtered
 */
#ifndef TILT_PLANT_H
#define TILT_PLANT_H

#include "gib.h"
#include <stdint.h>

typedef struct {
    double cycle_s;
    double length_mm, width_mm; /* of the workpiece, from 0 */
    double about_x_deg, about_y_deg;
    double depth_mm; /* under the middle of the workpiece */
    double tool_diameter_mm, speed_rpm, feed_mm_s;
    int pole_pairs, dc_load;
    double slope_nm_mm, knee_nm, knee_mm; /* K1, K2, d0 */
    double noise_ratio, noise_time_s; /* of the torque, standard deviation and correlation */
    double wear_1_m;                  /* growth of the torque per metre cut */
    double chips_1_s;                 /* how often a chip jams, for 40 ms */
    double current_grid_a;
    double pivot_mm[3]; /* where the table's axes cross: A carries B */
    uint64_t seed;
} tilt_plant_config;

typedef struct {
    tilt_plant_config c;
    double at[3];                /* commanded tool tip, mm */
    double offset[3], turned[2]; /* in force: x y z, and the table's a b in degrees */
    double angle, noise, filtered, cut_m, jam_s;
    uint64_t random;
} tilt_plant;

tilt_plant_config tilt_plant_default(void);
void tilt_plant_init(tilt_plant *p, const tilt_plant_config *c);
/* Depth of the cut under the tool now, mm; below 0: no contact. */
double tilt_plant_depth(const tilt_plant *p);
/* One cycle with the tool at the commanded x y (z is 0); returns the load that the drive shows. */
double tilt_plant_cycle(tilt_plant *p, double x, double y, int rotating);
/* Angle of the surface to the tool's plane, degrees, as clamped. */
double tilt_plant_truth(const tilt_plant *p);
/* Angle of the line that the surface cuts from the plane x = 0 (axis 0), y = 0 (axis 1), by the right hand, degrees. */
double tilt_plant_about(const tilt_plant *p, int axis);
/* Uniform in [0, 1); normal with standard deviation 1. */
double tilt_plant_uniform(uint64_t *state);
double tilt_plant_normal(uint64_t *state);

#endif
