/*
 * Family `program` from C: INA read, written and removed in the head of a part program, and every refusal by its number.
 */
#include "gib.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define PROGRAM "%\r\nO1234 (WELLE \xfc)\r\nG21\r\nT1 M6\r\nM30\r\n%"

/* A folder of its own for every test, and an instance in memory of our own. */
typedef struct {
    char folder[32];
    char path[64];
    _Alignas(16) unsigned char memory[1024];
    gib_program *handle;
} fixture;

static void write_file(const char *path, const void *bytes, size_t length)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, length, file), length);
    assert_int_equal(fclose(file), 0);
}

static void assert_file(const char *path, const char *expected)
{
    char found[1024] = {0};
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(found, 1, sizeof found - 1, file);
    fclose(file);
    assert_int_equal(length, strlen(expected));
    assert_memory_equal(found, expected, length);
}

static int set_up(void **state)
{
    fixture *f = calloc(1, sizeof *f);
    if (f == NULL)
        return -1;
    strcpy(f->folder, "/tmp/gib-program-XXXXXX");
    if (mkdtemp(f->folder) == NULL || gib_program_size() > sizeof f->memory)
        return -1;
    snprintf(f->path, sizeof f->path, "%s/shaft.nc", f->folder);
    write_file(f->path, PROGRAM, strlen(PROGRAM));
    *state = f;
    return gib_program_init_in(f->memory, sizeof f->memory, &f->handle);
}

static int tear_down(void **state)
{
    fixture *f = *state;
    unlink(f->path);
    int left = rmdir(f->folder); /* fails when anything was left beside the program */
    free(f);
    return left;
}

static void assert_error(const fixture *f, int32_t code, const char *field, const char *part_of_text)
{
    gib_error_detail detail;
    char text[GIB_PROGRAM_TEXT_SIZE];
    assert_int_equal(gib_program_last_error(f->handle, &detail), GIB_OK);
    assert_int_equal(detail.code, code);
    assert_string_equal(detail.field, field);
    assert_int_equal(gib_program_last_error_text(f->handle, text, sizeof text), GIB_OK);
    if (strstr(text, part_of_text) == NULL)
        fail_msg("\"%s\" does not say \"%s\"", text, part_of_text);
}

static void measured_once(void **state)
{
    fixture *f = *state;
    double inertia_kg_m2 = -1.0;
    assert_int_equal(gib_program_get(f->handle, f->path, 0, &inertia_kg_m2), GIB_ERR_PROGRAM_ABSENT);
    assert_true(inertia_kg_m2 == 0.0);
    assert_int_equal(gib_program_set(f->handle, f->path, 0, 0.5, GIB_PROGRAM_DIALECT_DETECT), GIB_OK);
    assert_error(f, GIB_OK, "", "ok");
    assert_int_equal(gib_program_get(f->handle, f->path, 0, &inertia_kg_m2), GIB_OK);
    assert_true(inertia_kg_m2 == 0.5);
    assert_file(f->path, "%\r\nO1234 (WELLE \xfc)\r\n(INA=0.5)\r\nG21\r\nT1 M6\r\nM30\r\n%");
    assert_int_equal(gib_program_get(f->handle, f->path, 2, &inertia_kg_m2), GIB_ERR_PROGRAM_ABSENT);
    assert_int_equal(gib_program_set(f->handle, f->path, 2, 0.42, GIB_PROGRAM_DIALECT_OKUMA), GIB_OK);
    assert_file(f->path, "%\r\nO1234 (WELLE \xfc)\r\n(INA=0.5)\r\nINA2=0.42\r\nG21\r\nT1 M6\r\nM30\r\n%");
    assert_int_equal(gib_program_remove(f->handle, f->path, 0), GIB_OK);
    assert_int_equal(gib_program_remove(f->handle, f->path, 2), GIB_OK);
    assert_int_equal(gib_program_remove(f->handle, f->path, 2), GIB_OK);
    assert_file(f->path, PROGRAM);
}

static void every_dialect(void **state)
{
    fixture *f = *state;
    static const struct {
        int32_t dialect;
        const char *line;
    } cases[] = {{GIB_PROGRAM_DIALECT_LINUXCNC, "\r\n#<_ina7>=0.5\r\n"},
                 {GIB_PROGRAM_DIALECT_OKUMA, "\r\nINA7=0.5\r\n"},
                 {GIB_PROGRAM_DIALECT_ISO, "\r\n(INA7=0.5)\r\n"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char found[1024] = {0};
        double inertia_kg_m2 = 0.0;
        assert_int_equal(gib_program_set(f->handle, f->path, 7, 0.5, cases[i].dialect), GIB_OK);
        FILE *file = fopen(f->path, "rb");
        assert_true(fread(found, 1, sizeof found - 1, file) > 0);
        fclose(file);
        assert_non_null(strstr(found, cases[i].line));
        assert_int_equal(gib_program_get(f->handle, f->path, 7, &inertia_kg_m2), GIB_OK);
        assert_true(inertia_kg_m2 == 0.5);
        assert_int_equal(gib_program_remove(f->handle, f->path, 7), GIB_OK);
    }
    assert_file(f->path, PROGRAM);
}

static void what_is_refused_is_named_and_touches_nothing(void **state)
{
    fixture *f = *state;
    gib_error_detail detail;
    static const double values[] = {0.0, -0.5, 1e-10, 1e10, 0.0 / 0.0, 1.0 / 0.0};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        assert_int_equal(gib_program_set(f->handle, f->path, 0, values[i], 0), GIB_ERR_CONFIG);
        assert_error(f, GIB_ERR_CONFIG, "inertia_kg_m2", "kg·m²");
        gib_program_last_error(f->handle, &detail);
        assert_true(detail.low == 1e-9 && detail.high == 1e9);
    }
    assert_int_equal(gib_program_set(f->handle, f->path, 10000, 0.5, 0), GIB_ERR_CONFIG);
    assert_error(f, GIB_ERR_CONFIG, "step", "");
    assert_int_equal(gib_program_set(f->handle, f->path, 10, 0.5, GIB_PROGRAM_DIALECT_OKUMA), GIB_ERR_CONFIG);
    assert_error(f, GIB_ERR_CONFIG, "step", "four characters");
    assert_int_equal(gib_program_set(f->handle, f->path, 0, 0.5, 4), GIB_ERR_CONFIG);
    assert_error(f, GIB_ERR_CONFIG, "dialect", "");
    assert_int_equal(gib_program_set(f->handle, f->path, 0, 0.5, -1), GIB_ERR_CONFIG);
    assert_int_equal(gib_program_set(f->handle, f->folder, 0, 0.5, 0), GIB_ERR_PROGRAM_NOT_A_FILE);
    assert_int_equal(gib_program_set(f->handle, "/nowhere/at/all", 0, 0.5, 0), GIB_ERR_IO);
    assert_error(f, GIB_ERR_IO, "", "No such file");
    assert_int_equal(gib_program_set(f->handle, "", 0, 0.5, 0), GIB_ERR_PROGRAM_NOT_A_FILE);
    char link[64];
    snprintf(link, sizeof link, "%s/link", f->folder);
    assert_int_equal(symlink(f->path, link), 0);
    assert_int_equal(gib_program_set(f->handle, link, 0, 0.5, 0), GIB_ERR_PROGRAM_LINK);
    assert_error(f, GIB_ERR_PROGRAM_LINK, "", "shaft.nc");
    unlink(link);
    assert_file(f->path, PROGRAM);
}

static void bad_programs_are_quoted(void **state)
{
    fixture *f = *state;
    gib_error_detail detail;
    double inertia_kg_m2 = 1.0;
    write_file(f->path, "%\nO1\nINA=0,5\n", 13);
    assert_int_equal(gib_program_get(f->handle, f->path, 0, &inertia_kg_m2), GIB_ERR_PROGRAM_VALUE);
    assert_true(inertia_kg_m2 == 0.0);
    assert_error(f, GIB_ERR_PROGRAM_VALUE, "line", "line 3: `INA=0,5`");
    gib_program_last_error(f->handle, &detail);
    assert_true(detail.value == 3.0);
    assert_int_equal(gib_program_set(f->handle, f->path, 0, 0.5, 0), GIB_ERR_PROGRAM_VALUE);

    write_file(f->path, "INA=0.5\n(x)\n(INA=0.6)\n", 22);
    assert_int_equal(gib_program_get(f->handle, f->path, 5, &inertia_kg_m2), GIB_ERR_PROGRAM_DUPLICATE);
    assert_error(f, GIB_ERR_PROGRAM_DUPLICATE, "line", "line 3: `(INA=0.6)`");
    gib_program_last_error(f->handle, &detail);
    assert_true(detail.low == 1.0 && detail.high == 3.0);

    write_file(f->path, "%\nO1\n\0\n", 7);
    assert_int_equal(gib_program_get(f->handle, f->path, 0, &inertia_kg_m2), GIB_ERR_FORMAT);
    assert_error(f, GIB_ERR_FORMAT, "", "NUL");
}

static void pointers_and_handles_are_checked(void **state)
{
    fixture *f = *state;
    double inertia_kg_m2 = 1.0;
    char text[8];
    gib_error_detail detail;
    gib_program *handle = f->handle;
    assert_int_equal(gib_program_get(NULL, f->path, 0, &inertia_kg_m2), GIB_ERR_NULL);
    assert_int_equal(gib_program_get(handle, NULL, 0, &inertia_kg_m2), GIB_ERR_NULL);
    assert_int_equal(gib_program_get(handle, f->path, 0, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_program_set(NULL, f->path, 0, 0.5, 0), GIB_ERR_NULL);
    assert_int_equal(gib_program_set(handle, NULL, 0, 0.5, 0), GIB_ERR_NULL);
    assert_int_equal(gib_program_remove(NULL, f->path, 0), GIB_ERR_NULL);
    assert_int_equal(gib_program_remove(handle, NULL, 0), GIB_ERR_NULL);
    assert_int_equal(gib_program_last_error(handle, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_program_last_error(NULL, &detail), GIB_ERR_NULL);
    assert_int_equal(gib_program_last_error_text(handle, NULL, 8), GIB_ERR_NULL);
    assert_int_equal(gib_program_last_error_text(NULL, text, sizeof text), GIB_ERR_NULL);
    assert_int_equal(gib_program_last_error_text(handle, text, sizeof text), GIB_ERR_BUFFER);
    assert_int_equal(strlen(text), sizeof text - 1);
    assert_int_equal(gib_program_last_error_text(handle, text, 0), GIB_ERR_BUFFER);

    _Alignas(16) unsigned char memory[1024] = {0};
    gib_program *zeroed = (gib_program *)memory;
    assert_int_equal(gib_program_get(zeroed, f->path, 0, &inertia_kg_m2), GIB_ERR_HANDLE);
    assert_int_equal(gib_program_set(zeroed, f->path, 0, 0.5, 0), GIB_ERR_HANDLE);
    assert_int_equal(gib_program_last_error(zeroed, &detail), GIB_ERR_HANDLE);
    gib_program *out = zeroed;
    assert_int_equal(gib_program_init_in(memory, gib_program_size() - 1, &out), GIB_ERR_MEMORY);
    assert_null(out);
    assert_int_equal(gib_program_init_in(memory + 1, sizeof memory - 1, &out), GIB_ERR_MEMORY);
    assert_int_equal(gib_program_init_in(NULL, sizeof memory, &out), GIB_ERR_NULL);
    assert_int_equal(gib_program_init_in(memory, sizeof memory, NULL), GIB_ERR_NULL);

    gib_program *allocated = gib_program_new();
    assert_non_null(allocated);
    assert_int_equal(gib_program_get(allocated, f->path, 0, &inertia_kg_m2), GIB_ERR_PROGRAM_ABSENT);
    gib_program_free(allocated);
    gib_program_free(NULL);
    assert_file(f->path, PROGRAM);
}

static void the_table_has_the_family(void **state)
{
    fixture *f = *state;
    const gib_api_table *api = gib_api(GIB_ABI_VERSION);
    assert_non_null(api);
    assert_true(api->struct_size >= offsetof(gib_api_table, program_last_error_text) + sizeof(void (*)(void)));
    assert_int_equal(api->program_set(f->handle, f->path, 0, 0.5, GIB_PROGRAM_DIALECT_ISO), GIB_OK);
    assert_int_equal(api->program_remove(f->handle, f->path, 0), GIB_OK);
    assert_file(f->path, PROGRAM);
}

#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(measured_once),
        CASE(every_dialect),
        CASE(what_is_refused_is_named_and_touches_nothing),
        CASE(bad_programs_are_quoted),
        CASE(pointers_and_handles_are_checked),
        CASE(the_table_has_the_family),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
