/* See vibration_adversary.h. */
#include "vibration_adversary.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *const vibration_trouble_names[VIBRATION_TROUBLES] = {
    "sensor stuck", "sensor dead",   "sensor inverted", "sensor NaN",     "sensor huge",   "sensor jumps",     "sensor noisy",  "sensor scaled",
    "sensors swapped", "sensors slow", "angle stuck",   "angle NaN",      "angle jumps",   "angle wild",       "angle inverted", "scale NaN",
    "scale huge",   "second NaN",    "second huge",     "second jumps",   "speed changes", "spindle stops",    "turns back",    "blows",
    "shaken",       "drive trips",   "flag unknown",    "abort flag",     "abort call",    "started anew",     "called twice",  "calls lost"};

static const double TWO_PI = 6.283185307179586;

/* Even, with standard deviation 1. */
static double noise(vibration_adversary *a)
{
    return 3.4641016151377544 * between(&a->base, -0.5, 0.5);
}

static double within(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

static gib_vibration *gib_of(vibration_adversary *a, int which)
{
    return (gib_vibration *)a->memory[which];
}

/* Harmonics `first` to `last` over the angle in turns, two coefficients each; or how they bend, their second derivative over time. */
static double form(const double *coefficient, int first, int last, double angle, double speed, double change, int bends)
{
    double sum = 0.0;
    for (int k = first; k <= last; k++, coefficient += 2) {
        double c = coefficient[0], s = coefficient[1];
        if (c != 0.0 || s != 0.0) {
            double co = cos(TWO_PI * k * angle), si = sin(TWO_PI * k * angle), at = TWO_PI * k * speed;
            sum += bends ? -at * at * (c * co + s * si) + TWO_PI * k * change * (s * co - c * si) : c * co + s * si;
        }
    }
    return sum;
}

static double second_um(const vibration_adversary *a, double angle, double speed, double change, int bends)
{
    return form(a->second, a->second_multiple, a->second_multiple, angle, speed, change, bends);
}

/* One cycle of spindle and machine. */
static void machine(vibration_adversary *a)
{
    const trouble *t;
    double base = 1.0 / a->turn_cycles, turns = a->base.cycle * base,
           wanted = base * (1.0 + a->swing * sin(TWO_PI * turns / a->swing_turns));
    if ((t = now(&a->base, VIBRATION_SPEED_CHANGES)) != NULL) wanted *= 0.5 + t->size;
    if (now(&a->base, VIBRATION_SPINDLE_STOPS)) wanted = 0.0;
    if (now(&a->base, VIBRATION_SPINDLE_TURNS_BACK)) wanted = -wanted;
    double most = 0.5 * base * base, change = within(wanted - a->rate, -most, most), h = a->config.cycle_s / a->steps;
    double blow = (t = now(&a->base, VIBRATION_BLOWS)) != NULL && chance(&a->base, 0.02) ? 20.0 * t->size : 0.0;
    /* The stroke grows over two turns. */
    double acceleration[2] = {0.0, 0.0}, grown = within(0.5 * turns, 0.0, 1.0);
    grown *= grown * (3.0 - 2.0 * grown);
    for (int i = 0; i < a->steps; i++) {
        double u = (i + 1.0) / a->steps, speed = (a->rate + change * u) / a->config.cycle_s, bend = change / (a->config.cycle_s * a->config.cycle_s);
        double angle = a->angle + a->rate * u + 0.5 * change * u * u;
        double slide = form(a->coefficient[0], 1, a->form, angle, speed, bend, 1);
        slide *= grown;
        double thrown = grown * form(a->unbalance, 1, 1, angle, speed, bend, 1);
        for (int n = 0; n < 2; n++) {
            double w = a->w[n], x = a->part[n][0], v = a->part[n][1];
            /* Where it is when it has that acceleration. */
            a->seen[n] = x;
            acceleration[n] = a->takes[n] * (slide + (n ? blow * 1e6 * a->noise[n] : 0.0)) + (n ? thrown : 0.0) - w * w * x - 2.0 * a->damping[n] * w * v;
            a->part[n][1] += h * acceleration[n];
            a->part[n][0] += h * a->part[n][1];
            double felt = a->gain[n] * (acceleration[n] + (n == 0 ? second_um(a, angle, speed, bend, 1) : 0.0));
            double part = a->lag_s[n] > 0.0 ? 1.0 - exp(-h / a->lag_s[n]) : 1.0;
            /* Half a step of the lag is what a hold over the step adds. */
            double before = a->filtered[n];
            a->filtered[n] += part * (0.5 * (felt + a->held[n]) - before) * (a->lag_s[n] > 0.0 ? 1.0 : 0.0);
            a->filtered[n] = a->lag_s[n] > 0.0 ? a->filtered[n] : felt;
            a->held[n] = felt;
        }
    }
    a->angle += a->rate + 0.5 * change;
    a->rate += change;
    a->truth = a->seen[0] - a->seen[1];
}

/* What the sensors say, and what the kernel makes of it. */
static void tell(vibration_adversary *a)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY};
    const gib_vibration_config *g = &a->config;
    const trouble *t;
    gib_vibration_input *in = &a->told;
    double range = g->acceleration_range_m_s2, of[2], angle = a->angle, shaken = 0.0;
    memset(in, 0, sizeof *in);
    if ((t = now(&a->base, VIBRATION_SHAKEN)) != NULL) shaken = 10.0 * t->size * sin((0.05 + t->size) * a->base.cycle);
    for (int n = 0; n < 2; n++) {
        of[n] = 1e-6 * a->filtered[n] + a->offset[n] + a->drift[n] * a->base.cycle + a->noise[n] * (noise(a) + shaken);
        of[n] = a->grid * floor(within(of[n], -range, range) / a->grid + 0.5);
        if ((t = now(&a->base, VIBRATION_SENSOR_DEAD)) != NULL && t->at % 2 == n) of[n] = t->size < 0.5 ? 0.0 : a->noise[n] * noise(a);
        if ((t = now(&a->base, VIBRATION_SENSOR_INVERTED)) != NULL && t->at % 2 == n) of[n] = -of[n];
        if ((t = now(&a->base, VIBRATION_SENSOR_JUMPS)) != NULL && t->at % 2 == n) of[n] += 0.2 * t->size * range;
        if ((t = now(&a->base, VIBRATION_SENSOR_NOISY)) != NULL && t->at % 2 == n) of[n] += 0.1 * t->size * range * noise(a);
        if ((t = now(&a->base, VIBRATION_SENSOR_SCALED)) != NULL && t->at % 2 == n) of[n] *= 0.3 + 1.5 * t->size;
        a->stuck[n] = begins(&a->base, VIBRATION_SENSOR_STUCK) ? of[n] : a->stuck[n];
        if ((t = now(&a->base, VIBRATION_SENSOR_STUCK)) != NULL && t->at % 2 == n) of[n] = a->stuck[n];
        if ((t = now(&a->base, VIBRATION_SENSOR_HUGE)) != NULL && t->at % 2 == n) of[n] = t->size < 0.5 ? range : -DBL_MAX;
        if ((t = now(&a->base, VIBRATION_SENSOR_NO_NUMBER)) != NULL && t->at % 2 == n) of[n] = ODD[(int)(3.0 * t->size)];
    }
    int swapped = now(&a->base, VIBRATION_SENSORS_SWAPPED) != NULL;
    in->acceleration_m_s2[0] = of[swapped];
    in->acceleration_m_s2[1] = of[!swapped];
    if (now(&a->base, VIBRATION_SENSORS_SLOW) && a->base.cycle % 2) {
        memcpy(in->acceleration_m_s2, a->told_before.acceleration_m_s2, sizeof in->acceleration_m_s2);
    }
    a->stuck[2] = begins(&a->base, VIBRATION_ANGLE_STUCK) ? angle : a->stuck[2];
    if (now(&a->base, VIBRATION_ANGLE_STUCK)) angle = a->stuck[2];
    if (begins(&a->base, VIBRATION_ANGLE_JUMPS)) a->angle_added += now(&a->base, VIBRATION_ANGLE_JUMPS)->size;
    angle = a->angle_added + (now(&a->base, VIBRATION_ANGLE_INVERTED) ? -angle : angle);
    if (now(&a->base, VIBRATION_ANGLE_WILD) && chance(&a->base, 0.3)) angle = between(&a->base, -1e6, 1e6);
    angle = a->counts > 0.0 ? floor(angle * a->counts) / a->counts : angle;
    angle -= a->wrapped == 0 ? 0.0 : floor(a->wrapped == 1 ? angle : angle + 0.5);
    a->told_angle = in->angle_deg = 360.0 * angle;
    if ((t = now(&a->base, VIBRATION_ANGLE_NO_NUMBER)) != NULL) in->angle_deg = ODD[(int)(3.0 * t->size)];
    /* The scale: another form of any size; the second slide with an origin of its own. */
    in->scale_mm = a->scale_mm + 1e-3 * form(a->coefficient[0], 1, a->form, a->angle, 0.0, 0.0, 0);
    in->scale_mm = a->scale_grid * floor(in->scale_mm / a->scale_grid + 0.5);
    in->second_slide_mm = g->second_slide ? 12.0 + 1e-3 * second_um(a, a->angle, 0.0, 0.0, 0) : NAN;
    if ((t = now(&a->base, VIBRATION_SCALE_HUGE)) != NULL) in->scale_mm = t->size < 0.5 ? 1e300 : -DBL_MAX;
    if ((t = now(&a->base, VIBRATION_SCALE_NO_NUMBER)) != NULL) in->scale_mm = ODD[(int)(3.0 * t->size)];
    if ((t = now(&a->base, VIBRATION_SECOND_JUMPS)) != NULL) in->second_slide_mm += t->size;
    if ((t = now(&a->base, VIBRATION_SECOND_HUGE)) != NULL) in->second_slide_mm = t->size < 0.3 ? 1e30 : t->size < 0.6 ? 1e150 : -DBL_MAX;
    if ((t = now(&a->base, VIBRATION_SECOND_NO_NUMBER)) != NULL) in->second_slide_mm = ODD[(int)(3.0 * t->size)];
    in->flags |= now(&a->base, VIBRATION_DRIVE_TRIPS) ? (uint32_t)GIB_INPUT_FAULT : 0u;
    in->flags |= begins(&a->base, VIBRATION_ABORT_FLAG) ? (uint32_t)GIB_INPUT_ABORT : 0u;
    if ((t = now(&a->base, VIBRATION_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (2 + (int)(30.0 * t->size));
}

/* Whether a trouble was met that cannot be told from a machine that swings otherwise; or whether it only begins. */
static int misled(const vibration_adversary *a)
{
    static const int NAMED[] = {VIBRATION_SENSOR_NO_NUMBER, VIBRATION_SENSOR_HUGE, VIBRATION_SENSOR_STUCK, VIBRATION_ANGLE_NO_NUMBER, VIBRATION_DRIVE_TRIPS,
                                VIBRATION_FLAG_UNKNOWN, VIBRATION_ABORT_FLAG, VIBRATION_ABORT_CALL, VIBRATION_STARTED_ANEW, VIBRATION_SCALE_NO_NUMBER};
    int named = 0;
    for (int i = 0; i < (int)(sizeof NAMED / sizeof *NAMED); i++) {
        named += troubles_ever(&a->base.troubles, NAMED[i]);
    }
    return a->base.cycle < 10.0 * a->turn_cycles || (a->base.run == 0 && named < troubles_met(&a->base.troubles));
}

/* What noise leaves in the displacement, averaged as it may be, µm. */
static double floor_um(const vibration_adversary *a)
{
    double turning = TWO_PI / (a->turn_cycles * a->config.cycle_s), revolutions = a->config.averaging_revolutions;
    double share = fmax(1.0 / (revolutions > 0.0 ? revolutions : 16.0), a->swing > 0.0 ? 0.5 : 0.1);
    double variance = a->noise[0] * a->noise[0] + a->noise[1] * a->noise[1] + a->grid * a->grid / 6.0;
    return 1e6 * sqrt(2.0 * share / a->turn_cycles * variance) / (turning * turning);
}

/* What both encoders say; a second slide beyond 1e9 mm is nowhere. */
static double plain_mm(const vibration_adversary *a)
{
    double second = a->config.second_slide ? a->told.second_slide_mm : 0.0;
    return a->told.scale_mm + (fabs(second) < 1e9 ? second : NAN);
}

/* A position is a number, the scale's and the correction's, and the correction goes as its blend and the machine do. */
static void see_position(vibration_adversary *a, double plain)
{
    const gib_vibration_output *o = &a->out, *b = &a->before;
    const gib_vibration_config *g = &a->given;
    double most = 2.0 * g->displacement_max_um, fade = fmin(1.0, g->cycle_s / g->fade_s);
    law(&a->base,
        isfinite(o->position_mm) && isfinite(o->correction_um) && isfinite(o->relative_um) && isfinite(o->speed_rpm) &&
            isfinite(o->blend_ratio) && isfinite(o->displacement_um[0]) && isfinite(o->displacement_um[1]),
        "a position that is a number");
    if (!isfinite(plain)) {
        law(&a->base, o->position_mm == b->position_mm && (o->message < 0 || b->status != GIB_BUSY),
            "a scale that is no number named, the last position kept");
    } else {
        law(&a->base, fabs(o->position_mm - plain - 1e-3 * o->correction_um) <= 1e-9 + 1e-12 * fabs(plain),
            "a position made of scale and correction");
    }
    law(&a->base, fabs(o->correction_um) <= most * (1.0 + 1e-6), "a correction no larger than is plausible");
    law(&a->base, fabs(o->blend_ratio - b->blend_ratio) <= fade * (1.0 + 1e-9) || o->status != GIB_BUSY,
        "a correction that comes and goes within its time");
    a->bad = o->reasons != 0 || o->status != GIB_BUSY || o->phase == GIB_VIBRATION_STOPPING ? a->bad + 1 : 0;
    /* What still goes after a start goes as it did before. */
    double longest = fmax(a->config.fade_s, g->fade_s) / g->cycle_s;
    law(&a->base, a->bad <= fmax(longest, 1.0) + 2.0 || o->correction_um == 0.0, "the plain scale where something is wrong");
    /* Where nothing has misled it, it moves as the machine does, a harmonic that is renewed at a changing speed aside. The first
     * revolutions tell of a stroke that still grows. */
    double turn = fmin(fabs(a->rate) + 0.5 / a->turn_cycles / a->turn_cycles, 0.5), faster = fmax(1.0, pow(fabs(a->rate) * a->turn_cycles, 2.0));
    double natural = TWO_PI * turn * vibration_adversary_swings(a, 1, 0) * faster + fade * most;
    law(&a->base,
        misled(a) || g->method != GIB_VIBRATION_HARMONIC || fabs(o->correction_um - b->correction_um) <= 3.0 * natural + 4.0 * floor_um(a),
        "a correction without a jump");
}

/* What is plainly wrong with an input is answered in its cycle, once and for all. */
static void see_answer(vibration_adversary *a, int was_running)
{
    const gib_vibration_config *g = &a->given;
    const gib_vibration_output *o = &a->out;
    const gib_vibration_input *in = &a->told;
    double range = g->acceleration_range_m_s2, most = g->acceleration_max_m_s2 > 0.0 ? g->acceleration_max_m_s2 : range;
    if (!was_running) {
        return;
    }
    law(&a->base, !in->flags || o->message < 0, "a fault in its cycle");
    if (o->phase == GIB_VIBRATION_STOPPING || o->phase == GIB_VIBRATION_FAILED) {
        return;
    }
    uint32_t asked = isfinite(in->angle_deg) ? 0u : (uint32_t)GIB_VIBRATION_BAD_ANGLE;
    for (int n = 0; n < 2; n++) {
        double reading = in->acceleration_m_s2[n];
        uint32_t why = !isfinite(reading) ? GIB_VIBRATION_NOT_A_NUMBER : fabs(reading) >= range ? GIB_VIBRATION_SATURATED : 0u;
        law(&a->base, !(fabs(reading) > most) || o->reasons != 0, "a fault in its cycle");
        asked |= why << (8 * n);
    }
    law(&a->base, (o->reasons & asked) == asked && (asked == 0 || o->message < 0), "a fault in its cycle");
    law(&a->base, o->reasons == 0 ? o->phase == GIB_VIBRATION_CORRECTING && o->message == 0 : o->phase != GIB_VIBRATION_CORRECTING,
        "a phase that fits its reasons");
}

/* Where all has been well for some revolutions the correction is there. */
static void see_diligence(vibration_adversary *a)
{
    const gib_vibration_config *g = &a->given;
    int well = !a->bad || a->out.phase == GIB_VIBRATION_WAITING || a->out.phase == GIB_VIBRATION_DEGRADED;
    double turns = fabs(a->rate), due = 8.0 * a->turn_cycles + 40.0 + (2.0 * g->fade_s + 8.0 * g->speed_filter_s) / g->cycle_s;
    for (int kind = 0; kind < VIBRATION_TROUBLES; kind++) {
        well &= now(&a->base, kind) == NULL;
    }
    well &= turns > 0.85 / a->turn_cycles && turns < 1.15 / a->turn_cycles && a->out.status == GIB_BUSY;
    a->good_cycles = well ? a->good_cycles + 1 : 0;
    /* What is integrated may be implausible at any time: see draw. */
    law(&a->base, a->good_cycles <= due || g->method == GIB_VIBRATION_INTEGRATE || (a->out.blend_ratio == 1.0 && a->out.reasons == 0),
        "a correction where all is well");
}

/* Mistakes put in on purpose. */
static void spoil(vibration_adversary *a)
{
    gib_vibration_output *o = &a->out;
    switch (a->mistake) {
    case VIBRATION_LEAPS: o->correction_um += a->base.cycle % 1000 == 0 ? 0.5 * a->config.displacement_max_um : 0.0; break;
    case VIBRATION_TOO_FAR: o->correction_um *= 1e4; break;
    case VIBRATION_NO_NUMBER: o->position_mm = a->base.cycle == 60 ? NAN : o->position_mm; break;
    case VIBRATION_OF_ANOTHER: o->position_mm = a->before.position_mm; break;
    case VIBRATION_SAYS_NOTHING: o->message = 0; break;
    case VIBRATION_STAYS: o->correction_um = o->status == GIB_BUSY ? o->relative_um : o->correction_um; break;
    case VIBRATION_NEVER_COMES: o->blend_ratio = fmin(o->blend_ratio, 0.5); break;
    case VIBRATION_HARMS: o->correction_um *= 1.0 + 4.0 * pow(sin(3.0 * a->base.cycle / a->turn_cycles), 2.0); break;
    case VIBRATION_HALF: o->correction_um *= 0.5; break;
    default: break;
    }
    if (a->mistake == VIBRATION_STAYS || a->mistake == VIBRATION_HALF || a->mistake == VIBRATION_HARMS || a->mistake == VIBRATION_TOO_FAR || a->mistake == VIBRATION_LEAPS) {
        double plain = plain_mm(a);
        o->position_mm = isfinite(plain) ? plain + 1e-3 * o->correction_um : o->position_mm;
    }
}

static void call(vibration_adversary *a)
{
    gib_vibration_output twin;
    int was_running = a->before.status == GIB_BUSY && a->before.phase != GIB_VIBRATION_STOPPING;
    double plain = plain_mm(a);
    if (begins(&a->base, VIBRATION_ABORT_CALL)) {
        law(&a->base, gib_vibration_abort(gib_of(a, 0)) == GIB_OK && gib_vibration_abort(gib_of(a, 1)) == GIB_OK, "an abort");
        was_running = 0;
    }
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_vibration_step(gib_of(a, 0), &a->told, &a->out);
    law(&a->base, status == a->out.status, "an output that is written");
    law(&a->base, gib_vibration_step(gib_of(a, 1), &a->told, &twin) == status && memcmp(&twin, &a->out, sizeof twin) == 0,
        "the same inputs, the same outputs");
    spoil(a);
    see_position(a, plain);
    see_answer(a, was_running);
    see_diligence(a);
    a->before = a->out;
}

/* How far the position is from the truth, over the last revolutions and ever. */
static void see_truth(vibration_adversary *a)
{
    double error = a->out.correction_um - a->truth, from = a->cycles - 10.0 * a->turn_cycles;
    a->peak = fmax(a->peak, fabs(a->truth));
    a->worst = fmax(a->worst, misled(a) ? 0.0 : fabs(error));
    /* What goes after a scale that was no number does not swing any more. */
    double share = a->out.status == GIB_BUSY ? 1.5 : 2.2;
    law(&a->base, misled(a) || a->config.method != GIB_VIBRATION_HARMONIC || fabs(error) <= share * a->peak + 6.0 * floor_um(a),
        "a correction that does no harm");
    if (a->base.cycle > from) {
        a->errors += error * error;
        a->truths += a->truth * a->truth;
    }
}

static void cycle(vibration_adversary *a)
{
    a->base.cycle++;
    if (a->base.run == 0) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    machine(a);
    tell(a);
    const trouble *t = now(&a->base, VIBRATION_STARTED_ANEW);
    if (t) {
        gib_vibration_config other = a->config;
        other.fade_s = within(other.fade_s * (0.3 + t->size), 0.001, 10.0);
        int32_t status = gib_vibration_start(gib_of(a, 0), &other, a->has_table ? &a->table : NULL);
        law(&a->base, status == (a->before.status == GIB_BUSY ? GIB_ERR_STATE : GIB_OK), "a start, refused while busy");
        gib_vibration_start(gib_of(a, 1), &other, a->has_table ? &a->table : NULL);
        if (status == GIB_OK) {
            a->given = other;
            a->before.status = GIB_BUSY;
            a->before.phase = 0;
        }
    }
    if (a->base.run == 0 && a->base.cycle == 100) {
        memcpy(a->memory[1], a->memory[0], sizeof a->memory[0]);
    }
    t = now(&a->base, VIBRATION_CALLS_LOST);
    if (!(t && chance(&a->base, 0.2 * t->size))) {
        call(a);
        if (now(&a->base, VIBRATION_CALLED_TWICE)) {
            call(a);
        }
    }
    see_truth(a);
    a->told_before = a->told;
}

int vibration_adversary_clean(const vibration_adversary *a, int run)
{
    return run == 1 || troubles_met(&a->base.troubles) == 0;
}

static void correct(vibration_adversary *a, int run)
{
    gib_vibration *placed;
    gib_vibration_config scribbled = a->config;
    a->base.run = run;
    a->base.cycle = a->bad = a->good_cycles = 0;
    memset(a->part, 0, sizeof a->part);
    memset(a->filtered, 0, sizeof a->filtered);
    memset(a->held, 0, sizeof a->held);
    a->truths = a->errors = a->angle_added = a->worst = a->peak = 0.0;
    a->angle = between(&a->base, -3.0, 3.0);
    a->rate = chance(&a->base, 0.5) ? 0.0 : 1.0 / a->turn_cycles;
    a->scale_mm = between(&a->base, -300.0, 300.0);
    for (int i = run; i < 2; i++) {
        memset(a->memory[i], 0xa5, sizeof a->memory[i]);
        law(&a->base, gib_vibration_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK, "an instance in memory of its own");
    }
    if (run == 1) {
        /* What still runs is aborted, and fades out on the plain scale. */
        gib_vibration_output out;
        gib_vibration_input in = {.scale_mm = a->scale_mm, .angle_deg = a->told_angle};
        gib_vibration_abort(gib_of(a, 0));
        for (int i = 0; i <= a->given.fade_s / a->given.cycle_s + 2.0; i++) {
            gib_vibration_step(gib_of(a, 0), &in, &out);
        }
        law(&a->base, out.status < 0 && out.correction_um == 0.0 && out.position_mm == a->scale_mm,
            "an abort that ends on the plain scale");
    }
    a->given = a->config;
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_vibration_start(gib_of(a, i), &scribbled, a->has_table ? &a->table : NULL) == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&a->before, 0, sizeof a->before);
    a->before.status = GIB_BUSY;
    if (a->mistake == VIBRATION_REMEMBERS && run == 1) {
        gib_vibration_input in = {.scale_mm = a->scale_mm, .angle_deg = 90.0};
        gib_vibration_step(gib_of(a, 0), &in, &a->out);
    }
    while (a->base.cycle < a->cycles && !a->base.broken) {
        cycle(a);
    }
    a->status[run] = a->out.status;
    double window = fmin(10.0 * a->turn_cycles, a->cycles);
    a->left[run] = sqrt(a->errors / window);
    a->without[run] = sqrt(a->truths / window);
    a->floor_um[run] = floor_um(a);
    if (a->base.broken) {
        return;
    }
    double share = (a->swing > 0.0 ? 0.5 : 0.1) + 2.0 / a->turn_cycles;
    int helps = a->left[run] <= share * a->without[run] + 4.0 * a->floor_um[run];
    law(&a->base, helps || !vibration_adversary_clean(a, run) || a->config.method != GIB_VIBRATION_HARMONIC, "a correction that helps");
}

void vibration_adversary_run(vibration_adversary *a)
{
    correct(a, 0);
    if (!a->base.broken) {
        correct(a, 1);
    }
}
