/* See lathe_plant.h. */
#include "lathe_plant.h"

#include <math.h>
#include <string.h>

#define TWO_PI 6.283185307179586

/* Places in the state. */
enum { XS, X1, XB, P, XH, VS, V1, VB, VP, VH, F };

const char *const lathe_shape_name[LATHE_SHAPES] = {"oval", "cam", "polygon"};

/* splitmix64: one word of state, good enough for sensor noise. */
double lathe_uniform(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

static double normal(uint64_t *state)
{
    double u = 1.0 - lathe_uniform(state);
    return sqrt(-2.0 * log(u)) * cos(TWO_PI * lathe_uniform(state));
}

double lathe_form(lathe_shape shape, double angle)
{
    if (shape == LATHE_OVAL) {
        return cos(2.0 * angle);
    }
    if (shape == LATHE_CAM) {
        /* A nose that takes up a third of the turn, the rest round. */
        return 2.0 * pow(0.5 + 0.5 * cos(angle), 4.0) - 1.0;
    }
    /* Three corners, rounded: a soft maximum of three planes. */
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        sum += exp(2.5 * cos(angle - TWO_PI * i / 3.0));
    }
    return 2.0 * (log(sum) / 2.5 - 0.85);
}

lathe_config lathe_default(void)
{
    lathe_config c;
    memset(&c, 0, sizeof c);
    c.cycle_s = 0.0005;
    c.substeps = 10;
    c.slide_kg = 40.0;
    c.seat_kg = 250.0;
    c.bed_kg = 3000.0;
    c.head_kg = 500.0;
    c.rocking_kg_m2 = 800.0;
    c.seat_n_m = 2e8;
    c.bed_n_m = 8e8;
    c.head_n_m = 5e8;
    c.rocking_nm = 1e8;
    c.seat_arm_m = 0.6;
    c.head_arm_m = 0.5;
    c.damping_ratio = 0.04;
    c.guide_n_s_m = 200.0;
    c.unbalance_kg_m = 0.002;
    c.hall_n = 10.0;
    c.hall_hz = 23.7;
    c.position_gain_1_s = 200.0;
    c.current_s = 0.0005;
    c.scale_um = 0.01;
    c.ball_bar_noise_um = 0.02;
    c.ball_bar_gain_ratio = 1.001;
    c.newton_per_nm = 200.0;
    c.seat = (lathe_accelerometer){1.05, 0.00035, 0.12, 0.002, 0.001, 0.01, 20.0};
    c.head = (lathe_accelerometer){0.95, 0.00025, -0.08, -0.001, 0.001, 0.01, 20.0};
    c.seed = 1;
    return c;
}

void lathe_init(lathe *p, const lathe_config *c)
{
    memset(p, 0, sizeof *p);
    p->c = *c;
    p->random = c->seed;
}

static void derive(const lathe *p, const double *s, double time, double *d)
{
    const lathe_config *c = &p->c;
    double seat_c = 2.0 * c->damping_ratio * sqrt(c->seat_n_m * c->seat_kg);
    double bed_c = 2.0 * c->damping_ratio * sqrt(c->bed_n_m * c->bed_kg);
    double head_c = 2.0 * c->damping_ratio * sqrt(c->head_n_m * c->head_kg);
    double rocking_c = 2.0 * c->damping_ratio * sqrt(c->rocking_nm * c->rocking_kg_m2);
    double a = c->seat_arm_m, b = c->head_arm_m;
    double f1 = c->seat_n_m * (s[X1] - s[XB] - a * s[P]) + seat_c * (s[V1] - s[VB] - a * s[VP]);
    double fh = c->head_n_m * (s[XH] - s[XB] + b * s[P]) + head_c * (s[VH] - s[VB] + b * s[VP]);
    double drive = s[F] - c->guide_n_s_m * (s[VS] - s[V1]);
    double hall = c->hall_n * sin(TWO_PI * c->hall_hz * time);
    double angle = p->angle + p->speed * (time - p->time);
    double thrown = c->unbalance_kg_m * p->speed * p->speed * cos(angle);
    memcpy(d, s + VS, 5 * sizeof *d);
    d[VS] = drive / c->slide_kg;
    d[V1] = (-drive - f1) / c->seat_kg;
    d[VB] = (f1 + fh - c->bed_n_m * s[XB] - bed_c * s[VB] + hall) / c->bed_kg;
    d[VP] = (a * f1 - b * fh - c->rocking_nm * s[P] - rocking_c * s[VP]) / c->rocking_kg_m2;
    d[VH] = (thrown - fh) / c->head_kg;
    d[F] = (p->asked - s[F]) / c->current_s;
}

static void substep(lathe *p, double time, double h)
{
    double k[4][LATHE_STATES], at[LATHE_STATES];
    static const double reach[4] = {0.0, 0.5, 0.5, 1.0};
    for (int n = 0; n < 4; n++) {
        for (int i = 0; i < LATHE_STATES; i++) {
            at[i] = p->state[i] + (n ? reach[n] * h * k[n - 1][i] : 0.0);
        }
        derive(p, at, time + reach[n] * h, k[n]);
    }
    for (int i = 0; i < LATHE_STATES; i++) {
        p->state[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    }
}

/* A sample of an accelerometer whose filter holds `filtered`. */
static double sampled(lathe *p, const lathe_accelerometer *a, double filtered, double *wandered)
{
    double grid = a->range_m_s2 / 32768.0;
    *wandered += a->wander_m_s2 * sqrt(p->c.cycle_s) * normal(&p->random);
    double value = a->gain_ratio * filtered + a->offset_m_s2 + a->drift_m_s2_s * p->time + *wandered +
                   a->noise_m_s2 * normal(&p->random);
    value = grid * floor(value / grid + 0.5);
    return fmin(fmax(value, -a->range_m_s2), a->range_m_s2 - grid);
}

/* Two lags of first order, by trapezia: what comes in and what was there before. */
static void filter(double held[3], double value, double part)
{
    double first = held[0], moved = part / (1.0 + 0.5 * part);
    held[0] += (0.5 * (held[2] + value) - held[0]) * moved;
    held[1] += (0.5 * (first + held[0]) - held[1]) * moved;
    held[2] = value;
}

lathe_reading lathe_sense(lathe *p)
{
    const lathe_config *c = &p->c;
    lathe_reading r;
    double grid = 1e-3 * c->scale_um;
    r.scale_mm = grid * floor(1e3 * (p->state[XS] - p->state[X1]) / grid + 0.5);
    r.angle_deg = 360.0 / TWO_PI * fmod(p->angle, TWO_PI);
    r.torque_nm = p->state[F] / c->newton_per_nm;
    r.ball_bar_um = c->ball_bar_gain_ratio * lathe_relative_um(p) + c->ball_bar_noise_um * normal(&p->random);
    r.acceleration_m_s2[0] = sampled(p, &c->seat, p->filtered[0][1], &p->wandered[0]);
    r.acceleration_m_s2[1] = sampled(p, &c->head, p->filtered[1][1], &p->wandered[1]);
    return r;
}

void lathe_cycle(lathe *p, double target_mm, double speed_rpm)
{
    const lathe_config *c = &p->c;
    double target = 1e-3 * target_mm, h = c->cycle_s / c->substeps;
    /* Feed-forward from the targets of the last cycles; feedback on the scale. */
    double asked = (target - 2.0 * p->last_target[0] + p->last_target[1]) / (c->cycle_s * c->cycle_s);
    double speed = (target - p->last_target[0]) / c->cycle_s;
    double error = p->last_target[0] - (p->state[XS] - p->state[X1]);
    double slower = speed - (p->state[VS] - p->state[V1]);
    double kp = c->position_gain_1_s;
    p->asked = c->slide_kg * (asked + kp * kp * error + 2.0 * kp * slower) + c->guide_n_s_m * speed;
    p->last_target[1] = p->last_target[0];
    p->last_target[0] = target;
    p->speed = TWO_PI / 60.0 * speed_rpm;
    for (int i = 0; i < c->substeps; i++) {
        double d[LATHE_STATES], time = p->time + i * h;
        substep(p, time, h);
        derive(p, p->state, time + h, d);
        filter(p->filtered[0], d[V1], h / c->seat.lag_s);
        filter(p->filtered[1], d[VH], h / c->head.lag_s);
    }
    p->time += c->cycle_s;
    p->angle += p->speed * c->cycle_s;
}

double lathe_tool_mm(const lathe *p)
{
    return 1e3 * (p->state[XS] - p->state[XH]);
}

double lathe_relative_um(const lathe *p)
{
    return 1e6 * (p->state[X1] - p->state[XH]);
}
