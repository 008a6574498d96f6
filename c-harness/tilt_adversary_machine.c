/* The random machine, its drive and its kernel, and what the troubles make of them; see tilt_adversary.h. */
#include "tilt_adversary.h"

#include <float.h>

const char *const tilt_trouble_names[TILT_TROUBLES] = {
    "load stuck",     "load dead",          "load NaN",         "load huge",        "load jumps",    "load noisy",      "load saturated",
    "load late",      "load foreign",       "load missing",     "speed stuck",      "speed dead",    "speed NaN",       "speed scaled",
    "position stuck", "position NaN",       "position jumps",   "position closed",  "position swapped", "angle turns",  "angle NaN",
    "cutting always", "cutting never",      "cutting flickers", "feed changed",     "feed held",     "tool breaks",     "skin",
    "ends early",     "taken off",          "drive trips",      "flag unknown",     "abort flag",    "abort call",      "started anew",
    "no answer",      "answers wildly",     "answers again",    "called twice",     "calls lost"};

static const double PI = 3.14159265358979323846;

/* Normal with standard deviation 1. */
static double normal(tilt_adversary *a)
{
    double radius = sqrt(-2.0 * log(1.0 - between(&a->base, 0.0, 1.0)));
    return radius * cos(2.0 * PI * between(&a->base, 0.0, 1.0));
}

static double within(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

static double load_of(const tilt_adversary *a, double depth)
{
    double d = fmax(depth, 0.0);
    return a->load_at_0 + a->rise * d + a->knee * (1.0 - exp(-d / a->knee_mm));
}

/* Passes forth and back along a line, or over a plane so that no direction goes one way with time. */
static void draw_path(tilt_adversary *a, double length)
{
    static const double ROWS[TILT_MOST_PASSES] = {0.1, 0.5, 0.9, 1.0, 0.4, 0.0};
    double toward = floor(between(&a->base, 0.0, 4.0)) * 0.5 * PI + (chance(&a->base, 0.3) ? between(&a->base, 0.2, 1.3) : 0.0),
           c = cos(toward), s = sin(toward);
    double width = chance(&a->base, 0.7) ? between(&a->base, 0.15, 0.8) * length : 0.0, low[2] = {0.0, 0.0}, high[2] = {0.0, 0.0};
    a->passes = width > 0.0 ? TILT_MOST_PASSES - (int)between(&a->base, 0.0, 4.0) : 1 + (int)between(&a->base, 0.0, 4.0);
    for (int i = 0; i < a->passes; i++) {
        double ends[2] = {0.0, length}, v = width * ROWS[i];
        for (int end = 0; end < 2; end++) {
            double u = ends[(i + end) % 2];
            a->way[i][2 * end] = c * u - s * v;
            a->way[i][2 * end + 1] = s * u + c * v;
            for (int k = 0; k < 2; k++) {
                low[k] = fmin(low[k], a->way[i][2 * end + k]);
                high[k] = fmax(high[k], a->way[i][2 * end + k]);
            }
        }
    }
    a->extent_mm = hypot(high[0] - low[0], high[1] - low[1]);
    double top = over(&a->base, 1.0, 15.0), steep = chance(&a->base, 0.1) ? 0.0 : tan(over(&a->base, 0.02, 5.0) * PI / 180.0),
           up = width > 0.0 ? between(&a->base, 0.0, 2.0 * PI) : toward;
    steep = fmin(steep, 0.6 * top / a->extent_mm);
    a->plane.gx = steep * cos(up);
    a->plane.gy = steep * sin(up);
    double middle = a->plane.gx * 0.5 * (low[0] + high[0]) + a->plane.gy * 0.5 * (low[1] + high[1]);
    a->plane.depth = between(&a->base, 0.4, 0.6) * top - middle;
    a->load_at_0 = over(&a->base, 0.5, 20.0);
    a->rise = over(&a->base, 0.2, 3.0) * a->load_at_0 / top;
    a->knee_mm = between(&a->base, 0.4, 1.0) * top;
    a->knee = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 0.0, 1.0) * a->rise * a->knee_mm;
    int rows = (int)between(&a->base, 6.0, 16.0);
    double std = chance(&a->base, 0.4) ? 0.0 : over(&a->base, 0.001, 0.05) * a->rise * top / rows;
    a->table.struct_size = sizeof a->table;
    for (int i = 0; i < rows; i++) {
        double depth = top * (0.02 + 0.98 * i / (rows - 1));
        gib_tilt_table_add(&a->table, depth, load_of(a, depth) + std * normal(a), std, NULL);
    }
}

static void draw_axes(tilt_adversary *a)
{
    int axes = (int)between(&a->base, 0.0, 3.0);
    for (int i = 0; i < axes; i++) {
        a->axes[i].letter = 1 + (int)between(&a->base, 0.0, 3.0);
        a->axes[i].letter = i && a->axes[1].letter == a->axes[0].letter ? 1 + a->axes[0].letter % 3 : a->axes[i].letter;
        a->axes[i].turns_tool = chance(&a->base, 0.5);
        a->axes[i].sense = chance(&a->base, 0.5) ? 1 : -1;
        for (int k = 0; k < 3; k++) {
            a->axes[i].pivot[k] = between(&a->base, -150.0, 150.0);
        }
    }
    for (int k = 0; k < 3; k++) {
        a->plane.angles[k] = axes ? between(&a->base, -40.0, 40.0) : 0.0;
        a->plane.start[k] = between(&a->base, -200.0, 200.0);
    }
    a->config.tool_centre_point = 0;
    tilt_axes_configure(&a->config, a->axes, a->plane.angles);
}

static void draw(tilt_adversary *a)
{
    gib_tilt_config *g = &a->config;
    g->struct_size = sizeof *g;
    double cycle = g->cycle_s = over(&a->base, 5e-5, 0.02);
    int block = (int)over(&a->base, 8.0, 25.0), blocks = (int)between(&a->base, 16.0, 40.0);
    a->pass_cycles = block * blocks;
    a->air = (int)over(&a->base, 3.0, 100.0);
    double length = fmin(over(&a->base, 20.0, 500.0), 16000.0 * a->pass_cycles * cycle);
    draw_path(a, length);
    draw_axes(a);
    g->time_limit_s = fmax(1.0, between(&a->base, 1.3, 3.0) * a->passes * a->pass_cycles * cycle);
    g->block_s = fmin(block * cycle * (1.0 + 1e-9), 10.0);
    double cycles = fmax(block, ceil(g->time_limit_s / (0.97 * 2048.0) / cycle));
    g->signal = chance(&a->base, 0.5) ? GIB_TILT_DC_LOAD : GIB_TILT_AC_CURRENT;
    g->pole_pairs = (int)over(&a->base, 1.0, 100.0);
    double turns = between(&a->base, 0.8 / cycles, 0.22);
    g->condition.speed_rpm = within(turns * 60.0 / (g->pole_pairs * cycle), 1.0, 1e6);
    g->condition.feed_mm_min = 60.0 * length / (a->pass_cycles * cycle);
    g->condition.tool_id = (uint32_t)between(&a->base, 0.0, 4e9);
    g->condition_tolerance_ratio = chance(&a->base, 0.5) ? 0.0 : between(&a->base, 0.02, 0.5);
    g->other_condition = chance(&a->base, 0.2) ? GIB_TILT_FLAG : GIB_TILT_REFUSE;
    g->entry_mm = chance(&a->base, 0.7) ? between(&a->base, 0.01, 0.12) * length : 0.0;
    a->entry_mm = g->entry_mm > 0.0 ? g->entry_mm : chance(&a->base, 0.5) ? 0.03 * length : 0.0;
    a->table.condition = g->condition;
    a->table.signal = g->signal;
    g->wear_ratio_m = chance(&a->base, 0.5) ? 0.0 : over(&a->base, 1e-4, 0.1);
    double wear = g->wear_ratio_m == 0.0 ? 0.01 : g->wear_ratio_m;
    a->wear_1_m = fmin(wear * fabs(normal(a)), 0.1 / (1e-3 * a->passes * length));
    a->noise = over(&a->base, 0.001, 0.03);
    a->slow = chance(&a->base, 0.3) ? over(&a->base, 0.0005, 0.005) : 0.0;
    a->slow_cycles = over(&a->base, 3.0, 3.0 * cycles);
    a->chips = chance(&a->base, 0.4) ? between(&a->base, 0.0, 0.02) / cycles : 0.0;
    double steep = hypot(a->plane.gx, a->plane.gy), feed = length / a->pass_cycles / cycle;
    a->needed_mm = steep * (a->extent_mm + (a->axes[0].letter ? 700.0 : 0.0)) + 0.1;
    g->offset_max_mm =
        within(chance(&a->base, 0.9) ? a->needed_mm * between(&a->base, 1.5, 4.0) : over(&a->base, 0.001, a->needed_mm), 0.001, 100.0);
    g->offset_max_deg =
        within(chance(&a->base, 0.9) ? atan(steep) * 180.0 / PI * between(&a->base, 3.0, 8.0) : over(&a->base, 0.001, 5.0), 0.001, 45.0);
    double speed = g->offset_max_mm / (over(&a->base, 100.0, 3000.0) * cycle),
           speed_deg = g->offset_max_deg / (over(&a->base, 100.0, 3000.0) * cycle);
    speed = chance(&a->base, 0.95) ? fmax(speed, 2.0 * steep * feed) : speed;
    g->offset_speed_mm_s = within(speed, 0.001, 1000.0);
    g->offset_acceleration_mm_s2 = within(g->offset_speed_mm_s / (over(&a->base, 5.0, 500.0) * cycle), 0.01, 1e5);
    g->offset_speed_deg_s = within(speed_deg, 1e-4, 1000.0);
    g->offset_acceleration_deg_s2 = within(g->offset_speed_deg_s / (over(&a->base, 5.0, 500.0) * cycle), 0.001, 1e5);
    g->ack_timeout_s = over(&a->base, 2.0, 400.0) * cycle;
    a->answers = (int)(between(&a->base, 0.0, 0.9) * g->ack_timeout_s / cycle);
    a->after = (int)between(&a->base, 10.0, 2.0 * a->pass_cycles);
    g->nominal_depth_mm = chance(&a->base, 0.2) ? a->plane.depth * between(&a->base, 0.9, 1.1) : 0.0;
    g->band_deg = chance(&a->base, 0.1) ? between(&a->base, 0.0, 0.3) : 0.0;
    g->method = chance(&a->base, 0.15) ? GIB_TILT_TWO_POINT : GIB_TILT_FIT;
    g->purpose = chance(&a->base, 0.8) ? GIB_TILT_COMPENSATE : chance(&a->base, 0.6) ? GIB_TILT_MEASURE_ONLY : GIB_TILT_TEACH;
    tilt_laws_init(&a->laws, g);
}

void tilt_adversary_init(tilt_adversary *a, uint64_t seed, tilt_mistake mistake)
{
    memset(a, 0, sizeof *a);
    a->base.random = seed;
    a->mistake = mistake;
    draw(a);
    int count = chance(&a->base, 0.3) ? 0 : (int)between(&a->base, 1.0, TILT_MOST_TROUBLES + 1.0);
    double cycles = a->passes * (a->pass_cycles + a->air) * 2.0 + 1000.0;
    troubles_draw(&a->base.troubles, &a->base.random, count, TILT_TROUBLES, cycles, 0.1, 0.4);
}

/* The tool goes on along its passes, begins anew with the offsets in force, and at last stands still at three corners. */
static int move(tilt_adversary *a)
{
    const trouble *t;
    double pace = 1.0 / a->pass_cycles, from[2] = {a->at[0], a->at[1]};
    if ((t = now(&a->base, TILT_FEED_CHANGED)) != NULL) pace *= 0.3 + 1.2 * t->size;
    if (now(&a->base, TILT_FEED_HELD)) pace = 0.0;
    if (a->corner >= 0) {
        const double *at = a->corner == 0 ? &a->way[0][0] : a->corner == 1 ? &a->way[0][2] : &a->way[a->passes > 2 ? 2 : 0][0];
        a->at[0] = at[0];
        a->at[1] = at[1];
        return 0;
    }
    if (a->pass >= a->passes) {
        return 0;
    }
    const double *way = a->way[a->pass];
    int cuts = a->n++ >= a->air;
    a->share = cuts ? fmin(a->share + pace, 1.0) : 0.0;
    for (int k = 0; k < 2; k++) {
        a->at[k] = way[k] + a->share * (way[2 + k] - way[k]);
    }
    if (a->share >= 1.0) {
        a->n = 0;
        a->pass++;
        return 0;
    }
    a->cut_m += cuts ? 1e-3 * hypot(a->at[0] - from[0], a->at[1] - from[1]) : 0.0;
    return cuts;
}

/* What the drive shows of the cut. */
static double load(tilt_adversary *a, int cuts)
{
    const gib_tilt_config *g = &a->config;
    const trouble *t;
    double keep = exp(-1.0 / a->slow_cycles), length = hypot(a->way[0][2] - a->way[0][0], a->way[0][3] - a->way[0][1]);
    double depth = a->plane.depth + a->plane.gx * a->at[0] + a->plane.gy * a->at[1], engaged = cuts ? 1.0 : 0.0;
    if (cuts && a->entry_mm > 0.0) {
        engaged = fmin(1.0, fmin(a->share, 1.0 - a->share) * length / a->entry_mm * 0.5 + 0.5);
    }
    a->drift = keep * a->drift + sqrt(1.0 - keep * keep) * normal(a);
    if (now(&a->base, TILT_TOOL_BREAKS)) engaged = 0.0;
    double value = a->load_at_0 + engaged * (load_of(a, depth * (1.0 + a->wear_1_m * a->cut_m)) - a->load_at_0);
    if ((t = now(&a->base, TILT_SKIN)) != NULL) value = a->load_at_0 + (value - a->load_at_0) * (1.2 + t->size);
    if ((t = now(&a->base, TILT_LOAD_JUMPS)) != NULL) value *= 0.5 + t->size;
    value *= 1.0 + a->noise * normal(a) + a->slow * a->drift;
    if ((t = now(&a->base, TILT_LOAD_NOISY)) != NULL) value *= 1.0 + t->size * normal(a);
    if (a->jammed == 0 && chance(&a->base, a->chips)) a->jammed = a->pass_cycles / 40;
    value *= a->jammed > 0 ? 1.4 : 1.0;
    a->jammed -= a->jammed > 0;
    if ((t = now(&a->base, TILT_LOAD_FOREIGN)) != NULL)
        value = load_of(a, a->plane.depth * (1.0 + 0.3 * sin((0.2 + t->size) * 0.005 * a->base.cycle)));
    if ((t = now(&a->base, TILT_LOAD_SATURATED)) != NULL) value = fmin(value, load_of(a, a->plane.depth) * (0.7 + 0.6 * t->size));
    if ((t = now(&a->base, TILT_LOAD_DEAD)) != NULL) value = t->size < 0.5 ? 0.0 : 0.01 * a->load_at_0 * fabs(normal(a));
    a->phase = fmod(a->phase + g->condition.speed_rpm * g->pole_pairs * g->cycle_s / 60.0, 1.0);
    if (g->signal == GIB_TILT_AC_CURRENT) {
        double wave = sqrt(2.0) * value * sin(2.0 * PI * a->phase);
        value = a->sign ? wave : fabs(wave);
    }
    a->late[a->base.cycle % TILT_LATEST] = value;
    return value;
}

/* What the kernel senses and tells in this cycle. */
void tilt_adversary_tell(tilt_adversary *a)
{
    static const double ODD[] = {NAN, INFINITY, -INFINITY}, WILD[] = {1e13, -1e13, DBL_MAX, -DBL_MAX};
    const gib_tilt_config *g = &a->config;
    const trouble *t;
    gib_tilt_input *in = &a->told;
    int cuts = move(a);
    double value = load(a, cuts);
    memset(in, 0, sizeof *in);
    for (int k = 0; k < 3; k++) {
        in->position_mm[k] = a->plane.start[k] + (k < 2 ? a->at[k] : 0.0);
        in->rotary_deg[k] = a->plane.angles[k];
    }
    if ((t = now(&a->base, TILT_LOAD_LATE)) != NULL)
        value = a->late[(a->base.cycle - (int)fmin(t->size * 40.0, a->base.cycle - 1)) % TILT_LATEST];
    if (begins(&a->base, TILT_LOAD_STUCK)) a->stuck[0] = value;
    if (now(&a->base, TILT_LOAD_STUCK)) value = a->stuck[0];
    if ((t = now(&a->base, TILT_LOAD_MISSING)) != NULL && chance(&a->base, 0.5 * t->size)) value = 0.0;
    if ((t = now(&a->base, TILT_LOAD_HUGE)) != NULL) value = WILD[(int)(4.0 * t->size)];
    if ((t = now(&a->base, TILT_LOAD_NO_NUMBER)) != NULL) value = ODD[(int)(3.0 * t->size)];
    in->load = value;
    in->speed_rpm = g->condition.speed_rpm * (a->sign ? -1.0 : 1.0) * (1.0 + 0.002 * normal(a));
    if (begins(&a->base, TILT_SPEED_STUCK)) a->stuck[1] = in->speed_rpm;
    if (now(&a->base, TILT_SPEED_STUCK)) in->speed_rpm = a->stuck[1];
    if ((t = now(&a->base, TILT_SPEED_SCALED)) != NULL) in->speed_rpm *= 0.5 + t->size;
    if (now(&a->base, TILT_SPEED_DEAD)) in->speed_rpm = 0.0;
    if ((t = now(&a->base, TILT_SPEED_NO_NUMBER)) != NULL) in->speed_rpm = ODD[(int)(3.0 * t->size)];
    if (begins(&a->base, TILT_POSITION_STUCK)) a->stuck[2] = in->position_mm[0];
    if (now(&a->base, TILT_POSITION_STUCK)) in->position_mm[0] = a->stuck[2];
    if ((t = now(&a->base, TILT_POSITION_JUMPS)) != NULL && chance(&a->base, 0.1)) in->position_mm[t->at % 2] += 500.0 * (t->size - 0.5);
    for (int k = 0; now(&a->base, TILT_POSITION_CLOSED) && k < 3; k++) {
        in->position_mm[k] += a->before.offset_mm[k];
        in->rotary_deg[k] += a->before.offset_deg[k];
    }
    if (now(&a->base, TILT_POSITION_SWAPPED)) {
        double x = in->position_mm[0];
        in->position_mm[0] = in->position_mm[1];
        in->position_mm[1] = x;
    }
    if ((t = now(&a->base, TILT_POSITION_NO_NUMBER)) != NULL) in->position_mm[t->at % 3] = ODD[(int)(3.0 * t->size)];
    if ((t = now(&a->base, TILT_ANGLE_TURNS)) != NULL) in->rotary_deg[t->at % 3] += fmin(0.002 * (a->base.cycle - t->at), 90.0 * t->size);
    if ((t = now(&a->base, TILT_ANGLE_NO_NUMBER)) != NULL) in->rotary_deg[t->at % 3] = ODD[(int)(3.0 * t->size)];
    if (now(&a->base, TILT_CUTTING_ALWAYS)) cuts = 1;
    if (now(&a->base, TILT_CUTTING_NEVER)) cuts = 0;
    if ((t = now(&a->base, TILT_CUTTING_FLICKERS)) != NULL) cuts ^= chance(&a->base, 0.2 * t->size);
    in->flags |= cuts ? (uint32_t)GIB_TILT_INPUT_CUTTING : 0u;
    int over_now = (a->pass >= a->passes && a->before.phase == GIB_TILT_MEASURING) || begins(&a->base, TILT_ENDS_EARLY);
    in->flags |= over_now ? (uint32_t)GIB_TILT_INPUT_END : 0u;
    in->flags |= begins(&a->base, TILT_TAKEN_OFF) || a->corner > 2 ? (uint32_t)GIB_TILT_INPUT_OFF : 0u;
    in->flags |= now(&a->base, TILT_DRIVE_TRIPS) ? (uint32_t)GIB_INPUT_FAULT : 0u;
    in->flags |= begins(&a->base, TILT_ABORT_FLAG) ? (uint32_t)GIB_INPUT_ABORT : 0u;
    if ((t = now(&a->base, TILT_FLAG_UNKNOWN)) != NULL) in->flags |= 1u << (5 + (int)(27.0 * t->size));
    a->waited = a->before.warning ? a->waited + 1 : 0;
    in->acknowledged_id = a->waited > a->answers && !now(&a->base, TILT_NO_ANSWER) ? a->before.request_id : 0;
    if (now(&a->base, TILT_ANSWERS_AGAIN)) in->acknowledged_id = a->before.request_id - 1u;
    if (now(&a->base, TILT_ANSWERS_WILDLY)) in->acknowledged_id = (uint32_t)between(&a->base, 0.0, 4.0);
}

