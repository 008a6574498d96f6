/*
 * Homing on a dead stop, in two tables: how well home repeats and what moves it, beside the plain threshold; and what a
 * homing is not fooled by. Exit 1 when something is not as it must be. Faults: homing_faults_demo.c.
 */
#include "homing_run.h"

#include <stdio.h>
#include <stdlib.h>

static const char *text(int32_t status)
{
    return gib_status_text(status);
}

typedef struct {
    const char *what;
    double limit_nm, stop, approach, touch, encoder;
} setting;

/* Mean and twice the standard deviation of home over runs, µm. */
static int repeat(const setting *s, int runs, double mean[2], double twice[2], double *says, int *covered)
{
    double sum[2] = {0}, squares[2] = {0};
    *says = 0.0;
    *covered = 0;
    for (int i = 0; i < runs; i++) {
        homing_plant_config c = homing_plant_default();
        c.seed = 1000u + (uint64_t)i;
        c.stop_mm[0] += 0.0137 * i;
        c.stop_stiffness_nm_mm = s->stop;
        c.torque_noise_nm = 0.03 * s->limit_nm;
        c.encoder_mm = s->encoder;
        gib_homing_config g = homing_config(&c);
        g.torque_limit_nm = s->limit_nm;
        g.approach_speed_mm_s = s->approach;
        g.touch_speed_mm_s = s->touch;
        homing_outcome o = homing_run(&c, &g);
        if (o.status != GIB_DONE) {
            printf("  %s: %s\n", s->what, text(o.status));
            return 0;
        }
        const gib_homing_side *side = &o.report.side[0];
        double error[2] = {-o.home_error_um, -o.home_error_um + 1e3 * (side->threshold_mm - side->contact_mm)};
        *covered += fabs(error[0]) <= side->uncertainty_um;
        *says += side->uncertainty_um / runs;
        for (int k = 0; k < 2; k++) {
            sum[k] += error[k];
            squares[k] += error[k] * error[k];
        }
    }
    for (int k = 0; k < 2; k++) {
        mean[k] = sum[k] / runs;
        twice[k] = 2.0 * sqrt(fmax(squares[k] / runs - mean[k] * mean[k], 0.0) * runs / (runs - 1));
    }
    return 1;
}

static int repeatability(int runs)
{
    static const setting SETTINGS[] = {
        {"as configured", 5.0, 400.0, 1.0, 0.0, 1e-4},     {"torque limit x2", 10.0, 400.0, 1.0, 0.0, 1e-4},
        {"stop stiffness x3", 5.0, 1200.0, 1.0, 0.0, 1e-4}, {"stop stiffness /3", 5.0, 133.0, 1.0, 0.0, 1e-4},
        {"approach 5 mm/s", 5.0, 400.0, 5.0, 0.0, 1e-4},    {"touches at 0.2 mm/s", 5.0, 400.0, 1.0, 0.2, 1e-4},
        {"encoder grid 1 um", 5.0, 400.0, 1.0, 0.0, 1e-3},
    };
    double mean[2], twice[2], says, first[2] = {0};
    int bad = 0, covered;
    printf("Home against the true contact point, um, %d runs each; torque noise 3 %% of the limit, 1 ms, 1 mm/s.\n\n",
           runs);
    printf("                         start of the line                      plain threshold\n");
    printf("                       mean   shift  +- (k=2)  says  covers     mean    shift  +- (k=2)\n");
    for (size_t i = 0; i < sizeof SETTINGS / sizeof *SETTINGS; i++) {
        if (!repeat(&SETTINGS[i], runs, mean, twice, &says, &covered)) {
            return 1;
        }
        for (int k = 0; k < 2; k++) {
            first[k] = i == 0 ? mean[k] : first[k];
        }
        printf("  %-19s %6.2f  %6.2f   %5.2f    %4.2f   %3d %%    %6.2f  %7.2f   %5.2f\n", SETTINGS[i].what, mean[0],
               mean[0] - first[0], twice[0], says, 100 * covered / runs, mean[1], mean[1] - first[1], twice[1]);
        bad += twice[0] > 1.0 || fabs(mean[0] - first[0]) > 2.0 || fabs(mean[0]) > 1.0;
    }
    printf("\n");
    return bad;
}

/* Ended as it must, and safe: within its bounds all the time, at rest afterwards. */
static int safe(const homing_plant_config *c, const gib_homing_config *g, const homing_outcome *o)
{
    double friction = 1.3 * c->breakaway_ratio * c->friction_nm + fabs(c->constant_nm) + c->beam_nm_mm * 0.2;
    return o->most_torque_nm <= g->torque_limit_nm + 1e-9 && o->most_travel_mm <= g->distance_max_mm && o->rest_way_mm < 0.005 &&
           o->rest_torque_nm <= friction;
}

static int show(const char *what, const homing_plant_config *c, const gib_homing_config *g, int32_t wanted)
{
    homing_outcome o = homing_run(c, g);
    int good = o.status == wanted && safe(c, g, &o);
    printf("  %-34s %-66s %s\n", what, text(o.status), good ? "safe" : "NOT AS IT MUST BE");
    if (!good) {
        printf("    status %d, torque %.2f, travel %.3f, at rest %.2f Nm %.4f mm\n", o.status, o.most_torque_nm,
               o.most_travel_mm, o.rest_torque_nm, o.rest_way_mm);
    }
    return !good;
}

static int not_fooled(void)
{
    const homing_plant_config usual = homing_plant_default();
    const gib_homing_config ordinary = homing_config(&usual);
    homing_plant_config c = usual;
    gib_homing_config g = ordinary;
    int bad = 0;
    printf("Not fooled by:\n");
    g.acceleration_mm_s2 = 5000.0;
    g.approach_speed_mm_s = 10.0;
    bad += show("acceleration at the torque limit", &c, &g, GIB_DONE);
    g = ordinary;
    c.tight_mm = 3.0;
    c.tight_nm = 2.5;
    bad += show("a tight spot below the limit", &c, &g, GIB_DONE);
    c.tight_nm = 8.0;
    c.tight_width_mm = 0.2;
    bad += show("a tight spot that holds the axis", &c, &g, GIB_ERR_HOMING_TIGHT_SPOT);
    c = usual;
    c.chips_mm = 0.3;
    c.chips_stiffness_nm_mm = 60.0;
    c.chips_crush_mm = 0.2;
    bad += show("chips that give way", &c, &g, GIB_ERR_HOMING_TOUCHES);
    c = usual;
    c.stop_stiffness_nm_mm = 4.0;
    bad += show("a soft stop", &c, &g, GIB_ERR_HOMING_SOFT_STOP);
    c = usual;
    c.stop_mm[0] = 1e6;
    bad += show("no stop", &c, &g, GIB_ERR_HOMING_NO_STOP);
    c.stop_mm[0] = 0.0;
    bad += show("starting on the stop", &c, &g, GIB_ERR_HOMING_ON_STOP);
    c = usual;
    g.distance_min_mm = 7.0;
    bad += show("a stop before the minimum distance", &c, &g, GIB_ERR_HOMING_EARLY);
    g = ordinary;
    g.time_limit_s = 4.0;
    bad += show("a time limit that is too short", &c, &g, GIB_ERR_HOMING_TIME_LIMIT);
    g = ordinary;
    c.torque_noise_nm = 1.0;
    g.touch_tolerance_um = 2.0;
    bad += show("a torque sensor that is too noisy", &c, &g, GIB_ERR_HOMING_NOISE);
    c = usual;
    c.motors = 2;
    c.beam_nm_mm = 20.0;
    c.stop_mm[1] = 6.05;
    g = homing_config(&c);
    bad += show("gantry, 0.05 mm out of square", &c, &g, GIB_DONE);
    c.stop_mm[1] = 6.5;
    bad += show("gantry, 0.5 mm out of square", &c, &g, GIB_ERR_HOMING_SQUARE);
    c.beam_nm_mm = 60.0; /* holds the other side before its stop */
    bad += show("the same, the beam three times as stiff", &c, &g, GIB_ERR_HOMING_SQUARE);
    printf("\n");
    return bad;
}

/* One homing as a recording, for `gib homing`. */
static int record(const char *path)
{
    static homing_plant p;
    homing_plant_config c = homing_plant_default();
    gib_homing_config g = homing_config(&c);
    gib_homing *gib = gib_homing_new();
    FILE *file = fopen(path, "w");
    int32_t status = gib_homing_start(gib, &g);
    if (!file || status != GIB_OK) {
        fprintf(stderr, "homing_demo: %s: not written\n", path);
        gib_homing_free(gib);
        return 1;
    }
    homing_plant_init(&p, &c);
    fprintf(file, "time_s,x.position_mm,x.torque_nm\n");
    do {
        const gib_homing_input *in = homing_plant_cycle(&p);
        status = gib_homing_step(gib, in, &p.out);
        fprintf(file, "%.6f,%.7f,%.5f\n", p.time_s, in->position_mm[0], in->torque[0]);
    } while (status == GIB_BUSY);
    gib_homing_report report;
    gib_homing_result(gib, &report);
    gib_homing_free(gib);
    printf("Recording of one homing: %s; the control found the contact at %.4f mm +- %.2f um.\n", path,
           report.side[0].contact_mm, report.side[0].uncertainty_um);
    return fclose(file) != 0 || status != GIB_DONE;
}

/* homing_demo [RUNS [RECORDING.csv]] */
int main(int argc, char **argv)
{
    int runs = argc > 1 ? atoi(argv[1]) : 30;
    int bad = repeatability(runs) + not_fooled();
    bad += argc > 2 ? record(argv[2]) : 0;
    printf(bad ? "%d results are not as they must be\n" : "all as it must be\n", bad);
    return bad != 0;
}
