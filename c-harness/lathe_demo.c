/*
 * A noncircular lathe: how far the form of the workpiece is from what the control believes, with the scale alone (the
 * conventional machine), with the published correction, and with gib's; at several speeds, forms, and a varying speed.
 */
#include "lathe_run.h"

#include <stdio.h>
#include <stdlib.h>

enum { SCALE, PUBLISHED, PUBLISHED_CALIBRATED, OURS, WAYS };

/* Root mean square of something less its mean. */
typedef struct {
    double n, sum, squares, low, high;
} spread;

static void add(spread *s, double x)
{
    s->low = s->n == 0.0 ? x : fmin(s->low, x);
    s->high = s->n == 0.0 ? x : fmax(s->high, x);
    s->n += 1.0;
    s->sum += x;
    s->squares += x * x;
}

static double rms(const spread *s)
{
    double mean = s->sum / s->n;
    return sqrt(fmax(s->squares / s->n - mean * mean, 0.0));
}

/* Form error over the spindle's angle in the last revolution. */
enum { BINS = 180 };
typedef struct {
    double um[WAYS][BINS];
    int met[BINS];
} form;

static void check(int32_t status, const char *what)
{
    if (status < 0) {
        fprintf(stderr, "%s: %s\n", what, gib_status_text(status));
        exit(1);
    }
}

/* Turns a form for a hundred revolutions, ten seconds at least; what every way of knowing the tool's place is wrong by over
 * the last four tenths. */
static void turn(const lathe_config *c, const lathe_job *job, const gib_calibration_table *own,
                 const gib_calibration_table *ours, spread error[WAYS], form *drawn)
{
    static lathe p;
    gib_vibration *gib[WAYS];
    const gib_calibration_table *table[WAYS] = {NULL, own, ours, ours};
    lathe_init(&p, c);
    for (int way = PUBLISHED; way < WAYS; way++) {
        gib_vibration_config g = lathe_vibration(c, way == OURS ? GIB_VIBRATION_HARMONIC : GIB_VIBRATION_INTEGRATE);
        g.main_harmonic = job->shape == LATHE_OVAL ? 2 : job->shape == LATHE_POLYGON ? 3 : 1;
        /* Up to 100 Hz, where this machine's resonances end. */
        g.harmonics = (int32_t)fmin(fmax(ceil(6000.0 / job->speed_rpm), 8.0), 16.0);
        gib[way] = gib_vibration_new();
        check(gib_vibration_start(gib[way], &g, table[way]), "start");
    }
    memset(error, 0, WAYS * sizeof *error);
    memset(drawn, 0, sizeof *drawn);
    double origin = job->stroke_mm * lathe_form(job->shape, 0.0);
    double whole = fmax(10.0, 6000.0 / job->speed_rpm);
    int cycles = (int)(whole / c->cycle_s);
    for (int i = 0; i < cycles; i++) {
        double time = i * c->cycle_s, speed = lathe_speed_rpm(job, time);
        lathe_reading r = lathe_sense(&p);
        double tool = lathe_tool_mm(&p), place[WAYS];
        place[SCALE] = r.scale_mm;
        for (int way = PUBLISHED; way < WAYS; way++) {
            gib_vibration_input in = lathe_vibration_input(&r);
            gib_vibration_output out;
            check(gib_vibration_step(gib[way], &in, &out), "step");
            place[way] = out.position_mm;
        }
        int bin = (int)(r.angle_deg * BINS / 360.0) % BINS;
        drawn->met[bin] |= time > whole - 60.0 / job->speed_rpm;
        for (int way = 0; way < WAYS && time > 0.6 * whole; way++) {
            add(&error[way], 1e3 * (tool - place[way]));
            drawn->um[way][bin] = 1e3 * (tool - place[way]);
        }
        /* The stroke grows in the first second; the form begins where the slide stands. */
        double next = p.angle + 6.283185307179586 / 60.0 * speed * c->cycle_s, grown = fmin(time, 1.0);
        grown = grown * grown * (3.0 - 2.0 * grown);
        lathe_cycle(&p, grown * (job->stroke_mm * lathe_form(job->shape, next) - origin), speed);
    }
    for (int way = PUBLISHED; way < WAYS; way++) {
        gib_vibration_free(gib[way]);
    }
}

/* What a control does that learns: its detected position, and how it makes the command better. */
typedef struct {
    const char *name;
    int detects; /* SCALE, PUBLISHED_CALIBRATED or OURS */
    int32_t learns;
} control;

/* Learns a form from nothing until done, a minute at most; then the form that is cut in the next two seconds. */
static gib_learning_report learn(const lathe_config *c, const lathe_job *job, const control *k,
                                 const gib_calibration_table *table, spread *cut)
{
    static lathe p;
    gib_vibration_config v =
        lathe_vibration(c, k->detects == OURS ? GIB_VIBRATION_HARMONIC : GIB_VIBRATION_INTEGRATE);
    gib_learning_config g = lathe_learning(c, k->learns);
    gib_learning_report report;
    gib_vibration *vibration = gib_vibration_new();
    gib_learning *learning = gib_learning_new();
    v.main_harmonic = job->shape == LATHE_OVAL ? 2 : job->shape == LATHE_POLYGON ? 3 : 1;
    v.harmonics = g.harmonics = 10;
    /* The correction itself has to settle, too: it averages over 16 revolutions. */
    g.settle_revolutions = k->detects == OURS ? 24 : 2;
    lathe_init(&p, c);
    check(gib_vibration_start(vibration, &v, table), "start");
    check(gib_learning_start(learning, &g), "start");
    memset(cut, 0, sizeof *cut);
    double origin = job->stroke_mm * lathe_form(job->shape, 0.0);
    int left = (int)(2.0 / c->cycle_s), most = (int)(60.0 / c->cycle_s);
    for (int i = 0; left > 0; i++) {
        double grown = fmin(i * c->cycle_s, 1.0);
        double target = grown * grown * (3.0 - 2.0 * grown) * (job->stroke_mm * lathe_form(job->shape, p.angle) - origin);
        double tool = lathe_tool_mm(&p);
        lathe_reading r = lathe_sense(&p);
        gib_vibration_input in = lathe_vibration_input(&r);
        gib_vibration_output out;
        check(gib_vibration_step(vibration, &in, &out), "step");
        /* Learning begins when the stroke is full and the vibration known. */
        gib_learning_input to = {target, k->detects == SCALE ? r.scale_mm : out.position_mm, r.angle_deg, 0, 0};
        gib_learning_output command = {.command_mm = target};
        int32_t status = GIB_BUSY;
        if (i * c->cycle_s > 3.0) {
            status = gib_learning_step(learning, &to, &command);
        }
        if (status != GIB_BUSY || i > most) {
            left--;
            add(cut, 1e3 * (tool - target));
        }
        lathe_cycle(&p, command.command_mm, job->speed_rpm);
    }
    gib_learning_result(learning, &report);
    gib_learning_free(learning);
    gib_vibration_free(vibration);
    return report;
}

static void learning_table(const lathe_config *c, const gib_calibration_table *table)
{
    static const control controls[] = {{"scale only, published update", SCALE, GIB_LEARNING_PUBLISHED},
                                       {"published, published update", PUBLISHED_CALIBRATED, GIB_LEARNING_PUBLISHED},
                                       {"gib, published update", OURS, GIB_LEARNING_PUBLISHED},
                                       {"gib, filtered update", OURS, GIB_LEARNING_FILTERED}};
    printf("\nThe same, learnt from revolution to revolution until within 0.2 um or no better: what is then cut\n");
    printf("%-8s %6s %-30s %12s %12s %8s %10s %9s  %s\n", "form", "rpm", "position and update", "believes um", "cut um rms",
           "updates", "peak-peak", "of scale", "ended");
    for (int shape = 0; shape < LATHE_SHAPES; shape++) {
        for (int speed = 600; speed <= 900; speed += 300) {
            lathe_job job = lathe_job_of((lathe_shape)shape, speed, 0.0, 12.0);
            double scale = 0.0;
            for (size_t k = 0; k < sizeof controls / sizeof *controls; k++) {
                spread cut;
                gib_learning_report report = learn(c, &job, &controls[k], table, &cut);
                scale = k == 0 ? rms(&cut) : scale;
                printf("%-8s %6d %-30s %12.3f %12.3f %8d %10.2f %8.1f%%  %s\n", lathe_shape_name[shape], speed,
                       controls[k].name, report.last_um, rms(&cut), report.updates, cut.high - cut.low,
                       100.0 * rms(&cut) / scale, gib_status_text(report.status));
            }
        }
    }
}

/* The form errors of one job as a picture. */
static void draw(const char *path, const lathe_job *job, const form *drawn, const spread error[WAYS])
{
    static const int ways[] = {SCALE, PUBLISHED_CALIBRATED, OURS};
    static const char *const names[] = {"scale only", "published", "gib"}, *const colours[] = {"#b03030", "#b08020", "#2060a0"};
    const double width = 720.0, height = 300.0, left = 60.0, top = 50.0, most = 16.0;
    FILE *f = fopen(path, "w");
    if (!f) {
        fprintf(stderr, "%s cannot be written\n", path);
        exit(1);
    }
    fprintf(f, "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 800 400\" font-family=\"sans-serif\" font-size=\"14\">\n"
               "<rect width=\"800\" height=\"400\" fill=\"white\"/>\n<text x=\"%g\" y=\"28\" font-size=\"16\">Form error of an %s at "
               "%.0f rpm over the spindle angle, one revolution</text>\n", left, lathe_shape_name[job->shape], job->speed_rpm);
    for (int um = -15; um <= 15; um += 5) {
        double y = top + height * (0.5 - 0.5 * um / most);
        fprintf(f, "<line x1=\"%g\" x2=\"%g\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/><text x=\"%g\" y=\"%.1f\" "
                   "text-anchor=\"end\">%d</text>\n", left, left + width, y, y, left - 6.0, y + 5.0, um);
    }
    for (int degrees = 0; degrees <= 360; degrees += 90) {
        fprintf(f, "<text x=\"%g\" y=\"370\" text-anchor=\"middle\">%d°</text>\n", left + width * degrees / 360.0, degrees);
    }
    fprintf(f, "<text x=\"%g\" y=\"%g\">µm</text>\n", left + 4.0, top + 12.0);
    for (int i = 0; i < 3; i++) {
        const spread *s = &error[ways[i]];
        fprintf(f, "<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"2\" points=\"", colours[i]);
        for (int b = 0; b < BINS; b++) {
            if (drawn->met[b]) {
                double um = drawn->um[ways[i]][b] - s->sum / s->n;
                fprintf(f, "%.1f,%.1f ", left + width * (b + 0.5) / BINS, top + height * (0.5 - 0.5 * fmax(fmin(um, most), -most) / most));
            }
        }
        fprintf(f, "\"/>\n<text x=\"%g\" y=\"392\" fill=\"%s\">%s: %.2f µm rms</text>\n", left + 240.0 * i, colours[i], names[i], rms(s));
    }
    fputs("</svg>\n", f);
    fclose(f);
}

static void calibration_table(const gib_calibration_table *table)
{
    printf("Calibration against a ball bar, two workpieces: gain that each accelerometer needs, with uncertainty (k = 2)\n");
    printf("%8s %18s %18s %14s %14s %10s\n", "Hz", "seat", "headstock", "phase seat", "phase head", "condition");
    for (uint32_t i = 0; i < table->count; i++) {
        const gib_calibration_point *q = &table->point[i];
        printf("%8.1f %9.4f +- %.4f %9.4f +- %.4f %6.2f +- %.2f %6.2f +- %.2f %10.1f\n", q->frequency_hz, q->gain_ratio[0],
               q->gain_uncertainty_ratio[0], q->gain_ratio[1], q->gain_uncertainty_ratio[1], q->phase_deg[0],
               q->phase_uncertainty_deg[0], q->phase_deg[1], q->phase_uncertainty_deg[1], q->condition_ratio);
    }
}

int main(int argc, char **argv)
{
    lathe_config c = lathe_default();
    gib_calibration_table ours, own;
    check(lathe_calibrate(&c, GIB_CALIBRATION_LEAST_SQUARES, 2, &ours), "calibration");
    calibration_table(&ours);
    int32_t refused = lathe_calibrate(&c, GIB_CALIBRATION_PUBLISHED, 1, &own);
    printf("The published formula, one experiment: %s\n", gib_status_text(refused));

    printf("\nForm error of the workpiece when the control's own position is perfect, um rms (largest less smallest)\n");
    printf("%-8s %7s %6s %7s %15s %15s %15s %15s %9s %9s\n", "form", "rpm", "swing", "stroke", "scale only", "published",
           "pub. calibr.", "gib", "of scale", "of publ.");
    static const double speeds[][2] = {{300, 0}, {600, 0}, {900, 0}, {1200, 0}, {600, 0.1}, {900, 0.1}};
    /* At steady speeds, and at swinging ones. */
    double worst_scale[2] = {0.0, 0.0}, worst_published[2] = {0.0, 0.0};
    for (int shape = 0; shape < LATHE_SHAPES; shape++) {
        for (size_t s = 0; s < sizeof speeds / sizeof *speeds; s++) {
            lathe_job job = lathe_job_of((lathe_shape)shape, speeds[s][0], speeds[s][1], 12.0);
            spread error[WAYS];
            static form drawn;
            turn(&c, &job, refused == GIB_OK ? &own : NULL, &ours, error, &drawn);
            if (shape == LATHE_OVAL && speeds[s][0] == 900.0 && speeds[s][1] == 0.0 && argc > 1) {
                draw(argv[1], &job, &drawn, error);
            }
            double of_scale = rms(&error[OURS]) / rms(&error[SCALE]);
            double of_published = rms(&error[OURS]) / fmin(rms(&error[PUBLISHED]), rms(&error[PUBLISHED_CALIBRATED]));
            int swings = speeds[s][1] > 0.0;
            worst_scale[swings] = fmax(worst_scale[swings], of_scale);
            worst_published[swings] = fmax(worst_published[swings], of_published);
            printf("%-8s %7.0f %5.0f%% %7.3f", lathe_shape_name[shape], speeds[s][0], 100.0 * speeds[s][1], job.stroke_mm);
            for (int way = 0; way < WAYS; way++) {
                printf(" %7.3f (%5.2f)", rms(&error[way]), error[way].high - error[way].low);
            }
            printf(" %8.1f%% %8.1f%%\n", 100.0 * of_scale, 100.0 * of_published);
        }
    }
    for (int swings = 0; swings < 2; swings++) {
        printf("gib's error at %s speeds is at most %.1f %% of scale only (wanted 10), %.0f %% of the better published one "
               "(wanted 50)\n", swings ? "swinging" : "steady", 100.0 * worst_scale[swings], 100.0 * worst_published[swings]);
    }
    learning_table(&c, &ours);
    return 0;
}
