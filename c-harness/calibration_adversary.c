/* See calibration_adversary.h. */
#include "calibration_adversary.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *const calibration_trouble_names[CALIBRATION_TROUBLES] = {
    "sensor stuck", "sensor dead",    "sensor inverted", "sensor NaN",  "sensor huge",  "sensor jumps", "sensor noisy",
    "sensor scaled", "sensors swapped", "torque huge",   "torque NaN",  "torque stuck", "position stuck", "position inverted",
    "position NaN", "position jumps", "drive trips",     "drive dies",  "drive weak",   "shaken",       "flag unknown",
    "abort flag",   "abort call",     "started anew",    "called twice", "calls lost"};

static const double TWO_PI = 6.283185307179586;

/* Even, with standard deviation 1. */
static double noise(calibration_adversary *a)
{
    return 3.4641016151377544 * between(&a->base, -0.5, 0.5);
}

static double amplitude_mm(const gib_calibration_config *g, double hz)
{
    double w = TWO_PI * hz;
    return fmin(g->stroke_mm, fmin(g->speed_mm_s / w, g->acceleration_mm_s2 / (w * w)));
}

/* Sensors that show the swing at the amplitude allowed. */
static void draw(calibration_adversary *a)
{
    gib_calibration_config *g = &a->config;
    g->struct_size = sizeof *g;
    double cycle = g->cycle_s = over(&a->base, 0.0002, 0.02);
    g->frequencies = 1 + (int)between(&a->base, 0.0, 3.0);
    double hz = fmax(0.5, between(&a->base, 0.01, 0.03) / cycle);
    for (int i = 0; i < g->frequencies; i++) {
        g->frequency_hz[i] = hz;
        hz *= between(&a->base, 1.1, 1.35);
    }
    double low = g->frequency_hz[0], high = g->frequency_hz[g->frequencies - 1];
    g->stroke_mm = over(&a->base, 0.05, 50.0);
    g->speed_mm_s = fmin(fmax(TWO_PI * low * g->stroke_mm * over(&a->base, 0.2, 3.0), 0.1), 1e4);
    g->acceleration_mm_s2 = fmin(fmax(TWO_PI * high * g->speed_mm_s * over(&a->base, 0.3, 3.0), 1.0), 1e6);
    g->measure_s = fmax(0.1, 32.0 / low * between(&a->base, 0.1, 1.5));
    g->ramp_s = fmin(10.0, fmax(0.01, 5.0 / low * between(&a->base, 0.5, 2.0)));
    g->lag_limit_mm = fmin(2.0 * g->stroke_mm, 100.0);
    a->bandwidth = 8.0 * TWO_PI * high;
    a->mass = over(&a->base, 1e-4, 0.2);
    double strongest = 0.0, least[3] = {INFINITY, INFINITY, INFINITY};
    for (int n = 0; n < 2; n++) {
        a->spring[n] = TWO_PI * high * over(&a->base, 1.5, 5.0);
        a->damping[n] = between(&a->base, 0.02, 0.3);
        a->takes[n] = over(&a->base, 0.05, 0.5) * (n ? 1.0 : -1.0);
        a->gain[n] = 1.0 + between(&a->base, -0.15, 0.15);
    }
    for (int i = 0; i < g->frequencies; i++) {
        double w = TWO_PI * g->frequency_hz[i], most = amplitude_mm(g, g->frequency_hz[i]);
        strongest = fmax(strongest, most * w * w);
        for (int n = 0; n < 2; n++) {
            double share = w * w / (a->spring[n] * a->spring[n]);
            least[n] = fmin(least[n], 1e-3 * most * w * w * share * fabs(a->takes[n]));
            least[2] = fmin(least[2], 1e3 * most * share * fabs(a->takes[n]));
        }
    }
    a->torque_unit = 1.0;
    if (chance(&a->base, 0.3)) {
        g->torque_unit = GIB_TORQUE_PERMILLE;
        g->rated_torque_nm = over(&a->base, 0.1, 100.0);
        a->torque_unit = 1000.0 / g->rated_torque_nm;
    }
    g->torque_bound_nm = fmax(1e-6, a->mass * strongest * between(&a->base, 0.7, 4.0));
    g->torque_share_ratio = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 0.1, 0.9);
    g->acceleration_range_m_s2 = fmin(fmax(fmax(least[0], least[1]) * over(&a->base, 5.0, 100.0), 0.1), 1e4);
    g->ball_bar_range_um = fmin(fmax(least[2] * over(&a->base, 5.0, 500.0), 1.0), 1e6);
    for (int n = 0; n < 3; n++) {
        a->noise[n] = least[n] * over(&a->base, 1e-5, 0.02);
    }
    g->tolerance_ratio = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 0.1, 1.0);
    a->start_mm = between(&a->base, -300.0, 300.0);
}

void calibration_adversary_init(calibration_adversary *a, uint64_t seed, calibration_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    draw(a);
    int count = chance(&a->base, 0.3) ? 0 : (int)between(&a->base, 1.0, CALIBRATION_MOST_TROUBLES + 1.0);
    double cycles = 120.0 * a->config.frequencies / (a->config.frequency_hz[0] * a->config.cycle_s);
    troubles_draw(&a->base.troubles, &a->base.random, count, CALIBRATION_TROUBLES, cycles, 0.1, 0.4);
}

static gib_calibration *gib_of(calibration_adversary *a, int which)
{
    return (gib_calibration *)a->memory[which];
}

/* One cycle of the machine; lengths from the start, mm. The slide's acceleration has no steps, so that a sample of it is worth one. */
static void machine(calibration_adversary *a)
{
    const trouble *t = now(&a->base, CALIBRATION_DRIVE_WEAK);
    double goal = a->out.owns_motion ? a->out.target_position_mm - a->start_mm : a->slide[1], h = a->config.cycle_s, k = a->bandwidth;
    goal *= t ? t->size : 1.0;
    double speed = a->out.owns_motion ? a->out.target_speed_mm_s * h : 0.0, from[2] = {a->goal_mm[0], a->goal_mm[1]};
    speed *= t ? t->size : 1.0;
    a->goal_mm[0] = goal;
    a->goal_mm[1] = speed;
    int steps = (int)fmax(8.0, ceil(8.0 * k * h));
    h /= steps;
    for (int i = 0; i < steps; i++) {
        /* The drive goes from one target and speed to the next without a step of either, as one that interpolates. */
        double u = (i + 1.0) / steps, due = (1.0 - u) * (1.0 - u) * ((1.0 + 2.0 * u) * from[0] + u * from[1]) + u * u * ((3.0 - 2.0 * u) * goal - (1.0 - u) * speed);
        int held = now(&a->base, CALIBRATION_DRIVE_DIES) || a->out.stop_drive;
        a->slide[0] += held ? 0.0 : h * k * (due - a->slide[0]);
        double pull = held ? -4.0 * k * a->slide[2] : k * k * (a->slide[0] - a->slide[1]) - 2.0 * k * a->slide[2];
        a->slide[2] += h * pull;
        a->slide[1] += h * a->slide[2];
        for (int n = 0; n < 2; n++) {
            double w = a->spring[n];
            a->acceleration[n] = a->takes[n] * pull - w * w * a->part[n][0] - 2.0 * a->damping[n] * w * a->part[n][1];
            /* Where it is when it has that acceleration. */
            a->seen[n] = a->part[n][0];
            a->part[n][1] += h * a->acceleration[n];
            a->part[n][0] += h * a->part[n][1];
        }
        a->command = pull;
    }
}

/* What the sensors say, and what the kernel makes of it. */
static void tell(calibration_adversary *a)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY};
    const gib_calibration_config *g = &a->config;
    const trouble *t;
    gib_calibration_input *in = &a->told;
    double range[3] = {g->acceleration_range_m_s2, g->acceleration_range_m_s2, g->ball_bar_range_um}, shaken = 0.0, of[3];
    memset(in, 0, sizeof *in);
    in->position_mm = a->start_mm + a->slide[1];
    in->torque = a->torque_unit * a->mass * a->command;
    if ((t = now(&a->base, CALIBRATION_SHAKEN)) != NULL) shaken = 0.3 * t->size * sin((0.05 + t->size) * a->base.cycle);
    for (int n = 0; n < 2; n++) {
        of[n] = a->gain[n] * 1e-3 * a->acceleration[n] + a->noise[n] * (noise(a) + 20.0 * shaken);
    }
    of[2] = 1e3 * (a->seen[0] - a->seen[1]) + a->noise[2] * (noise(a) + 20.0 * shaken);
    for (int n = 0; n < 3; n++) {
        int which;
        if ((t = now(&a->base, CALIBRATION_SENSOR_DEAD)) != NULL && t->at % 3 == n) of[n] = t->size < 0.5 ? 0.0 : a->noise[n] * noise(a);
        if ((t = now(&a->base, CALIBRATION_SENSOR_INVERTED)) != NULL && t->at % 3 == n) of[n] = -of[n];
        if ((t = now(&a->base, CALIBRATION_SENSOR_JUMPS)) != NULL && t->at % 3 == n) of[n] += 0.2 * t->size * range[n];
        if ((t = now(&a->base, CALIBRATION_SENSOR_NOISY)) != NULL && t->at % 3 == n) of[n] += 0.1 * t->size * range[n] * noise(a);
        if ((t = now(&a->base, CALIBRATION_SENSOR_SCALED)) != NULL && t->at % 3 == n) of[n] *= 0.3 + 1.5 * t->size;
        which = begins(&a->base, CALIBRATION_SENSOR_STUCK);
        a->stuck[n] = which ? of[n] : a->stuck[n];
        if ((t = now(&a->base, CALIBRATION_SENSOR_STUCK)) != NULL && t->at % 3 == n) of[n] = a->stuck[n];
        if ((t = now(&a->base, CALIBRATION_SENSOR_HUGE)) != NULL && t->at % 3 == n) of[n] = t->size < 0.5 ? range[n] : -DBL_MAX;
        if ((t = now(&a->base, CALIBRATION_SENSOR_NO_NUMBER)) != NULL && t->at % 3 == n) of[n] = ODD[(int)(3.0 * t->size)];
    }
    int swapped = now(&a->base, CALIBRATION_SENSORS_SWAPPED) != NULL;
    in->acceleration_m_s2[0] = of[swapped];
    in->acceleration_m_s2[1] = of[!swapped];
    in->ball_bar_um = of[2];
    a->stuck[3] = begins(&a->base, CALIBRATION_TORQUE_STUCK) ? in->torque : a->stuck[3];
    if (now(&a->base, CALIBRATION_TORQUE_STUCK)) in->torque = a->stuck[3];
    if ((t = now(&a->base, CALIBRATION_TORQUE_HUGE)) != NULL)
        in->torque = g->torque_bound_nm * a->torque_unit * (t->size < 0.5 ? 1.1 : -1e9);
    if ((t = now(&a->base, CALIBRATION_TORQUE_NO_NUMBER)) != NULL) in->torque = ODD[(int)(3.0 * t->size)];
    a->stuck[4] = begins(&a->base, CALIBRATION_POSITION_STUCK) ? in->position_mm : a->stuck[4];
    if (now(&a->base, CALIBRATION_POSITION_STUCK)) in->position_mm = a->stuck[4];
    if (now(&a->base, CALIBRATION_POSITION_INVERTED)) in->position_mm = 2.0 * a->start_mm - in->position_mm;
    if ((t = now(&a->base, CALIBRATION_POSITION_JUMPS)) != NULL && chance(&a->base, 0.1))
        in->position_mm += 4.0 * g->stroke_mm * (t->size - 0.5);
    if ((t = now(&a->base, CALIBRATION_POSITION_NO_NUMBER)) != NULL) in->position_mm = ODD[(int)(3.0 * t->size)];
    in->flags |= now(&a->base, CALIBRATION_DRIVE_TRIPS) ? (uint32_t)GIB_INPUT_FAULT : 0u;
    in->flags |= begins(&a->base, CALIBRATION_ABORT_FLAG) ? (uint32_t)GIB_INPUT_ABORT : 0u;
    if ((t = now(&a->base, CALIBRATION_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (2 + (int)(30.0 * t->size));
}

/* Cycles that a state may take. */
static double cycles_at_most(const calibration_adversary *a, int phase)
{
    const gib_calibration_config *g = &a->config;
    double low = g->frequency_hz[0], rise = fmax(g->ramp_s, 5.1 / low) / g->cycle_s + 3.0;
    double block = (ceil(g->measure_s * g->frequency_hz[g->frequencies - 1] / 8.0) + 5.0) / (low * g->cycle_s);
    switch (phase) {
    case GIB_CALIBRATION_RISE: return 2.0 * rise + 3.0 * block;
    case GIB_CALIBRATION_PROBE: return block;
    case GIB_CALIBRATION_MEASURE: return 8.0 * block;
    case GIB_CALIBRATION_EVALUATE: return 34.0;
    case GIB_CALIBRATION_FALL: return rise;
    case GIB_CALIBRATION_STOPPING: return 1.25 * rise;
    default: return 1e9;
    }
}

/* Commands are numbers, go on from where the axis stood, and keep to stroke, speed and acceleration. */
static void see_command(calibration_adversary *a)
{
    const gib_calibration_config *g = &a->config;
    const gib_calibration_output *o = &a->out, *b = &a->before, *e = &a->earlier;
    law(&a->base, isfinite(o->target_position_mm) && isfinite(o->target_speed_mm_s) && isfinite(o->amplitude_mm),
        "a command that is a number");
    law(&a->base, !o->owns_motion || o->status == GIB_BUSY, "a motion that is gib's");
    if (!o->owns_motion) {
        return;
    }
    law(&a->base, fabs(o->target_position_mm - a->origin_mm) <= g->stroke_mm * (1.0 + 1e-9) + 1e-9, "a command within the stroke");
    double step = o->target_position_mm - (b->owns_motion ? b->target_position_mm : a->origin_mm);
    law(&a->base, fabs(step) <= 1.001 * g->speed_mm_s * g->cycle_s + 1e-9, "a command within the speed");
    if (b->owns_motion && e->owns_motion) {
        double bend = step - (b->target_position_mm - e->target_position_mm);
        law(&a->base, fabs(bend) <= 1.001 * g->acceleration_mm_s2 * g->cycle_s * g->cycle_s + 1e-9,
            "a command within the acceleration");
        /* A swinging sampled as coarsely as that goes less far than its speed says. */
        double way = 0.5 * (o->target_position_mm - e->target_position_mm), turned = TWO_PI * b->frequency_hz * g->cycle_s;
        law(&a->base, fabs(way - b->target_speed_mm_s * g->cycle_s) <= (0.005 + 0.2 * turned * turned) * g->speed_mm_s * g->cycle_s + 1e-9,
            "a speed that is the command's");
    }
}

/* What is plainly wrong with an input is answered in its cycle, once and for all. */
static void see_answer(calibration_adversary *a, int was_busy, int was_leaving)
{
    const gib_calibration_config *g = &a->config;
    const gib_calibration_output *o = &a->out;
    const gib_calibration_input *in = &a->told;
    double range = g->acceleration_range_m_s2, lag = g->lag_limit_mm;
    int position = !isfinite(in->position_mm) || (a->before.owns_motion && fabs(in->position_mm - a->before.target_position_mm) > 1.001 * lag);
    int wrong = position || in->flags != 0 || !(fabs(in->torque) <= 1.001 * g->torque_bound_nm * a->torque_unit);
    wrong |= !(fabs(in->acceleration_m_s2[0]) < range) || !(fabs(in->acceleration_m_s2[1]) < range) || !(fabs(in->ball_bar_um) < g->ball_bar_range_um);
    law(&a->base, !(was_busy && wrong) || o->message < 0, "a fault in its cycle");
    law(&a->base,
        !(was_busy && (position || (in->flags & GIB_INPUT_FAULT)) && !(in->flags & GIB_INPUT_ABORT) && !(in->flags & ~3u)) ||
            !o->owns_motion,
        "nothing commanded where the axis is lost");
    law(&a->base, !was_leaving || o->message == a->before.message, "the first fault kept");
    a->named = a->named == 0 && o->message < 0 ? a->base.cycle : a->named;
}

/* Mistakes put in on purpose. */
static void spoil(calibration_adversary *a)
{
    gib_calibration_output *o = &a->out;
    switch (a->mistake) {
    case CALIBRATION_JUMPS: o->target_position_mm += a->base.cycle == 100 ? 0.9 * a->config.stroke_mm : 0.0; break;
    case CALIBRATION_TOO_FAR: o->target_position_mm += o->owns_motion ? 1.5 * a->config.stroke_mm : 0.0; break;
    case CALIBRATION_NO_NUMBER: o->target_speed_mm_s = a->base.cycle == 60 ? NAN : o->target_speed_mm_s; break;
    case CALIBRATION_SAYS_NOTHING: o->message = 0; break;
    case CALIBRATION_NEVER_ENDS:
        if (o->status != GIB_BUSY) {
            o->status = GIB_BUSY;
            o->phase = GIB_CALIBRATION_EVALUATE;
        }
        break;
    default: break;
    }
}

static int32_t call(calibration_adversary *a)
{
    gib_calibration_output twin;
    int was_busy = a->before.status == GIB_BUSY, was_leaving = a->before.message < 0;
    if (begins(&a->base, CALIBRATION_ABORT_CALL)) {
        law(&a->base, gib_calibration_abort(gib_of(a, 0)) == GIB_OK && gib_calibration_abort(gib_of(a, 1)) == GIB_OK, "an abort");
    }
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_calibration_step(gib_of(a, 0), &a->told, &a->out);
    law(&a->base, status == a->out.status, "an output that is written");
    law(&a->base, gib_calibration_step(gib_of(a, 1), &a->told, &twin) == status && memcmp(&twin, &a->out, sizeof twin) == 0,
        "the same inputs, the same outputs");
    spoil(a);
    /* Where the axis stands at first is what the kernel says. */
    a->origin_mm = was_busy && !a->before.phase && isfinite(a->told.position_mm) ? a->told.position_mm : a->origin_mm;
    see_command(a);
    see_answer(a, was_busy, was_leaving);
    a->in_phase = a->out.phase == a->before.phase ? a->in_phase + 1 : 0;
    law(&a->base, a->in_phase <= cycles_at_most(a, a->out.phase), "a state that ends in time");
    a->earlier = a->before;
    a->before = a->out;
    return a->out.status;
}

static int32_t cycle(calibration_adversary *a)
{
    a->base.cycle++;
    if (a->base.run == 0) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    tell(a);
    if (now(&a->base, CALIBRATION_STARTED_ANEW) && a->before.status == GIB_BUSY) {
        gib_calibration_config other = a->config;
        other.stroke_mm *= 0.5;
        law(&a->base, gib_calibration_start(gib_of(a, 0), &other) == GIB_ERR_STATE, "a start while busy is refused");
    }
    if (a->base.run == 0 && a->base.cycle == 100) {
        memcpy(a->memory[1], a->memory[0], sizeof a->memory[0]);
    }
    const trouble *lost = now(&a->base, CALIBRATION_CALLS_LOST);
    if (!(lost && chance(&a->base, 0.2 * lost->size))) {
        call(a);
        if (now(&a->base, CALIBRATION_CALLED_TWICE) && a->out.status == GIB_BUSY) {
            call(a);
        }
    }
    machine(a);
    return a->before.status;
}

int calibration_adversary_clean(const calibration_adversary *a, int run)
{
    return run == 1 || troubles_met(&a->base.troubles) == 0;
}

/* The table: uncertainties in it, gains within them. A sensor that is scaled is one with another gain. */
static void see_result(calibration_adversary *a)
{
    gib_calibration_table *t = &a->table[a->base.run], other;
    memset(t, 0, sizeof *t);
    memset(&other, 0, sizeof other);
    t->struct_size = other.struct_size = sizeof other;
    int32_t result = gib_calibration_result(gib_of(a, 0), t);
    law(&a->base, gib_calibration_result(gib_of(a, 1), &other) == result && memcmp(t, &other, sizeof other) == 0,
        "the same inputs, the same result");
    law(&a->base, (a->status[a->base.run] == GIB_DONE) == (result == GIB_OK), "a table where it ended well, and only there");
    int unknowable = ever(&a->base, CALIBRATION_SENSOR_SCALED) || ever(&a->base, CALIBRATION_SENSORS_SWAPPED) ||
                     ever(&a->base, CALIBRATION_SENSOR_INVERTED) || ever(&a->base, CALIBRATION_CALLED_TWICE) ||
                     ever(&a->base, CALIBRATION_CALLS_LOST),
        clean = calibration_adversary_clean(a, a->base.run);
    for (uint32_t i = 0; result == GIB_OK && i < t->count; i++) {
        const gib_calibration_point *q = &t->point[i];
        for (int n = 0; n < 2; n++) {
            double said = a->mistake == CALIBRATION_NO_DOUBT ? 0.0 : q->gain_uncertainty_ratio[n];
            double error = fabs(q->gain_ratio[n] * (a->mistake == CALIBRATION_OFF ? 1.5 : 1.0) - 1.0 / a->gain[n]);
            law(&a->base, isfinite(q->gain_ratio[n]) && said > 0.0 && isfinite(said) && isfinite(q->phase_deg[n]),
                "a gain with an uncertainty");
            a->known[a->base.run]++;
            a->held[a->base.run] += error <= said + 0.005;
            law(&a->base, unknowable || error <= fmax(3.0 * said, clean ? 0.02 : 0.1), "a gain that is right, or refused");
        }
    }
}

static void calibrate(calibration_adversary *a, int run)
{
    gib_calibration *placed;
    gib_calibration_config scribbled = a->config;
    a->base.run = run;
    a->base.cycle = a->base.ended = a->named = a->in_phase = 0;
    memset(a->slide, 0, sizeof a->slide);
    memset(a->part, 0, sizeof a->part);
    memset(a->acceleration, 0, sizeof a->acceleration);
    memset(a->seen, 0, sizeof a->seen);
    a->command = a->goal_mm[0] = a->goal_mm[1] = 0.0;
    memset(&a->out, 0, sizeof a->out);
    for (int i = run; i < 2; i++) {
        memset(a->memory[i], 0xa5, sizeof a->memory[i]);
        law(&a->base, gib_calibration_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK, "an instance in memory of its own");
    }
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_calibration_start(gib_of(a, i), &scribbled) == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&a->before, 0, sizeof a->before);
    a->earlier = a->before;
    a->before.status = GIB_BUSY;
    if (a->mistake == CALIBRATION_REMEMBERS && run == 1) {
        gib_calibration_input in = {.position_mm = a->start_mm + 1.0};
        gib_calibration_step(gib_of(a, 0), &in, &a->out);
        a->out.owns_motion = 0;
    }
    while (cycle(a) == GIB_BUSY && !a->base.broken) {
    }
    a->base.ended = a->base.cycle;
    a->status[run] = a->out.status;
    law(&a->base, (a->out.status == GIB_DONE && !a->out.message) || (a->out.status < 0 && a->out.message == a->out.status), "a named end");
    gib_calibration_input odd = {NAN, NAN, INFINITY, {NAN, NAN}, 0xffffffffu, 0};
    for (int i = 0; i < 3 && !a->base.broken; i++) {
        gib_calibration_output after;
        int32_t kept = gib_calibration_step(gib_of(a, 0), &odd, &after);
        law(&a->base, kept == a->out.status && !after.owns_motion && isfinite(after.target_position_mm), "an end that is kept");
        gib_calibration_step(gib_of(a, 1), &odd, &after);
    }
    see_result(a);
}

void calibration_adversary_run(calibration_adversary *a)
{
    calibrate(a, 0);
    if (!a->base.broken) {
        calibrate(a, 1);
    }
}
