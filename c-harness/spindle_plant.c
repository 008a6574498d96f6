/* See spindle_plant.h. */
#include "spindle_plant.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TAU 6.283185307179586

static double uniform(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

static double normal(uint64_t *state)
{
    double u = 1.0 - uniform(state), v = uniform(state);
    return sqrt(-2.0 * log(u)) * cos(TAU * v);
}

double spindle_rad_s(double rpm)
{
    return rpm * TAU / 60.0;
}

double spindle_rpm(double rad_s)
{
    return rad_s * 60.0 / TAU;
}

spindle_config spindle_default(void)
{
    spindle_config c;
    memset(&c, 0, sizeof c);
    c.cycle_s = 0.001;
    c.inertia_kg_m2 = 0.5;
    c.coulomb_nm = 6.0;
    c.viscous_nm_s = 0.03;
    c.ripple_nm = 1.0;
    c.ripples_per_turn = 6.0;
    c.torque_limit_nm = 200.0;
    c.torque_noise_nm = 1.8;
    c.speed_grid_rpm = 0.05;
    c.bandwidth_1_s = 60.0;
    c.substeps = 20;
    c.seed = 1;
    return c;
}

void spindle_init(spindle *s, const spindle_config *c)
{
    memset(s, 0, sizeof *s);
    s->c = *c;
    s->random = c->seed;
}

spindle_reading spindle_sense(spindle *s)
{
    spindle_reading r;
    double grid = s->c.speed_grid_rpm, weakening = spindle_rad_s(s->c.weakening_rpm);
    double reported = s->past[s->c.torque_late_cycles];
    if (weakening > 0.0 && fabs(s->w) > weakening) {
        reported *= fabs(s->w) / weakening;
    }
    if (s->c.saturation_nm > 0.0 && fabs(reported) > s->c.saturation_nm) {
        reported *= fabs(reported) / s->c.saturation_nm;
    }
    double speed = spindle_rpm(s->w);
    if (s->c.counts_per_turn > 0.0) {
        double counts = floor(s->angle / TAU * s->c.counts_per_turn);
        speed = (counts - s->counts) / s->c.counts_per_turn / s->c.cycle_s * 60.0;
        s->counts = counts;
    }
    r.speed_rpm = grid > 0.0 ? grid * floor(speed / grid + 0.5) : speed;
    r.torque = reported + s->c.torque_noise_nm * normal(&s->random);
    if (uniform(&s->random) < s->c.outlier_ratio) {
        r.torque += (uniform(&s->random) - 0.5) * 8.0 * s->c.torque_limit_nm;
    }
    if (s->c.torque_grid_nm > 0.0) {
        r.torque = s->c.torque_grid_nm * floor(r.torque / s->c.torque_grid_nm + 0.5);
    }
    if (s->c.torque_constant_nm_a > 0.0) {
        r.torque /= s->c.torque_constant_nm_a;
    }
    return r;
}

void spindle_cycle(spindle *s, double command_rpm, double feed_forward_nm)
{
    const spindle_config *c = &s->c;
    double dt = c->cycle_s / c->substeps;
    /* A command is where the speed is to be at the end of its cycle: now it is to be where the one before said. */
    double error = s->due - s->w;
    s->due = spindle_rad_s(command_rpm);
    double gain = c->bandwidth_1_s * c->inertia_kg_m2;
    double wanted = gain * (error + s->integral) + feed_forward_nm;
    double limited = fmin(fmax(wanted, -c->torque_limit_nm), c->torque_limit_nm);
    if (limited == wanted) {
        s->integral += error * c->cycle_s * c->bandwidth_1_s / 4.0;
    }
    for (int i = 0; i < c->substeps; i++) {
        s->torque += (limited - s->torque) * dt / 0.0004;
        double cutting = s->w > 0.0 ? c->cutting_nm : s->w < 0.0 ? -c->cutting_nm : 0.0;
        double drive = s->torque + c->ripple_nm * sin(c->ripples_per_turn * s->angle) - cutting;
        if (s->w == 0.0 && fabs(drive) <= c->coulomb_nm) {
            continue;
        }
        double sense = s->w != 0.0 ? copysign(1.0, s->w) : copysign(1.0, drive);
        double faster = s->w + dt * (drive - sense * c->coulomb_nm - c->viscous_nm_s * s->w) / c->inertia_kg_m2;
        s->w = faster * s->w < 0.0 ? 0.0 : faster;
        s->angle += s->w * dt;
        s->peak_w = fmax(s->peak_w, s->torque * s->w);
    }
    memmove(s->past + 1, s->past, sizeof s->past - sizeof *s->past);
    s->past[0] = s->torque;
}

/* The tool's position one revolution ago: found by angle, which only grows, between two stored steps. */
typedef struct {
    double *angle, *x;
    int count, behind;
} trace;

static double one_turn_ago(trace *t, double angle)
{
    double wanted = angle - TAU;
    if (wanted <= t->angle[0]) {
        return 0.0;
    }
    while (t->behind + 1 < t->count && t->angle[t->behind + 1] < wanted) {
        t->behind++;
    }
    double from = t->angle[t->behind], to = t->angle[t->behind + 1];
    double share = to > from ? (wanted - from) / (to - from) : 0.0;
    return t->x[t->behind] + share * (t->x[t->behind + 1] - t->x[t->behind]);
}

int chatter_is_stable(const chatter_config *c, double depth_m, const double *speeds, int count, double cycle_s)
{
    const int substeps = 8;
    double dt = cycle_s / substeps, own = TAU * c->frequency_hz;
    double mass = c->stiffness_n_m / (own * own), damping = 2.0 * c->damping_ratio * mass * own;
    double x = 0.0, v = 0.0, angle = 0.0, early = 0.0, late = 0.0;
    const double kick = 1e-6; /* m: a disturbance far below a chip's thickness, so that the cut stays linear */
    int steps = count * substeps;
    trace t = {malloc((size_t)steps * sizeof(double)), malloc((size_t)steps * sizeof(double)), 0, 0};
    if (!t.angle || !t.x) {
        abort();
    }
    x = kick;
    for (int i = 0; i < steps; i++) {
        t.angle[i] = angle;
        t.x[i] = x;
        t.count = i + 1;
        double chip = one_turn_ago(&t, angle) - x;
        double force = c->cutting_n_m2 * depth_m * chip;
        /* Semi-implicit Euler keeps the energy of the free tool. */
        v += dt * (force - damping * v - c->stiffness_n_m * x) / mass;
        x += dt * v;
        angle += dt * speeds[i / substeps];
        double size = fabs(x);
        if (i < steps / 3) {
            early = fmax(early, size);
        } else if (i >= 2 * steps / 3) {
            late = fmax(late, size);
        }
        if (size > 1.0) {
            late = INFINITY;
            break;
        }
    }
    free(t.angle);
    free(t.x);
    return late <= early;
}

double chatter_stable_depth_m(const chatter_config *c, double most_m, const double *speeds, int count, double cycle_s)
{
    double low = 0.0, high = most_m;
    while (high - low > 0.01 * most_m) {
        double depth = 0.5 * (low + high);
        if (chatter_is_stable(c, depth, speeds, count, cycle_s)) {
            low = depth;
        } else {
            high = depth;
        }
    }
    return low;
}
