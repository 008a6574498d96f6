/* Tilt when things go wrong: faults in every state, an abort at every cycle, inputs that are no numbers, wrong calls. */
#include "tilt_laws.h"
#include "tilt_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { PASSES = 2, PHASES = GIB_TILT_FAILED + 1 };

static tilt_plant_config usual; /* short, tilted, on a table that a B axis turns */
static gib_tilt_config config;
static gib_tilt_table table;
static tilt_pass passes[TILT_PASSES];

static int prepare(void **state)
{
    (void)state;
    usual = tilt_plant_default();
    usual.feed_mm_s = 40.0;
    usual.tool_diameter_mm = 6.0;
    usual.length_mm = 80.0;
    usual.noise_ratio = 0.005;
    usual.chips_1_s = 0.0;
    tilt_raster(&usual, passes);
    config = tilt_config(&usual);
    config.ack_timeout_s = 0.3;
    config.block_s = 0.05;
    config.offset_speed_deg_s = 4.0;
    config.offset_acceleration_deg_s2 = 40.0;
    config.rotary[0].axis = GIB_TILT_AXIS_B;
    memcpy(config.rotary[0].pivot_mm, usual.pivot_mm, sizeof usual.pivot_mm);
    gib_tilt *gib = gib_tilt_new();
    int32_t status = tilt_teach(usual, gib, 1.0, 5.0, 0.5, &table);
    gib_tilt_free(gib);
    usual.about_x_deg = 0.6;
    usual.about_y_deg = -0.5;
    return status == GIB_DONE ? 0 : -1;
}

/* A run in memory of its own, which can be copied at any cycle. */
typedef struct {
    tilt_plant plant;
    tilt_kernel kernel;
    tilt_laws laws;
    int32_t status;
    int warned; /* cycles in which the warning stood: accepted in the fiftieth */
} run;

static void *aligned(void)
{
    return aligned_alloc(16, (gib_tilt_size() + 15) / 16 * 16);
}

static void begin(run *r, void *memory)
{
    memset(r, 0, sizeof *r);
    tilt_plant_init(&r->plant, &usual);
    r->kernel.plant = &r->plant;
    assert_int_equal(gib_tilt_init_in(memory, gib_tilt_size(), &r->kernel.gib), GIB_OK);
    tilt_laws_init(&r->laws, &config);
    assert_int_equal(gib_tilt_start(r->kernel.gib, &config, &table), GIB_OK);
    r->status = GIB_BUSY;
    tilt_rewind(&r->kernel);
}

/* What the kernel senses now; the offsets are taken out again when the passes are over. */
static gib_tilt_input sense(run *r)
{
    r->kernel.plant = &r->plant;
    gib_tilt_input in = tilt_sense(&r->kernel, passes, PASSES);
    r->warned += r->kernel.out.warning;
    if (r->warned >= 50) {
        in.acknowledged_id = r->kernel.out.request_id;
    }
    return in;
}

static void step(run *r, const gib_tilt_input *in)
{
    r->status = gib_tilt_step(r->kernel.gib, in, &r->kernel.out);
    tilt_laws_watch(&r->laws, in, r->status, &r->kernel.out);
    if (r->laws.broken) {
        fail_msg("%s, in phase %d", r->laws.broken, r->kernel.out.phase);
    }
}

/* A run brought into a phase, for some cycles; false when the run has ended before. */
static int reach(run *r, void *memory, int phase, int cycles)
{
    begin(r, memory);
    if (phase == GIB_TILT_IDLE) {
        gib_tilt_input in = {0};
        assert_int_equal(gib_tilt_init_in(memory, gib_tilt_size(), &r->kernel.gib), GIB_OK);
        step(r, &in);
        return 1;
    }
    for (int i = 0, n = 0; i < 200000; i++) {
        gib_tilt_input in = sense(r);
        int p = r->kernel.out.phase;
        if (p == phase && n++ == cycles) {
            return 1;
        }
        if (p == GIB_TILT_ACTIVE && (phase > GIB_TILT_ACTIVE) && r->status == GIB_BUSY) {
            in.flags |= phase == GIB_TILT_FAILED ? GIB_INPUT_ABORT : GIB_TILT_INPUT_OFF;
        }
        step(r, &in);
    }
    return 0;
}

/* To the end without further trouble: offsets out, within the time that the bounds allow. */
static void end(run *r, int32_t wanted)
{
    int cycles = 0;
    while (r->status == GIB_BUSY && cycles++ < 3000) {
        gib_tilt_input in = sense(r);
        in.flags &= GIB_TILT_INPUT_CUTTING;
        step(r, &in);
    }
    if (r->status != wanted) {
        fail_msg("ended with %s, not with %s", gib_status_text(r->status), gib_status_text(wanted));
    }
    for (int i = 0; i < 3; i++) {
        assert_true(r->kernel.out.offset_mm[i] == 0.0 && r->kernel.out.offset_deg[i] == 0.0);
    }
    /* The first error stays, also in the detail, until the next start. */
    gib_error_detail detail;
    gib_tilt_last_error(r->kernel.gib, &detail);
    assert_int_equal(detail.code, wanted < 0 ? wanted : GIB_OK);
    assert_int_equal(r->kernel.out.message, wanted < 0 ? wanted : 0);
    gib_tilt_input later = {.flags = GIB_INPUT_FAULT};
    step(r, &later);
    assert_int_equal(r->status, wanted);
}

static double *field(gib_tilt_input *in, int i)
{
    return i < 3 ? &in->position_mm[i] : i < 6 ? &in->rotary_deg[i - 3] : i == 6 ? &in->load : &in->speed_rpm;
}

static const char *const FIELDS[8] = {"position_mm", "position_mm", "position_mm", "rotary_deg",
                                      "rotary_deg",  "rotary_deg",  "load",        "speed_rpm"};

/* Whether an input can end a run in this phase, and how an untroubled run ends from there. */
static int busy_in(int phase)
{
    return phase >= GIB_TILT_MEASURING && phase <= GIB_TILT_RAMP_OFF;
}

static int32_t ended(int phase)
{
    return phase == GIB_TILT_IDLE ? GIB_OK : phase == GIB_TILT_FAILED ? GIB_ERR_ABORTED : GIB_DONE;
}

/* Abort, drive fault, an unknown flag, and NaN, infinity or a number beyond any machine in each input: in every phase. */
static void every_fault_in_every_phase(void **state)
{
    (void)state;
    static const double NO_NUMBERS[] = {NAN, INFINITY, -INFINITY, 1e300};
    void *memory = aligned(), *copy = aligned();
    int faults = 0;
    for (int phase = 0; phase < PHASES; phase++) {
        for (int cycles = 0; cycles < 40; cycles += 13) {
            run at;
            if (!reach(&at, memory, phase, cycles)) {
                fail_msg("phase %d was not reached", phase);
            }
            for (int kind = 0; kind < 4 + 8 * 4; kind++) {
                run r = at;
                memcpy(copy, memory, gib_tilt_size());
                r.kernel.gib = copy;
                gib_tilt_input in = sense(&r);
                int32_t wanted = GIB_ERR_ABORTED;
                const char *name = "";
                if (kind == 0) {
                    in.flags |= GIB_INPUT_ABORT;
                } else if (kind == 1) {
                    assert_int_equal(gib_tilt_abort(r.kernel.gib), GIB_OK);
                } else if (kind < 4) {
                    in.flags |= kind == 2 ? GIB_INPUT_FAULT : 1u << 20;
                    wanted = kind == 2 ? GIB_ERR_DRIVE_FAULT : GIB_ERR_CONFIG;
                    name = kind == 2 ? "" : "flags";
                } else {
                    *field(&in, (kind - 4) / 4) = NO_NUMBERS[kind % 4];
                    wanted = GIB_ERR_NON_FINITE;
                    name = FIELDS[(kind - 4) / 4];
                }
                step(&r, &in);
                if (busy_in(phase)) {
                    gib_error_detail detail;
                    gib_tilt_last_error(r.kernel.gib, &detail);
                    assert_int_equal(detail.code, wanted);
                    assert_string_equal(detail.field, name);
                    assert_true(r.kernel.out.phase == GIB_TILT_RAMP_OFF || r.kernel.out.phase == GIB_TILT_FAILED);
                }
                end(&r, busy_in(phase) ? wanted : ended(phase));
                faults++;
            }
        }
    }
    printf("%d faults\n", faults);
    free(memory);
    free(copy);
}

/* One whole run, aborted at each of its cycles in turn; alternately by the flag, by the call, and by taking the offsets
 * out. */
static void abort_at_every_cycle(void **state)
{
    (void)state;
    void *memory = aligned(), *copy = aligned();
    run r;
    int aborted[PHASES] = {0}, active = 0;
    begin(&r, memory);
    for (int i = 0; r.status == GIB_BUSY; i++) {
        run a = r;
        memcpy(copy, memory, gib_tilt_size());
        a.kernel.gib = copy;
        gib_tilt_input in = sense(&a);
        int phase = r.kernel.out.phase;
        if (i % 2) {
            gib_tilt_abort(a.kernel.gib);
        } else {
            in.flags |= GIB_INPUT_ABORT;
        }
        step(&a, &in);
        end(&a, GIB_ERR_ABORTED);
        aborted[phase]++;
        in = sense(&r);
        active += phase == GIB_TILT_ACTIVE;
        in.flags |= active > 200 ? GIB_TILT_INPUT_OFF : 0;
        step(&r, &in);
    }
    assert_int_equal(r.status, GIB_DONE);
    for (int p = GIB_TILT_MEASURING; p <= GIB_TILT_RAMP_OFF; p++) {
        printf("phase %d: aborted %d times\n", p, aborted[p]);
        assert_true(aborted[p] > 0);
    }
    free(memory);
    free(copy);
}

/* From this cycle on the table stands turned: by less than counts, by more, or about an axis that is not gib's. In the air, and where
 * the offsets are in force or go out, nobody asks; a later cut, the answer to the warning and the ramp in do. */
static void a_table_that_turns(void **state)
{
    (void)state;
    void *memory = aligned();
    for (int phase = GIB_TILT_MEASURING; phase <= GIB_TILT_RAMP_OFF; phase++) {
        for (int kind = 0; kind < 3; kind++) {
            run r;
            gib_error_detail detail;
            assert_true(reach(&r, memory, phase, phase == GIB_TILT_MEASURING ? 2000 : 13));
            int matters = kind == 1 && phase <= GIB_TILT_RAMP_ON, cycles = 0;
            while (r.status == GIB_BUSY && cycles++ < 100000) {
                gib_tilt_input in = sense(&r);
                in.flags |= r.kernel.out.phase == GIB_TILT_ACTIVE && phase != GIB_TILT_RAMP_OFF ? GIB_TILT_INPUT_OFF : 0u;
                in.rotary_deg[kind == 2 ? 2 : 1] += kind == 0 ? 0.009 : -0.011;
                step(&r, &in);
            }
            gib_tilt_last_error(r.kernel.gib, &detail);
            assert_int_equal(r.status, matters ? GIB_ERR_TILT_CONDITION : GIB_DONE);
            assert_string_equal(detail.field, matters ? "rotary_deg" : "");
        }
    }
    free(memory);
}

/* Taken out in the middle of the ramp in: a ramp too, and no error. */
static void off_at_every_moment(void **state)
{
    (void)state;
    void *memory = aligned();
    for (int phase = GIB_TILT_WARNING; phase <= GIB_TILT_RAMP_OFF; phase++) {
        for (int cycles = 0; cycles < 9; cycles++) {
            run r;
            assert_true(reach(&r, memory, phase, cycles * (phase == GIB_TILT_WARNING ? 1 : 17)));
            gib_tilt_input in = sense(&r);
            in.flags |= GIB_TILT_INPUT_OFF;
            step(&r, &in);
            end(&r, GIB_DONE);
        }
    }
    free(memory);
}

/* Positions that jump about while the offsets are in force: still within every bound, and limited where they must be. */
static void a_position_that_jumps(void **state)
{
    (void)state;
    void *memory = aligned();
    run r;
    uint64_t random = 9;
    int limited = 0;
    assert_true(reach(&r, memory, GIB_TILT_ACTIVE, 5));
    for (int i = 0; i < 20000; i++) {
        gib_tilt_input in = sense(&r);
        if (i % 500 < 250) {
            in.position_mm[i / 500 % 2] = 1e4 * (tilt_plant_uniform(&random) - 0.5);
        }
        step(&r, &in);
        limited += r.kernel.out.limited;
        assert_int_equal(r.status, GIB_BUSY);
    }
    assert_true(limited > 100);
    gib_tilt_input in = {.flags = GIB_TILT_INPUT_OFF};
    step(&r, &in);
    end(&r, GIB_DONE);
    free(memory);
}

static void wrong_calls_are_refused(void **state)
{
    (void)state;
    gib_tilt *gib = gib_tilt_new();
    gib_tilt_input in = {0};
    gib_tilt_output out;
    gib_tilt_report report;
    gib_error_detail detail;
    /* Before a start: idle, no offset; NaN changes nothing of that. */
    in.load = NAN;
    memset(&out, 0x7f, sizeof out);
    assert_int_equal(gib_tilt_step(gib, &in, &out), GIB_OK);
    assert_true(out.offset_mm[0] == 0.0 && out.offset_deg[2] == 0.0 && out.phase == GIB_TILT_IDLE);
    assert_int_equal(gib_tilt_result(gib, &report), GIB_OK);
    assert_int_equal(report.decision, GIB_TILT_UNDECIDED);
    assert_int_equal(gib_tilt_abort(gib), GIB_OK);
    assert_int_equal(gib_tilt_step(gib, &in, &out), GIB_OK);
    /* Pointers. */
    assert_int_equal(gib_tilt_start(NULL, &config, &table), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_start(gib, NULL, &table), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_start(gib, &config, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_step(gib, NULL, &out), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_step(gib, &in, NULL), GIB_ERR_NULL);
    memset(&out, 0x7f, sizeof out);
    assert_int_equal(gib_tilt_step(NULL, &in, &out), GIB_ERR_NULL);
    assert_true(out.offset_mm[2] == 0.0 && out.status == GIB_ERR_NULL);
    assert_int_equal(gib_tilt_result(gib, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_last_error(NULL, &detail), GIB_ERR_NULL);
    gib_tilt_free(NULL);
    /* Memory that holds no instance, too little of it, or crooked. */
    char *raw = aligned();
    gib_tilt *placed;
    memset(raw, 0, gib_tilt_size());
    assert_int_equal(gib_tilt_step((gib_tilt *)(void *)raw, &in, &out), GIB_ERR_HANDLE);
    assert_int_equal(gib_tilt_start((gib_tilt *)(void *)raw, &config, &table), GIB_ERR_HANDLE);
    assert_int_equal(gib_tilt_init_in(raw, gib_tilt_size() - 1, &placed), GIB_ERR_MEMORY);
    assert_null(placed);
    assert_int_equal(gib_tilt_init_in(raw + 4, gib_tilt_size(), &placed), GIB_ERR_MEMORY);
    free(raw);
    /* Sizes: shorter than the first published, longer with a tail that is not zero, longer with a zero tail. */
    struct {
        gib_tilt_config config;
        double later;
    } longer = {config, 0.0};
    longer.config.struct_size = 8;
    assert_int_equal(gib_tilt_start(gib, &longer.config, &table), GIB_ERR_STRUCT_SIZE);
    longer.config.struct_size = sizeof longer;
    longer.later = 1.0;
    assert_int_equal(gib_tilt_start(gib, &longer.config, &table), GIB_ERR_STRUCT_SIZE);
    longer.later = 0.0;
    assert_int_equal(gib_tilt_start(gib, &longer.config, &table), GIB_OK);
    /* Busy: that must not hide why the run fails. */
    assert_int_equal(gib_tilt_start(gib, &config, &table), GIB_ERR_STATE);
    gib_tilt_last_error(gib, &detail);
    assert_int_equal(detail.code, GIB_OK);
    gib_tilt_abort(gib);
    gib_tilt_last_error(gib, &detail);
    assert_int_equal(detail.code, GIB_ERR_ABORTED);
    gib_tilt_free(gib);
}

/* Every field of the configuration is checked, and named. */
static void bad_configurations_are_named(void **state)
{
    (void)state;
    static const struct {
        size_t at;
        double value;
        const char *field;
    } BAD[] = {
        {offsetof(gib_tilt_config, cycle_s), 1.0, "cycle_s"},
        {offsetof(gib_tilt_config, condition.speed_rpm), 0.0, "condition.speed_rpm"},
        {offsetof(gib_tilt_config, condition.feed_mm_min), -1.0, "condition.feed_mm_min"},
        {offsetof(gib_tilt_config, condition_tolerance_ratio), 0.9, "condition_tolerance_ratio"},
        {offsetof(gib_tilt_config, entry_mm), -1.0, "entry_mm"},
        {offsetof(gib_tilt_config, block_s), 20.0, "block_s"},
        {offsetof(gib_tilt_config, time_limit_s), 1e6, "time_limit_s"},
        {offsetof(gib_tilt_config, wear_ratio_m), 100.0, "wear_ratio_m"},
        {offsetof(gib_tilt_config, band_deg), 50.0, "band_deg"},
        {offsetof(gib_tilt_config, band_load), -1.0, "band_load"},
        {offsetof(gib_tilt_config, nominal_depth_mm), -1.0, "nominal_depth_mm"},
        {offsetof(gib_tilt_config, offset_max_mm), 1000.0, "offset_max_mm"},
        {offsetof(gib_tilt_config, offset_max_deg), 90.0, "offset_max_deg"},
        {offsetof(gib_tilt_config, offset_speed_mm_s), 1e4, "offset_speed_mm_s"},
        {offsetof(gib_tilt_config, offset_acceleration_mm_s2), 1e6, "offset_acceleration_mm_s2"},
        {offsetof(gib_tilt_config, offset_speed_deg_s), 1e4, "offset_speed_deg_s"},
        {offsetof(gib_tilt_config, offset_acceleration_deg_s2), 1e6, "offset_acceleration_deg_s2"},
        {offsetof(gib_tilt_config, ack_timeout_s), 1e6, "ack_timeout_s"},
        {offsetof(gib_tilt_config, rotary[0].pivot_mm), 1e9, "rotary.pivot_mm"},
    };
    gib_tilt *gib = gib_tilt_new();
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        for (int nan = 0; nan < 2; nan++) {
            gib_tilt_config c = config;
            gib_error_detail detail;
            double value = nan ? NAN : BAD[i].value;
            memcpy((char *)&c + BAD[i].at, &value, sizeof value);
            assert_int_equal(gib_tilt_start(gib, &c, &table), GIB_ERR_CONFIG);
            gib_tilt_last_error(gib, &detail);
            assert_string_equal(detail.field, BAD[i].field);
            assert_true(nan || (detail.value == BAD[i].value && (detail.value < detail.low || detail.value > detail.high)));
        }
    }
    gib_tilt_free(gib);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_fault_in_every_phase), cmocka_unit_test(abort_at_every_cycle),
        cmocka_unit_test(a_table_that_turns),         cmocka_unit_test(off_at_every_moment),
        cmocka_unit_test(a_position_that_jumps),
        cmocka_unit_test(wrong_calls_are_refused),    cmocka_unit_test(bad_configurations_are_named),
    };
    return cmocka_run_group_tests(tests, prepare, NULL);
}
