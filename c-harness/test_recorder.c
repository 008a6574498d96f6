/*
 * Family `recorder` from C: what stands in the shared memory, every refusal, and a writer that dies.
 */
#include "gib.h"

#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

typedef struct {
    char name[32], path[64];
    gib_recorder_config config;
    gib_recorder *gib;
} fixture;

static int set_up(void **state)
{
    fixture *f = calloc(1, sizeof *f);
    snprintf(f->name, sizeof f->name, "test-%d", (int)getpid());
    snprintf(f->path, sizeof f->path, "/gib-%s", f->name);
    gib_recorder_config config = {.struct_size = sizeof config,
                                  .channels = 2,
                                  .capacity_rows = 16,
                                  .cycle_s = 0.001,
                                  .name = f->name,
                                  .machine = "rig",
                                  .columns = "x.position_mm,x.torque_nm"};
    f->config = config;
    f->gib = gib_recorder_new();
    *state = f;
    return f->gib == NULL;
}

static int tear_down(void **state)
{
    fixture *f = *state;
    gib_recorder_free(f->gib);
    shm_unlink(f->path);
    free(f);
    return 0;
}

/* The shared memory as anybody sees it who has the permission; NULL when there is none. */
static const uint64_t *look(const fixture *f, struct stat *meta)
{
    int file = shm_open(f->path, O_RDONLY, 0);
    if (file < 0) {
        return NULL;
    }
    assert_int_equal(fstat(file, meta), 0);
    const uint64_t *words = mmap(NULL, (size_t)meta->st_size, PROT_READ, MAP_SHARED, file, 0);
    close(file);
    return words == MAP_FAILED ? NULL : words;
}

static double number(uint64_t word)
{
    double value;
    memcpy(&value, &word, sizeof value);
    return value;
}

static void memory_is_as_documented(void **state)
{
    fixture *f = *state;
    struct stat meta;
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
    for (int n = 0; n < 20; n++) {
        double values[] = {n + 0.5, -n};
        assert_int_equal(gib_recorder_step(f->gib, values, 2), GIB_BUSY);
    }
    const uint64_t *words = look(f, &meta);
    assert_non_null(words);
    assert_int_equal(meta.st_mode & 0777, 0600);
    assert_int_equal(meta.st_size, 4096 + 16 * 3 * 8);
    assert_memory_equal(words, "gib-ring", 8);
    const uint64_t numbers[] = {1, 512, 2, 16, 1};
    assert_memory_equal(words + 1, numbers, sizeof numbers);
    assert_float_equal(number(words[6]), 0.001, 0.0);
    assert_int_equal(words[7], 1);
    assert_int_equal(words[16], 20);
    assert_string_equal((const char *)(words + 32), "rig");
    assert_string_equal((const char *)(words + 40), "x.position_mm,x.torque_nm");
    for (uint64_t n = 4; n < 20; n++) {
        const uint64_t *row = words + 512 + n % 16 * 3;
        assert_int_equal(row[0], n);
        assert_float_equal(number(row[1]), n + 0.5, 0.0);
        assert_float_equal(number(row[2]), -(double)n, 0.0);
    }

    gib_recorder_report report;
    assert_int_equal(gib_recorder_result(f->gib, &report), GIB_OK);
    assert_int_equal(report.rows, 20);
    assert_int_equal(report.bytes, meta.st_size);
    assert_int_equal(report.capacity_rows, 16);

    /* The end: rows stop, whoever has it open sees so, and the name goes. */
    double values[] = {0.0, 0.0};
    assert_int_equal(gib_recorder_abort(f->gib), GIB_OK);
    assert_int_equal(gib_recorder_step(f->gib, values, 2), GIB_ERR_ABORTED);
    assert_int_equal(words[16], 20);
    assert_int_equal(words[7], 2);
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_ERR_STATE);
    assert_int_equal(gib_recorder_close(f->gib), GIB_OK);
    munmap((void *)words, (size_t)meta.st_size);
    assert_null(look(f, &meta));
    assert_int_equal(gib_recorder_step(f->gib, values, 2), GIB_OK);
    /* And again under the same name. */
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
    assert_int_equal(gib_recorder_result(f->gib, &report), GIB_OK);
    assert_int_equal(report.rows, 0);
}

/* From their own addresses the values come as they are at each cycle, and as many as there are channels. */
static void scattered_values_are_read_where_they_are(void **state)
{
    fixture *f = *state;
    for (uint32_t channels = 1; channels <= 64; channels++) {
        char columns[512] = "";
        double values[64];
        const double *sources[64];
        struct stat meta;
        for (uint32_t i = 0; i < channels; i++) {
            snprintf(columns + strlen(columns), sizeof columns - strlen(columns), "%sc%u", i ? "," : "", i);
            sources[i] = &values[channels - 1 - i];
        }
        f->config.channels = channels;
        f->config.columns = columns;
        assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
        for (int n = 0; n < 5; n++) {
            for (uint32_t i = 0; i < channels; i++) {
                values[i] = 100.0 * n + i;
            }
            assert_int_equal(gib_recorder_step_from(f->gib, sources, channels), GIB_BUSY);
        }
        assert_int_equal(gib_recorder_step_from(f->gib, sources, channels + 1), GIB_ERR_RECORDER_COUNT);
        assert_int_equal(gib_recorder_step_from(f->gib, NULL, channels), GIB_ERR_NULL);
        assert_int_equal(gib_recorder_step_from(NULL, sources, channels), GIB_ERR_NULL);
        const uint64_t *words = look(f, &meta);
        assert_non_null(words);
        assert_int_equal(words[16], 5);
        uint64_t row_words = ((uint64_t)meta.st_size / 8 - 512) / 16;
        for (uint64_t n = 0; n < 5; n++) {
            const uint64_t *row = words + 512 + n * row_words;
            assert_int_equal(row[0], n);
            for (uint32_t i = 0; i < channels; i++) {
                assert_float_equal(number(row[1 + i]), 100.0 * n + (channels - 1 - i), 0.0);
            }
        }
        munmap((void *)words, (size_t)meta.st_size);
        assert_int_equal(gib_recorder_abort(f->gib), GIB_OK);
        assert_int_equal(gib_recorder_step_from(f->gib, sources, channels), GIB_ERR_ABORTED);
        assert_int_equal(gib_recorder_close(f->gib), GIB_OK);
        assert_int_equal(gib_recorder_step_from(f->gib, sources, channels), GIB_OK);
    }
}

static void refused(fixture *f, gib_recorder_config config, int32_t code, const char *field)
{
    gib_error_detail detail;
    assert_int_equal(gib_recorder_start(f->gib, &config), code);
    assert_int_equal(gib_recorder_last_error(f->gib, &detail), GIB_OK);
    assert_int_equal(detail.code, code);
    assert_string_equal(detail.field, field);
}

static void every_refusal(void **state)
{
    fixture *f = *state;
    struct stat meta;
    gib_recorder_config c = f->config;
#define REFUSED(member, bad, code)                                                                                     \
    do {                                                                                                               \
        c = f->config;                                                                                                 \
        c.member = bad;                                                                                                \
        refused(f, c, code, #member);                                                                                  \
    } while (0)
    REFUSED(channels, 0, GIB_ERR_CONFIG);
    REFUSED(channels, 65, GIB_ERR_CONFIG);
    REFUSED(capacity_rows, 15, GIB_ERR_CONFIG);
    REFUSED(every_cycles, 1000001, GIB_ERR_CONFIG);
    REFUSED(mode, 0777, GIB_ERR_CONFIG);
    REFUSED(mode, 0400, GIB_ERR_CONFIG);
    REFUSED(cycle_s, NAN, GIB_ERR_CONFIG);
    REFUSED(cycle_s, 0.0, GIB_ERR_CONFIG);
    REFUSED(name, NULL, GIB_ERR_CONFIG);
    REFUSED(name, "../x", GIB_ERR_CONFIG);
    REFUSED(machine, "my rig", GIB_ERR_CONFIG);
    REFUSED(columns, NULL, GIB_ERR_CONFIG);
    REFUSED(columns, "x.position_mm", GIB_ERR_RECORDER_COLUMN);
    REFUSED(columns, "x.position_mm,x.position_mm", GIB_ERR_RECORDER_COLUMN);
    REFUSED(columns, "x.position_mm,x.torque_mm", GIB_ERR_RECORDER_COLUMN);
    REFUSED(columns, "x.position_mm,time_s", GIB_ERR_RECORDER_COLUMN);
    REFUSED(columns, "x.position_mm,a b", GIB_ERR_RECORDER_COLUMN);
    /* The number of a wrong column stands without a range, a wrong count with the one wanted. */
    gib_error_detail detail;
    assert_int_equal(gib_recorder_last_error(f->gib, &detail), GIB_OK);
    assert_true(detail.value == 2.0 && detail.low == 0.0 && detail.high == 0.0);
    REFUSED(columns, "x.position_mm", GIB_ERR_RECORDER_COLUMN);
    assert_int_equal(gib_recorder_last_error(f->gib, &detail), GIB_OK);
    assert_true(detail.value == 1.0 && detail.low == detail.high && detail.low > 1.0);
    c = f->config;
    c.struct_size = 8;
    assert_int_equal(gib_recorder_start(f->gib, &c), GIB_ERR_STRUCT_SIZE);
    assert_int_equal(gib_recorder_start(f->gib, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_recorder_start(NULL, &c), GIB_ERR_NULL);
    assert_null(look(f, &meta));

    double values[] = {1.0, NAN};
    assert_int_equal(gib_recorder_step(NULL, values, 2), GIB_ERR_NULL);
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
    assert_int_equal(gib_recorder_step(f->gib, NULL, 2), GIB_ERR_NULL);
    assert_int_equal(gib_recorder_step(f->gib, values, 1), GIB_ERR_RECORDER_COUNT);
    assert_int_equal(gib_recorder_step(f->gib, values, 3), GIB_ERR_RECORDER_COUNT);
    gib_recorder_report report;
    assert_int_equal(gib_recorder_result(f->gib, &report), GIB_OK);
    assert_int_equal(report.rows, 0);
    assert_int_equal(gib_recorder_result(f->gib, NULL), GIB_ERR_NULL);
    _Alignas(16) unsigned char memory[1024] = {0};
    assert_true(gib_recorder_size() <= sizeof memory);
    assert_int_equal(gib_recorder_step((gib_recorder *)memory, values, 2), GIB_ERR_HANDLE);
    gib_recorder *placed;
    assert_int_equal(gib_recorder_init_in(memory, gib_recorder_size(), &placed), GIB_OK);
    assert_int_equal(gib_recorder_step(placed, values, 2), GIB_OK);
    assert_int_equal(gib_recorder_close(placed), GIB_OK);
    gib_recorder_free(NULL);
}

static void one_writer_a_name(void **state)
{
    fixture *f = *state;
    gib_recorder *other = gib_recorder_new();
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
    assert_int_equal(gib_recorder_start(other, &f->config), GIB_ERR_RECORDER_IN_USE);
    gib_recorder_close(f->gib);
    assert_int_equal(gib_recorder_start(other, &f->config), GIB_OK);
    gib_recorder_free(other);
}

static void a_dead_writer_is_cleared_away(void **state)
{
    fixture *f = *state;
    struct stat meta;
    pid_t child = fork();
    if (child == 0) {
        gib_recorder *gib = gib_recorder_new();
        _exit(gib_recorder_start(gib, &f->config) == GIB_OK ? 0 : 1);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    const uint64_t *left = look(f, &meta);
    assert_non_null(left); /* what it had written can still be read */
    assert_int_equal(left[7], 1);
    munmap((void *)left, (size_t)meta.st_size);
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
}

static void a_foreign_name_is_left_alone(void **state)
{
    fixture *f = *state;
    struct stat meta;
    int file = shm_open(f->path, O_RDWR | O_CREAT, 0600);
    assert_int_equal(write(file, "somebody else's", 15), 15);
    close(file);
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_ERR_RECORDER_FOREIGN);
    const uint64_t *still = look(f, &meta);
    assert_non_null(still);
    assert_memory_equal(still, "somebody", 8);
    munmap((void *)still, (size_t)meta.st_size);
}

static void the_mode_is_the_operators(void **state)
{
    fixture *f = *state;
    struct stat meta;
    mode_t mask = umask(077);
    f->config.mode = 0660;
    assert_int_equal(gib_recorder_start(f->gib, &f->config), GIB_OK);
    umask(mask);
    const uint64_t *words = look(f, &meta);
    assert_non_null(words);
    assert_int_equal(meta.st_mode & 0777, 0660);
    munmap((void *)words, (size_t)meta.st_size);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(memory_is_as_documented, set_up, tear_down),
        cmocka_unit_test_setup_teardown(scattered_values_are_read_where_they_are, set_up, tear_down),
        cmocka_unit_test_setup_teardown(every_refusal, set_up, tear_down),
        cmocka_unit_test_setup_teardown(one_writer_a_name, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_dead_writer_is_cleared_away, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_foreign_name_is_left_alone, set_up, tear_down),
        cmocka_unit_test_setup_teardown(the_mode_is_the_operators, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
