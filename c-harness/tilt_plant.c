/* See tilt_plant.h. */
#include "tilt_plant.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

double tilt_plant_uniform(uint64_t *state)
{
    /* splitmix64 */
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

double tilt_plant_normal(uint64_t *state)
{
    double radius = sqrt(-2.0 * log(1.0 - tilt_plant_uniform(state)));
    return radius * cos(2.0 * PI * tilt_plant_uniform(state));
}

tilt_plant_config tilt_plant_default(void)
{
    tilt_plant_config c = {.cycle_s = 0.001,
                           .length_mm = 100.0,
                           .width_mm = 60.0,
                           .depth_mm = 3.0,
                           .tool_diameter_mm = 16.0,
                           .speed_rpm = 2000.0,
                           .feed_mm_s = 5.0,
                           .pole_pairs = 2,
                           .slope_nm_mm = 2.2,
                           .knee_nm = 4.0,
                           .knee_mm = 1.5,
                           .noise_ratio = 0.03,
                           .noise_time_s = 1e-4,
                           .wear_1_m = 0.02,
                           .chips_1_s = 0.2,
                           .current_grid_a = 0.005,
                           .pivot_mm = {50.0, 30.0, -80.0},
                           .seed = 1};
    return c;
}

void tilt_plant_init(tilt_plant *p, const tilt_plant_config *c)
{
    tilt_plant empty = {0};
    *p = empty;
    p->c = *c;
    p->random = c->seed * 7919u + 17u;
    p->angle = 2.0 * PI * tilt_plant_uniform(&p->random);
}

static void about_x(double v[3], double degrees)
{
    double s = sin(degrees * PI / 180.0), c = cos(degrees * PI / 180.0), y = v[1], z = v[2];
    v[1] = c * y - s * z;
    v[2] = s * y + c * z;
}

static void about_y(double v[3], double degrees)
{
    double s = sin(degrees * PI / 180.0), c = cos(degrees * PI / 180.0), x = v[0], z = v[2];
    v[0] = c * x + s * z;
    v[2] = c * z - s * x;
}

/* The surface as it lies now: a point of it and its normal. */
static void surface(const tilt_plant *p, double point[3], double normal[3])
{
    const tilt_plant_config *c = &p->c;
    double start[3] = {0.5 * c->length_mm, 0.5 * c->width_mm, c->depth_mm}, up[3] = {0.0, 0.0, 1.0};
    about_y(up, c->about_y_deg);
    about_x(up, c->about_x_deg);
    for (int i = 0; i < 3; i++) {
        point[i] = start[i] - c->pivot_mm[i];
        normal[i] = up[i];
    }
    /* The table turns B first, which A carries. */
    about_y(point, p->turned[1]);
    about_x(point, p->turned[0]);
    about_y(normal, p->turned[1]);
    about_x(normal, p->turned[0]);
    for (int i = 0; i < 3; i++) {
        point[i] += c->pivot_mm[i];
    }
}

double tilt_plant_depth(const tilt_plant *p)
{
    double point[3], normal[3];
    surface(p, point, normal);
    double x = p->at[0] + p->offset[0] - point[0], y = p->at[1] + p->offset[1] - point[1];
    double height = point[2] - (normal[0] * x + normal[1] * y) / normal[2];
    return height - (p->at[2] + p->offset[2]);
}

double tilt_plant_truth(const tilt_plant *p)
{
    double up[3] = {0.0, 0.0, 1.0};
    about_y(up, p->c.about_y_deg);
    about_x(up, p->c.about_x_deg);
    return atan2(hypot(up[0], up[1]), up[2]) * 180.0 / PI;
}

double tilt_plant_about(const tilt_plant *p, int axis)
{
    double up[3] = {0.0, 0.0, 1.0};
    about_y(up, p->c.about_y_deg);
    about_x(up, p->c.about_x_deg);
    return (axis == 0 ? atan2(-up[1], up[2]) : atan2(up[0], up[2])) * 180.0 / PI;
}

double tilt_plant_cycle(tilt_plant *p, double x, double y, int rotating)
{
    const tilt_plant_config *c = &p->c;
    double way = hypot(x - p->at[0], y - p->at[1]);
    p->at[0] = x;
    p->at[1] = y;
    double radius = 0.5 * c->tool_diameter_mm, depth = fmax(tilt_plant_depth(p), 0.0);
    /* How much of the tool is over the workpiece, along x. */
    double engaged = fmin(fmin((x + radius) / (2.0 * radius), (c->length_mm + radius - x) / (2.0 * radius)), 1.0);
    engaged = rotating ? fmax(engaged, 0.0) : 0.0;
    if (engaged > 0.0 && depth > 0.0) {
        p->cut_m += 1e-3 * way;
    }
    double torque = c->slope_nm_mm * depth + c->knee_nm * (1.0 - exp(-depth / c->knee_mm));
    torque *= engaged * (1.0 + c->wear_1_m * p->cut_m);
    double keep = exp(-c->cycle_s / c->noise_time_s);
    p->noise = keep * p->noise + sqrt(1.0 - keep * keep) * tilt_plant_normal(&p->random);
    torque *= 1.0 + c->noise_ratio * p->noise;
    if (tilt_plant_uniform(&p->random) < c->chips_1_s * c->cycle_s) {
        p->jam_s = 0.04;
    }
    torque *= p->jam_s > 0.0 ? 1.5 : 1.0;
    p->jam_s -= c->cycle_s;
    double idle = 1.5, active = (torque + (rotating ? idle : 0.0)) / 0.9;
    double current = sqrt(9.0 + active * active);
    p->angle = fmod(p->angle + 2.0 * PI * c->speed_rpm / 60.0 * c->pole_pairs * c->cycle_s, 2.0 * PI);
    p->filtered += c->cycle_s / 0.01 * (100.0 * (torque + idle) / 40.0 - p->filtered);
    if (c->dc_load) {
        return floor(p->filtered / 0.05 + 0.5) * 0.05;
    }
    return floor(sqrt(2.0) * current * fabs(sin(p->angle)) / c->current_grid_a + 0.5) * c->current_grid_a;
}
