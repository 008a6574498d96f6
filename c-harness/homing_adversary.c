/* See homing_adversary.h. */
#include "homing_adversary.h"
#include "homing_axes.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const char *const NAMES[TROUBLES - FAULTS] = {
    "answers late", "answers twice", "answers early", "answers wildly", "numbers burst", "torque spikes",
    "torque offset", "limit flickers", "command late", "other config", "called to abort"};

const char *homing_trouble_name(int kind)
{
    return kind < FAULTS ? homing_fault_names[kind] : NAMES[kind - FAULTS];
}

static int chance(homing_adversary *a, double share)
{
    return homing_plant_uniform(&a->random) < share;
}

static double between(homing_adversary *a, double low, double high)
{
    return homing_between(&a->random, low, high);
}

static void draw_config(homing_adversary *a, homing_plant_config *c, gib_homing_config *g)
{
    memset(g, 0, sizeof *g);
    c->stop_mm[0] = c->stop_mm[1] = between(a, 1.2, 3.0);
    c->answer_cycles = (int)between(a, 0.0, 15.0);
    c->motors = chance(a, 0.3) ? 2 : 1;
    if (c->motors == 2) {
        c->beam_nm_mm = homing_over(&a->random, 3.0, 60.0);
        c->stop_mm[1] += chance(a, 0.5) ? between(a, -0.1, 0.1) : 0.0;
    }
    g->struct_size = sizeof *g;
    g->direction = c->sense > 0.0 ? 1 : -1;
    g->motors = c->motors;
    g->cycle_s = c->cycle_s;
    g->method = chance(a, 0.2);
    g->position_unit = chance(a, 0.3);
    g->lag_reduction = chance(a, 0.3);
    g->unacknowledged = chance(a, 0.2) ? (uint32_t)between(a, 1.0, 8.0) : 0u;
    g->touches = (int32_t)between(a, 1.0, 4.0);
    g->torque_limit_nm = between(a, 4.0, 8.0);
    g->approach_speed_mm_s = chance(a, 0.5) ? 0.0 : homing_over(&a->random, 0.5, 10.0);
    g->distance_min_mm = chance(a, 0.3) ? between(a, 0.0, 1.1) * c->stop_mm[0] : 0.0;
    g->distance_max_mm = c->stop_mm[0] + between(a, 0.3, 2.0);
    g->time_limit_s = chance(a, 0.1) ? homing_over(&a->random, 0.05, 20.0) : 0.0;
    g->set_position_mm = between(a, -100.0, 100.0);
    g->zero_offset_mm = chance(a, 0.2) ? 0.0 : between(a, 0.0, 2.0);
    g->zero_offset_speed_mm_s = chance(a, 0.5) ? 0.0 : homing_over(&a->random, 0.5, 30.0);
    g->retract_mm = between(a, 0.3, 1.0);
    g->ack_timeout_s = fmax(0.1, 30.0 * c->cycle_s);
    if (chance(a, 0.3)) {
        g->torque_unit = GIB_TORQUE_PERMILLE;
        g->rated_torque_nm = 8.0;
        c->torque_unit_nm = 0.008;
    }
    if (chance(a, 0.2)) {
        g->torque_inverted = 1;
        c->torque_unit_nm = c->torque_unit_nm == 0.0 ? -1.0 : -c->torque_unit_nm;
    }
}

/* Troubles of the kernel and of the way are both sides'. */
static int of_one_side(int kind)
{
    return (kind >= FAULT_TORQUE_NAN && kind <= FAULT_ENCODER_INF) || kind == FAULT_NOT_FOLLOWED || kind == FAULT_STOP_GONE ||
           kind == FAULT_STOP_EARLY || (kind >= FAULT_TORQUE_STUCK && kind <= FAULT_ENCODER_JUMPS && kind != FAULT_TORQUE_NOISY);
}

void homing_adversary_init(homing_adversary *a, uint64_t seed)
{
    memset(a, 0, sizeof *a);
    a->random = seed;
    homing_plant_config c = homing_random_axis(&a->random);
    draw_config(a, &c, &a->scribbled);
    a->stop_mm = c.stop_mm[0];
    a->troubles = (int)between(a, 0.0, HOMING_TROUBLES + 1.0);
    for (int i = 0; i < a->troubles; i++) {
        homing_trouble *t = &a->trouble[i];
        t->kind = (int)between(a, 1.0, TROUBLES);
        t->side = of_one_side(t->kind) && chance(a, 0.5) ? (int)between(a, 0.0, c.motors) : -1;
        t->state = (homing_state)between(a, 0.0, STATES);
        t->after = chance(a, 0.2) ? 0 : (int)homing_over(&a->random, 1.0, 1500.0);
        t->lasts = chance(a, 0.4) ? 1 << 30 : (int)homing_over(&a->random, 1.0, 2000.0);
    }
    /* The caller's configuration is its own again once the start has returned. */
    if (homing_world_start(&a->world, &c, &a->scribbled) != GIB_OK) {
        a->broken = "the start";
    }
    memset(&a->scribbled, 0x7f, sizeof a->scribbled);
}

static void law(homing_adversary *a, int holds, const char *what)
{
    if (!holds && !a->broken) {
        a->broken = what;
        a->broken_at = a->cycles;
    }
}

/* Troubles begin and end. */
static void stir(homing_adversary *a)
{
    homing_plant *p = &a->world.plant;
    homing_state state = homing_world_state(&a->world);
    a->in_state = state == a->state ? a->in_state + 1 : 0;
    a->state = state;
    for (int i = 0; i < a->troubles; i++) {
        homing_trouble *t = &a->trouble[i];
        if (!t->begun && state == t->state && a->in_state >= t->after) {
            t->begun = a->cycles;
            if (t->kind < FAULTS) {
                homing_plant_break(p, (homing_fault)t->kind, t->side);
            } else if (t->kind == CALLED_TO_ABORT) {
                gib_homing_abort(homing_world_gib(&a->world));
            }
        }
        if (t->begun && !t->over && a->cycles - t->begun >= t->lasts) {
            t->over = 1;
            if (t->kind < FAULTS) {
                homing_plant_mend(p, (homing_fault)t->kind);
            }
        }
    }
}

/* Whether such a trouble is there now, or was. */
static int now(const homing_adversary *a, int kind)
{
    for (int i = 0; i < a->troubles; i++) {
        if (a->trouble[i].kind == kind && a->trouble[i].begun && !a->trouble[i].over) {
            return 1;
        }
    }
    return 0;
}

static int ever(const homing_adversary *a, int kind)
{
    for (int i = 0; i < a->troubles; i++) {
        if (a->trouble[i].kind == kind && a->trouble[i].begun) {
            return 1;
        }
    }
    return 0;
}

/* Whether such a trouble was there in that cycle. */
static int lasts_till(const homing_adversary *a, int kind, int cycle)
{
    for (int i = 0; i < a->troubles; i++) {
        const homing_trouble *t = &a->trouble[i];
        if (t->kind == kind && t->begun && t->begun <= cycle && cycle - t->begun <= t->lasts) {
            return 1;
        }
    }
    return 0;
}

static void tamper(homing_adversary *a, gib_homing_input *in)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY}, HUGE_NM[] = {1e3, -1e3, 1e30, DBL_MAX, -DBL_MAX};
    const double unit = fabs(a->world.plant.c.torque_unit_nm != 0.0 ? a->world.plant.c.torque_unit_nm : 1.0);
    uint32_t asked = a->world.plant.out.request_id;
    in->acknowledged_id -= now(a, ANSWERS_TWICE) && a->cycles % 3 != 0;
    in->acknowledged_id = now(a, ANSWERS_EARLY) ? asked + 1u : in->acknowledged_id;
    in->acknowledged_id = now(a, ANSWERS_WILDLY) ? (uint32_t)between(a, 0.0, 5.0) : in->acknowledged_id;
    if (now(a, NUMBERS_BURST) && chance(a, 0.3)) {
        double *one[] = {&in->position_mm[0], &in->torque[0], &in->position_mm[1], &in->torque[1], &in->torque_limit};
        *one[(int)between(a, 0.0, 5.0)] = ODD[(int)between(a, 0.0, 3.0)];
    }
    if (now(a, TORQUE_SPIKES) && chance(a, 0.1)) {
        in->torque[chance(a, 0.5)] = HUGE_NM[(int)between(a, 0.0, 5.0)] / (unit < 1.0 ? 1.0 : unit);
    }
    if (now(a, TORQUE_OFFSET)) {
        in->torque[0] += 2.0 / unit;
    }
    if (now(a, LIMIT_FLICKERS)) {
        in->torque_limit *= between(a, 0.9, 1.1);
    }
}

/* Whether gib was told what is no number, of a motor that it moves. */
static int unreadable(const homing_adversary *a, const gib_homing_input *in)
{
    for (int i = 0; i < a->world.plant.c.motors; i++) {
        if (!isfinite(in->position_mm[i]) || !isfinite(in->torque[i])) {
            return 1;
        }
    }
    return 0;
}

static double given(double value, double otherwise)
{
    return value == 0.0 ? otherwise : value;
}

/* Commands go on from where they were, at no more than their speeds, or jump to where the axis is, and say so. */
static void see_command(homing_adversary *a, const gib_homing_input *in)
{
    const gib_homing_config *g = &a->world.config;
    const gib_homing_output *o = &a->world.plant.out, *b = &a->before;
    double approach = given(g->approach_speed_mm_s, 1.0), fastest = fmax(approach, g->zero_offset_speed_mm_s);
    double speed = fastest + given(g->acceleration_mm_s2, 50.0) * g->cycle_s;
    int may_jump = o->stop_drive || b->phase == GIB_HOMING_LIMIT ||
                   (o->new_events & (GIB_HOMING_EVENT_CLEAR_REQUESTED | GIB_HOMING_EVENT_CLEARED)) != 0;
    law(a, homing_brakes(g, b, o, a->world.plant.c.motors), "braking from the speed before");
    for (int i = 0; i < a->world.plant.c.motors; i++) {
        double target = o->target_position_mm[i];
        law(a, isfinite(target) && isfinite(o->target_speed_mm_s[i]), "a command that is a number");
        law(a, fabs(o->target_speed_mm_s[i]) <= speed * (1.0 + 1e-9), "a speed within bounds");
        if (!b->owns_motion || !o->owns_motion) {
            continue;
        }
        int goes_on = fabs(target - b->target_position_mm[i]) <= speed * g->cycle_s * (1.0 + 1e-9) + 1e-12;
        /* What breaks a bound is not taken in. */
        int jumps = target == in->position_mm[i] || target == a->told[0][i] || target == a->told[1][i];
        law(a, goes_on || (may_jump && jumps), "a command without a jump");
        /* With the drive stopped what is commanded does not count. */
        law(a, jumps || o->stop_drive || g->direction * target <= g->distance_max_mm + 1e-9, "a command within the way");
    }
}

/* Each event once, in order, none after a fault. */
static void see_events(homing_adversary *a)
{
    const gib_homing_output *o = &a->world.plant.out;
    law(a, (o->new_events & a->events) == 0, "each event once");
    law(a, a->events == 0 || o->new_events == 0 || o->new_events > a->events, "events in order");
    law(a, o->new_events == 0 || o->message == 0, "no event after a fault");
    a->events |= o->new_events;
    law(a, a->events == o->events, "all events kept");
    law(a, (o->status == GIB_DONE) == ((o->events & GIB_HOMING_EVENT_HOMED) != 0), "homed is told by its event");
}

/* What is plainly wrong with an input is answered in its cycle. */
static void see_answer(homing_adversary *a, const gib_homing_input *in)
{
    const gib_homing_output *o = &a->world.plant.out;
    if (a->before.status != GIB_BUSY) {
        return;
    }
    int dead = unreadable(a, in) || (in->flags & GIB_INPUT_FAULT) != 0;
    law(a, !(dead || in->flags != 0) || o->message != 0, "a fault in its cycle");
    law(a, !dead || o->stop_drive || (in->flags & GIB_INPUT_ABORT), "the drive stopped in its cycle");
}

/* Whether, on the way out, chips grew against the table or an encoder stood for a while and then jumped: once the drive has its
 * old limit it answers with that. */
static int struck(const homing_adversary *a)
{
    for (int i = 0; i < a->troubles; i++) {
        const homing_trouble *t = &a->trouble[i];
        if ((t->kind == FAULT_CHIPS || t->kind == FAULT_ENCODER_FROZEN) && a->named && t->begun > a->named) {
            return 1;
        }
    }
    return 0;
}

/* Torque and way of the real motors and tables. */
static void see_world(homing_adversary *a, const gib_homing_input *in)
{
    const homing_plant *p = &a->world.plant;
    const gib_homing_config *g = &a->world.config;
    /* While the drive has the limit, and on the way out after it; once the position was to be set, off the stop, and with an
     * encoder that jumps, the drive is on its own. */
    a->limited |= p->limit_nm < p->c.torque_limit_nm;
    a->set |= p->out.phase == GIB_HOMING_SET;
    int unlimited = !a->limited || a->set || ever(a, FAULT_LIMIT_IGNORED) || ever(a, FAULT_LIMIT_LOST) ||
                    ever(a, FAULT_ENCODER_JUMPS) || struck(a);
    /* After the end the kernel's servo may pull at what still holds the axis. */
    unlimited |= a->ended && ever(a, FAULT_TIGHT_SPOT);
    /* Then a command of rest follows the encoder, a step of which is a speed that the servo answers. */
    double answer = a->ended ? p->c.velocity_gain_nm_s_mm * p->c.encoder_mm / p->c.cycle_s : 0.0;
    for (int i = 0; i < p->c.motors; i++) {
        const homing_plant_side *s = &p->side[i];
        double lie = s->x - p->c.sense * in->position_mm[i];
        a->lie_mm[i] = isfinite(lie) ? fmax(a->lie_mm[i], lie) : a->lie_mm[i];
        /* A stop that breaks away or gives way lets go of an axis under torque, which no command holds at once, and none
         * at all while its encoder stands. */
        double flies = ever(a, FAULT_STOP_GONE) || ever(a, FAULT_STOP_SOFT) ? 1.0 : 0.0;
        flies = flies > 0.0 && ever(a, FAULT_ENCODER_FROZEN) ? INFINITY : flies;
        law(a, s->y <= g->distance_max_mm + p->c.clearance_mm + a->lie_mm[i] + flies, "the way");
        /* A drive that limits late takes the time of its current loop to come down. */
        int falls = a->limited && fabs(s->torque) < a->torque_nm[i];
        a->torque_nm[i] = fabs(s->torque);
        law(a, unlimited || falls || fabs(s->torque) <= g->torque_limit_nm + answer + 1e-9, "the torque limit");
    }
}

static void cycle(homing_adversary *a)
{
    homing_world *w = &a->world;
    homing_plant *p = &w->plant;
    gib_homing_input in;
    a->cycles++;
    if (!a->ended) {
        stir(a);
    }
    p->c.answer_cycles = now(a, ANSWERS_LATE) ? (int)(2.0 * a->random / 1.8446744073709552e19 * w->config.ack_timeout_s / w->config.cycle_s)
                                              : p->c.answer_cycles;
    /* A field bus brings commands some cycles later. */
    gib_homing_output here = p->out;
    memcpy(a->late[a->cycles % 8], p->out.target_position_mm, sizeof a->late[0]);
    if (now(a, COMMAND_LATE) && a->cycles > 8) {
        memcpy(p->out.target_position_mm, a->late[(a->cycles - 3) % 8], sizeof a->late[0]);
    }
    in = *homing_plant_cycle(p);
    p->out = here;
    tamper(a, &in);
    if (now(a, OTHER_CONFIG) && w->status == GIB_BUSY) {
        gib_homing_config other = w->config;
        other.direction = -other.direction;
        other.torque_limit_nm *= 3.0;
        law(a, gib_homing_start(homing_world_gib(w), &other) == GIB_ERR_STATE, "a start while busy is refused");
    }
    a->before = here;
    memset(&p->out, 0x7f, sizeof p->out);
    w->status = gib_homing_step(homing_world_gib(w), &in, &p->out);
    w->touches += p->out.phase == GIB_HOMING_TOUCH && w->phase != GIB_HOMING_TOUCH;
    w->phase = p->out.phase;
    law(a, p->out.status == w->status && p->out.reserved == 0, "an output that is written");
    if (a->before.status == GIB_BUSY || p->out.status == GIB_BUSY) {
        see_command(a, &in);
        see_answer(a, &in);
    }
    see_events(a);
    see_world(a, &in);
    memcpy(a->told[1], a->told[0], sizeof a->told[1]);
    memcpy(a->told[0], in.position_mm, sizeof a->told[0]);
    a->named = a->named || p->out.message == 0 ? a->named : a->cycles;
    a->slipped_mm = p->out.phase == GIB_HOMING_TOUCH ? p->side[0].slipped : a->slipped_mm;
}

/* Half a second to swing out, a tenth of rest. */
static void see_rest(homing_adversary *a)
{
    homing_plant *p = &a->world.plant;
    int swing = (int)(0.5 / p->c.cycle_s), rest = (int)(0.1 / p->c.cycle_s);
    /* The kernel is on its own with an axis that lies or is held, and with what happens as gib ends. */
    int lies = ever(a, FAULT_ENCODER_FROZEN) || ever(a, FAULT_ENCODER_SLIPS) || ever(a, FAULT_NOT_FOLLOWED) || ever(a, FAULT_TIGHT_SPOT);
    for (int i = 0; i < a->troubles; i++) {
        lies |= a->trouble[i].begun && a->ended - a->trouble[i].begun < 100;
    }
    double from[2] = {0};
    int32_t kept = a->world.status;
    for (int k = 0; k < swing + rest; k++) {
        cycle(a);
        law(a, a->world.status == kept && !p->out.owns_motion, "an end that is kept");
        for (int i = 0; i < p->c.motors; i++) {
            from[i] = k == swing ? p->side[i].y : from[i];
            /* The kernel's servo may hunt about its goal by stick and slip; a brake holds, but for chips that give way. */
            const homing_plant_side *s = &p->side[i];
            int hunts = !p->out.stop_drive && fabs(s->x - s->last_target) <= 0.2;
            int free = kept == GIB_DONE || (lies && !p->out.stop_drive) || ever(a, FAULT_CHIPS) || hunts;
            law(a, k <= swing || free || fabs(s->y - from[i]) <= 0.005, "an axis at rest");
        }
    }
}

/* The torque limit is given back, or owed and said so; once all is well the instance homes again. */
static void see_restored(homing_adversary *a)
{
    homing_world *w = &a->world;
    homing_plant *p = &w->plant;
    gib_homing *gib = homing_world_gib(w);
    gib_homing_report report;
    gib_error_detail detail;
    gib_homing_result(gib, &report);
    gib_homing_last_error(gib, &detail);
    law(a, report.status == w->status, "the report's status");
    law(a, detail.code == (w->status == GIB_DONE ? GIB_OK : w->status), "the first error");
    int back = p->limit_nm == p->c.torque_limit_nm, said = p->out.message == GIB_ERR_RESTORE_UNCONFIRMED;
    int fooled = (w->config.unacknowledged & GIB_HOMING_REQUEST_TORQUE_LIMIT) || ever(a, FAULT_LIMIT_IGNORED) || ever(a, LIMIT_FLICKERS) || ever(a, ANSWERS_EARLY) || ever(a, ANSWERS_WILDLY);
    law(a, fooled || back || (report.restore_owed && said), "the limit given back, or owed");
    homing_plant_mend(p, FAULT_NONE);
    p->c.answer_cycles = 1;
    for (int i = 0; i < 20; i++) {
        p->out.stop_drive = 0;
        gib_homing_step(gib, homing_plant_cycle(p), &p->out);
    }
    gib_homing_result(gib, &report);
    law(a, fooled || p->limit_nm == p->c.torque_limit_nm, "the limit given back in the end");
    int32_t status = gib_homing_start(gib, &w->config);
    law(a, status == GIB_OK || (fooled && report.restore_owed && status == GIB_ERR_RESTORE_UNCONFIRMED), "a new start");
    status = status == GIB_OK ? GIB_BUSY : status;
    for (int i = 0; i < 300 && status == GIB_BUSY; i++) {
        status = gib_homing_step(gib, homing_plant_cycle(p), &p->out);
    }
    gib_homing_abort(gib);
    for (int i = 0; i < homing_way_out(&w->config) && status == GIB_BUSY; i++) {
        status = gib_homing_step(gib, homing_plant_cycle(p), &p->out);
    }
    law(a, status != GIB_BUSY, "a second end");
}

/* Homed in spite of troubles: home is right, as far as gib can know: of a stop that is another, a jump that a motor may make in a
 * cycle, or that comes out only after the end since the encoder stood, what an encoder slips once the last touch is over, and a
 * position that a kernel does not set and need not confirm, or confirms by chance, it cannot. */
static void see_home(homing_adversary *a)
{
    const homing_plant *p = &a->world.plant;
    const homing_plant_config *c = &p->c;
    const gib_homing_config *g = &a->world.config;
    double approach = given(g->approach_speed_mm_s, 1.0), offset = given(g->zero_offset_speed_mm_s, approach);
    int hidden = lasts_till(a, FAULT_ENCODER_FROZEN, a->ended) || 0.01 + 10.0 * fmax(approach, offset) * c->cycle_s > 0.3;
    int jumped = ever(a, FAULT_ENCODER_JUMPS) && hidden;
    int unset = ((g->unacknowledged & GIB_HOMING_REQUEST_SET_POSITION) || ever(a, ANSWERS_WILDLY)) && ever(a, FAULT_NO_ACKNOWLEDGEMENT);
    /* A torque that stands for a part of the only touch: no other disagrees with it. */
    int unequalled = g->touches == 1 && ever(a, FAULT_TORQUE_STUCK_HIGH);
    if (jumped || unset || unequalled || ever(a, FAULT_STOP_EARLY) || ever(a, FAULT_CHIPS) || c->stop_mm[0] != c->stop_mm[1] ||
        g->method == GIB_HOMING_THRESHOLD) {
        return;
    }
    gib_homing_report report;
    gib_homing_result(homing_world_gib(&a->world), &report);
    double slipped = ever(a, FAULT_ENCODER_JUMPS) ? p->side[0].slipped : a->slipped_mm;
    double contact = a->stop_mm + homing_plant_lead(c, fmin(approach, 1.0)) - slipped;
    double error = 1e3 * (contact + c->sense * p->shift_mm[0] - c->sense * g->set_position_mm - g->zero_offset_mm);
    double allowed = fmax(20.0, 4.0 * report.side[0].uncertainty_um);
    a->home_error_um = fabs(error);
    law(a, fabs(error) <= allowed, "home where the stop is");
}

void homing_adversary_run(homing_adversary *a)
{
    homing_world *w = &a->world;
    const gib_homing_config *g = &w->config;
    double seconds = g->time_limit_s > 0.0 ? g->time_limit_s : 1000.0;
    int longest = (int)(seconds / g->cycle_s) + 2 + homing_way_out(g);
    while (w->status == GIB_BUSY && a->cycles <= longest) {
        cycle(a);
    }
    a->ended = a->cycles;
    law(a, w->status != GIB_BUSY, "an end in time");
    law(a, w->status == GIB_DONE || !a->named || a->ended - a->named <= homing_way_out(g), "a way out in time");
    law(a, w->status == GIB_DONE || w->status < 0, "a named end");
    see_rest(a);
    if (w->status == GIB_DONE) {
        see_home(a);
    }
    see_restored(a);
}
