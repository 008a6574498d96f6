/* See homing_plant.h. */
#include "homing_plant.h"

#include <math.h>
#include <string.h>

#define BRAKE_NM 5.0

/* splitmix64: one word of state, good enough for sensor noise. */
double homing_plant_uniform(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

static double normal(uint64_t *state)
{
    double u = 1.0 - homing_plant_uniform(state);
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * homing_plant_uniform(state));
}

homing_plant_config homing_plant_default(void)
{
    homing_plant_config c;
    memset(&c, 0, sizeof c);
    c.motors = 1;
    c.sense = 1.0;
    c.cycle_s = 0.001;
    c.substeps = 20;
    c.motor_inertia_nm_s2_mm = 0.0010;
    c.table_inertia_nm_s2_mm = 0.0008;
    c.stiffness_nm_mm = 137.0;
    c.damping_nm_s_mm = 0.05;
    c.clearance_mm = 0.018;
    c.friction_nm = 1.5;
    c.motor_share = 0.2;
    c.breakaway_ratio = 1.1;
    c.stop_mm[0] = c.stop_mm[1] = 6.0;
    c.stop_stiffness_nm_mm = 400.0;
    c.stop_damping_nm_s_mm = 0.1;
    c.chips_crush_mm = 1e9;
    c.tight_width_mm = 1.0;
    c.position_gain_1_s = 40.0;
    c.velocity_gain_nm_s_mm = 0.33;
    c.velocity_integral_time_s = 0.02;
    c.velocity_feedforward = 1.0;
    c.torque_time_constant_s = 0.0005;
    c.torque_limit_nm = 16.0;
    c.encoder_mm = 0.0001;
    c.torque_noise_nm = 0.15;
    c.seed = 1;
    return c;
}

void homing_plant_init(homing_plant *p, const homing_plant_config *c)
{
    memset(p, 0, sizeof *p);
    p->c = *c;
    p->random = c->seed;
    p->limit_nm = c->torque_limit_nm;
    p->first_cycle = 1;
    for (int i = 0; i < 2; i++) {
        p->side[i].motor_sticks = p->side[i].table_sticks = 1;
    }
}

/* N.m of one unit of the drive's torque, with its sign. */
static double unit_nm(const homing_plant *p)
{
    return p->c.torque_unit_nm != 0.0 ? p->c.torque_unit_nm : 1.0;
}

static uint32_t bit(homing_fault fault)
{
    return fault == FAULT_NONE ? 0u : 1u << fault;
}

/* Whether side `s` has `fault`. */
static int has(const homing_plant *p, const homing_plant_side *s, homing_fault fault)
{
    return ((p->faults | s->faults) & bit(fault)) != 0;
}

void homing_plant_break(homing_plant *p, homing_fault fault, int side)
{
    for (int i = 0; i < p->c.motors; i++) {
        homing_plant_side *s = &p->side[i];
        if (side == 1 - i) {
            continue;
        }
        s->faults |= side == i ? bit(fault) : 0u;
        if (fault == FAULT_STOP_GONE) {
            p->c.stop_mm[i] += 1e6;
        } else if (fault == FAULT_TORQUE_STUCK_HIGH) {
            s->stuck_at = 4.9;
        } else if (fault == FAULT_STOP_EARLY && s->y < p->c.stop_mm[i]) {
            p->c.stop_mm[i] = fmin(p->c.stop_mm[i], s->y + 0.1);
            s->crushed = fmax(s->crushed, s->y - (p->c.stop_mm[i] - p->c.chips_mm)); /* it brings no chips along */
        }
    }
    p->faults |= side < 0 ? bit(fault) : 0u;
    switch (fault) {
    case FAULT_LIMIT_LOST:
        p->limit_nm = p->c.torque_limit_nm;
        p->in.torque_limit = p->limit_nm / fabs(unit_nm(p));
        break;
    case FAULT_TIGHT_SPOT:
        p->c.tight_mm = p->side[0].y;
        p->c.tight_nm = 8.0;
        p->c.tight_width_mm = 0.2;
        break;
    case FAULT_STOP_SOFT: p->c.stop_stiffness_nm_mm = 4.0; break;
    case FAULT_TORQUE_NOISY: p->c.torque_noise_nm = 1.5; break;
    default: break;
    }
}

void homing_plant_mend(homing_plant *p, homing_fault fault)
{
    uint32_t left = fault == FAULT_NONE ? 0u : ~bit(fault);
    p->faults &= left;
    for (int i = 0; i < p->c.motors; i++) {
        p->side[i].faults &= left;
    }
    if (fault == FAULT_NONE || fault == FAULT_TIGHT_SPOT) {
        p->c.tight_nm = 0.0;
    }
    if (fault == FAULT_NONE || fault == FAULT_TORQUE_NOISY) {
        p->c.torque_noise_nm = fmin(p->c.torque_noise_nm, 0.1);
    }
    if (fault == FAULT_NONE || fault == FAULT_LIMIT_NAN) {
        p->in.torque_limit = p->limit_nm / fabs(unit_nm(p));
    }
}

static double deadzone(double wound, double clearance)
{
    double half = 0.5 * clearance;
    return wound > half ? wound - half : wound < -half ? wound + half : 0.0;
}

/* One body with Coulomb friction: sticks at rest, slides beyond break-away. Semi-implicit Euler. */
static void move(double *x, double *v, int *sticks, double force, double sliding, double breakaway, double inertia,
                 double dt)
{
    if (*sticks && fabs(force) <= breakaway) {
        return;
    }
    *sticks = 0;
    double sense = copysign(1.0, *v != 0.0 ? *v : force);
    double faster = *v + dt * (force - sense * sliding) / inertia;
    if (*v != 0.0 && faster * *v <= 0.0) {
        *v = 0.0;
        *sticks = 1;
        return;
    }
    *v = faster;
    *x += dt * faster;
}

/* Elastic and damped, but it only pushes. */
static double pushes(double depth, double speed, double stiffness, double damping)
{
    return depth > 0.0 ? fmax(stiffness * depth + damping * speed, 0.0) : 0.0;
}

/* Friction of the table of which `coulomb` is left at speed. */
static double table_friction(const homing_plant_config *c, double coulomb, double speed)
{
    double slow = c->stribeck_mm_s > 0.0 ? speed / c->stribeck_mm_s : INFINITY;
    return coulomb * (1.0 + (c->breakaway_ratio - 1.0) * exp(-slow * slow));
}

double homing_plant_lead(const homing_plant_config *c, double speed)
{
    double slides = table_friction(c, (1.0 - c->motor_share) * c->friction_nm, speed) + c->constant_nm;
    return copysign(0.5 * c->clearance_mm, slides) + slides / c->stiffness_nm_mm;
}

/* The drive is off and its brake on. */
static int braked(const homing_plant *p)
{
    return p->out.stop_drive || (p->faults & bit(FAULT_DRIVE_TRIP));
}

static void substep(homing_plant *p, homing_plant_side *s, int i, double torque_command, double dt)
{
    const homing_plant_config *c = &p->c;
    double lag = c->torque_time_constant_s;
    s->torque += (torque_command - s->torque) * (lag > 0.0 ? 1.0 - exp(-dt / lag) : 1.0);
    double wound = deadzone(s->x - s->y, c->clearance_mm);
    double drive = wound != 0.0 ? c->stiffness_nm_mm * wound + c->damping_nm_s_mm * (s->vx - s->vy) : 0.0;
    double against = c->constant_nm + c->viscous_nm_s_mm * s->vy;
    double depth = s->y - c->stop_mm[i];
    double stiffens = c->stop_power > 0.0 && depth > 0.0 ? pow(depth / 0.02, c->stop_power - 1.0) : 1.0;
    against += pushes(depth, s->vy, stiffens * c->stop_stiffness_nm_mm, c->stop_damping_nm_s_mm);
    if (c->chips_mm > 0.0) {
        depth = s->y - (c->stop_mm[i] - c->chips_mm) - s->crushed;
        against += pushes(depth, s->vy, c->chips_stiffness_nm_mm, 0.0);
        /* Pressed hard they give way, once by the crushed layer. */
        if (c->chips_stiffness_nm_mm * depth > 2.0 && s->crushed < c->chips_mm) {
            s->crushed += dt * c->chips_crush_mm;
        }
    }
    if (c->motors == 2) {
        double askew = (s->y - c->stop_mm[i]) - (p->side[1 - i].y - c->stop_mm[1 - i]);
        against += c->beam_nm_mm * (askew + (c->stop_mm[i] - c->stop_mm[1 - i]));
    }
    double far = (s->y - c->tight_mm) / c->tight_width_mm;
    double friction = (1.0 - c->motor_share) * c->friction_nm + c->tight_nm * fmax(0.0, 1.0 - far * far);
    double motor_friction = c->motor_share * c->friction_nm + (braked(p) ? BRAKE_NM : 0.0);
    move(&s->x, &s->vx, &s->motor_sticks, s->torque - drive, motor_friction, motor_friction,
         c->motor_inertia_nm_s2_mm, dt);
    move(&s->y, &s->vy, &s->table_sticks, drive - against, table_friction(c, friction, s->vy),
         c->breakaway_ratio * friction, c->table_inertia_nm_s2_mm, dt);
    int meets = !s->touches && s->y >= c->stop_mm[i];
    s->touched_mm = meets ? s->x : s->touched_mm;
    s->touches = meets || (s->touches && s->y > c->stop_mm[i] - 0.02);
}

/* The servo of one side; `target` in mm toward the stop. */
static double servo(homing_plant *p, homing_plant_side *s, double target, double encoder)
{
    const homing_plant_config *c = &p->c;
    double step = target - s->last_target, velocity = (encoder - s->last_encoder) / c->cycle_s;
    s->last_target = target;
    s->last_encoder = encoder;
    double error = c->position_gain_1_s * (target - encoder) + c->velocity_feedforward * step / c->cycle_s - velocity;
    double wanted = c->velocity_gain_nm_s_mm * (error + s->integral);
    double limited = fmin(fmax(wanted, -p->limit_nm), p->limit_nm);
    if (limited == wanted && c->velocity_integral_time_s > 0.0) {
        s->integral += error * c->cycle_s / c->velocity_integral_time_s;
    }
    return limited;
}

static double encoder(homing_plant *p, homing_plant_side *s)
{
    const homing_plant_config *c = &p->c;
    if (has(p, s, FAULT_ENCODER_SLIPS) && s->vx > 0.0) {
        s->slipped += 0.02 * s->vx * c->cycle_s; /* 2 % on the way to the stop only */
    } else if (has(p, s, FAULT_ENCODER_JUMPS) && s->slipped == 0.0) {
        s->slipped = 0.3;
    }
    double x = s->x - s->slipped;
    double grid = c->encoder_mm > 0.0 ? c->encoder_mm * floor(x / c->encoder_mm + 0.5) : x;
    if (!has(p, s, FAULT_ENCODER_FROZEN)) {
        s->frozen_at = grid;
    }
    return s->frozen_at;
}

static double torque_reading(homing_plant *p, homing_plant_side *s)
{
    double t = s->torque + p->c.torque_noise_nm * normal(&p->random);
    if (p->c.torque_grid_nm > 0.0) {
        t = p->c.torque_grid_nm * round(t / p->c.torque_grid_nm);
    }
    if (has(p, s, FAULT_TORQUE_STUCK) || has(p, s, FAULT_TORQUE_STUCK_HIGH)) {
        return s->stuck_at;
    }
    if (has(p, s, FAULT_TORQUE_NAN) || has(p, s, FAULT_TORQUE_PLUS_INF) || has(p, s, FAULT_TORQUE_MINUS_INF)) {
        return has(p, s, FAULT_TORQUE_NAN) ? NAN : has(p, s, FAULT_TORQUE_PLUS_INF) ? INFINITY : -INFINITY;
    }
    t = has(p, s, FAULT_TORQUE_INVERTED) ? -t : t;
    s->stuck_at = t;
    return t;
}

static uint32_t flags(const homing_plant *p)
{
    uint32_t trips = p->faults & bit(FAULT_DRIVE_TRIP) ? GIB_INPUT_FAULT : 0u;
    uint32_t aborts = p->faults & bit(FAULT_ABORT) ? GIB_INPUT_ABORT : 0u;
    return trips | aborts | (p->faults & bit(FAULT_FLAG_UNKNOWN) ? 1u << 20 : 0u);
}

static void serve_requests(homing_plant *p)
{
    if (p->out.request_id == p->done_id || p->faults & bit(FAULT_NO_ACKNOWLEDGEMENT)) {
        p->waited = 0;
        return;
    }
    if (p->waited++ < p->c.answer_cycles) {
        return;
    }
    if (p->out.requests & GIB_HOMING_REQUEST_TORQUE_LIMIT) {
        p->in.torque_limit = p->out.torque_limit;
        if (!(p->faults & bit(FAULT_LIMIT_IGNORED))) {
            p->limit_nm = p->out.torque_limit * fabs(unit_nm(p));
        }
    }
    if (p->out.requests & GIB_HOMING_REQUEST_SET_POSITION) {
        p->shift_mm[0] = p->out.shift_mm[0];
        p->shift_mm[1] = p->out.shift_mm[1];
    }
    if (p->out.requests & GIB_HOMING_REQUEST_CLEAR_DEVIATION) {
        for (int i = 0; i < p->c.motors; i++) {
            p->side[i].last_target = p->c.sense * p->out.target_position_mm[i]; /* dropped, not moved */
        }
    }
    p->done_id = p->out.request_id;
}

const gib_homing_input *homing_plant_cycle(homing_plant *p)
{
    const homing_plant_config *c = &p->c;
    if (p->first_cycle) {
        p->in.torque_limit = p->limit_nm / fabs(unit_nm(p));
    }
    serve_requests(p);
    if (p->faults & bit(FAULT_CHIPS) && c->chips_mm == 0.0 && p->side[0].y < c->stop_mm[0] - 0.35) {
        p->c.chips_mm = 0.3;
        p->c.chips_stiffness_nm_mm = 60.0;
        p->c.chips_crush_mm = 0.2;
    }
    for (int i = 0; i < c->motors; i++) {
        homing_plant_side *s = &p->side[i];
        double x = encoder(p, s);
        double told = has(p, s, FAULT_ENCODER_NAN) ? NAN : has(p, s, FAULT_ENCODER_INF) ? INFINITY : x;
        p->in.position_mm[i] = c->sense * told;
        p->in.torque[i] = c->sense * torque_reading(p, s) / unit_nm(p);
        int follows = p->out.owns_motion && !has(p, s, FAULT_NOT_FOLLOWED);
        double target = follows ? c->sense * p->out.target_position_mm[i] : s->last_target;
        if (p->first_cycle || (p->owned && !p->out.owns_motion)) {
            s->last_encoder = p->first_cycle ? x : s->last_encoder;
            s->last_target = target = x; /* the kernel takes over where the axis is */
        }
        double wanted = servo(p, s, target, x);
        if (braked(p)) {
            wanted = s->integral = 0.0;
        }
        for (int k = 0; k < c->substeps; k++) {
            substep(p, s, i, wanted, c->cycle_s / c->substeps);
        }
        p->most_torque_nm = fmax(p->most_torque_nm, fabs(s->torque));
        p->most_travel_mm = fmax(p->most_travel_mm, s->y);
    }
    p->in.acknowledged_id = p->done_id;
    if (p->faults & bit(FAULT_LIMIT_NAN)) {
        p->in.torque_limit = NAN;
    }
    p->in.flags = flags(p);
    p->first_cycle = 0;
    p->owned = p->out.owns_motion;
    p->time_s += c->cycle_s;
    return &p->in;
}
