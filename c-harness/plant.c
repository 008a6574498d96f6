/* See plant.h. */
#include "plant.h"

#include <math.h>
#include <string.h>

/* splitmix64: one word of state, good enough for sensor noise. */
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double plant_uniform(uint64_t *state)
{
    return (double)(next_random(state) >> 11) / 9007199254740992.0;
}

double plant_normal(uint64_t *state)
{
    double u = 1.0 - plant_uniform(state);
    double v = plant_uniform(state);
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v);
}

plant_config plant_default(void)
{
    plant_config c;
    memset(&c, 0, sizeof c);
    c.cycle_s = 0.001;
    c.substeps = 40;
    c.motor_inertia_nm_s2_mm = 0.0010;
    c.table_inertia_nm_s2_mm = 0.0008;
    c.stiffness_nm_mm = 137.0;
    c.damping_nm_s_mm = 0.05;
    c.clearance_mm = 0.018;
    c.friction_nm = 3.0;
    c.motor_share = 0.2;
    c.breakaway_ratio = 1.1;
    c.hold_ratio = 0.8;
    c.hold_time_s = 0.05;
    c.position_gain_1_s = 40.0;
    c.velocity_gain_nm_s_mm = 0.33;
    c.velocity_integral_time_s = 0.02;
    c.velocity_feedforward = 1.0;
    c.torque_time_constant_s = 0.0005;
    c.torque_limit_nm = 16.0;
    c.encoder_mm = 0.0001;
    c.torque_noise_nm = 0.1;
    c.reversal_kick_s = 0.02;
    c.seed = 1;
    return c;
}

void plant_init(plant *p, const plant_config *c)
{
    memset(p, 0, sizeof *p);
    p->c = *c;
    p->random = c->seed;
    p->table_sticks = p->motor_sticks = 1;
    p->reversal_acceleration_on = 1;
}

static double spring(const plant *p)
{
    double wound = p->x - p->y, half = 0.5 * p->c.clearance_mm;
    if (wound > half) {
        return p->c.stiffness_nm_mm * (wound - half);
    }
    if (wound < -half) {
        return p->c.stiffness_nm_mm * (wound + half);
    }
    return 0.0;
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
        /* Through zero within this step: it stops; whether it goes on is the next step's question. */
        *v = 0.0;
        *sticks = 1;
        return;
    }
    *v = faster;
    *x += dt * faster;
}

/* The table on friction that gives way: each element is stretched by the way until it slips. */
static void move_presliding(plant *p, double force, double sliding, double dt)
{
    const plant_config *c = &p->c;
    double held = 0.0;
    for (int i = 0; i < PLANT_ELEMENTS; i++) {
        double slips = c->presliding_mm * pow((i + 0.5) / PLANT_ELEMENTS, c->presliding_exponent);
        p->stretch[i] = fmin(fmax(p->stretch[i] + p->vy * dt / slips, -1.0), 1.0);
        held += p->stretch[i] / PLANT_ELEMENTS;
    }
    p->vy += dt * (force - sliding * held) / c->table_inertia_nm_s2_mm;
    p->y += dt * p->vy;
}

static void substep(plant *p, double torque_command, double dt)
{
    const plant_config *c = &p->c;
    double motor_friction = c->motor_share * c->friction_nm;
    double table_friction = c->friction_nm - motor_friction;
    double lag = c->torque_time_constant_s;
    p->torque += (torque_command - p->torque) * (lag > 0.0 ? 1.0 - exp(-dt / lag) : 1.0);
    double wound = spring(p);
    double through = wound + (wound != 0.0 ? c->damping_nm_s_mm * (p->vx - p->vy) : 0.0);
    double on_table = through - c->viscous_nm_s_mm * p->vy - c->constant_nm;
    move(&p->x, &p->vx, &p->motor_sticks, p->torque - through, motor_friction, motor_friction,
         c->motor_inertia_nm_s2_mm, dt);
    if (c->presliding_mm > 0.0) {
        move_presliding(p, on_table, table_friction, dt);
        return;
    }
    move(&p->y, &p->vy, &p->table_sticks, on_table, table_friction, c->breakaway_ratio * table_friction,
         c->table_inertia_nm_s2_mm, dt);
    /* Standing still, the table creeps until only part of the wind-up is held. */
    double held = c->hold_ratio * table_friction, load = spring(p) - c->constant_nm;
    if (p->table_sticks && fabs(p->vx) < 0.01 && fabs(load) > held) {
        double excess = load - copysign(held, load);
        p->y += excess / c->stiffness_nm_mm * (1.0 - exp(-dt / c->hold_time_s));
    }
}

plant_reading plant_cycle(plant *p, double target_mm)
{
    const plant_config *c = &p->c;
    plant_reading r;
    double encoder = c->encoder_mm > 0.0 ? c->encoder_mm * floor(p->x / c->encoder_mm + 0.5) : p->x;
    r.position_mm = encoder;
    r.table_mm = p->y;
    r.torque_nm = p->torque + c->torque_noise_nm * plant_normal(&p->random);

    /* The control: compensation adds half of its amount in the sense of the commanded motion. */
    if (p->time_s == 0.0) {
        p->last_target = target_mm;
        p->last_encoder = encoder;
    }
    double step = target_mm - p->last_target;
    p->last_target = target_mm;
    if (step != 0.0 && copysign(1.0, step) != p->command_sense) {
        p->command_sense = copysign(1.0, step);
        p->kick_left_s = p->reversal_acceleration_on ? c->reversal_kick_s : 0.0;
    }
    double command = target_mm + 0.5e-3 * p->compensation_um * p->command_sense;
    double velocity = (encoder - p->last_encoder) / c->cycle_s;
    p->last_encoder = encoder;
    double error = c->position_gain_1_s * (command - encoder) + c->velocity_feedforward * step / c->cycle_s - velocity;
    double wanted = c->velocity_gain_nm_s_mm * (error + p->integral);
    double limited = fmin(fmax(wanted, -c->torque_limit_nm), c->torque_limit_nm);
    if (limited == wanted && c->velocity_integral_time_s > 0.0) {
        p->integral += error * c->cycle_s / c->velocity_integral_time_s;
    }
    if (p->kick_left_s > 0.0) {
        limited += c->reversal_kick_nm * p->command_sense;
        p->kick_left_s -= c->cycle_s;
    }
    for (int i = 0; i < c->substeps; i++) {
        substep(p, limited, c->cycle_s / c->substeps);
    }
    p->time_s += c->cycle_s;
    return r;
}

/* Moves by `way` at `speed` and returns the mean of (motor - table) over the last half, in mm. */
static double mean_lead(plant *p, double *target, double way, double speed)
{
    double step = copysign(speed * p->c.cycle_s, way), sum = 0.0;
    int cycles = (int)(fabs(way) / fabs(step)), n = 0;
    for (int i = 0; i < cycles; i++) {
        *target += step;
        plant_cycle(p, *target);
        if (i >= cycles / 2) {
            sum += p->x - p->y;
            n++;
        }
    }
    return sum / n;
}

static void quiet_plant(plant *p, const plant_config *c)
{
    plant_config quiet = *c;
    quiet.torque_noise_nm = 0.0;
    plant_init(p, &quiet);
    p->reversal_acceleration_on = 0;
}

double plant_true_lost_motion_um(const plant_config *c)
{
    const double way = 4.0, speed = 1.0;
    plant p;
    double target = 0.0;
    quiet_plant(&p, c);
    mean_lead(&p, &target, way, speed);
    double backward = mean_lead(&p, &target, -way, speed);
    double forward = mean_lead(&p, &target, way, speed);
    return 1e3 * (forward - backward);
}

double plant_true_standstill_um(const plant_config *c)
{
    const double way = 4.0, speed = 1.0;
    plant p;
    double target = 0.0, lead[2] = {0.0, 0.0};
    quiet_plant(&p, c);
    for (int i = 0; i < 4; i++) {
        mean_lead(&p, &target, i % 2 ? -way : way, speed);
        for (double t = 0.0; t < 1.0; t += c->cycle_s) {
            plant_cycle(&p, target);
        }
        lead[i % 2] = p.x - p.y;
    }
    return 1e3 * (lead[0] - lead[1]);
}
