/* See homing_axes.h. */
#include "homing_axes.h"

#include <math.h>

double homing_between(uint64_t *random, double low, double high)
{
    return low + (high - low) * homing_plant_uniform(random);
}

double homing_over(uint64_t *random, double low, double high)
{
    return exp(homing_between(random, log(low), log(high)));
}

homing_plant_config homing_random_axis(uint64_t *random)
{
    static const double CYCLES[] = {0.00025, 0.0005, 0.001, 0.001, 0.001, 0.002, 0.004};
    static const double GRIDS[] = {0.0, 1e-5, 1e-4, 1e-3};
    homing_plant_config c = homing_plant_default();
    c.seed = (uint64_t)homing_between(random, 1.0, 1e15);
    c.cycle_s = CYCLES[(int)homing_between(random, 0.0, 7.0)];
    c.substeps = (int)ceil(c.cycle_s / 0.00005);
    c.sense = homing_between(random, 0.0, 1.0) < 0.5 ? 1.0 : -1.0;
    c.stop_stiffness_nm_mm = homing_over(random, 60.0, 4000.0);
    c.stiffness_nm_mm = homing_over(random, 60.0, 600.0);
    c.friction_nm = homing_between(random, 0.1, 2.0);
    c.motor_share = homing_between(random, 0.0, 0.4);
    c.breakaway_ratio = homing_between(random, 1.0, 1.5);
    c.stribeck_mm_s = homing_between(random, 0.0, 1.0) < 0.5 ? 0.0 : homing_over(random, 0.3, 5.0);
    /* Less than friction holds: see the limits in docs/homing.md. */
    c.constant_nm = fmax(homing_between(random, -0.8, 0.8), -0.9 * (1.0 - c.motor_share) * c.friction_nm);
    c.clearance_mm = homing_between(random, 0.0, 0.03);
    c.viscous_nm_s_mm = homing_between(random, 0.0, 0.02);
    double heavy = homing_over(random, 0.3, 4.0);
    c.motor_inertia_nm_s2_mm *= heavy;
    c.table_inertia_nm_s2_mm *= heavy;
    /* Gains that a servo of this cycle and inertia can have. */
    c.position_gain_1_s = homing_between(random, 20.0, 60.0) * (c.cycle_s > 0.003 ? 0.6 : 1.0);
    c.velocity_gain_nm_s_mm = 0.33 * heavy * homing_between(random, 0.6, 1.2);
    c.velocity_gain_nm_s_mm *= c.cycle_s > 0.003 ? 0.4 : c.cycle_s > 0.0015 ? 0.7 : 1.0;
    c.velocity_integral_time_s = homing_between(random, 0.01, 0.04) * (c.cycle_s > 0.0015 ? 2.0 : 1.0);
    c.velocity_feedforward = homing_between(random, 0.0, 1.0) < 0.3 ? 0.0 : 1.0;
    c.torque_noise_nm = homing_between(random, 0.0, 0.2);
    c.encoder_mm = GRIDS[(int)homing_between(random, 0.0, 4.0)];
    return c;
}
