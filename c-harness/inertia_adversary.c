/* See inertia_adversary.h. */
#include "inertia_adversary.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *const inertia_trouble_names[INERTIA_TROUBLES] = {
    "torque stuck",    "torque dead",    "torque inverted", "torque NaN",    "torque infinite", "torque huge",
    "torque late",     "torque noisy",   "torque scaled",   "torque offset", "speed stuck",     "speed inverted",
    "speed NaN",       "speed infinite", "speed huge",      "speed late",    "speed noisy",     "speed scaled",
    "drive saturates", "drive trips",    "drive dies",      "drive refuses", "jammed",          "load",
    "cycles long",     "flag unknown",   "started anew",    "abort flag",    "abort call",      "finished"};

static double expected_s(const gib_inertia_config *g)
{
    double ramp_s = (fabs(g->speed_high_rpm) - g->speed_low_rpm) / g->acceleration_rpm_s;
    return g->mode == GIB_INERTIA_LISTEN ? g->listen_s : g->ramps * (2.7 * ramp_s + 2.0 * g->hold_s) + g->hold_s;
}

/* A loop that can follow its ramps, and a motor that has the torque. */
static void draw(inertia_adversary *a)
{
    spindle_config *c = &a->plant[0];
    gib_inertia_config *g = &a->config[0];
    *c = spindle_default();
    memset(g, 0, sizeof *g);
    g->struct_size = sizeof *g;
    g->cycle_s = c->cycle_s = random_over(&a->base.random, 0.000125, 0.004);
    c->substeps = (int)fmax(2.0, ceil(c->cycle_s / 0.0001));
    c->bandwidth_1_s = fmin(between(&a->base, 60.0, 120.0), 0.3 / c->cycle_s);
    c->seed = (uint64_t)between(&a->base, 1.0, 1e15);
    double top = random_over(&a->base.random, 200.0, 6000.0), ramp_s = random_over(&a->base.random, 0.3, 1.2);
    double sense = chance(&a->base, 0.3) ? -1.0 : 1.0;
    g->speed_high_rpm = sense * top;
    g->speed_low_rpm = between(&a->base, 0.05, 0.4) * top;
    g->acceleration_rpm_s = (top - g->speed_low_rpm) / fmax(ramp_s, 64.0 * c->cycle_s);
    ramp_s = (top - g->speed_low_rpm) / g->acceleration_rpm_s;
    g->takeup_s = between(&a->base, 0.1, 0.45) * ramp_s;
    g->hold_s = between(&a->base, 0.05, 0.3);
    g->ramps = (int32_t)between(&a->base, 1.0, 5.0);
    g->process_step = (int32_t)between(&a->base, 0.0, 10000.0);
    g->lag_limit_rpm = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 0.3, 1.0) * top;
    c->inertia_kg_m2 = random_over(&a->base.random, 0.01, 5.0);
    double pull = c->inertia_kg_m2 * spindle_rad_s(g->acceleration_rpm_s), rated = pull / between(&a->base, 0.2, 0.8);
    double friction = between(&a->base, 0.02, 0.5) * rated, viscous = between(&a->base, 0.0, 0.5);
    c->torque_limit_nm = 2.0 * rated;
    c->coulomb_nm = (1.0 - viscous) * friction;
    c->viscous_nm_s = viscous * friction / spindle_rad_s(top);
    c->ripple_nm = between(&a->base, 0.0, 0.03) * rated;
    c->ripples_per_turn = floor(between(&a->base, 1.0, 13.0));
    c->torque_noise_nm = chance(&a->base, 0.1) ? 0.0 : between(&a->base, 0.0, 0.03) * rated;
    c->torque_grid_nm = chance(&a->base, 0.3) ? between(&a->base, 0.001, 0.01) * rated : 0.0;
    c->speed_grid_rpm = chance(&a->base, 0.2) ? 0.0 : random_over(&a->base.random, 1e-6, 1e-4) * top;
    c->counts_per_turn = chance(&a->base, 0.2) ? 60.0 / (c->cycle_s * random_over(&a->base.random, 0.0005, 0.01) * top) : 0.0;
    c->torque_late_cycles = chance(&a->base, 0.2);
    if (chance(&a->base, 0.5)) {
        g->torque_bound_nm = 2.0 * (pull + friction) + c->ripple_nm + 7.0 * c->torque_noise_nm;
    } else {
        c->outlier_ratio = between(&a->base, 0.0, 0.01);
    }
    g->torque_unit = (int32_t)between(&a->base, 0.0, 3.0);
    g->rated_torque_nm = rated;
    if (g->torque_unit == GIB_TORQUE_AMPERE) {
        g->torque_constant_nm_a = c->torque_constant_nm_a = random_over(&a->base.random, 0.05, 5.0);
    }
    /* A weakened field and a motor that saturates, told or to be found. */
    if (chance(&a->base, 0.2)) {
        c->weakening_rpm = between(&a->base, 0.6, 1.1) * top;
        g->base_speed_rpm = chance(&a->base, 0.6) ? fmax(c->weakening_rpm, 1.01 * g->speed_low_rpm) : 0.0;
    }
    if (chance(&a->base, 0.2)) {
        c->saturation_nm = between(&a->base, 0.6, 1.1) * (pull + friction);
        g->saturation_nm = chance(&a->base, 0.6) ? c->saturation_nm : 0.0;
    }
    g->own_inertia_kg_m2 = chance(&a->base, 0.4) ? (chance(&a->base, 0.05) ? 1.1 : between(&a->base, 0.05, 0.45)) * c->inertia_kg_m2 : 0.0;
    g->own_uncertainty_kg_m2 = 0.01 * g->own_inertia_kg_m2;
    if (chance(&a->base, 0.2)) {
        g->mode = GIB_INERTIA_LISTEN;
        g->listen_s = fmax((5.4 * ramp_s + 4.0 * g->hold_s) * between(&a->base, 1.0, 1.5), 257.0 * g->cycle_s);
    }
    a->start_rpm = chance(&a->base, 0.6) ? 0.0 : sense * between(&a->base, -0.3, 1.3) * top;
}

void inertia_adversary_init(inertia_adversary *a, uint64_t seed, inertia_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    draw(a);
    double cycles = expected_s(&a->config[0]) / a->config[0].cycle_s;
    int count = chance(&a->base, 0.3) ? 0 : (int)between(&a->base, 1.0, INERTIA_MOST_TROUBLES + 1.0);
    troubles_draw(&a->base.troubles, &a->base.random, count, INERTIA_TROUBLES, cycles, 0.2, 0.4);
    /* Metal is cut off before the next process step. */
    a->plant[1] = a->plant[0];
    a->config[1] = a->config[0];
    a->plant[1].inertia_kg_m2 *= between(&a->base, 0.5, 0.95);
    a->plant[1].seed++;
    a->config[1].process_step = (a->config[0].process_step + 1) % 10000;
}

static gib_inertia *gib_of(inertia_adversary *a, int which)
{
    return (gib_inertia *)a->memory[which];
}

/* What the kernel tells of the spindle in this cycle. */
static void tell(inertia_adversary *a)
{
    const spindle_config *c = &a->plant[a->base.run];
    const gib_inertia_config *g = &a->config[a->base.run];
    static const double HUGE_ONES[] = {1e6, -1e9, 1e13, -1e30, DBL_MAX, -DBL_MAX};
    const trouble *t;
    gib_inertia_input *in = &a->told;
    double delivered = a->s.past[c->torque_late_cycles];
    spindle_reading r = spindle_sense(&a->s);
    double unit = g->torque_unit == GIB_TORQUE_PERMILLE ? 1e-3 * g->rated_torque_nm
                  : g->torque_unit == GIB_TORQUE_AMPERE ? c->torque_constant_nm_a
                                                        : 1.0;
    r.torque = g->torque_unit == GIB_TORQUE_PERMILLE ? r.torque / unit : r.torque;
    memmove(a->late + 1, a->late, sizeof a->late - sizeof *a->late);
    a->late[0] = r;
    *in = (gib_inertia_input){r.speed_rpm, r.torque, 0, 0};
    if ((t = now(&a->base, INERTIA_TORQUE_LATE)) != NULL) in->torque = a->late[1 + (int)(14.0 * t->size)].torque;
    if ((t = now(&a->base, INERTIA_SPEED_LATE)) != NULL) in->speed_rpm = a->late[1 + (int)(14.0 * t->size)].speed_rpm;
    if ((t = now(&a->base, INERTIA_TORQUE_NOISY)) != NULL) in->torque += t->size * between(&a->base, -1.0, 1.0) * c->torque_limit_nm / unit;
    if ((t = now(&a->base, INERTIA_SPEED_NOISY)) != NULL) in->speed_rpm += 0.2 * t->size * between(&a->base, -1.0, 1.0) * g->speed_high_rpm;
    if ((t = now(&a->base, INERTIA_TORQUE_SCALED)) != NULL) in->torque *= 0.5 + t->size;
    if ((t = now(&a->base, INERTIA_SPEED_SCALED)) != NULL) in->speed_rpm *= 0.8 + 0.4 * t->size;
    if ((t = now(&a->base, INERTIA_TORQUE_OFFSET)) != NULL) in->torque += (t->size - 0.5) * c->torque_limit_nm / unit;
    if (now(&a->base, INERTIA_TORQUE_INVERTED)) in->torque = -in->torque;
    if (now(&a->base, INERTIA_SPEED_INVERTED)) in->speed_rpm = -in->speed_rpm;
    if (now(&a->base, INERTIA_TORQUE_DEAD)) in->torque -= delivered / unit;
    a->stuck.torque = begins(&a->base, INERTIA_TORQUE_STUCK) ? in->torque : a->stuck.torque;
    a->stuck.speed_rpm = begins(&a->base, INERTIA_SPEED_STUCK) ? in->speed_rpm : a->stuck.speed_rpm;
    if (now(&a->base, INERTIA_TORQUE_STUCK)) in->torque = a->stuck.torque;
    if (now(&a->base, INERTIA_SPEED_STUCK)) in->speed_rpm = a->stuck.speed_rpm;
    if ((t = now(&a->base, INERTIA_TORQUE_HUGE)) != NULL) in->torque = HUGE_ONES[(int)(6.0 * t->size)];
    if ((t = now(&a->base, INERTIA_SPEED_HUGE)) != NULL) in->speed_rpm = HUGE_ONES[(int)(6.0 * t->size)];
    if (now(&a->base, INERTIA_TORQUE_NAN)) in->torque = NAN;
    if (now(&a->base, INERTIA_SPEED_NAN)) in->speed_rpm = NAN;
    if ((t = now(&a->base, INERTIA_TORQUE_INFINITE)) != NULL) in->torque = t->size < 0.5 ? -INFINITY : INFINITY;
    if ((t = now(&a->base, INERTIA_SPEED_INFINITE)) != NULL) in->speed_rpm = t->size < 0.5 ? -INFINITY : INFINITY;
    if (now(&a->base, INERTIA_DRIVE_TRIPS)) in->flags |= GIB_INPUT_FAULT;
    if (begins(&a->base, INERTIA_ABORT_FLAG)) in->flags |= GIB_INPUT_ABORT;
    if ((t = now(&a->base, INERTIA_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (3 + (int)(28.0 * t->size));
    if (begins(&a->base, INERTIA_FINISHED)) in->flags |= GIB_INERTIA_FINISH;
}

/* How the kernel turns the spindle while gib listens: up and down, every second time gentler. */
static double listened_rpm(const inertia_adversary *a)
{
    const gib_inertia_config *g = &a->config[a->base.run];
    double low = g->speed_low_rpm, top = fabs(g->speed_high_rpm), brisk = (top - low) / g->acceleration_rpm_s;
    double t = fmod(a->base.cycle * g->cycle_s, 2.0 * (brisk + brisk / 0.6) + 4.0 * g->hold_s), pace = brisk;
    if (t > 2.0 * (brisk + g->hold_s)) {
        t -= 2.0 * (brisk + g->hold_s);
        pace = brisk / 0.6;
    }
    double share = t < pace ? t / pace : t < pace + g->hold_s ? 1.0 : fmax(0.0, 1.0 - (t - pace - g->hold_s) / pace);
    return copysign(low + share * (top - low), g->speed_high_rpm);
}

/* The drive follows, or does not. */
static void drive(inertia_adversary *a)
{
    const spindle_config *c = &a->plant[a->base.run];
    const trouble *t;
    int listens = a->config[a->base.run].mode == GIB_INERTIA_LISTEN;
    a->command_rpm = a->out.owns_motion ? a->out.speed_command_rpm : listens ? listened_rpm(a) : a->start_rpm;
    a->refused_rpm = begins(&a->base, INERTIA_DRIVE_REFUSES) ? a->command_rpm : a->refused_rpm;
    a->command_rpm = now(&a->base, INERTIA_DRIVE_REFUSES) ? a->refused_rpm : a->command_rpm;
    t = now(&a->base, INERTIA_DRIVE_SATURATES);
    a->s.c.torque_limit_nm = t ? (0.1 + 0.5 * t->size) * c->torque_limit_nm : c->torque_limit_nm;
    if (now(&a->base, INERTIA_DRIVE_TRIPS) || now(&a->base, INERTIA_DRIVE_DIES)) {
        a->s.c.torque_limit_nm = 0.0;
    }
    t = now(&a->base, INERTIA_LOAD);
    a->s.c.cutting_nm = t ? 0.25 * t->size * c->torque_limit_nm : 0.0;
    int cycles = 1;
    if ((t = now(&a->base, INERTIA_CYCLES_LONG)) != NULL && chance(&a->base, t->size)) {
        cycles = 1 + (int)between(&a->base, 1.0, 4.0);
        a->extra += cycles - 1;
    }
    for (int i = 0; i < cycles; i++) {
        spindle_cycle(&a->s, a->command_rpm, 0.0);
    }
    if (now(&a->base, INERTIA_JAMMED)) {
        a->s.w = 0.0;
    }
}

/* Cycles that a move between two speeds may take at most. */
static double cycles_between(const gib_inertia_config *g, double from_rpm, double to_rpm)
{
    return fabs(to_rpm - from_rpm) / (g->acceleration_rpm_s * g->cycle_s) + 2.0;
}

/* Commands are numbers, go on from where they were at no more than the ramps' pace, and stay between start and ramps. */
static void see_command(inertia_adversary *a)
{
    const gib_inertia_config *g = &a->config[a->base.run];
    const gib_inertia_output *o = &a->out, *b = &a->before;
    double step = g->acceleration_rpm_s * g->cycle_s * (1.0 + 1e-9);
    law(&a->base, isfinite(o->speed_command_rpm), "a command that is a number");
    law(&a->base, o->progress_ratio >= 0.0 && o->progress_ratio <= 1.0, "a share that is done");
    law(&a->base, o->progress_ratio >= b->progress_ratio || b->status != GIB_BUSY, "a share that grows");
    if (!o->owns_motion) {
        return;
    }
    law(&a->base, o->status == GIB_BUSY && g->mode == GIB_INERTIA_RAMP, "a motion that is gib's");
    double from = b->owns_motion ? b->speed_command_rpm : a->told.speed_rpm, most = fmax(fabs(g->speed_high_rpm), fabs(a->first_rpm));
    law(&a->base, fabs(o->speed_command_rpm - from) <= step + 1e-9, "a command without a jump");
    law(&a->base, fabs(o->speed_command_rpm) <= most * (1.0 + 1e-9) + 1e-9, "a command within the ramps");
}

/* What is plainly wrong with an input is answered in its cycle, once and for all. */
static void see_answer(inertia_adversary *a, int was_busy)
{
    const gib_inertia_config *g = &a->config[a->base.run];
    const gib_inertia_output *o = &a->out;
    double unit = g->torque_unit == GIB_TORQUE_PERMILLE ? 1e-3 * g->rated_torque_nm
                  : g->torque_unit == GIB_TORQUE_AMPERE ? g->torque_constant_nm_a
                                                        : 1.0;
    uint32_t allowed = g->mode == GIB_INERTIA_LISTEN ? (uint32_t)GIB_INERTIA_FINISH : 0u;
    int wrong = !isfinite(a->told.speed_rpm) || !isfinite(a->told.torque) || (a->told.flags & ~allowed) != 0;
    wrong |= g->torque_bound_nm > 0.0 && fabs(a->told.torque * unit) > g->torque_bound_nm * (1.0 + 1e-9);
    law(&a->base, !(was_busy && wrong) || o->message < 0, "a fault in its cycle");
    law(&a->base, !(was_busy && (a->told.flags & GIB_INPUT_FAULT)) || (!o->owns_motion && o->status < 0),
        "a drive that trips is let go at once");
    law(&a->base, a->named == 0 || o->message == a->before.message, "the first fault kept");
    a->named = a->named == 0 && o->message < 0 ? a->base.cycle : a->named;
}

/* Mistakes put in on purpose. */
static void spoil(inertia_adversary *a)
{
    gib_inertia_output *o = &a->out;
    double top = a->config[a->base.run].speed_high_rpm;
    int late = a->base.cycle == 40;
    switch (a->mistake) {
    case INERTIA_JUMPS: o->speed_command_rpm += late ? 0.05 * top : 0.0; break;
    case INERTIA_TOO_FAST: o->speed_command_rpm += o->phase == GIB_INERTIA_HOLD_HIGH ? 1e-6 * top : 0.0; break;
    case INERTIA_NO_NUMBER: o->speed_command_rpm = late ? NAN : o->speed_command_rpm; break;
    case INERTIA_SAYS_NOTHING: o->message = 0; break;
    case INERTIA_NEVER_ENDS: o->status = a->base.run == 0 ? GIB_BUSY : o->status; break;
    default: break;
    }
}

static int32_t cycle(inertia_adversary *a)
{
    gib_inertia_output twin;
    int was_busy = a->before.status == GIB_BUSY;
    a->base.cycle++;
    if (a->base.run == 0 && !a->base.ended) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    tell(a);
    a->first_rpm = a->base.cycle == 1 ? a->told.speed_rpm : a->first_rpm;
    if (begins(&a->base, INERTIA_ABORT_CALL)) {
        law(&a->base, gib_inertia_abort(gib_of(a, 0)) == GIB_OK && gib_inertia_abort(gib_of(a, 1)) == GIB_OK, "an abort");
    }
    if (now(&a->base, INERTIA_STARTED_ANEW) && was_busy && !begins(&a->base, INERTIA_ABORT_CALL)) {
        gib_inertia_config other = a->config[1];
        gib_inertia_report none;
        other.speed_high_rpm *= -3.0;
        law(&a->base, gib_inertia_start(gib_of(a, 0), &other) == GIB_ERR_STATE, "a start while busy is refused");
        law(&a->base, gib_inertia_result(gib_of(a, 0), &none) == GIB_ERR_STATE, "no result while busy");
    }
    /* From somewhere on the other is a copy. */
    if (a->base.run == 0 && a->base.cycle == 100) {
        memcpy(a->memory[1], a->memory[0], sizeof a->memory[0]);
    }
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_inertia_step(gib_of(a, 0), &a->told, &a->out);
    law(&a->base, status == a->out.status, "an output that is written");
    law(&a->base, gib_inertia_step(gib_of(a, 1), &a->told, &twin) == status && memcmp(&twin, &a->out, sizeof twin) == 0,
        "the same inputs, the same outputs");
    spoil(a);
    see_command(a);
    see_answer(a, was_busy);
    drive(a);
    a->before = a->out;
    return a->out.status;
}

/* The result, by the one that met troubles and by the other: within bounds, or refused by name. */
static void see_result(inertia_adversary *a)
{
    const gib_inertia_config *g = &a->config[a->base.run];
    gib_inertia_report *r = &a->report[a->base.run], other;
    memset(&other, 0, sizeof other);
    int32_t result = gib_inertia_result(gib_of(a, 0), r);
    law(&a->base, gib_inertia_result(gib_of(a, 1), &other) == result && memcmp(r, &other, sizeof other) == 0,
        "the same inputs, the same result");
    a->result[a->base.run] = result;
    gib_inertia_last_error(gib_of(a, 0), &a->detail[a->base.run]);
    if (a->status[a->base.run] != GIB_DONE) {
        law(&a->base, result == GIB_ERR_STATE, "no result without an end");
        return;
    }
    int named = result == GIB_OK || (result <= GIB_ERR_INERTIA_EXCITATION && result >= GIB_ERR_INERTIA_TORQUE);
    law(&a->base, named && r->verdict == result && r->process_step == g->process_step, "a result that is refused by name");
    if (a->mistake == INERTIA_OFF) {
        r->total_kg_m2 *= 1.2;
    }
    if (result != GIB_OK) {
        return;
    }
    double truth = a->plant[a->base.run].inertia_kg_m2;
    a->error[a->base.run] = fabs(r->total_kg_m2 - truth) / truth;
    law(&a->base, isfinite(r->total_kg_m2) && r->total_uncertainty_kg_m2 > 0.0 && r->total_uncertainty_kg_m2 <= 0.34 * r->total_kg_m2,
        "a value with an uncertainty");
    law(&a->base, a->mistake || r->workpiece_kg_m2 == r->total_kg_m2 - g->own_inertia_kg_m2, "the machine's own taken off");
    law(&a->base, r->workpiece_kg_m2 > 0.0, "a workpiece that has an inertia");
}

int inertia_adversary_clean(const inertia_adversary *a, int run)
{
    const spindle_config *c = &a->plant[run];
    const gib_inertia_config *g = &a->config[run];
    int begun = run == 0 && troubles_met(&a->base.troubles) > 0;
    int untold = (c->weakening_rpm > 0.0 && g->base_speed_rpm == 0.0) || (c->saturation_nm > 0.0 && g->saturation_nm == 0.0);
    return !begun && !untold;
}

/* The value is right, as far as can be known. Nobody can know that a signal is scaled, or that cycles are longer than told; and of
 * one acceleration, or of one way only, the report says that it cannot exclude all. */
static void see_value(inertia_adversary *a)
{
    const gib_inertia_report *r = &a->report[a->base.run];
    int clean = inertia_adversary_clean(a, a->base.run), warned = r->one_acceleration || !r->both_ways;
    int unknowable = ever(&a->base, INERTIA_TORQUE_SCALED) || ever(&a->base, INERTIA_SPEED_SCALED) || ever(&a->base, INERTIA_CYCLES_LONG);
    /* Who turns the spindle must see that it does not turn. */
    unknowable |= a->config[0].mode == GIB_INERTIA_LISTEN && (ever(&a->base, INERTIA_DRIVE_REFUSES) || ever(&a->base, INERTIA_DRIVE_DIES) ||
                                                              ever(&a->base, INERTIA_JAMMED) || ever(&a->base, INERTIA_DRIVE_SATURATES));
    if (a->status[a->base.run] != GIB_DONE || a->result[a->base.run] != GIB_OK || unknowable || (warned && !clean)) {
        return;
    }
    double uncertainty = r->total_uncertainty_kg_m2 / a->plant[a->base.run].inertia_kg_m2;
    law(&a->base, a->error[a->base.run] <= fmax(clean && !warned ? 0.03 : 0.1, 3.0 * uncertainty), "a value that is right, or refused");
}

static void start(inertia_adversary *a, int run)
{
    gib_inertia *placed;
    gib_inertia_config scribbled = a->config[run];
    a->base.run = run;
    a->base.cycle = a->base.ended = a->named = 0;
    a->extra = 0.0;
    a->start_rpm = run == 0 ? a->start_rpm : 0.0;
    memset(&a->out, 0, sizeof a->out);
    spindle_init(&a->s, &a->plant[run]);
    for (int i = 0; a->start_rpm != 0.0 && i < (int)(0.5 / a->config[run].cycle_s); i++) {
        spindle_cycle(&a->s, a->start_rpm, 0.0);
    }
    /* The memory holds something before; of the next process step the first instance is the one that met the troubles. */
    for (int i = run; i < 2; i++) {
        memset(a->memory[i], 0xa5, sizeof a->memory[i]);
        law(&a->base, gib_inertia_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK, "an instance in memory of its own");
    }
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_inertia_start(gib_of(a, i), &scribbled) == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&a->before, 0, sizeof a->before);
    a->before.status = GIB_BUSY;
}

static void measure(inertia_adversary *a, int run)
{
    const gib_inertia_config *g = &a->config[run];
    start(a, run);
    if (a->mistake == INERTIA_REMEMBERS && run == 1) {
        gib_inertia_input in = {0.0, 1e-3, 0, 0};
        gib_inertia_step(gib_of(a, 0), &in, &a->out);
    }
    int32_t status = cycle(a);
    double low = copysign(g->speed_low_rpm, g->speed_high_rpm), start_rpm = isfinite(a->first_rpm) ? a->first_rpm : 0.0;
    double ramp = cycles_between(g, g->speed_low_rpm, fabs(g->speed_high_rpm)), hold = g->hold_s / g->cycle_s + 2.0;
    double longest = g->mode == GIB_INERTIA_LISTEN ? g->listen_s / g->cycle_s + 2.0
                                                   : 2.0 * cycles_between(g, start_rpm, low) + hold + g->ramps * (2.0 * hold + 2.0 * ramp / 0.6) + 4.0;
    /* A spindle that is told to turn too fast to be measured is refused in its first cycle. */
    while (status == GIB_BUSY && a->base.cycle < fmin(longest + 10.0, 1e6)) {
        double left = a->named ? cycles_between(g, a->out.speed_command_rpm, start_rpm) + 2.0 : INFINITY;
        status = cycle(a);
        law(&a->base, status != GIB_BUSY || left > 0.0, "a way out in time");
        if (a->base.broken) {
            break;
        }
    }
    law(&a->base, status != GIB_BUSY, "an end in time");
    a->base.ended = a->base.cycle;
    law(&a->base, (status == GIB_DONE && !a->out.message) || (status < 0 && a->out.message == status), "a named end");
    a->status[run] = status;
    /* An end that is kept, whatever is told. */
    gib_inertia_input odd = {NAN, INFINITY, 0xffffffffu, 0};
    gib_inertia_output after;
    for (int i = 0; i < 3; i++) {
        int32_t kept = gib_inertia_step(gib_of(a, 0), &odd, &after);
        law(&a->base, a->mistake == INERTIA_NEVER_ENDS || (kept == status && !after.owns_motion && isfinite(after.speed_command_rpm)),
            "an end that is kept");
    }
    see_result(a);
    see_value(a);
}

void inertia_adversary_run(inertia_adversary *a)
{
    measure(a, 0);
    if (!a->base.broken) {
        measure(a, 1);
    }
}
