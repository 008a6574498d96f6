/* See variation_adversary.h. */
#include "variation_adversary.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *const variation_trouble_names[VARIATION_TROUBLES] = {
    "override",    "changes",      "every cycle", "cut",        "speed out",  "no number", "amplitude out", "period out",  "cutting out",
    "drive fault", "flag unknown", "abort flag",  "abort call", "stop",       "started anew", "cycles long", "drive weak"};

/* Time constant of the plant's current loop, s. */
#define CURRENT_S 0.0004

static double given(double value, double otherwise)
{
    return value == 0.0 ? otherwise : value;
}

/* The largest amplitude there is: by the formula chosen, within the bounds of speed. */
static double most_of(const gib_speed_variation_config *g, const gib_speed_variation_limits *limits)
{
    double speed = fabs(g->speed_rpm), by_speed = fmax(0.0, fmin(given(g->speed_max_rpm, 2e5) / speed - 1.0, 1.0 - g->speed_min_rpm / speed));
    return g->formula == GIB_SPEED_VARIATION_PUBLISHED ? fmin(fmin(limits->published_amplitude_ratio, 0.999), by_speed) : limits->amplitude_ratio;
}

/* A motor that can do something of what is asked. */
static void draw(variation_adversary *a)
{
    gib_speed_variation_config *g = &a->config;
    gib_speed_variation_limits limits;
    do {
        *g = variation_random(&a->base.random);
        g->cycle_s = random_over(&a->base.random, 0.000125, 0.004);
        g->formula = chance(&a->base, 0.1) ? GIB_SPEED_VARIATION_PUBLISHED : GIB_SPEED_VARIATION_EXACT;
        g->period_s = random_over(&a->base.random, fmax(0.02, 8.0 * g->cycle_s), fmax(0.03, 1500.0 * g->cycle_s));
        g->reserve_ratio = chance(&a->base, 0.3) ? between(&a->base, 0.0, 0.5) : 0.0;
        double speed = fabs(g->speed_rpm), at_mean = g->power_w / spindle_rad_s(speed);
        g->torque_nm = chance(&a->base, 0.4) ? at_mean * between(&a->base, 0.8, 3.0) : 0.0;
        g->speed_max_rpm = chance(&a->base, 0.4) ? speed * between(&a->base, 1.05, 2.0) : 0.0;
        g->speed_min_rpm = chance(&a->base, 0.4) ? speed * between(&a->base, 0.1, 0.95) : 0.0;
        g->amplitude_ratio = 0.0;
    } while (gib_speed_variation_possible(g, &limits) != GIB_OK || limits.amplitude_ratio < 1e-4);
    g->amplitude_ratio = fmax(most_of(g, &limits) * (chance(&a->base, 0.3) ? 1.0 : between(&a->base, 0.05, 1.0)), 1e-6);
}

void variation_adversary_init(variation_adversary *a, uint64_t seed, variation_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    draw(a);
    a->cycles = (int)fmin(fmax(between(&a->base, 1.0, 4.0) * a->config.period_s / a->config.cycle_s, 300.0), 4000.0);
    int count = (int)between(&a->base, 1.0, VARIATION_MOST_TROUBLES + 1.0);
    troubles_draw(&a->base.troubles, &a->base.random, count, VARIATION_TROUBLES, a->cycles, 0.1, 0.5);
}

static gib_speed_variation *gib_of(variation_adversary *a, int which)
{
    return (gib_speed_variation *)a->memory[which];
}

/* Asks for anything that may be asked for. */
static void change(variation_adversary *a)
{
    const gib_speed_variation_config *g = &a->config;
    double speed = fabs(g->speed_rpm), low = fmax(g->speed_min_rpm, 0.4 * speed), high = fmin(given(g->speed_max_rpm, 1e9), 1.6 * speed);
    double at_mean = g->power_w / spindle_rad_s(speed);
    a->in.speed_rpm = copysign(between(&a->base, low, high), g->speed_rpm);
    a->in.amplitude_ratio = chance(&a->base, 0.2) ? 0.0 : random_over(&a->base.random, 1e-9, 0.999);
    a->in.period_s = chance(&a->base, 0.2) ? 0.0 : random_over(&a->base.random, fmax(0.02, 8.0 * g->cycle_s), 600.0);
    a->in.cutting_nm = chance(&a->base, 0.3) ? 0.0 : between(&a->base, 0.0, 0.8) * at_mean;
}

/* What the kernel asks for in this cycle. */
static void ask(variation_adversary *a)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY}, WILD[] = {1e7, -1e7, DBL_MAX, -DBL_MAX, -1e-300};
    const gib_speed_variation_config *g = &a->config;
    const trouble *t;
    double speed = fabs(g->speed_rpm), at_mean = g->power_w / spindle_rad_s(speed);
    gib_speed_variation_input *in = &a->in;
    if ((t = now(&a->base, VARIATION_OVERRIDE)) != NULL && a->base.cycle > 1) {
        double share = 1.0 + 0.5 * sin((0.2 + t->size) * 0.01 * (a->base.cycle - t->at));
        in->speed_rpm = g->speed_rpm * fmin(fmax(share, g->speed_min_rpm / speed), given(g->speed_max_rpm, 1e9) / speed);
    }
    if ((now(&a->base, VARIATION_EVERY_CYCLE) && a->base.cycle > 1) ||
        (now(&a->base, VARIATION_CHANGES) && a->base.cycle > 1 && chance(&a->base, 0.02))) {
        change(a);
    }
    if ((t = now(&a->base, VARIATION_CUT)) != NULL && chance(&a->base, 0.05)) {
        in->cutting_nm = chance(&a->base, 0.4) ? 0.0 : 1.5 * t->size * at_mean;
    }
    gib_speed_variation_input kept = *in;
    if ((t = now(&a->base, VARIATION_SPEED_OUT)) != NULL) in->speed_rpm = t->size < 0.5 ? -in->speed_rpm : WILD[(int)(10.0 * t->size) - 5];
    if ((t = now(&a->base, VARIATION_AMPLITUDE_OUT)) != NULL) in->amplitude_ratio = t->size < 0.3 ? 1.0 : WILD[(int)(5.0 * t->size)];
    if ((t = now(&a->base, VARIATION_PERIOD_OUT)) != NULL)
        in->period_s = t->size < 0.5 ? 7.9 * g->cycle_s * t->size : WILD[(int)(5.0 * t->size)];
    if ((t = now(&a->base, VARIATION_CUTTING_OUT)) != NULL) in->cutting_nm = WILD[(int)(5.0 * t->size)];
    if ((t = now(&a->base, VARIATION_NO_NUMBER)) != NULL) {
        double *one[] = {&in->speed_rpm, &in->amplitude_ratio, &in->period_s, &in->cutting_nm};
        *one[(int)(4.0 * t->size)] = ODD[a->base.cycle % 3];
    }
    in->flags = now(&a->base, VARIATION_DRIVE_FAULT) ? GIB_INPUT_FAULT : 0u;
    in->flags |= begins(&a->base, VARIATION_ABORT_FLAG) ? (uint32_t)GIB_INPUT_ABORT : 0u;
    in->flags |= begins(&a->base, VARIATION_STOP) || a->base.cycle == a->cycles ? (uint32_t)GIB_SPEED_VARIATION_STOP : 0u;
    if ((t = now(&a->base, VARIATION_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (4 + (int)(28.0 * t->size));
    a->last = *in;
    /* Nonsense does not stay. */
    *in = kept;
}

/* What is wrong with an input beyond doubt, and what is out of range. */
static int dangerous(const gib_speed_variation_input *in)
{
    int numbers = isfinite(in->speed_rpm) && isfinite(in->amplitude_ratio) && isfinite(in->period_s) && isfinite(in->cutting_nm);
    return !numbers || (in->flags & ~(uint32_t)GIB_SPEED_VARIATION_STOP) != 0;
}

static int out_of_range(const variation_adversary *a)
{
    const gib_speed_variation_config *g = &a->config;
    const gib_speed_variation_input *in = &a->last;
    double speed = copysign(1.0, g->speed_rpm) * in->speed_rpm;
    return speed < g->speed_min_rpm * (1.0 - 1e-9) || speed < 0.001 || speed > given(g->speed_max_rpm, 2e5) * (1.0 + 1e-9) ||
           in->amplitude_ratio < 0.0 || in->amplitude_ratio > 0.999 || in->cutting_nm < 0.0 || in->cutting_nm > 1e6 ||
           (in->period_s != 0.0 && (in->period_s < fmax(0.02, 8.0 * g->cycle_s) || in->period_s > 600.0));
}

/* Commands go on from where they were, in the sense of rotation, and take no more than the motor has: by the balance of torque. */
static void see_command(variation_adversary *a)
{
    const gib_speed_variation_config *g = &a->config;
    const gib_speed_variation_output *o = &a->out, *b = &a->before;
    double before = a->base.cycle == 1 ? a->last.speed_rpm : b->speed_command_rpm, sense = copysign(1.0, g->speed_rpm);
    int was_at_work = a->base.cycle == 1 || b->phase == GIB_SPEED_VARIATION_RUNNING || b->phase == GIB_SPEED_VARIATION_STOPPING;
    law(&a->base, isfinite(o->speed_command_rpm) && isfinite(o->torque_nm), "a command that is a number");
    law(&a->base, isfinite(o->amplitude_ratio) && isfinite(o->amplitude_limit_ratio) && isfinite(o->period_limit_s) && o->reserved == 0,
        "an output that is written");
    if (o->status != GIB_BUSY || !was_at_work || (a->base.cycle == 1 && out_of_range(a))) {
        return;
    }
    double w0 = spindle_rad_s(sense * before), w1 = spindle_rad_s(sense * o->speed_command_rpm), faster = fmax(w0, w1);
    double inertia = (g->inertia_kg_m2 + g->own_inertia_kg_m2) * (w1 - w0) / g->cycle_s, trifle = 1e-7 * g->power_w / faster;
    double keep = 1.0 - g->reserve_ratio, friction = g->coulomb_nm + g->viscous_nm_s * faster;
    law(&a->base, fabs(sense * o->torque_nm - inertia) <= 1e-6 * fabs(inertia) + trifle, "a feed-forward that is what the change takes");
    law(&a->base,
        w1 > 0.0 && w1 <= spindle_rad_s(given(g->speed_max_rpm, 2e5)) * (1.0 + 1e-9) &&
            w1 >= spindle_rad_s(g->speed_min_rpm) * (1.0 - 1e-9),
        "a command within its bounds");
    /* What is out of range is not taken over: cutting stays what it was. */
    double told = a->last.cutting_nm >= 0.0 && a->last.cutting_nm <= 1e6 ? fmin(a->last.cutting_nm, a->true_cutting_nm) : a->true_cutting_nm;
    double needs = inertia > 0.0 ? inertia + friction + fmax(told, g->cutting_nm) : -inertia - friction;
    int exact = g->formula == GIB_SPEED_VARIATION_EXACT;
    if (fabs(inertia) > trifle && exact) {
        law(&a->base, needs <= keep * given(g->torque_nm, INFINITY) + trifle, "no more torque than the motor has");
        law(&a->base, needs * faster <= keep * g->power_w + trifle * faster, "no more power than the motor has");
    }
    law(&a->base, exact || fabs(w1 - w0) <= faster, "a command without a jump");
}

static void see_answer(variation_adversary *a)
{
    const gib_speed_variation_output *o = &a->out;
    int phase = a->base.cycle == 1 ? GIB_SPEED_VARIATION_RUNNING : a->before.phase;
    int wrong = dangerous(&a->last) || (phase == GIB_SPEED_VARIATION_RUNNING && out_of_range(a));
    int at_work = phase == GIB_SPEED_VARIATION_RUNNING || phase == GIB_SPEED_VARIATION_STOPPING;
    law(&a->base, !(at_work && wrong) || (o->message < 0 && o->phase != GIB_SPEED_VARIATION_RUNNING), "a fault in its cycle");
    law(&a->base, !at_work || !(a->last.flags & GIB_INPUT_FAULT) || (o->status < 0 && o->torque_nm == 0.0),
        "a drive that trips is let go at once");
    int ends = o->phase != GIB_SPEED_VARIATION_RUNNING;
    a->named = a->named == 0 && ends ? a->base.cycle : a->named;
}

/* What is asked for and does not change takes effect within twenty cycles: the amplitude asked for, or the largest there is. */
static void see_effect(variation_adversary *a, const gib_speed_variation_input *before)
{
    gib_speed_variation_config c = a->config;
    gib_speed_variation_limits limits;
    a->steady = memcmp(before, &a->last, sizeof *before) == 0 && a->out.phase == GIB_SPEED_VARIATION_RUNNING ? a->steady + 1 : 0;
    if (a->steady != 21) {
        return;
    }
    c.speed_rpm = a->last.speed_rpm;
    c.amplitude_ratio = fmax(given(a->last.amplitude_ratio, c.amplitude_ratio), 1e-6);
    c.period_s = given(a->last.period_s, c.period_s);
    c.cutting_nm = fmax(c.cutting_nm, a->last.cutting_nm);
    law(&a->base, gib_speed_variation_possible(&c, &limits) == GIB_OK, "limits for what is asked");
    double most = most_of(&c, &limits);
    law(&a->base, fabs(a->out.amplitude_ratio - fmin(c.amplitude_ratio, most)) <= 1e-9 && fabs(a->out.amplitude_limit_ratio - most) <= 1e-9,
        "an amplitude in effect within twenty cycles");
}

/*
 * The power meter. The drive gives the feed-forward, and its loop what is left: the current loop's lag lets the speed slip by
 * lag/inertia times a step of the feed-forward, which a loop of this bandwidth answers with bandwidth times lag of that step, and
 * takes some of its own time to give back; what cutting changes by it finds out itself.
 */
static void see_meter(variation_adversary *a, double step_nm, double cut_nm)
{
    const gib_speed_variation_config *g = &a->config;
    const spindle_config *c = &a->s.c;
    a->loose_nm = a->loose_nm * exp(-0.2 * c->bandwidth_1_s * c->cycle_s) + 2.0 * c->bandwidth_1_s * CURRENT_S * fabs(step_nm) + 1.5 * fabs(cut_nm);
    int honest = !ever(&a->base, VARIATION_CYCLES_LONG) && !ever(&a->base, VARIATION_DRIVE_WEAK) && a->out.status == GIB_BUSY;
    if (!honest || g->formula != GIB_SPEED_VARIATION_EXACT) {
        return;
    }
    double w = fabs(a->s.w), used = g->coulomb_nm + g->viscous_nm_s * w + a->s.c.cutting_nm, keep = 1.0 - g->reserve_ratio;
    double power = fmax(keep * g->power_w, used * w), torque = fmax(keep * given(g->torque_nm, INFINITY), used);
    double over = fmax((a->s.peak_w - power) / w, fabs(a->s.torque) - torque);
    a->worst = fmax(a->worst, over / (a->loose_nm + 1e-3 * power / w));
    law(&a->base, over <= a->loose_nm + 1e-3 * power / w, "a meter within the motor");
}

/* Mistakes put in on purpose. */
static void spoil(variation_adversary *a)
{
    gib_speed_variation_output *o = &a->out;
    double own_rpm;
    int late = a->base.cycle == 60;
    switch (a->mistake) {
    case VARIATION_JUMPS: o->speed_command_rpm *= late ? 1.3 : 1.0; break;
    case VARIATION_TOO_FAST: o->speed_command_rpm *= 1.0 + 1e-3 * a->base.cycle; break;
    case VARIATION_NO_COMMAND: o->speed_command_rpm = late ? NAN : o->speed_command_rpm; break;
    case VARIATION_SAYS_NOTHING: o->message = 0; break;
    case VARIATION_NEVER_ENDS:
        if (o->status != GIB_BUSY && a->base.cycle > 1) {
            *o = a->before;
            o->torque_nm = 0.0;
        }
        break;
    case VARIATION_TOO_MUCH: o->torque_nm *= 1.05; break;
    case VARIATION_TOO_STEEP:
        own_rpm = o->speed_command_rpm;
        if (a->base.cycle > 1) {
            o->speed_command_rpm = a->before.speed_command_rpm + 1.2 * (own_rpm - a->own_rpm);
            o->torque_nm *= 1.2;
        }
        a->own_rpm = own_rpm;
        break;
    case VARIATION_TIMID:
        o->speed_command_rpm = a->mean_rpm + (a->base.run ? 0.9 : 1.0) * (o->speed_command_rpm - a->mean_rpm);
        o->torque_nm *= a->base.run ? 0.9 : 1.0;
        break;
    default: break;
    }
}

/* The spindle follows: the feed-forward at once, the speed by the end of the cycle. */
static void follow(variation_adversary *a)
{
    const trouble *t = now(&a->base, VARIATION_DRIVE_WEAK);
    double cut = a->true_cutting_nm - a->s.c.cutting_nm, torque = a->out.torque_nm;
    int at_work = a->out.status == GIB_BUSY, cycles = 1 + (now(&a->base, VARIATION_CYCLES_LONG) ? (int)between(&a->base, 0.0, 3.0) : 0);
    a->s.c.torque_limit_nm = t ? t->size * a->config.power_w / fabs(a->s.w) : 1e12;
    a->s.c.cutting_nm = a->true_cutting_nm;
    a->s.peak_w = 0.0;
    for (int i = 0; i < cycles; i++) {
        spindle_cycle(&a->s, at_work ? a->out.speed_command_rpm : a->mean_rpm, at_work ? torque : 0.0);
    }
    see_meter(a, torque - a->before.torque_nm, cut);
}

static int32_t cycle(variation_adversary *a)
{
    gib_speed_variation_output twin;
    gib_speed_variation_input before = a->last;
    int was_busy = a->before.status == GIB_BUSY;
    a->base.cycle++;
    if (a->base.run == 0) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    ask(a);
    if (begins(&a->base, VARIATION_ABORT_CALL)) {
        law(&a->base, gib_speed_variation_abort(gib_of(a, 0)) == GIB_OK && gib_speed_variation_abort(gib_of(a, 1)) == GIB_OK, "an abort");
    } else if (now(&a->base, VARIATION_STARTED_ANEW) && was_busy) {
        gib_speed_variation_config other = a->config;
        other.speed_rpm *= -0.5;
        law(&a->base, gib_speed_variation_start(gib_of(a, 0), &other) == GIB_ERR_STATE, "a start while busy is refused");
    }
    if (a->base.run == 0 && a->base.cycle == 100) {
        memcpy(a->memory[1], a->memory[0], sizeof a->memory[0]);
    }
    /* The cut is there when it is told; what is no torque is none. */
    double cutting = a->last.cutting_nm;
    a->true_cutting_nm = cutting >= 0.0 && cutting <= 1e6 ? fmax(cutting, 0.0) : a->true_cutting_nm;
    a->mean_rpm = was_busy && a->named == 0 && !begins(&a->base, VARIATION_ABORT_CALL) && !dangerous(&a->last) && !out_of_range(a)
                      ? a->last.speed_rpm
                      : a->mean_rpm;
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_speed_variation_step(gib_of(a, 0), &a->last, &a->out);
    law(&a->base, status == a->out.status, "an output that is written");
    law(&a->base, gib_speed_variation_step(gib_of(a, 1), &a->last, &twin) == status && memcmp(&twin, &a->out, sizeof twin) == 0,
        "the same inputs, the same outputs");
    /* The way back leads where the mean speed goes; what asks for less than the lowest, or for the other sense, leads there. */
    double sense = copysign(1.0, a->config.speed_rpm), wanted = sense * a->last.speed_rpm, mean = a->mean_rpm;
    if (was_busy && a->base.cycle > 1 && a->out.phase != GIB_SPEED_VARIATION_RUNNING && !(a->last.flags & GIB_INPUT_FAULT) &&
        isfinite(wanted) && wanted <= given(a->config.speed_max_rpm, 2e5) * (1.0 + 1e-9)) {
        a->mean_rpm = sense * fmax(wanted, fmax(a->config.speed_min_rpm, 0.001));
        a->way_rpm += fabs(a->mean_rpm - mean);
    }
    spoil(a);
    see_command(a);
    see_answer(a);
    see_effect(a, &before);
    follow(a);
    a->before = a->out;
    return a->out.status;
}

/* A way back: the mean speed and how far from it the command was when it began, and the fastest that it has been since. */
typedef struct {
    double mean_rpm, begun_rpm, fastest_rpm;
} way_back;

/*
 * Cycles that a way back may take under the load of this cycle: twice what it takes the motor, by what it has left at the fastest, or at
 * a tenth of the mean in a second where it has more; and a second. One that has nothing left has the time of one that has more; then,
 * and where the time is cut short, *cannot is set.
 */
static double time_for_the_way(const variation_adversary *a, const way_back *w, int *cannot)
{
    const gib_speed_variation_config *g = &a->config;
    double mean = spindle_rad_s(fabs(a->mean_rpm)), from = spindle_rad_s(w->fastest_rpm), fastest = fmax(mean, from);
    double used = g->coulomb_nm + fmax(g->cutting_nm, a->true_cutting_nm), keep = 1.0 - g->reserve_ratio;
    double most = keep * fmin(given(g->torque_nm, INFINITY), g->power_w / fastest), left = most - used - g->viscous_nm_s * fastest;
    double pace = 0.1 * spindle_rad_s(w->mean_rpm), way = spindle_rad_s(w->begun_rpm + a->way_rpm);
    if (g->formula == GIB_SPEED_VARIATION_EXACT) {
        /* Where the mean moves, the way may go up and down; friction helps to brake. */
        int up = mean > from || a->way_rpm > 0.0, down = mean <= from || a->way_rpm > 0.0;
        double per_nm = 0.9955 / (g->inertia_kg_m2 + g->own_inertia_kg_m2);
        double has[2] = {per_nm * left, per_nm * (left + used + g->coulomb_nm)};
        *cannot |= (up && has[0] <= 0.0) || (down && has[1] <= 0.0);
        pace = up && has[0] > 0.0 ? fmin(pace, has[0]) : pace;
        pace = down && has[1] > 0.0 ? fmin(pace, has[1]) : pace;
    }
    *cannot |= 2.0 * way / pace + 1.0 > 600.0;
    return (fmin(2.0 * way / pace, 600.0) + 1.0) / g->cycle_s + 3.0;
}

static void start(variation_adversary *a, int run)
{
    const gib_speed_variation_config *g = &a->config;
    gib_speed_variation_config scribbled = *g;
    gib_speed_variation *placed;
    spindle_config c = spindle_default();
    c.cycle_s = g->cycle_s;
    c.substeps = (int)fmax(4.0, ceil(c.cycle_s / 0.0001));
    c.bandwidth_1_s = fmin(60.0, 0.2 / c.cycle_s);
    c.inertia_kg_m2 = g->inertia_kg_m2 + g->own_inertia_kg_m2;
    c.coulomb_nm = g->coulomb_nm;
    c.viscous_nm_s = g->viscous_nm_s;
    c.ripple_nm = 0.0;
    c.torque_limit_nm = 1e12;
    spindle_init(&a->s, &c);
    /* The spindle turns at its mean speed, with what friction takes. */
    a->s.w = a->s.due = spindle_rad_s(g->speed_rpm);
    a->s.torque = copysign(g->coulomb_nm, g->speed_rpm) + g->viscous_nm_s * a->s.w;
    a->s.integral = a->s.torque / (c.bandwidth_1_s * c.inertia_kg_m2);
    a->base.run = run;
    a->base.cycle = a->named = a->steady = 0;
    a->loose_nm = a->true_cutting_nm = a->way_rpm = 0.0;
    a->in = (gib_speed_variation_input){g->speed_rpm, 0.0, 0.0, 0.0, 0, 0};
    a->mean_rpm = g->speed_rpm;
    for (int i = run; i < 2; i++) {
        memset(a->memory[i], 0x5a, sizeof a->memory[i]);
        law(&a->base, gib_speed_variation_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK,
            "an instance in memory of its own");
    }
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_speed_variation_start(gib_of(a, i), &scribbled) == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&a->last, 0x7f, sizeof a->last);
    memset(&a->before, 0, sizeof a->before);
    a->before.status = GIB_BUSY;
}

static void vary(variation_adversary *a, int run)
{
    const gib_speed_variation_config *g = &a->config;
    start(a, run);
    if (a->mistake == VARIATION_REMEMBERS && run == 1) {
        gib_speed_variation_input in = {0.9 * g->speed_rpm, 0.0, 0.0, 0.0, 0, 0};
        gib_speed_variation_step(gib_of(a, 0), &in, &a->out);
    }
    int last = run == 0 ? 1 << 30 : a->cycles - (int)(2.0 * g->period_s / g->cycle_s);
    a->high_rpm = 0.0;
    a->low_rpm = INFINITY;
    int32_t status = GIB_BUSY;
    double patience = 0.0, stood = fabs(g->speed_rpm);
    way_back w = {0};
    int cannot = 0;
    while (status == GIB_BUSY && !a->base.broken) {
        int was_named = a->named;
        double mean = fabs(a->mean_rpm);
        status = cycle(a);
        double speed = fabs(a->out.speed_command_rpm);
        if (a->base.cycle > last && a->out.phase == GIB_SPEED_VARIATION_RUNNING) {
            a->high_rpm = fmax(a->high_rpm, speed);
            a->low_rpm = fmin(a->low_rpm, speed);
        }
        if (a->named && !was_named) {
            /* What is asked for in this very cycle may count already, or not yet. */
            double now_rpm = fabs(a->mean_rpm);
            w = (way_back){fmin(mean, now_rpm), fmax(fabs(stood - mean), fabs(stood - now_rpm)), stood};
        }
        if (a->named) {
            w.fastest_rpm = a->way_rpm > 0.0 ? fmax(w.fastest_rpm, speed) : w.fastest_rpm;
            patience = fmax(patience, time_for_the_way(a, &w, &cannot));
        }
        stood = speed;
        law(&a->base, a->named == 0 || status != GIB_BUSY || a->base.cycle - a->named <= patience, "an end in time");
        law(&a->base, a->named || a->base.cycle <= a->cycles, "an end where it is asked for");
    }
    law(&a->base, status != GIB_ERR_SPEED_VARIATION_NONE || cannot, "given up only where the motor cannot");
    a->status[run] = status;
    law(&a->base, status == GIB_DONE ? a->out.message == 0 || a->out.message > GIB_ERR_SPEED_VARIATION_NONE - 1 : a->out.message == status,
        "a named end");
    /* But for a drive that trips, and for a motor that could not come back in all the time there was. */
    int there = (a->last.flags & GIB_INPUT_FAULT) != 0 || (a->named && (a->base.cycle - a->named) * g->cycle_s >= 0.99) ||
                fabs(a->out.speed_command_rpm - a->mean_rpm) <= 1e-6 * fabs(a->mean_rpm);
    law(&a->base, a->base.cycle == 1 || there, "an end at the mean speed");
    gib_speed_variation_input odd = {NAN, INFINITY, -INFINITY, NAN, 0xffffffffu, 0};
    gib_speed_variation_output after;
    for (int i = 0; i < 3; i++) {
        int32_t kept = gib_speed_variation_step(gib_of(a, 0), &odd, &after);
        law(&a->base, kept == status && after.torque_nm == 0.0 && isfinite(after.speed_command_rpm), "an end that is kept");
    }
}

/* Left alone it swings as far as asked for, and no further; of less the drive's own overshoot takes its part. */
static void see_swing(variation_adversary *a)
{
    const gib_speed_variation_config *g = &a->config;
    double mean = fabs(g->speed_rpm), q = g->amplitude_ratio, step = 5.0 * q * g->cycle_s / g->period_s + 1e-3 * q + 1e-9;
    law(&a->base, a->status[1] == GIB_DONE, "a variation without trouble");
    if (g->formula == GIB_SPEED_VARIATION_EXACT && q >= LEAST_AMPLITUDE) {
        law(&a->base, fabs(a->high_rpm / mean - 1.0 - q) <= step && fabs(1.0 - a->low_rpm / mean - q) <= step, "a swing as asked for");
    }
}

void variation_adversary_run(variation_adversary *a)
{
    vary(a, 0);
    if (!a->base.broken) {
        a->cycles = (int)ceil(5.0 * a->config.period_s / a->config.cycle_s) + 50;
        vary(a, 1);
        see_swing(a);
    }
}
