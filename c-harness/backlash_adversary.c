/* See backlash_adversary.h. */
#include "backlash_adversary.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *const backlash_trouble_names[BACKLASH_TROUBLES] = {
    "torque stuck",       "torque dead",       "torque inverted", "torque no number",  "torque huge",       "torque late",
    "torque noisy",       "torque offset",     "position stuck",  "position inverted", "position no number", "position huge",
    "position jumps",     "position noisy",    "amount no number", "amount foreign",   "drive trips",       "drive dies",
    "jammed",             "friction",          "load",            "deaf kernel",       "late kernel",       "lying kernel",
    "answers wildly",     "command late",      "cycles lost",     "flag unknown",      "started anew",      "abort flag",
    "abort call",         "switched off"};

/* Cycles that a run may take at most: all ways at their speeds, twice, and the answers of the kernel. */
static double cycles_at_most(const gib_backlash_config *g)
{
    double limit = 1e-3 * g->detection_limit_um, stop = 2.0 * g->slide_speed_mm_s * g->slide_speed_mm_s / g->acceleration_mm_s2;
    double run_in = g->slide_mm + limit + g->lag_limit_mm + stop, scan = limit + g->lag_limit_mm;
    double reversals = g->repeats * (g->one_direction ? 1.0 : 2.0), speedup = g->slide_speed_mm_s / g->acceleration_mm_s2;
    double slow = g->mode == GIB_BACKLASH_STEP ? g->dwell_s / (1e-3 * g->step_um) : 1.0 / g->feed_mm_s;
    double approach = fabs(g->reference_1_mm) + fabs(g->reference_2_mm) + fabs(g->reference_1_mm - g->reference_2_mm) + run_in;
    double each = 2.0 * run_in / g->slide_speed_mm_s + 6.0 * speedup + g->settle_s + 2.0 * scan * slow + 4.0 * scan / g->slide_speed_mm_s;
    each += 2.0 * approach / g->approach_speed_mm_s + 2.0 * g->approach_speed_mm_s / g->acceleration_mm_s2;
    return 2.0 * (reversals * each + 2.0 * g->ack_timeout_s) / g->cycle_s + reversals * 3000.0;
}

/* An axis that a loop can hold and whose lost motion can be seen, and a configuration that allows for it. */
static void draw(backlash_adversary *a)
{
    plant_config *c = &a->c;
    gib_backlash_config *g = &a->config;
    double scale = over(&a->base, 0.1, 10.0);
    *c = plant_default();
    memset(g, 0, sizeof *g);
    g->struct_size = sizeof *g;
    g->cycle_s = c->cycle_s = over(&a->base, 0.00025, 0.002);
    c->substeps = (int)ceil(c->cycle_s / 0.0001);
    c->motor_inertia_nm_s2_mm *= scale * between(&a->base, 0.6, 1.6);
    c->table_inertia_nm_s2_mm *= scale * between(&a->base, 0.6, 1.6);
    c->velocity_gain_nm_s_mm *= scale * between(&a->base, 0.7, 1.2);
    c->position_gain_1_s = between(&a->base, 20.0, 50.0);
    c->friction_nm = scale * over(&a->base, 1.0, 4.0);
    c->motor_share = between(&a->base, 0.0, 0.4);
    c->stiffness_nm_mm = scale * over(&a->base, 80.0, 300.0);
    c->damping_nm_s_mm *= scale;
    c->clearance_mm = chance(&a->base, 0.2) ? 0.0 : over(&a->base, 0.003, 0.06);
    c->breakaway_ratio = between(&a->base, 1.0, 1.3);
    c->hold_ratio = between(&a->base, 0.5, 1.0);
    if (chance(&a->base, 0.4)) {
        double windup_mm = 2.0 * (1.0 - c->motor_share) * c->friction_nm / c->stiffness_nm_mm;
        c->presliding_mm = over(&a->base, 0.005, 0.15) * windup_mm;
        c->presliding_exponent = between(&a->base, 0.7, 1.5);
    }
    c->viscous_nm_s_mm = chance(&a->base, 0.5) ? 0.0 : scale * over(&a->base, 0.001, 0.05);
    /* A load that the table's friction holds well, or one on which it hangs. */
    int hangs = chance(&a->base, 0.15);
    double load = hangs                   ? (chance(&a->base, 0.5) ? -1.0 : 1.0) * between(&a->base, 1.2, 2.0)
                  : chance(&a->base, 0.3) ? between(&a->base, -0.3, 0.3)
                                          : 0.0;
    c->constant_nm = load * c->friction_nm;
    c->torque_noise_nm = chance(&a->base, 0.1) ? 0.0 : over(&a->base, 0.002, 0.06) * c->friction_nm;
    c->encoder_mm = over(&a->base, 0.00005, 0.001);
    c->torque_limit_nm = scale * 16.0;
    c->reversal_kick_nm = chance(&a->base, 0.3) ? between(&a->base, 0.1, 0.5) * c->friction_nm : 0.0;
    c->seed = (uint64_t)between(&a->base, 1.0, 1e15);
    a->answer_cycles = (int)between(&a->base, 0.0, 15.0);

    g->mode = chance(&a->base, 0.3) ? GIB_BACKLASH_STEP : GIB_BACKLASH_SLOW_FEED;
    g->first_direction = chance(&a->base, 0.3) ? -1 : chance(&a->base, 0.5);
    g->one_direction = chance(&a->base, 0.3);
    g->repeats = (int32_t)between(&a->base, 1.0, 3.0);
    g->measure_only = chance(&a->base, 0.1);
    g->dwell_s = fmax(0.004, 4.0 * c->cycle_s);
    g->feed_mm_s = between(&a->base, 0.2, 0.6);
    g->settle_s = between(&a->base, 0.05, 0.2);
    g->slide_speed_mm_s = over(&a->base, 0.5, 2.0);
    /* What the table takes to slide as fast as gib reads it. One that hangs never crosses the clearance. */
    double takes_nm = (1.0 - c->motor_share) * c->friction_nm + c->viscous_nm_s_mm * g->slide_speed_mm_s;
    a->truth_um = 1e3 * ((hangs ? 0.0 : c->clearance_mm) + 2.0 * takes_nm / c->stiffness_nm_mm);
    g->step_um = fmax(1.0, 0.02 * a->truth_um);
    g->detection_limit_um = between(&a->base, 2.0, 4.0) * fmax(a->truth_um, 15.0);
    g->approach_speed_mm_s = over(&a->base, 2.0, 20.0);
    g->slide_mm = between(&a->base, 0.3, 1.0);
    g->acceleration_mm_s2 = over(&a->base, 20.0, 100.0);
    g->travel_min_mm = -20.0;
    g->travel_max_mm = 20.0;
    g->torque_bound_nm = 2.0 * c->friction_nm + fabs(c->constant_nm) + 8.0 * c->torque_noise_nm + c->reversal_kick_nm + 2.0 * scale;
    g->lag_limit_mm = between(&a->base, 0.2, 0.5);
    g->ack_timeout_s = fmax(0.1, 30.0 * c->cycle_s);
    g->compensation_resolution_um = chance(&a->base, 0.5) ? 1.0 : 0.1;
    if (chance(&a->base, 0.3)) {
        g->references_given = 1;
        g->reference_1_mm = between(&a->base, -8.0, 8.0);
        g->reference_2_mm = between(&a->base, -8.0, 8.0);
    }
    if (chance(&a->base, 0.3)) {
        g->torque_unit = GIB_TORQUE_PERMILLE;
        g->rated_torque_nm = c->torque_limit_nm;
    }
    a->old_um = chance(&a->base, 0.3) ? 0.0 : floor(between(&a->base, 1.0, 30.0));
    a->longest = cycles_at_most(g);
}

void backlash_adversary_init(backlash_adversary *a, uint64_t seed, backlash_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    draw(a);
    int count = chance(&a->base, 0.25) ? 0 : (int)between(&a->base, 1.0, BACKLASH_MOST_TROUBLES + 1.0);
    troubles_draw(&a->base.troubles, &a->base.random, count, BACKLASH_TROUBLES, 0.3 * a->longest, 0.1, 0.4);
}

static gib_backlash *gib_of(backlash_adversary *a, int which)
{
    return (gib_backlash *)a->memory[which];
}

int backlash_adversary_clean(const backlash_adversary *a, int run)
{
    return run != 0 || troubles_met(&a->base.troubles) == 0;
}

/* What one unit of the torque that the drive reports is, N·m. */
static double unit_nm(const backlash_adversary *a)
{
    return a->config.torque_unit == GIB_TORQUE_PERMILLE ? 1e-3 * a->config.rated_torque_nm : 1.0;
}

/* The kernel carries out what it is asked for, in steps of what it can store, and answers; or does not. */
static void serve(backlash_adversary *a)
{
    const gib_backlash_output *o = &a->out;
    const trouble *t = now(&a->base, BACKLASH_LATE);
    double waits = a->answer_cycles + (t ? t->size / a->config.cycle_s : 0.0), grid = a->config.compensation_resolution_um;
    if (o->request_id != a->asked_id) {
        a->asked_id = o->request_id;
        a->asked_at = a->base.cycle;
    }
    if (begins(&a->base, BACKLASH_AMOUNT_FOREIGN)) {
        a->axis.compensation_um = a->foreign_um = floor(40.0 * now(&a->base, BACKLASH_AMOUNT_FOREIGN)->size);
        a->old_um = a->base.cycle == 1 ? a->foreign_um : a->old_um;
    }
    if (a->asked_id == a->done_id || a->base.cycle - a->asked_at < waits || now(&a->base, BACKLASH_DEAF)) {
        return;
    }
    a->done_id = a->asked_id;
    if (!now(&a->base, BACKLASH_LIAR)) {
        a->axis.compensation_um = grid * floor(o->compensation_um / grid + 0.5);
        a->axis.reversal_acceleration_on = !o->reversal_acceleration_off;
    }
}

/* The axis moves for a cycle toward what gib commands, or stays. */
static void drive(backlash_adversary *a)
{
    const trouble *t;
    a->command_mm = a->out.owns_motion ? a->out.target_position_mm : a->command_mm;
    memmove(a->late_mm + 1, a->late_mm, sizeof a->late_mm - sizeof *a->late_mm);
    a->late_mm[0] = a->command_mm;
    plant_config *c = &a->axis.c;
    *c = a->c;
    if (now(&a->base, BACKLASH_DRIVE_TRIPS) || now(&a->base, BACKLASH_DRIVE_DIES)) c->torque_limit_nm = 0.0;
    if ((t = now(&a->base, BACKLASH_FRICTION)) != NULL) c->friction_nm *= pow(4.0, 2.0 * t->size - 1.0);
    if ((t = now(&a->base, BACKLASH_LOAD)) != NULL) c->constant_nm += 2.0 * (t->size - 0.5) * c->friction_nm;
    if (now(&a->base, BACKLASH_JAMMED)) c->friction_nm *= 100.0;
    t = now(&a->base, BACKLASH_COMMAND_LATE);
    plant_reading r = plant_cycle(&a->axis, a->late_mm[t ? 1 + (int)(7.0 * t->size) : 0]);
    memmove(a->past + 1, a->past, sizeof a->past - sizeof *a->past);
    a->past[0] = r;
}

/* What the kernel tells gib. */
static void tell(backlash_adversary *a)
{
    static const double NONE[] = {NAN, INFINITY, -INFINITY}, HUGE_ONES[] = {1e4, -1e9, 1e15, -1e30, DBL_MAX, -DBL_MAX};
    const trouble *t;
    const double unit = unit_nm(a), delivered = a->past[0].torque_nm;
    gib_backlash_input *in = &a->told;
    memset(in, 0, sizeof *in);
    in->position_mm = a->past[0].position_mm - 0.5e-3 * a->axis.compensation_um * a->axis.command_sense;
    in->torque = delivered / unit;
    in->compensation_um = a->axis.compensation_um;
    in->acknowledged_id = a->done_id;
    if ((t = now(&a->base, BACKLASH_TORQUE_LATE)) != NULL) in->torque = a->past[1 + (int)(14.0 * t->size)].torque_nm / unit;
    if ((t = now(&a->base, BACKLASH_TORQUE_NOISY)) != NULL) in->torque += t->size * between(&a->base, -1.0, 1.0) * a->c.friction_nm / unit;
    if ((t = now(&a->base, BACKLASH_TORQUE_OFFSET)) != NULL) in->torque += (t->size - 0.5) * a->c.friction_nm / unit;
    if (now(&a->base, BACKLASH_TORQUE_INVERTED)) in->torque = -in->torque;
    if (now(&a->base, BACKLASH_TORQUE_DEAD)) in->torque = a->c.torque_noise_nm * plant_normal(&a->base.random) / unit;
    if ((t = now(&a->base, BACKLASH_POSITION_NOISY)) != NULL) in->position_mm += 0.01 * t->size * between(&a->base, -1.0, 1.0);
    if ((t = now(&a->base, BACKLASH_POSITION_JUMPS)) != NULL) in->position_mm += 4.0 * (t->size - 0.5);
    if (now(&a->base, BACKLASH_POSITION_INVERTED)) in->position_mm = -in->position_mm;
    a->stuck.torque_nm = begins(&a->base, BACKLASH_TORQUE_STUCK) ? in->torque : a->stuck.torque_nm;
    a->stuck.position_mm = begins(&a->base, BACKLASH_POSITION_STUCK) ? in->position_mm : a->stuck.position_mm;
    if (now(&a->base, BACKLASH_TORQUE_STUCK)) in->torque = a->stuck.torque_nm;
    if (now(&a->base, BACKLASH_POSITION_STUCK)) in->position_mm = a->stuck.position_mm;
    if ((t = now(&a->base, BACKLASH_TORQUE_HUGE)) != NULL) in->torque = HUGE_ONES[(int)(6.0 * t->size)];
    if ((t = now(&a->base, BACKLASH_POSITION_HUGE)) != NULL) in->position_mm = HUGE_ONES[(int)(6.0 * t->size)];
    if ((t = now(&a->base, BACKLASH_TORQUE_NO_NUMBER)) != NULL) in->torque = NONE[(int)(3.0 * t->size)];
    if ((t = now(&a->base, BACKLASH_POSITION_NO_NUMBER)) != NULL) in->position_mm = NONE[(int)(3.0 * t->size)];
    if ((t = now(&a->base, BACKLASH_AMOUNT_NO_NUMBER)) != NULL) in->compensation_um = NONE[(int)(3.0 * t->size)];
    if (now(&a->base, BACKLASH_ANSWERS_WILDLY)) in->acknowledged_id = (uint32_t)between(&a->base, 0.0, 5.0);
    if (now(&a->base, BACKLASH_DRIVE_TRIPS)) in->flags |= GIB_INPUT_FAULT;
    if (begins(&a->base, BACKLASH_ABORT_FLAG)) in->flags |= GIB_INPUT_ABORT;
    if ((t = now(&a->base, BACKLASH_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (3 + (int)(28.0 * t->size));
}

/* Commands are numbers, go on from where they were at no more than their speeds, and stay within the travel allowed. */
static void see_command(backlash_adversary *a)
{
    const gib_backlash_config *g = &a->config;
    const gib_backlash_output *o = &a->out, *b = &a->before;
    double fastest = fmax(fmax(g->approach_speed_mm_s, g->slide_speed_mm_s), g->feed_mm_s) * (1.0 + 1e-9);
    double step = fmax(fastest * g->cycle_s, g->mode == GIB_BACKLASH_STEP ? 1e-3 * g->step_um : 0.0) + 1e-9;
    law(&a->base, isfinite(o->target_position_mm) && isfinite(o->target_speed_mm_s), "a command that is a number");
    law(&a->base, isfinite(o->compensation_um) && isfinite(o->remaining_mm), "an amount that is a number");
    law(&a->base, o->progress_ratio >= 0.0 && o->progress_ratio <= 1.0, "a share that is done");
    law(&a->base, o->compensation_um >= 0.0 && o->compensation_um <= fmax(g->detection_limit_um, a->old_um) + 40.0,
        "an amount within bounds");
    if (!o->owns_motion) {
        return;
    }
    double from = b->owns_motion ? b->target_position_mm : a->told.position_mm;
    law(&a->base, fabs(o->target_speed_mm_s) <= fastest, "a speed within bounds");
    law(&a->base, fabs(o->target_position_mm - from) <= step, "a command without a jump");
    law(&a->base, o->target_position_mm >= g->travel_min_mm && o->target_position_mm <= g->travel_max_mm, "a command within the travel");
    law(&a->base, o->status == GIB_BUSY, "a motion while busy only");
}

/* What is plainly wrong with an input is answered in its cycle, once and for all. */
static void see_answer(backlash_adversary *a, int was_busy)
{
    const gib_backlash_config *g = &a->config;
    const gib_backlash_output *o = &a->out;
    const gib_backlash_input *in = &a->told;
    int wrong = !isfinite(in->position_mm) || !isfinite(in->torque) || !isfinite(in->compensation_um) || in->flags != 0;
    wrong |= fabs(in->torque * unit_nm(a)) > g->torque_bound_nm * (1.0 + 1e-9);
    wrong |= in->position_mm < g->travel_min_mm || in->position_mm > g->travel_max_mm;
    law(&a->base, !(was_busy && wrong) || o->message < 0, "a fault in its cycle");
    law(&a->base, !(was_busy && (in->flags & GIB_INPUT_FAULT) && !a->named) || o->target_speed_mm_s == 0.0,
        "a drive that trips is commanded nothing");
    int owed = o->message == GIB_ERR_RESTORE_UNCONFIRMED && o->status < 0;
    /* Once it has ended, what an operator wished for begins. */
    int wished = ever(&a->base, BACKLASH_SWITCHED_OFF);
    law(&a->base, a->named == 0 || o->message == a->before.message || owed || wished || o->message == o->status, "the first fault kept");
    a->named = a->named == 0 && o->message < 0 ? a->base.cycle : a->named;
}

/* Mistakes put in on purpose. */
static void spoil(backlash_adversary *a)
{
    gib_backlash_output *o = &a->out;
    int late = a->base.cycle == 100;
    switch (a->mistake) {
    case BACKLASH_JUMPS: o->target_position_mm += late ? 0.2 : 0.0; break;
    case BACKLASH_NO_NUMBER: o->target_position_mm = late ? NAN : o->target_position_mm; break;
    case BACKLASH_SAYS_NOTHING: o->message = 0; break;
    case BACKLASH_NEVER_ENDS: o->status = a->base.run == 0 ? GIB_BUSY : o->status; break;
    case BACKLASH_KEEPS: o->compensation_um = o->message < 0 ? 0.0 : o->compensation_um; break;
    case BACKLASH_FORGETS: o->reversal_acceleration_off |= o->message < 0; break;
    default: break;
    }
}

static int32_t cycle(backlash_adversary *a)
{
    gib_backlash_output twin;
    int was_busy = a->before.status == GIB_BUSY;
    a->base.cycle++;
    if (a->base.run == 0 && !a->base.ended) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    const trouble *lost = now(&a->base, BACKLASH_CYCLES_LOST);
    do {
        drive(a);
        serve(a);
    } while (lost && chance(&a->base, 0.5 * lost->size));
    tell(a);
    if (begins(&a->base, BACKLASH_ABORT_CALL)) {
        law(&a->base, gib_backlash_abort(gib_of(a, 0)) == GIB_OK && gib_backlash_abort(gib_of(a, 1)) == GIB_OK, "an abort");
    }
    if (begins(&a->base, BACKLASH_SWITCHED_OFF) && was_busy) {
        law(&a->base, gib_backlash_enable(gib_of(a, 0), 0) == GIB_OK && gib_backlash_enable(gib_of(a, 1), 0) == GIB_OK, "switching off");
    }
    if (now(&a->base, BACKLASH_STARTED_ANEW) && was_busy && !begins(&a->base, BACKLASH_ABORT_CALL)) {
        gib_backlash_config other = a->config;
        other.slide_speed_mm_s *= 5.0;
        law(&a->base, gib_backlash_start(gib_of(a, 0), &other) == GIB_ERR_STATE, "a start while busy is refused");
    }
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_backlash_step(gib_of(a, 0), &a->told, &a->out);
    law(&a->base, status == a->out.status, "an output that is written");
    /* Of the next run the second instance is new and counts its requests from 1. */
    gib_backlash_input its = a->told;
    its.acknowledged_id -= its.acknowledged_id > a->counted ? a->counted : its.acknowledged_id;
    law(&a->base, gib_backlash_step(gib_of(a, 1), &its, &twin) == status, "the same inputs, the same status");
    twin.compensation_um = twin.request_id ? twin.compensation_um : a->out.compensation_um;
    twin.request_id += a->counted;
    law(&a->base, memcmp(&twin, &a->out, sizeof twin) == 0, a->base.run ? "nothing left behind" : "the same inputs, the same outputs");
    spoil(a);
    see_command(a);
    see_answer(a, was_busy);
    a->before = a->out;
    return a->out.status;
}

/* The value is right, as far as can be known, and the amount that was written is the value. */
static void see_value(backlash_adversary *a)
{
    const gib_backlash_config *g = &a->config;
    gib_backlash_report *r = &a->report[a->base.run];
    /* Who is switched off rests in the end, and the report keeps why the run ended. */
    int switched_off = a->status[a->base.run] == GIB_OK && ever(&a->base, BACKLASH_SWITCHED_OFF);
    law(&a->base, gib_backlash_result(gib_of(a, 0), r) == GIB_OK && (r->status == a->status[a->base.run] || (switched_off && r->status == GIB_ERR_DISABLED)), "a report of the end");
    if (a->status[a->base.run] != GIB_DONE) {
        law(&a->base, !r->written, "nothing written without an end");
        return;
    }
    if (a->mistake == BACKLASH_OFF) {
        r->mean.lost_motion_um *= 1.33;
    }
    double grid = g->compensation_resolution_um, found = r->mean.lost_motion_um, uncertainty = r->mean.uncertainty_um;
    law(&a->base, found > 0.0 && found <= g->detection_limit_um && uncertainty > 0.0 && uncertainty <= 0.5 * found,
        "a value with an uncertainty");
    law(&a->base, r->written == !g->measure_only, "an amount that is written, or not to be");
    law(&a->base, !r->written || a->mistake || fabs(r->value_written_um - found) <= 1e-9 * found, "the amount that was found");
    law(&a->base, !r->written || fabs(r->value_active_um - r->value_written_um) <= grid, "the amount in force");
    int clean = backlash_adversary_clean(a, a->base.run);
    /* Nobody can know what the friction, and so the wind-up, was to be; nor by how much a torque is late, which is as good as
     * friction of the motor's. */
    int unknowable = ever(&a->base, BACKLASH_FRICTION) || ever(&a->base, BACKLASH_JAMMED) || ever(&a->base, BACKLASH_LOAD) ||
                     ever(&a->base, BACKLASH_TORQUE_LATE);
    double allowed = fmax(clean ? 0.5 + 0.03 * a->truth_um : 2.0 + 0.15 * a->truth_um, 3.0 * uncertainty);
    law(&a->base, unknowable || fabs(found - a->truth_um) <= allowed, "a value that is right, or refused");
}

/* All is well again: what was changed is put back, but for the amount that was found; or it is owed, and said so. */
static void see_restored(backlash_adversary *a)
{
    gib_backlash_report r;
    int cycles = (int)(a->config.ack_timeout_s / a->config.cycle_s) + 20;
    double grid = a->config.compensation_resolution_um;
    gib_backlash_result(gib_of(a, 0), &r);
    if (r.restore_owed || ever(&a->base, BACKLASH_LIAR)) {
        law(&a->base, !r.restore_owed || a->out.message == GIB_ERR_RESTORE_UNCONFIRMED, "a restore that is owed is said to be");
        a->done_id = a->asked_id ? a->asked_id - 1 : 0; /* the operator has the kernel look again */
    }
    for (int i = 0; i < cycles; i++) {
        cycle(a);
    }
    if (ever(&a->base, BACKLASH_SWITCHED_OFF)) {
        int32_t on = gib_backlash_enable(gib_of(a, 0), 1);
        law(&a->base, gib_backlash_enable(gib_of(a, 1), 1) == on, "the same inputs, the same status");
        for (int i = 0; i < cycles; i++) {
            cycle(a);
        }
    }
    /* An axis at rest stands where it is commanded to. */
    a->command_mm = a->axis.x;
    for (int i = 0; i < (int)(0.5 / a->config.cycle_s); i++) {
        drive(a);
    }
    gib_backlash_result(gib_of(a, 0), &r);
    law(&a->base, !r.restore_owed && a->axis.reversal_acceleration_on, "what was changed is put back");
    double wanted = r.written ? r.value_written_um : a->old_um;
    int others = ever(&a->base, BACKLASH_AMOUNT_FOREIGN) && fabs(a->axis.compensation_um - a->foreign_um) <= grid;
    law(&a->base, others || fabs(a->axis.compensation_um - wanted) <= grid, "the amount is put back");
}

static void start(backlash_adversary *a, int run)
{
    gib_backlash *placed;
    gib_backlash_config scribbled = a->config;
    a->base.run = run;
    a->base.cycle = a->base.ended = a->named = 0;
    a->counted = run ? a->out.request_id : 0;
    memset(a->past, 0, sizeof a->past);
    for (int i = run; i < 2; i++) {
        /* The memory holds something before. */
        memset(a->memory[i], 0xa5, sizeof a->memory[i]);
        law(&a->base, gib_backlash_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK, "an instance in memory of its own");
    }
    if (run == 0) {
        plant_init(&a->axis, &a->c);
        a->axis.compensation_um = a->old_um;
    }
    a->old_um = a->axis.compensation_um;
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_backlash_start(gib_of(a, i), &scribbled) == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&a->before, 0, sizeof a->before);
    a->before.status = GIB_BUSY;
}

static void measure(backlash_adversary *a, int run)
{
    const gib_backlash_config *g = &a->config;
    start(a, run);
    if (a->mistake == BACKLASH_REMEMBERS && run == 1) {
        gib_backlash_input in = a->told;
        in.acknowledged_id = 0;
        gib_backlash_step(gib_of(a, 0), &in, &a->out);
    }
    double way_out = fmax(g->approach_speed_mm_s, g->slide_speed_mm_s) / (g->acceleration_mm_s2 * g->cycle_s) + g->ack_timeout_s / g->cycle_s + 10.0;
    int32_t status;
    do {
        status = cycle(a);
    } while (status == GIB_BUSY && a->base.cycle < a->longest && (!a->named || a->base.cycle - a->named <= way_out) && !a->base.broken);
    law(&a->base, status != GIB_BUSY || !a->named, "a way out in time");
    law(&a->base, status != GIB_BUSY, "an end in time");
    a->status[run] = status;
    /* Who is switched off before the first cycle has nothing to put back, and rests. */
    int rests = status == GIB_OK && ever(&a->base, BACKLASH_SWITCHED_OFF);
    law(&a->base, (status == GIB_DONE && !a->out.message) || ((status < 0 || rests) && a->out.message < 0), "a named end");
    law(&a->base, !a->out.owns_motion && !a->out.reversal_acceleration_off, "an end that lets go");
    see_value(a);
    a->base.ended = a->base.cycle;
    if (!a->base.broken) {
        see_restored(a);
    }
}

void backlash_adversary_run(backlash_adversary *a)
{
    measure(a, 0);
    if (!a->base.broken) {
        measure(a, 1);
    }
}
