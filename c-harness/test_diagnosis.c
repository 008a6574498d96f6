/*
 * Families `machine` and `diagnosis` from C: a machine file in and out, a wrong belief found in a recording that this
 * program writes, the machine that was extended by it judged again, and every refusal by its number and sentence.
 */
#include "gib.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* What the machine is: kg m2, N m, N m s. The machine file believes another constant torque. */
#define INERTIA 0.0028
#define COULOMB 0.9
#define VISCOUS 0.008
#define CONSTANT 0.35
#define LEAD_MM 10.0

static const char BELIEF[] =
    "{\"schema\": \"gib.machine/1\", \"name\": \"made\", \"axes\": [{\"name\": \"x\", \"drive\": \"ball_screw\","
    " \"lead_mm\": 10.0, \"inertia_kg_m2\": 0.0028, \"coulomb_friction_nm\": 0.9, \"viscous_friction_nm_s\": 0.008,"
    " \"constant_torque_nm\": 0.0, \"colour\": \"grey\"}]}";

typedef struct {
    char folder[40], recording[64], machine_file[64];
    gib_machine *machine;
    gib_diagnosis *diagnosis;
} fixture;

/* Noise that is nearly normal: twelve even numbers, less their mean. */
static double noise(unsigned *seed)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++)
        sum += rand_r(seed) / (RAND_MAX + 1.0);
    return sum;
}

/* Strokes there and back, each from rest to rest, of growing length and speed; 1 kHz. */
static void write_recording(const char *path, double seconds, double torque_noise)
{
    const double to_rad = 2.0 * M_PI / LEAD_MM, pi2 = 2.0 * M_PI;
    unsigned seed = 20;
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "time_s,x.position_mm,x.torque_nm\n");
    double start = 0.0, begin_s = 0.0;
    int stroke = 0;
    for (long row = 0; row < (long)(1000.0 * seconds); row++) {
        double t = row / 1000.0, length = 4.0 + 3.0 * (stroke / 2 % 5), time_s = 0.5 + 0.1 * (stroke / 2 % 3);
        double way = stroke % 2 == 0 ? length : -length, s = (t - begin_s) / time_s;
        if (s >= 1.0) {
            start += way;
            begin_s += time_s;
            stroke++;
            row--;
            continue;
        }
        double x = start + way * (s - sin(pi2 * s) / pi2);
        double v = to_rad * way / time_s * (1.0 - cos(pi2 * s)), a = to_rad * way / (time_s * time_s) * pi2 * sin(pi2 * s);
        double friction = v == 0.0 ? 0.0 : COULOMB * (v > 0.0 ? 1.0 : -1.0) + VISCOUS * v;
        double torque = INERTIA * a + friction + CONSTANT + torque_noise * noise(&seed);
        fprintf(file, "%.3f,%.6f,%.4f\n", t, round(x / 1e-6) * 1e-6, round(torque / 1e-3) * 1e-3);
    }
    assert_int_equal(fclose(file), 0);
}

static int set_up(void **state)
{
    fixture *f = calloc(1, sizeof *f);
    if (f == NULL)
        return -1;
    strcpy(f->folder, "/tmp/gib-diagnosis-XXXXXX");
    if (mkdtemp(f->folder) == NULL)
        return -1;
    snprintf(f->recording, sizeof f->recording, "%s/r.csv", f->folder);
    snprintf(f->machine_file, sizeof f->machine_file, "%s/m.json", f->folder);
    write_recording(f->recording, 8.0, 0.01);
    f->machine = gib_machine_new();
    f->diagnosis = gib_diagnosis_new();
    *state = f;
    return gib_machine_read(f->machine, BELIEF, strlen(BELIEF));
}

static int tear_down(void **state)
{
    fixture *f = *state;
    gib_machine_free(f->machine);
    gib_diagnosis_free(f->diagnosis);
    unlink(f->recording);
    unlink(f->machine_file);
    int left = rmdir(f->folder);
    free(f);
    return left;
}

static gib_diagnosis_config config_of(const fixture *f)
{
    gib_diagnosis_config config = {.struct_size = sizeof config, .machine = f->machine, .recording = f->recording};
    return config;
}

static char *json_of(const gib_diagnosis *diagnosis)
{
    size_t needed = 0;
    assert_int_equal(gib_diagnosis_json(diagnosis, NULL, 0, &needed), GIB_ERR_BUFFER);
    char *json = malloc(needed);
    assert_non_null(json);
    assert_int_equal(gib_diagnosis_json(diagnosis, json, needed - 1, NULL), GIB_ERR_BUFFER);
    assert_int_equal(gib_diagnosis_json(diagnosis, json, needed, NULL), GIB_OK);
    assert_int_equal(strlen(json) + 1, needed);
    return json;
}

static void assert_says(const char *text, const char *part)
{
    if (strstr(text, part) == NULL)
        fail_msg("\"%s\" does not say \"%s\"", text, part);
}

static void assert_refused(const fixture *f, const gib_diagnosis_config *config, int32_t status, const char *part)
{
    char text[512];
    assert_int_equal(gib_diagnosis_start(f->diagnosis, config), status);
    assert_int_equal(gib_diagnosis_last_error_text(f->diagnosis, text, sizeof text), GIB_OK);
    assert_says(text, part);
    /* Nothing is left to be worked at or read. */
    gib_diagnosis_report report = {.verdict = 9};
    assert_int_equal(gib_diagnosis_run(f->diagnosis, NULL, NULL), GIB_ERR_STATE);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_ERR_STATE);
    assert_int_equal(report.verdict, 0);
}

struct told {
    double share;
    int calls, stop_at;
};

static int32_t tell(void *user, double share, const char *stage)
{
    struct told *told = user;
    if (!(share >= told->share && share <= 1.0) || stage[0] == '\0')
        abort();
    told->share = share;
    return ++told->calls == told->stop_at;
}

static void a_wrong_belief_is_found_and_its_extension_holds(void **state)
{
    fixture *f = *state;
    gib_diagnosis_config config = config_of(f);
    gib_diagnosis_report report;
    struct told told = {0};
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
    assert_int_equal(gib_diagnosis_run(f->diagnosis, tell, &told), GIB_DONE);
    assert_true(told.calls > 3);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_OK);
    assert_int_equal(report.verdict, GIB_DIAGNOSIS_EXPLAINED);
    assert_int_equal(report.findings, 1);
    /* Rows in which the axis turns round keep an error: a cycle's sign of friction cannot be known. */
    assert_true(report.residual_before > CONSTANT && report.residual_before > 3.0 * report.residual_after);
    assert_true(report.noise > 0.0 && report.noise < report.residual_after);
    char *json = json_of(f->diagnosis);
    assert_says(json, "\"cause\": \"constant_torque\"");
    const char *value = strstr(json, "\"value\": ");
    assert_non_null(value);
    assert_true(fabs(strtod(value + 9, NULL) - CONSTANT) < 0.005);
    free(json);

    /* The extended machine, saved and loaded, is right. */
    assert_int_equal(gib_diagnosis_machine(f->diagnosis, f->machine), GIB_OK);
    assert_int_equal(gib_machine_save(f->machine, f->machine_file), GIB_OK);
    assert_int_equal(gib_machine_load(f->machine, f->machine_file), GIB_OK);
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_ERR_STATE); /* the old result is forgotten */
    assert_int_equal(gib_diagnosis_run(f->diagnosis, NULL, NULL), GIB_DONE);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_OK);
    assert_int_equal(report.verdict, GIB_DIAGNOSIS_NO_DISCREPANCY);
    assert_int_equal(report.findings, 0);
}

static void a_second_recording_measures_the_gain(void **state)
{
    fixture *f = *state;
    char holdout[80];
    snprintf(holdout, sizeof holdout, "%s/h.csv", f->folder);
    write_recording(holdout, 5.0, 0.01);
    gib_diagnosis_config config = config_of(f);
    config.holdout = holdout;
    config.axis = "x";
    gib_diagnosis_report report;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
    unlink(holdout); /* it was read */
    assert_int_equal(gib_diagnosis_run(f->diagnosis, NULL, NULL), GIB_DONE);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_OK);
    assert_true(report.residual_after > 0.0 && report.residual_before > 3.0 * report.residual_after);
}

static void what_cannot_be_used_is_refused_by_name(void **state)
{
    fixture *f = *state;
    gib_diagnosis_config config = config_of(f);
    config.axis = "z";
    assert_refused(f, &config, GIB_ERR_DIAGNOSIS_AXIS, "z");
    config = config_of(f);
    config.recording = "/nowhere/r.csv";
    assert_refused(f, &config, GIB_ERR_IO, "/nowhere/r.csv");
    config = config_of(f);
    config.holdout = f->folder;
    assert_refused(f, &config, GIB_ERR_IO, f->folder);

    FILE *file = fopen(f->machine_file, "w");
    fputs("time_s,x.position_mm,x.torque_nm\n0.000,0.0,0.1\n0.001,0.0,oh\n", file);
    fclose(file);
    config = config_of(f);
    config.recording = f->machine_file;
    assert_refused(f, &config, GIB_ERR_FORMAT, "row 3");
    assert_refused(f, &config, GIB_ERR_FORMAT, "x.torque_nm");

    config = config_of(f);
    config.struct_size = 8;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_ERR_STRUCT_SIZE);
    config = config_of(f);
    config.recording = NULL;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_ERR_NULL);
    config = config_of(f);
    config.machine = NULL;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_ERR_NULL);
    gib_machine *empty = gib_machine_new();
    config.machine = empty;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_ERR_STATE);
    gib_machine_free(empty);
    assert_int_equal(gib_diagnosis_start(NULL, &config), GIB_ERR_NULL);
    assert_int_equal(gib_diagnosis_run(NULL, NULL, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_diagnosis_abort(NULL), GIB_ERR_NULL);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_diagnosis_machine(f->diagnosis, f->machine), GIB_ERR_STATE);
    assert_int_equal(gib_diagnosis_json(f->diagnosis, NULL, 0, NULL), GIB_ERR_STATE);
}

static void a_recording_that_does_not_suffice_is_a_verdict(void **state)
{
    fixture *f = *state;
    write_recording(f->recording, 0.2, 0.01);
    gib_diagnosis_config config = config_of(f);
    gib_diagnosis_report report;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
    assert_int_equal(gib_diagnosis_run(f->diagnosis, NULL, NULL), GIB_DONE);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_OK);
    assert_int_equal(report.verdict, GIB_DIAGNOSIS_INSUFFICIENT_DATA);
    char *json = json_of(f->diagnosis);
    assert_says(json, "\"verdict\": \"insufficient_data\"");
    free(json);
}

static void it_stops_when_its_caller_says_so(void **state)
{
    fixture *f = *state;
    gib_diagnosis_config config = config_of(f);
    gib_diagnosis_report report;
    for (int stop_at = 1; stop_at <= 4; stop_at++) {
        struct told told = {.stop_at = stop_at};
        assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
        assert_int_equal(gib_diagnosis_run(f->diagnosis, tell, &told), GIB_ERR_ABORTED);
        assert_int_equal(told.calls, stop_at);
        assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_ERR_STATE);
    }
    /* And works again after it. */
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
    assert_int_equal(gib_diagnosis_run(f->diagnosis, NULL, NULL), GIB_DONE);
}

static int32_t wait_for_abort(void *user, double share, const char *stage)
{
    (void)share;
    (void)stage;
    *(volatile int *)user = 1;
    usleep(1000);
    return 0;
}

struct other_thread {
    fixture *f;
    volatile int begun;
    int32_t status;
};

static void *work(void *user)
{
    struct other_thread *thread = user;
    thread->status = gib_diagnosis_run(thread->f->diagnosis, wait_for_abort, (void *)&thread->begun);
    return NULL;
}

static void another_thread_may_stop_it_and_nothing_else(void **state)
{
    struct other_thread thread = {.f = *state};
    fixture *f = *state;
    gib_diagnosis_config config = config_of(f);
    gib_diagnosis_report report;
    pthread_t id;
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_OK);
    assert_int_equal(pthread_create(&id, NULL, work, &thread), 0);
    while (!thread.begun)
        usleep(100);
    assert_int_equal(gib_diagnosis_result(f->diagnosis, &report), GIB_ERR_STATE);
    assert_int_equal(gib_diagnosis_start(f->diagnosis, &config), GIB_ERR_STATE);
    assert_int_equal(gib_diagnosis_abort(f->diagnosis), GIB_OK);
    assert_int_equal(pthread_join(id, NULL), 0);
    assert_int_equal(thread.status, GIB_ERR_ABORTED);
}

static void a_machine_goes_in_and_out_as_json(void **state)
{
    fixture *f = *state;
    char text[2048], again[2048];
    size_t needed = 0;
    assert_int_equal(gib_machine_result(f->machine, text, sizeof text, &needed), GIB_OK);
    assert_int_equal(strlen(text) + 1, needed);
    assert_int_equal(gib_machine_ignored_keys(f->machine, again, sizeof again, NULL), GIB_OK);
    assert_string_equal(again, "axes[0].colour");
    assert_int_equal(gib_machine_read(f->machine, text, strlen(text)), GIB_OK);
    assert_int_equal(gib_machine_result(f->machine, again, sizeof again, NULL), GIB_OK);
    assert_string_equal(text, again);

    /* A text that cannot be used leaves what was read, and says where and why. */
    const char negative[] = "{\"schema\": \"gib.machine/1\", \"axes\": [{\"name\": \"x\", \"drive\": \"linear\", \"mass_kg\": -4}]}";
    assert_int_equal(gib_machine_read(f->machine, negative, strlen(negative)), GIB_ERR_FORMAT);
    assert_int_equal(gib_machine_last_error_text(f->machine, again, sizeof again), GIB_OK);
    assert_says(again, "axes[0].mass_kg");
    assert_says(again, "-4");
    assert_int_equal(gib_machine_read(f->machine, "\xff\xfe", 2), GIB_ERR_FORMAT);
    assert_int_equal(gib_machine_load(f->machine, "/nowhere/m.json"), GIB_ERR_IO);
    assert_int_equal(gib_machine_last_error_text(f->machine, again, sizeof again), GIB_OK);
    assert_says(again, "/nowhere/m.json");
    assert_int_equal(gib_machine_last_error_text(f->machine, again, 4), GIB_ERR_BUFFER);
    assert_int_equal(strlen(again), 3);
    assert_int_equal(gib_machine_save(f->machine, "/nowhere/m.json"), GIB_ERR_IO);
    assert_int_equal(gib_machine_result(f->machine, again, sizeof again, NULL), GIB_OK);
    assert_string_equal(text, again);

    gib_machine *empty = gib_machine_new();
    assert_int_equal(gib_machine_result(empty, again, sizeof again, NULL), GIB_ERR_STATE);
    assert_int_equal(gib_machine_save(empty, f->machine_file), GIB_ERR_STATE);
    gib_machine_free(empty);
    gib_machine_free(NULL);
    gib_diagnosis_free(NULL);
    assert_int_equal(gib_machine_read(f->machine, NULL, 0), GIB_ERR_NULL);
    assert_int_equal(gib_machine_load(f->machine, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_machine_read(NULL, text, 1), GIB_ERR_NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_wrong_belief_is_found_and_its_extension_holds, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_second_recording_measures_the_gain, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_cannot_be_used_is_refused_by_name, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_recording_that_does_not_suffice_is_a_verdict, set_up, tear_down),
        cmocka_unit_test_setup_teardown(it_stops_when_its_caller_says_so, set_up, tear_down),
        cmocka_unit_test_setup_teardown(another_thread_may_stop_it_and_nothing_else, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_machine_goes_in_and_out_as_json, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
