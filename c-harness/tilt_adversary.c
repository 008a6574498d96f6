/* The laws; see tilt_adversary.h. */
#include "tilt_adversary.h"

static const double PI = 3.14159265358979323846;

static gib_tilt *gib_of(tilt_adversary *a, int which)
{
    return (gib_tilt *)a->memory[which];
}

/* Cycles in which offsets are out again, whatever they and their speeds are. */
static double way_out(const tilt_adversary *a)
{
    double most = 0.0;
    for (int kind = 0; kind < 2; kind++) {
        double x = a->laws.most[kind], v = a->laws.speed[kind], c = a->laws.acceleration[kind], rate = a->fastest[kind];
        most = fmax(most, x / v + 6.0 * sqrt(x / c) + 8.0 * rate / c + 2.0 * fmin(v / c, sqrt(x / c)) + 60.0);
    }
    return most;
}

static double cycles_at_most(const tilt_adversary *a, int phase)
{
    const gib_tilt_config *g = &a->config;
    double ramp = 0.0, limit = g->time_limit_s / g->cycle_s + 3.0;
    for (int kind = 0; kind < 2; kind++) {
        double x = a->laws.most[kind], v = a->laws.speed[kind], c = a->laws.acceleration[kind];
        ramp = fmax(ramp, x / v + 4.0 * v / c + 4.0 * sqrt(x / c));
    }
    switch (phase) {
    case GIB_TILT_MEASURING: return 2.0 * limit;
    case GIB_TILT_EVALUATE: return 75.0 * (2048.0 / 12.0 + 1.0) + 200.0;
    case GIB_TILT_WARNING: return g->ack_timeout_s / g->cycle_s + 3.0;
    case GIB_TILT_RAMP_ON: return 4.0 * ramp + 110.0;
    case GIB_TILT_RAMP_OFF: return way_out(a);
    default: return 1e9;
    }
}

/* Mistakes put in on purpose. */
static void spoil(tilt_adversary *a)
{
    gib_tilt_output *o = &a->out;
    int active = o->phase == GIB_TILT_ACTIVE;
    switch (a->mistake) {
    case TILT_JUMPS: o->offset_mm[2] += active && a->in_phase == 5 ? 1e-3 : 0.0; break;
    case TILT_TOO_FAR: o->offset_mm[2] *= active ? 3.0 : 1.0; break;
    case TILT_NO_NUMBER: o->offset_deg[1] = a->base.cycle == 40 ? NAN : o->offset_deg[1]; break;
    case TILT_ASKS_NOBODY: o->offset_mm[0] += o->phase == GIB_TILT_WARNING ? 1e-6 : 0.0; break;
    case TILT_SAYS_NOTHING: o->message = 0; break;
    case TILT_NEVER_ENDS:
        if (o->phase == GIB_TILT_DONE || o->phase == GIB_TILT_FAILED) {
            o->phase = GIB_TILT_RAMP_OFF;
            o->status = GIB_BUSY;
        }
        break;
    case TILT_KEEPS: o->offset_mm[2] = o->status != GIB_BUSY && a->before.status == GIB_BUSY ? a->before.offset_mm[2] + 1e-7 : o->offset_mm[2]; break;
    case TILT_WRONG_WAY:
        for (int k = 0; k < 3; k++) {
            o->offset_mm[k] = -o->offset_mm[k];
            o->offset_deg[k] = -o->offset_deg[k];
        }
        break;
    default: break;
    }
}

/* What is plainly wrong with an input is answered in its cycle, once and for all. */
static void see_answer(tilt_adversary *a, int was_busy)
{
    const gib_tilt_output *o = &a->out;
    const gib_tilt_input *in = &a->told;
    int wrong = !(fabs(in->load) < 1e12) || !isfinite(in->speed_rpm) || (in->flags & ~28u) != 0;
    for (int k = 0; k < 3; k++) {
        wrong |= !isfinite(in->position_mm[k]) || !isfinite(in->rotary_deg[k]);
    }
    law(&a->base, !(was_busy && wrong) || o->message < 0, "a fault in its cycle");
    law(&a->base, a->named == 0 || o->message == a->before.message, "the first fault kept");
    law(&a->base, o->message == 0 || o->status == o->message || o->phase == GIB_TILT_RAMP_OFF, "a fault that leads out");
    a->named = a->named == 0 && o->message < 0 ? a->base.cycle : a->named;
}

/* One call with what is told, by both. */
static void call(tilt_adversary *a)
{
    gib_tilt_output twin;
    int was_busy = a->before.status == GIB_BUSY;
    if (begins(&a->base, TILT_ABORT_CALL) && was_busy) {
        law(&a->base, gib_tilt_abort(gib_of(a, 0)) == GIB_OK && gib_tilt_abort(gib_of(a, 1)) == GIB_OK, "an abort");
    }
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_tilt_step(gib_of(a, 0), &a->told, &a->out);
    /* The numbers of requests go on where those of the run before ended, of which the other knows nothing. */
    gib_tilt_input as_well = a->told;
    as_well.acknowledged_id -= as_well.acknowledged_id ? a->made : 0u;
    int the_same = gib_tilt_step(gib_of(a, 1), &as_well, &twin) == status;
    twin.request_id += a->made;
    law(&a->base, the_same && memcmp(&twin, &a->out, sizeof twin) == 0, "the same inputs, the same outputs");
    spoil(a);
    for (int kind = 0; kind < 2; kind++) {
        const double *value = kind ? a->out.offset_deg : a->out.offset_mm;
        a->fastest[kind] = 0.0;
        for (int k = 0; k < 3; k++) {
            a->fastest[kind] = fmax(a->fastest[kind], fabs(value[k] - a->laws.value[3 * kind + k]));
        }
    }
    tilt_laws_watch(&a->laws, &a->told, a->out.status, &a->out);
    law(&a->base, a->laws.broken == NULL, a->laws.broken);
    see_answer(a, was_busy);
    a->in_phase = a->out.phase == a->before.phase ? a->in_phase + 1 : 0;
    law(&a->base, a->in_phase <= cycles_at_most(a, a->out.phase), "a state that ends in time");
    a->before = a->out;
}

/* With the offsets in force: the path once more, then three corners, each until z rests there. */
static void cut_again(tilt_adversary *a)
{
    if (a->out.phase != GIB_TILT_ACTIVE) {
        return;
    }
    if (a->in_phase == 0) {
        a->pass = a->n = 0;
    }
    if (a->corner < 0) {
        a->corner = a->in_phase > a->after ? 0 : -1;
        a->tried = 0;
        return;
    }
    double moves = 0.0;
    for (int k = 0; k < 3; k++) {
        moves += fabs(a->laws.rate[k]) + fabs(a->laws.rate[3 + k]);
    }
    /* Where it turns round it rests for one cycle. */
    a->rested = moves == 0.0 ? a->rested + 1 : 0;
    if (a->corner < 3 && ((++a->tried > 3 && a->rested > 3) || a->tried > 20000)) {
        const gib_tilt_output *o = &a->out;
        tilt_plane found = a->plane;
        gib_tilt_report r;
        gib_tilt_result(gib_of(a, 0), &r);
        found.gx = r.slope_x_ratio;
        found.gy = r.slope_y_ratio;
        for (int of = 0; of < 2; of++) {
            double depth = tilt_axes_depth(a->axes, of ? &found : &a->plane, o->offset_mm, o->offset_deg, a->plane.start[0] + a->at[0],
                                           a->plane.start[1] + a->at[1], NULL);
            a->depth[0] = of == 0 && a->corner == 0 ? depth : a->depth[0];
            a->depth[1] = of == 1 && a->corner == 0 ? depth : a->depth[1];
            double apart = fabs(depth - a->depth[of]);
            double *worst = of ? &a->depth[2] : &a->left_mm[a->base.run];
            *worst = a->corner == 0 ? 0.0 : fmax(*worst, apart);
        }
        a->slowed |= o->limited;
        a->corner++;
        a->tried = 0;
    }
}

static int32_t cycle(tilt_adversary *a)
{
    a->base.cycle++;
    if (a->base.run == 0 && !a->base.ended) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    tilt_adversary_tell(a);
    if (now(&a->base, TILT_STARTED_ANEW) && a->before.status == GIB_BUSY) {
        gib_tilt_config other = a->config;
        other.offset_max_mm *= 0.5;
        law(&a->base, gib_tilt_start(gib_of(a, 0), &other, &a->table) == GIB_ERR_STATE, "a start while busy is refused");
    }
    if (a->base.run == 0 && a->base.cycle == 100) {
        memcpy(a->memory[1], a->memory[0], sizeof a->memory[0]);
    }
    const trouble *lost = now(&a->base, TILT_CALLS_LOST);
    if (lost && random_chance(&a->base.random, 0.3 * lost->size)) {
        return a->before.status;
    }
    call(a);
    if (now(&a->base, TILT_CALLED_TWICE) && a->out.status == GIB_BUSY) {
        call(a);
    }
    cut_again(a);
    return a->out.status;
}

double tilt_adversary_truth(const tilt_adversary *a, int run, int axis)
{
    const gib_tilt_report *r = &a->report[run];
    double gx = a->plane.gx, gy = a->plane.gy;
    if (r->axes_seen != (GIB_TILT_ABOUT_X | GIB_TILT_ABOUT_Y)) {
        /* What is along a line. */
        double c = cos(r->path_deg * PI / 180.0), s = sin(r->path_deg * PI / 180.0), along = gx * c + gy * s;
        gx = along * c;
        gy = along * s;
    }
    double slope = axis == 0 ? gy : axis == 1 ? -gx : hypot(gx, gy);
    return atan(slope) * 180.0 / PI;
}

int tilt_adversary_clean(const tilt_adversary *a, int run)
{
    return run == 1 || troubles_met(&a->base.troubles) == 0;
}

/* The result, by the one that met troubles and by the other. */
static void see_result(tilt_adversary *a)
{
    const gib_tilt_config *g = &a->config;
    gib_tilt_report *r = &a->report[a->base.run], other;
    memset(&other, 0, sizeof other);
    gib_tilt_result(gib_of(a, 0), r);
    gib_tilt_result(gib_of(a, 1), &other);
    law(&a->base, memcmp(r, &other, sizeof other) == 0, "the same inputs, the same result");
    gib_tilt_last_error(gib_of(a, 0), &a->detail[a->base.run]);
    law(&a->base,
        (a->status[a->base.run] < 0 ? a->detail[a->base.run].code == a->status[a->base.run] : a->detail[a->base.run].code == GIB_OK),
        "a detail of the fault");
    r->uncertainty_deg = a->mistake == TILT_NO_DOUBT ? 0.0 : r->uncertainty_deg;
    r->tilt_deg += a->mistake == TILT_OFF ? 0.4 * r->tilt_deg + 10.0 * r->uncertainty_deg : 0.0;
    int found = r->decision != GIB_TILT_UNDECIDED && r->decision != GIB_TILT_TAUGHT;
    law(&a->base, a->status[a->base.run] != GIB_DONE || r->decision != GIB_TILT_UNDECIDED || ever(&a->base, TILT_TAKEN_OFF), "a decision");
    if (!found) {
        return;
    }
    law(&a->base, isfinite(r->tilt_deg) && r->uncertainty_deg > 0.0 && isfinite(r->uncertainty_deg), "a value with an uncertainty");
    law(&a->base, r->decision != GIB_TILT_SIGNIFICANT || (r->tilt_deg > r->uncertainty_deg && r->tilt_deg > g->band_deg),
        "no offsets but for a tilt that is sure");
    double truth = tilt_adversary_truth(a, a->base.run, -1), error = fabs(r->tilt_deg - truth);
    /* Nobody can know that the load is another drive's, or that of another material, or that x is y. */
    int unknowable = ever(&a->base, TILT_LOAD_FOREIGN) || ever(&a->base, TILT_SKIN) || ever(&a->base, TILT_POSITION_SWAPPED),
        clean = tilt_adversary_clean(a, a->base.run);
    law(&a->base, unknowable || error <= fmax(3.0 * r->uncertainty_deg, clean ? fmax(0.03 * truth, 0.005) : fmax(0.2 * truth, 0.05)),
        "a value that is right, or refused");
    int moved = ever(&a->base, TILT_POSITION_CLOSED) || ever(&a->base, TILT_POSITION_JUMPS) || ever(&a->base, TILT_POSITION_STUCK) ||
                ever(&a->base, TILT_POSITION_SWAPPED) || ever(&a->base, TILT_ANGLE_TURNS) || ever(&a->base, TILT_CALLS_LOST) || a->slowed;
    if (a->corner >= 3 && !moved) {
        law(&a->base, a->depth[2] <= 0.02 * tan(r->tilt_deg * PI / 180.0) * a->extent_mm + 1e-6, "offsets that undo what was found");
    }
}

static void start(tilt_adversary *a, int run)
{
    gib_tilt *placed;
    gib_tilt_config scribbled = a->config;
    gib_tilt_table table = a->table;
    a->base.run = run;
    a->base.cycle = a->pass = a->n = a->base.ended = a->named = a->in_phase = a->waited = a->slowed = a->tried = a->rested = a->jammed = 0;
    a->corner = -1;
    a->share = a->cut_m = a->drift = 0.0;
    a->at[0] = a->at[1] = 0.0;
    a->sign = random_chance(&a->base.random, 0.5);
    a->left_mm[run] = -1.0;
    a->depth[2] = 0.0;
    memset(&a->out, 0, sizeof a->out);
    for (int i = run; i < 2; i++) {
        memset(a->memory[i], 0xa5, sizeof a->memory[i]);
        law(&a->base, gib_tilt_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK, "an instance in memory of its own");
    }
    a->made = a->before.request_id;
    for (int i = 0; i < 2; i++) {
        int32_t status = gib_tilt_start(gib_of(a, i), &scribbled, &table);
        law(&a->base, status == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&table, 0x7f, sizeof table);
    memset(&a->before, 0, sizeof a->before);
    a->before.status = GIB_BUSY;
    a->before.phase = GIB_TILT_MEASURING;
    tilt_laws_init(&a->laws, &a->config);
    a->laws.request = a->before.request_id = a->made;
}

static void measure(tilt_adversary *a, int run)
{
    start(a, run);
    if (a->mistake == TILT_REMEMBERS && run == 1) {
        gib_tilt_input in = {.load = 1.0, .speed_rpm = 1.0, .flags = GIB_TILT_INPUT_CUTTING};
        gib_tilt_step(gib_of(a, 0), &in, &a->out);
    }
    while (cycle(a) == GIB_BUSY && !a->base.broken) {
    }
    a->base.ended = a->base.cycle;
    a->status[run] = a->out.status;
    law(&a->base, (a->out.status == GIB_DONE && !a->out.message) || (a->out.status < 0 && a->out.message == a->out.status), "a named end");
    gib_tilt_input odd = {{NAN, INFINITY, 0.0}, {NAN, 0.0, 0.0}, NAN, INFINITY, 1, 0xffffffffu};
    for (int i = 0; i < 3 && !a->base.broken; i++) {
        gib_tilt_output after;
        int32_t kept = gib_tilt_step(gib_of(a, 0), &odd, &after);
        gib_tilt_step(gib_of(a, 1), &odd, &after);
        int still = after.offset_mm[0] == 0.0 && after.offset_mm[1] == 0.0 && after.offset_mm[2] == 0.0 && after.offset_deg[0] == 0.0 &&
                    after.offset_deg[1] == 0.0 && after.offset_deg[2] == 0.0;
        law(&a->base, kept == a->out.status && still, "an end that is kept");
    }
    see_result(a);
}

void tilt_adversary_run(tilt_adversary *a)
{
    measure(a, 0);
    if (!a->base.broken) {
        measure(a, 1);
    }
}
