/* See homing_faults.h. */
#include "homing_faults.h"

#include <math.h>
#include <string.h>

const char *const homing_state_names[STATES] = {"limit", "approach", "press", "retract", "touch",  "clear",
                                                "evaluate", "offset", "set", "stopping", "unload", "restore"};

const char *const homing_fault_names[FAULTS] = {
    "none",           "abort",          "drive trip",        "unknown flag",     "torque NaN",
    "torque +inf",    "torque -inf",    "encoder NaN",       "encoder inf",      "limit in force NaN", "limit lost",
    "torque stuck",   "torque stuck high", "torque inverted", "torque noisy",    "encoder frozen",
    "encoder slips",  "encoder jumps",  "no acknowledgement", "limit ignored",   "command not followed",
    "tight spot",     "stop gone",      "stop soft",         "stop too early",   "chips"};

gib_homing *homing_world_gib(homing_world *w)
{
    return (gib_homing *)(void *)w->memory;
}

int32_t homing_world_start(homing_world *w, const homing_plant_config *c, const gib_homing_config *g)
{
    gib_homing *gib;
    memset(w, 0, sizeof *w);
    homing_plant_init(&w->plant, c);
    w->config = *g;
    int32_t status = gib_homing_init_in(w->memory, sizeof w->memory, &gib);
    status = status == GIB_OK ? gib_homing_start(gib, g) : status;
    w->status = status == GIB_OK ? GIB_BUSY : status;
    return status;
}

void homing_world_step(homing_world *w)
{
    const gib_homing_input *in = homing_plant_cycle(&w->plant);
    w->before = w->plant.out;
    w->status = gib_homing_step(homing_world_gib(w), in, &w->plant.out);
    w->touches += w->plant.out.phase == GIB_HOMING_TOUCH && w->phase != GIB_HOMING_TOUCH;
    w->phase = w->plant.out.phase;
    w->cycles++;
}

homing_state homing_world_state(const homing_world *w)
{
    const homing_plant *p = &w->plant;
    switch (p->out.phase) {
    case GIB_HOMING_LIMIT: return IN_LIMIT;
    case GIB_HOMING_TOUCH: return p->side[0].y > p->c.stop_mm[0] ? IN_PRESS : w->touches == 1 ? IN_APPROACH : IN_TOUCH;
    case GIB_HOMING_RETRACT: return IN_RETRACT;
    case GIB_HOMING_CLEAR: return IN_CLEAR;
    case GIB_HOMING_EVALUATE: return IN_EVALUATE;
    case GIB_HOMING_OFFSET: return IN_OFFSET;
    case GIB_HOMING_SET: return IN_SET;
    case GIB_HOMING_STOPPING: return IN_STOPPING;
    case GIB_HOMING_UNLOAD: return IN_UNLOAD;
    case GIB_HOMING_RESTORE: return IN_RESTORE;
    default: return IN_REST;
    }
}

static double given(double value, double otherwise)
{
    return value == 0.0 ? otherwise : value;
}

int homing_way_out(const gib_homing_config *g)
{
    double approach = given(g->approach_speed_mm_s, 1.0), fastest = fmax(approach, g->zero_offset_speed_mm_s);
    double press = given(g->press_max_mm, 0.4 * given(g->retract_mm, 1.0)), lag = given(g->lag_limit_mm, 1.0 + 0.1 * approach);
    double braking = 5.0 * (fastest + approach) / given(g->acceleration_mm_s2, 50.0);
    double seconds = braking + (lag + press) / approach + 4.0 * given(g->detection_time_s, 0.1) + 2.0 * given(g->ack_timeout_s, 1.0);
    return (int)(seconds / g->cycle_s) + 40;
}

int homing_brakes(const gib_homing_config *g, const gib_homing_output *before, const gib_homing_output *now, int motors)
{
    double change = given(g->acceleration_mm_s2, 50.0) * g->cycle_s;
    int all = 1;
    for (int i = 0; i < motors && now->phase == GIB_HOMING_STOPPING; i++) {
        double moved = now->target_position_mm[i] - before->target_position_mm[i], speed = now->target_speed_mm_s[i];
        all &= fabs(speed - before->target_speed_mm_s[i]) <= 1.5 * change + 1e-9;
        all &= fabs(moved / g->cycle_s - speed) <= change + 1e-9;
    }
    return all;
}

/* The first bound that is broken in this cycle, or NULL. */
static const char *broken(const homing_world *w, homing_fault fault)
{
    const homing_plant *p = &w->plant;
    double most = fault == FAULT_LIMIT_IGNORED ? 1.5 * w->config.torque_limit_nm : w->config.torque_limit_nm + 1e-9;
    int limited = p->limit_nm < p->c.torque_limit_nm || fault == FAULT_LIMIT_IGNORED;
    const gib_homing_output *o = &p->out;
    for (int i = 0; i < p->c.motors; i++) {
        if (limited && fabs(p->side[i].torque) > most && o->phase != GIB_HOMING_LIMIT) {
            return "torque";
        }
        if (p->side[i].y > w->config.distance_max_mm) {
            return "way";
        }
        if (!isfinite(o->target_position_mm[i]) || !isfinite(o->target_speed_mm_s[i])) {
            return "command";
        }
    }
    if (!homing_brakes(&w->config, &w->before, o, p->c.motors)) {
        return "braking";
    }
    return NULL;
}

/* Half a second to swing out, a tenth of rest. */
static const char *restless(homing_world *w, homing_fault fault)
{
    const char *why = NULL;
    const homing_plant_config *c = &w->plant.c;
    int swing = (int)(0.5 / c->cycle_s), rest = (int)(0.1 / c->cycle_s);
    double from[2] = {0};
    double friction = 1.3 * c->breakaway_ratio * c->friction_nm + fabs(c->constant_nm) + c->beam_nm_mm * 0.2;
    if (fault == FAULT_TIGHT_SPOT) { /* which holds the torque too; it is taken off by a fault */
        friction = (w->status == GIB_DONE ? 1.0 : 0.5) * w->config.torque_limit_nm;
    }
    for (int k = 0; k < swing + rest; k++) {
        homing_world_step(w);
        const char *now = broken(w, fault);
        why = why ? why : now;
        for (int i = 0; i < c->motors; i++) {
            from[i] = k == swing ? w->plant.side[i].y : from[i];
            if (k > swing && fabs(w->plant.side[i].y - from[i]) > 0.005) {
                why = why ? why : "moves on";
            }
            if (k > swing && fabs(w->plant.side[i].torque) > friction) {
                why = why ? why : "torque at rest";
            }
        }
    }
    return why;
}

homing_branch homing_world_break(homing_world *w, homing_fault fault)
{
    homing_branch b = {.safe = 1};
    int from = w->cycles, named = 0, longest = homing_way_out(&w->config);
    int told = w->plant.out.message != 0;
    if (fault == FAULT_ABORT) {
        gib_homing_abort(homing_world_gib(w));
    } else {
        homing_plant_break(&w->plant, fault, -1);
    }
    while (w->status == GIB_BUSY && w->cycles - from < 200000) {
        homing_world_step(w);
        const char *why = broken(w, fault);
        b.unsafe = b.unsafe ? b.unsafe : why;
        if (!named && w->plant.out.message != 0) {
            named = w->cycles;
        }
    }
    b.status = w->status;
    b.named = named ? named - from : 0;
    b.out = named ? w->cycles - (told ? from : named) : 0;
    if (b.status == GIB_BUSY || b.out > longest) {
        b.unsafe = b.unsafe ? b.unsafe : "time";
    }
    /* What happens as gib ends is the kernel's to see. */
    int late = (fault == FAULT_ENCODER_FROZEN || fault == FAULT_TIGHT_SPOT) && (told || b.status == GIB_DONE) && w->cycles - from < 100;
    const char *why = restless(w, fault);
    b.unsafe = b.unsafe || late ? b.unsafe : why;
    gib_homing_report report;
    gib_homing_result(homing_world_gib(w), &report);
    int back = w->plant.limit_nm == w->plant.c.torque_limit_nm, unconfirmed = w->plant.out.message == GIB_ERR_RESTORE_UNCONFIRMED;
    if (fault != FAULT_LIMIT_IGNORED && !(report.restore_owed ? unconfirmed : back)) {
        b.unsafe = b.unsafe ? b.unsafe : "limit not given back";
    }
    if (b.status == GIB_DONE) {
        /* Homed in spite of a fault is right only where home is right. */
        const homing_plant_config *c = &w->plant.c;
        double lead = homing_plant_lead(c, 1.0);
        double home = w->config.set_position_mm + c->sense * w->config.zero_offset_mm;
        double error = c->sense * (c->stop_mm[0] + lead) + w->plant.shift_mm[0] - home;
        int moved = fault == FAULT_STOP_GONE || fault == FAULT_STOP_EARLY; /* the stop, after it was measured */
        if (fabs(error) > 0.005 && !moved && c->motors == 1) {
            b.unsafe = b.unsafe ? b.unsafe : "wrong home";
        }
    }
    b.safe = b.unsafe == NULL;
    return b;
}

int homing_names(homing_fault fault, int32_t first, const homing_branch *b)
{
    static const int32_t NAMES[FAULTS][8] = {
        [FAULT_NONE] = {GIB_DONE},
        [FAULT_ABORT] = {GIB_ERR_ABORTED},
        [FAULT_DRIVE_TRIP] = {GIB_ERR_DRIVE_FAULT},
        [FAULT_FLAG_UNKNOWN] = {GIB_ERR_CONFIG},
        [FAULT_TORQUE_NAN] = {GIB_ERR_NON_FINITE},
        [FAULT_TORQUE_PLUS_INF] = {GIB_ERR_NON_FINITE},
        [FAULT_TORQUE_MINUS_INF] = {GIB_ERR_NON_FINITE},
        [FAULT_ENCODER_NAN] = {GIB_ERR_NON_FINITE},
        [FAULT_ENCODER_INF] = {GIB_ERR_NON_FINITE},
        [FAULT_LIMIT_NAN] = {GIB_ERR_NON_FINITE},
        [FAULT_LIMIT_LOST] = {GIB_ERR_HOMING_LIMIT, GIB_DONE},
        [FAULT_TORQUE_STUCK] = {GIB_ERR_HOMING_TORQUE_STUCK, GIB_DONE},
        /* Amid the line it bends the line; just before a move it is a press without a way, as where an encoder stands. */
        [FAULT_TORQUE_STUCK_HIGH] = {GIB_ERR_HOMING_TORQUE_STUCK, GIB_ERR_HOMING_SHAPE, GIB_ERR_HOMING_TOUCHES,
                                     GIB_ERR_HOMING_ENCODER, GIB_DONE},
        /* Amid a way back it looks like a torque that changes sense while the encoder turns. */
        [FAULT_TORQUE_INVERTED] = {GIB_ERR_HOMING_TORQUE_SIGN, GIB_ERR_HOMING_ENCODER, GIB_ERR_HOMING_TIGHT_SPOT, GIB_DONE},
        /* Under pressure a single reading may be too much before it is known for noise. */
        [FAULT_TORQUE_NOISY] = {GIB_ERR_HOMING_NOISE, GIB_ERR_TORQUE_BOUND, GIB_ERR_HOMING_ENCODER, GIB_DONE},
        /* At the start it is an axis that cannot move. */
        [FAULT_ENCODER_FROZEN] = {GIB_ERR_HOMING_ENCODER, GIB_ERR_HOMING_ON_STOP, GIB_DONE},
        [FAULT_ENCODER_SLIPS] = {GIB_ERR_HOMING_TOUCHES, GIB_DONE},
        [FAULT_ENCODER_JUMPS] = {GIB_ERR_HOMING_ENCODER},
        [FAULT_NO_ACKNOWLEDGEMENT] = {GIB_ERR_ACK_TIMEOUT},
        [FAULT_LIMIT_IGNORED] = {GIB_ERR_TORQUE_BOUND, GIB_DONE},
        [FAULT_NOT_FOLLOWED] = {GIB_ERR_LAG, GIB_DONE},
        /* Early on it is what a stop would be; amid a measured touch it is a touch that disagrees. */
        [FAULT_TIGHT_SPOT] = {GIB_ERR_HOMING_TIGHT_SPOT, GIB_ERR_HOMING_ON_STOP, GIB_ERR_HOMING_EARLY,
                              GIB_ERR_HOMING_TOUCHES, GIB_ERR_HOMING_SHAPE, GIB_DONE},
        [FAULT_STOP_GONE] = {GIB_ERR_HOMING_NO_STOP, GIB_ERR_HOMING_TOUCHES, GIB_DONE},
        /* After the last touch it is a stop that gives way. */
        [FAULT_STOP_SOFT] = {GIB_ERR_HOMING_SOFT_STOP, GIB_ERR_HOMING_TOUCHES, GIB_DONE},
        [FAULT_STOP_EARLY] = {GIB_ERR_HOMING_EARLY, GIB_ERR_HOMING_ON_STOP, GIB_ERR_HOMING_TOUCHES,
                              GIB_ERR_HOMING_SHAPE, GIB_DONE},
        [FAULT_CHIPS] = {GIB_ERR_HOMING_TOUCHES, GIB_ERR_HOMING_SOFT_STOP, GIB_DONE},
    };
    if (first != 0) {
        return b->status == first; /* the first error is kept */
    }
    for (int i = 0; i < 8; i++) {
        if (NAMES[fault][i] != 0 && NAMES[fault][i] == b->status) {
            return 1;
        }
    }
    return 0;
}
