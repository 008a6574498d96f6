/* See learning_adversary.h. */
#include "learning_adversary.h"

#include <math.h>
#include <string.h>

const char *const learning_trouble_names[LEARNING_TROUBLES] = {
    "detected stuck", "detected NaN", "detected huge", "detected far",   "detected jumps", "detected noisy", "detected scaled",
    "angle stuck",    "angle NaN",    "angle jumps",   "angle wild",     "angle inverted", "target NaN",     "target jumps",
    "speed changes",  "spindle stops", "turns back",   "drive weak",     "shaken",         "drive trips",    "flag unknown",
    "abort flag",     "abort call",   "started anew",  "resumed",        "called twice",   "calls lost"};

static const double TWO_PI = 6.283185307179586;

/* Even, with standard deviation 1. */
static double noise(learning_adversary *a)
{
    return 3.4641016151377544 * between(&a->base, -0.5, 0.5);
}

static double within(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

/* How far the tool lags behind harmonic k, a share of it: |1 − G|. */
static double lags(const learning_adversary *a, int k)
{
    double at = TWO_PI * k / (a->turn_cycles * a->config.cycle_s) / a->w, re = 1.0 - at * at, im = 2.0 * a->damping * at, square = re * re + im * im;
    return hypot(1.0 - a->gain * re / square, a->gain * im / square);
}

static void draw_machine(learning_adversary *a)
{
    gib_learning_config *g = &a->config;
    double rpm;
    do {
        g->cycle_s = over(&a->base, 5e-5, 0.02);
        a->turn_cycles = over(&a->base, 30.0, 300.0);
        rpm = 60.0 / (a->turn_cycles * g->cycle_s);
    } while (rpm < 8.0 || rpm > 30000.0);
    g->harmonics = chance(&a->base, 0.3) ? 0 : 1 + (int)between(&a->base, 0.0, 16.0);
    a->form = (int)fmin(g->harmonics ? g->harmonics : 8, 0.1 * a->turn_cycles);
    a->w = TWO_PI * rpm / 60.0 * a->form * over(&a->base, 1.2, 8.0);
    a->damping = between(&a->base, 0.2, 1.0);
    a->gain = between(&a->base, 0.9, 1.1);
    double size = over(&a->base, 0.002, 3.0);
    for (int i = 0; i < 3; i++) {
        int k = 1 + (int)between(&a->base, 0.0, a->form);
        double way = size * between(&a->base, -1.0, 1.0) / k;
        a->coefficient[k - 1][i & 1] = way;
    }
    for (int k = 1; k <= a->form; k++) {
        a->lag_um += 1e3 * hypot(a->coefficient[k - 1][0], a->coefficient[k - 1][1]) * lags(a, k);
    }
}

void learning_adversary_init(learning_adversary *a, uint64_t seed, learning_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    gib_learning_config *g = &a->config;
    g->struct_size = sizeof *g;
    draw_machine(a);
    double turn_s = a->turn_cycles * g->cycle_s, rpm = 60.0 / turn_s, fastest = TWO_PI * a->form / turn_s;
    g->method = chance(&a->base, 0.3) ? GIB_LEARNING_PUBLISHED : GIB_LEARNING_FILTERED;
    int fewest = (int)fmax(16.0, 4.0 * (g->harmonics ? g->harmonics : 8)), most = g->method ? (int)fmax(16.0, a->turn_cycles) : 1024;
    g->points = 2 * (int)(0.5 * over(&a->base, fewest, fmax(fewest + 2.0, most)));
    g->points = g->points < fewest ? fewest + fewest % 2 : g->points;
    g->revolutions = 1 + (int)between(&a->base, 0.0, 3.0);
    g->settle_revolutions = 1 + (int)between(&a->base, 1.0, 5.0);
    g->updates = 1 + (int)between(&a->base, 0.0, 12.0);
    g->lag_s = fmin(0.1, 2.0 * a->damping / a->w * over(&a->base, 0.5, 2.0));
    g->lead_deg = chance(&a->base, 0.8) ? 0.0 : between(&a->base, 0.0, 20.0);
    g->gain_ratio = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 0.05, 1.0);
    g->tolerance_um = within(a->lag_um * over(&a->base, 0.01, 0.3), 1e-3, 1e3);
    g->correction_max_um = within(a->lag_um * over(&a->base, 0.3, 10.0), 0.1, 1e5);
    g->correction_speed_mm_s = within(1e-3 * a->lag_um * fastest * over(&a->base, 0.3, 50.0), 1e-3, 1e4);
    g->deviation_max_um = within(a->lag_um * over(&a->base, 3.0, 50.0), g->tolerance_um, 1e6);
    g->growth_ratio = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 1.01, 3.0);
    g->speed_min_rpm = within(rpm * over(&a->base, 0.05, 0.6), 1.0, 1e4);
    g->speed_tolerance_ratio = chance(&a->base, 0.5) ? 0.0 : over(&a->base, 0.01, 0.5);
    g->fade_s = within(turn_s * over(&a->base, 0.02, 3.0), 0.001, 10.0);
    g->wait_s = within(turn_s * over(&a->base, 4.0, 20.0) + 150.0 * g->cycle_s, 0.1, 1e5);
    a->noise_mm = 1e-3 * g->tolerance_um * over(&a->base, 0.003, 0.3);
    a->grid_mm = 1e-3 * g->tolerance_um * over(&a->base, 0.001, 0.3);
    a->counts = chance(&a->base, 0.4) ? 0.0 : over(&a->base, 2000.0, 1e6);
    a->wrapped = (int)between(&a->base, 0.0, 3.0);
    int count = chance(&a->base, 0.3) ? 0 : (int)between(&a->base, 1.0, LEARNING_MOST_TROUBLES + 1.0);
    double round = (g->settle_revolutions + g->revolutions + 2.0) * a->turn_cycles;
    troubles_draw(&a->base.troubles, &a->base.random, count, LEARNING_TROUBLES, round * fmin(g->updates, 5.0), 0.1, 0.3);
    a->cycles = (int)(round * (g->updates + 3.0) + 4.0 * g->wait_s / g->cycle_s + 3.0 * g->points * g->updates);
}

static gib_learning *gib_of(learning_adversary *a, int which)
{
    return (gib_learning *)a->memory[which];
}

/* Where the tool is to be, mm. */
static double wanted(const learning_adversary *a)
{
    double grown = within(0.5 * a->base.cycle / a->turn_cycles, 0.0, 1.0), sum = 0.0;
    grown *= grown * (3.0 - 2.0 * grown);
    for (int k = 1; k <= a->form; k++) {
        double c = a->coefficient[k - 1][0], s = a->coefficient[k - 1][1];
        sum += c == 0.0 && s == 0.0 ? 0.0 : c * cos(TWO_PI * k * a->angle) + s * sin(TWO_PI * k * a->angle);
    }
    return 40.0 + grown * sum;
}

/* One cycle of spindle and tool. */
static void machine(learning_adversary *a)
{
    const trouble *t;
    double base = 1.0 / a->turn_cycles, rate = base, h = a->config.cycle_s;
    if ((t = now(&a->base, LEARNING_SPEED_CHANGES)) != NULL) rate *= 0.7 + 0.6 * t->size;
    if (now(&a->base, LEARNING_SPINDLE_STOPS)) rate = 0.0;
    if (now(&a->base, LEARNING_SPINDLE_TURNS_BACK)) rate = -rate;
    a->rate += within(rate - a->rate, -0.5 * base * base, 0.5 * base * base);
    a->angle += a->rate;
    double due = (t = now(&a->base, LEARNING_DRIVE_WEAK)) != NULL ? 40.0 + (0.3 + 0.6 * t->size) * (a->command - 40.0) : a->command;
    int steps = (int)ceil(a->w * h / 0.1);
    h /= steps;
    a->seen = a->tool[0];
    for (int i = 0; i < steps; i++) {
        a->tool[1] += h * (a->w * a->w * (due - a->tool[0]) - 2.0 * a->damping * a->w * a->tool[1]);
        a->tool[0] += h * a->tool[1];
    }
}

/* What the sensors say, and what the kernel makes of it. */
static void tell(learning_adversary *a)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY};
    const gib_learning_config *g = &a->config;
    const trouble *t;
    gib_learning_input *in = &a->told;
    memset(in, 0, sizeof *in);
    a->target = in->target_mm = wanted(a);
    double of = 40.0 + a->gain * (a->seen - 40.0) + a->noise_mm * noise(a), angle = a->angle;
    if ((t = now(&a->base, LEARNING_SHAKEN)) != NULL) of += 1e-3 * a->lag_um * t->size * sin((0.02 + t->size) * a->base.cycle);
    if ((t = now(&a->base, LEARNING_DETECTED_NOISY)) != NULL) of += 1e-3 * a->lag_um * t->size * noise(a);
    if ((t = now(&a->base, LEARNING_DETECTED_SCALED)) != NULL) of = 40.0 + (0.5 + t->size) * (of - 40.0);
    if ((t = now(&a->base, LEARNING_DETECTED_JUMPS)) != NULL && chance(&a->base, 0.02)) of += 2e-3 * a->lag_um * (t->size - 0.5);
    a->stuck[0] = begins(&a->base, LEARNING_DETECTED_STUCK) ? of : a->stuck[0];
    if (now(&a->base, LEARNING_DETECTED_STUCK)) of = a->stuck[0];
    if ((t = now(&a->base, LEARNING_DETECTED_FAR)) != NULL)
        of += (t->size < 0.5 ? -1.2e-3 : 1.2e-3) * g->deviation_max_um + (of - in->target_mm);
    if ((t = now(&a->base, LEARNING_DETECTED_HUGE)) != NULL) of = t->size < 0.5 ? 1e300 : -1e13;
    if ((t = now(&a->base, LEARNING_DETECTED_NO_NUMBER)) != NULL) of = ODD[(int)(3.0 * t->size)];
    in->detected_mm = isfinite(of) ? a->grid_mm * floor(of / a->grid_mm + 0.5) : of;
    a->stuck[1] = begins(&a->base, LEARNING_ANGLE_STUCK) ? angle : a->stuck[1];
    if (now(&a->base, LEARNING_ANGLE_STUCK)) angle = a->stuck[1];
    if (begins(&a->base, LEARNING_ANGLE_JUMPS)) a->angle_added += now(&a->base, LEARNING_ANGLE_JUMPS)->size;
    angle = a->angle_added + (now(&a->base, LEARNING_ANGLE_INVERTED) ? -angle : angle);
    if (now(&a->base, LEARNING_ANGLE_WILD) && chance(&a->base, 0.3)) angle = between(&a->base, -1e6, 1e6);
    angle = a->counts > 0.0 ? floor(angle * a->counts) / a->counts : angle;
    angle -= a->wrapped == 0 ? 0.0 : floor(a->wrapped == 1 ? angle : angle + 0.5);
    in->angle_deg = 360.0 * angle;
    if ((t = now(&a->base, LEARNING_ANGLE_NO_NUMBER)) != NULL) in->angle_deg = ODD[(int)(3.0 * t->size)];
    if ((t = now(&a->base, LEARNING_TARGET_JUMPS)) != NULL) in->target_mm += 1e-3 * a->lag_um * t->size;
    if ((t = now(&a->base, LEARNING_TARGET_NO_NUMBER)) != NULL) in->target_mm = ODD[(int)(3.0 * t->size)];
    in->flags |= now(&a->base, LEARNING_DRIVE_TRIPS) ? (uint32_t)GIB_INPUT_FAULT : 0u;
    in->flags |= begins(&a->base, LEARNING_ABORT_FLAG) ? (uint32_t)GIB_INPUT_ABORT : 0u;
    if ((t = now(&a->base, LEARNING_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (2 + (int)(30.0 * t->size));
}

static int holds(int32_t status)
{
    return status == GIB_DONE || status == GIB_ERR_LEARNING_GROWS || status == GIB_ERR_LEARNING_UPDATES;
}

/* A command is a number, the target's and the correction's, and the correction keeps its bounds and changes by no more than its speed. */
static void see_command(learning_adversary *a)
{
    const gib_learning_config *g = &a->config;
    const gib_learning_output *o = &a->out, *b = &a->before;
    double step = 1e3 * g->correction_speed_mm_s * g->cycle_s;
    law(&a->base, isfinite(o->command_mm) && isfinite(o->correction_um), "a command that is a number");
    if (isfinite(a->told.target_mm)) {
        law(&a->base, fabs(o->command_mm - a->told.target_mm - 1e-3 * o->correction_um) <= 1e-10 * (1.0 + fabs(a->told.target_mm)),
            "a command made of target and correction");
    } else {
        law(&a->base, o->command_mm == b->command_mm && (o->message < 0 || b->status == GIB_OK),
            "a target that is no number named, the last command kept");
    }
    law(&a->base, fabs(o->correction_um) <= 1.002 * g->correction_max_um + 1e-9, "a correction within its bound");
    law(&a->base, fabs(o->correction_um - b->correction_um) <= step * (1.0 + 1e-9) + 2e-10, "a correction within its speed");
    int leaving = o->phase == GIB_LEARNING_STOPPING || (o->phase == GIB_LEARNING_FAILED && !holds(o->status));
    a->out_cycles = leaving ? a->out_cycles + 1 : 0;
    double due = g->fade_s / g->cycle_s + 1.1 * g->correction_max_um / step + 3.0;
    law(&a->base, a->out_cycles <= due || (o->correction_um == 0.0 && o->phase == GIB_LEARNING_FAILED), "no correction after a fault");
}

/* What is plainly wrong with an input is answered in its cycle, once and for all; waiting has its end. */
static void see_answer(learning_adversary *a, int was_busy)
{
    const gib_learning_config *g = &a->config;
    const gib_learning_output *o = &a->out;
    const gib_learning_input *in = &a->told;
    double left = fabs(in->target_mm - in->detected_mm);
    int lost = !isfinite(in->detected_mm) || !(left < 1e12), wild = !lost && left > 1.001e-3 * g->deviation_max_um;
    law(&a->base, !was_busy || !(in->flags || lost || wild || !isfinite(in->angle_deg) || !isfinite(in->target_mm)) || o->message < 0,
        "a fault in its cycle");
    if (was_busy && o->status == GIB_BUSY && o->phase != GIB_LEARNING_STOPPING) {
        law(&a->base, isfinite(in->angle_deg) || (o->reasons & GIB_LEARNING_BAD_ANGLE), "a fault in its cycle");
        law(&a->base, !lost || (o->reasons & GIB_LEARNING_NOT_DETECTED), "a fault in its cycle");
    }
    a->waits = o->reasons && o->status == GIB_BUSY && o->phase != GIB_LEARNING_STOPPING ? a->waits + 1 : 0;
    law(&a->base, a->waits <= g->wait_s / g->cycle_s + 2.0, "a state that ends in time");
    /* The slowest state: settling, with the spindle at its slowest. */
    double slowest = fmax(1.0, 60.0 / (g->speed_min_rpm * g->cycle_s * a->turn_cycles));
    double most = (g->settle_revolutions + g->revolutions + 3.0) * a->turn_cycles * slowest + g->fade_s / g->cycle_s + 2.1 * g->points + 100.0;
    a->in_phase = o->phase == a->before.phase && !o->reasons ? a->in_phase + 1 : 0;
    law(&a->base, o->status != GIB_BUSY || a->in_phase <= most || o->phase == GIB_LEARNING_STOPPING, "a state that ends in time");
}

/* Mistakes put in on purpose. */
static void spoil(learning_adversary *a)
{
    gib_learning_output *o = &a->out;
    double step = 1e3 * a->config.correction_speed_mm_s * a->config.cycle_s, was = o->correction_um;
    switch (a->mistake) {
    case LEARNING_LEAPS: o->correction_um += a->base.cycle % 500 == 499 ? 2.5 * step : 0.0; break;
    case LEARNING_TOO_FAR: o->correction_um *= 20.0; break;
    case LEARNING_NO_NUMBER: o->command_mm = a->base.cycle == 60 ? NAN : o->command_mm; break;
    case LEARNING_OF_ANOTHER: o->command_mm = a->before.command_mm; break;
    case LEARNING_SAYS_NOTHING: o->message = 0; break;
    case LEARNING_STAYS: o->correction_um = o->phase == GIB_LEARNING_FAILED ? a->before.correction_um : o->correction_um; break;
    case LEARNING_NEVER_ENDS:
        if (o->status == GIB_DONE) {
            o->status = GIB_BUSY;
            o->phase = GIB_LEARNING_SETTLE;
        }
        break;
    case LEARNING_TURNED_ROUND: o->correction_um *= cos(0.5 * TWO_PI * fmin(0.5 * a->after / a->turn_cycles, 1.0)); break;
    default: break;
    }
    o->command_mm += 1e-3 * (o->correction_um - was);
}

static void call(learning_adversary *a)
{
    gib_learning_output twin;
    int was_busy = a->before.status == GIB_BUSY && a->before.phase != GIB_LEARNING_STOPPING;
    if (begins(&a->base, LEARNING_ABORT_CALL)) {
        law(&a->base, gib_learning_abort(gib_of(a, 0)) == GIB_OK && gib_learning_abort(gib_of(a, 1)) == GIB_OK, "an abort");
        was_busy = 0;
    }
    memset(&a->out, 0x7f, sizeof a->out);
    memset(&twin, 0x7f, sizeof twin);
    int32_t status = gib_learning_step(gib_of(a, 0), &a->told, &a->out);
    law(&a->base, status == a->out.status, "an output that is written");
    law(&a->base, gib_learning_step(gib_of(a, 1), &a->told, &twin) == status && memcmp(&twin, &a->out, sizeof twin) == 0,
        "the same inputs, the same outputs");
    spoil(a);
    see_command(a);
    see_answer(a, was_busy);
    a->before = a->out;
    a->command = a->out.command_mm;
}

static void start_anew(learning_adversary *a, int resume)
{
    gib_learning_config other = a->config;
    other.resume = resume;
    int32_t status = gib_learning_start(gib_of(a, 0), &other);
    law(&a->base, status == (a->before.status == GIB_BUSY ? GIB_ERR_STATE : GIB_OK), "a start, refused while busy");
    gib_learning_start(gib_of(a, 1), &other);
    if (status == GIB_OK) {
        a->before.status = GIB_BUSY;
        a->before.phase = 0;
        a->waits = a->in_phase = 0;
    }
}

static int cycle(learning_adversary *a)
{
    a->base.cycle++;
    if (a->base.run == 0) {
        troubles_begin(&a->base.troubles, a->base.cycle);
    }
    machine(a);
    tell(a);
    if (now(&a->base, LEARNING_STARTED_ANEW)) start_anew(a, 0);
    if (now(&a->base, LEARNING_RESUMED)) start_anew(a, 1);
    if (a->base.run == 0 && a->base.cycle == 100) {
        memcpy(a->memory[1], a->memory[0], sizeof a->memory[0]);
    }
    const trouble *t = now(&a->base, LEARNING_CALLS_LOST);
    if (!(t && chance(&a->base, 0.2 * t->size))) {
        call(a);
        if (now(&a->base, LEARNING_CALLED_TWICE)) {
            call(a);
        }
    }
    /* Without a correction before the first update, with it after the end. */
    double left = 1e3 * (a->target - (40.0 + a->gain * (a->seen - 40.0)));
    int turn = (int)(a->base.cycle / a->turn_cycles);
    a->squares[0] += turn >= 4 && turn < 6 ? left * left / (2.0 * a->turn_cycles) : 0.0;
    a->after = a->out.status == GIB_BUSY ? 0 : a->after + 1;
    double rest = (a->config.settle_revolutions + 4.0) * a->turn_cycles + a->config.fade_s / a->config.cycle_s;
    a->squares[1] += a->after > rest ? left * left / (2.0 * a->turn_cycles) : 0.0;
    return a->after <= rest + 2.0 * a->turn_cycles;
}

int learning_adversary_clean(const learning_adversary *a, int run)
{
    return run == 1 || troubles_met(&a->base.troubles) == 0;
}

/* What was learnt, and that nothing of a run before is in it. */
static void see_result(learning_adversary *a)
{
    gib_learning_report *r = &a->report[a->base.run], other;
    size_t count[2] = {0, 0};
    gib_learning_result(gib_of(a, 0), r);
    gib_learning_result(gib_of(a, 1), &other);
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_learning_points(gib_of(a, i), a->points[i], 1024, &count[i]) == GIB_OK, "points");
    }
    law(&a->base,
        memcmp(r, &other, sizeof other) == 0 && count[0] == count[1] &&
            memcmp(a->points[0], a->points[1], count[0] * sizeof a->points[0][0]) == 0,
        "the same inputs, the same result");
    a->first[a->base.run] = sqrt(a->squares[0]);
    a->last[a->base.run] = sqrt(a->squares[1]);
    int clean = learning_adversary_clean(a, a->base.run);
    double noise_um = 1e3 * hypot(a->noise_mm, a->grid_mm);
    /* A first trial may leave more than was there before, see docs; the published method may go on so. */
    int grows = a->config.method || a->config.deviation_max_um < 12.0 * a->lag_um;
    law(&a->base, !clean || grows || holds(a->status[a->base.run]), "what was learnt kept, no worse, and as good as it says");
    law(&a->base, !clean || a->last[a->base.run] <= 1.1 * a->first[a->base.run] + noise_um,
        "what was learnt kept, no worse, and as good as it says");
    /* What it says is of the means at its points: a part of the deviation and of the angle's grid does not show there. The published method
     * may have few of them. */
    law(&a->base,
        !clean || a->config.method || a->status[a->base.run] != GIB_DONE ||
            a->last[a->base.run] <= 1.3 * a->config.tolerance_um + noise_um + 0.04 * a->first[a->base.run],
        "what was learnt kept, no worse, and as good as it says");
}

static void learn(learning_adversary *a, int run)
{
    gib_learning *placed;
    gib_learning_config scribbled = a->config;
    a->base.run = run;
    a->base.cycle = a->waits = a->out_cycles = a->after = a->in_phase = 0;
    a->angle = between(&a->base, -3.0, 3.0);
    a->rate = chance(&a->base, 0.5) ? 0.0 : 1.0 / a->turn_cycles;
    a->tool[0] = a->seen = a->command = 40.0;
    a->tool[1] = a->angle_added = 0.0;
    memset(a->squares, 0, sizeof a->squares);
    for (int i = run; i < 2; i++) {
        memset(a->memory[i], 0xa5, sizeof a->memory[i]);
        law(&a->base, gib_learning_init_in(a->memory[i], sizeof a->memory[i], &placed) == GIB_OK, "an instance in memory of its own");
    }
    if (run == 1) {
        /* What still runs or is kept is aborted, and fades out. */
        gib_learning_output out;
        gib_learning_input in = {.target_mm = 40.0, .detected_mm = 40.0, .angle_deg = a->told.angle_deg};
        double step = 1e3 * a->config.correction_speed_mm_s * a->config.cycle_s;
        gib_learning_abort(gib_of(a, 0));
        for (int i = 0; i <= a->config.fade_s / a->config.cycle_s + 1.1 * a->config.correction_max_um / step + 3.0; i++) {
            gib_learning_step(gib_of(a, 0), &in, &out);
        }
        law(&a->base, out.status < 0 && out.correction_um == 0.0 && out.command_mm == 40.0, "an abort that takes the correction out");
    }
    for (int i = 0; i < 2; i++) {
        law(&a->base, gib_learning_start(gib_of(a, i), &scribbled) == GIB_OK, "a start");
    }
    memset(&scribbled, 0x7f, sizeof scribbled);
    memset(&a->before, 0, sizeof a->before);
    a->before.status = GIB_BUSY;
    if (a->mistake == LEARNING_REMEMBERS && run == 1) {
        gib_learning_input in = {.target_mm = 40.0, .detected_mm = 40.0, .angle_deg = 90.0};
        gib_learning_step(gib_of(a, 0), &in, &a->out);
    }
    while (cycle(a) && !a->base.broken && a->base.cycle < 3 * a->cycles) {
    }
    a->status[run] = a->out.status;
    law(&a->base, a->out.status != GIB_BUSY || a->base.run == 0, "a state that ends in time");
    if (!a->base.broken) {
        see_result(a);
    }
}

void learning_adversary_run(learning_adversary *a)
{
    learn(a, 0);
    if (!a->base.broken) {
        learn(a, 1);
    }
}
