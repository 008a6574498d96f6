/* The load table from C: built from cuts, checked, saved, loaded, and refused where it cannot be measured with. */
#include "gib.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char file[64];

static gib_tilt_table published(void)
{
    gib_tilt_table t;
    memset(&t, 0, sizeof t);
    t.struct_size = sizeof t;
    t.condition.tool_id = 3;
    t.condition.material_id = 7;
    t.condition.speed_rpm = 1000.0;
    t.condition.feed_mm_min = 300.0;
    /* In any order. */
    assert_int_equal(gib_tilt_table_add(&t, 4.0, 35.59341, 0.0, NULL), GIB_OK);
    assert_int_equal(gib_tilt_table_add(&t, 2.0, 35.07572, 0.0, NULL), GIB_OK);
    assert_int_equal(gib_tilt_table_add(&t, 3.0, 35.42784, 0.0, NULL), GIB_OK);
    return t;
}

/* The print's numbers, but for its slip in the first fraction. */
static void the_published_example(void **state)
{
    (void)state;
    gib_tilt_table t = published();
    gib_tilt_two_point_result r;
    const double position[2] = {-19.333, -60.733}, load[2] = {35.56424, 35.36833};
    assert_int_equal(gib_tilt_two_point(&t, position, load, &r, NULL), GIB_OK);
    assert_true(fabs(r.depth_mm[0] - 3.823821) < 5e-7 && fabs(r.depth_mm[1] - 2.830995) < 5e-7);
    assert_true(fabs(r.tilt_deg - 1.373764) < 5e-7);
    assert_true(fabs(r.slope - tan(1.373764 * 3.14159265358979 / 180.0)) < 1e-8);
}

static void two_points_refuse(void **state)
{
    (void)state;
    gib_tilt_table t = published();
    gib_tilt_two_point_result r;
    gib_error_detail detail;
    const double apart[2] = {0.0, 10.0}, same[2] = {5.0, 5.0}, inside[2] = {35.2, 35.5}, outside[2] = {35.2, 35.7},
                 none[2] = {35.2, NAN};
    assert_int_equal(gib_tilt_two_point(&t, apart, outside, &r, &detail), GIB_ERR_TILT_RANGE);
    assert_string_equal(detail.field, "load");
    assert_true(detail.value == 35.7 && detail.high == 35.59341);
    assert_int_equal(gib_tilt_two_point(&t, apart, none, &r, &detail), GIB_ERR_TILT_RANGE);
    assert_int_equal(gib_tilt_two_point(&t, same, inside, &r, &detail), GIB_ERR_CONFIG);
    assert_string_equal(detail.field, "position_mm");
    assert_int_equal(gib_tilt_two_point(&t, NULL, inside, &r, &detail), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_two_point(&t, apart, inside, NULL, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_two_point(NULL, apart, inside, &r, NULL), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_two_point(&t, apart, inside, &r, NULL), GIB_OK);
}

static void what_does_not_rise_is_refused(void **state)
{
    (void)state;
    gib_error_detail detail;
    gib_tilt_table t = published();
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_OK);
    t.load[1] = 35.0;
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_ERR_TILT_TABLE);
    assert_string_equal(detail.field, "load");
    assert_true(detail.value == 35.0 && detail.low == 35.07572);
    /* It rises, but by less than it is known. */
    t = published();
    t.load_std[1] = t.load_std[2] = 0.2;
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_ERR_TILT_TABLE);
    t = published();
    t.rows = 1;
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_ERR_TILT_TABLE);
    assert_string_equal(detail.field, "rows");
    t = published();
    t.depth_mm[2] = NAN;
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_ERR_TILT_TABLE);
    assert_string_equal(detail.field, "depth_mm");
    t = published();
    t.rows = 1000000;
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_ERR_CONFIG);
    assert_int_equal(gib_tilt_table_add(&t, 1.0, 1.0, 0.0, &detail), GIB_ERR_CONFIG);
    t = published();
    t.struct_size = 16;
    assert_int_equal(gib_tilt_table_check(&t, &detail), GIB_ERR_STRUCT_SIZE);
    assert_int_equal(gib_tilt_table_check(NULL, NULL), GIB_ERR_NULL);
    t = published();
    assert_int_equal(gib_tilt_table_add(&t, NAN, 1.0, 0.0, &detail), GIB_ERR_CONFIG);
    assert_int_equal(gib_tilt_table_add(&t, 1.0, INFINITY, 0.0, &detail), GIB_ERR_CONFIG);
    assert_int_equal(gib_tilt_table_add(&t, 1.0, 30.0, -1.0, &detail), GIB_ERR_CONFIG);
    assert_int_equal(t.rows, 3);
    for (uint32_t i = 3; i < GIB_TILT_ROWS; i++) {
        assert_int_equal(gib_tilt_table_add(&t, 2.0 + i, 36.0 + i, 0.0, NULL), GIB_OK);
    }
    assert_int_equal(gib_tilt_table_add(&t, 500.0, 500.0, 0.0, &detail), GIB_ERR_TILT_TABLE);
}

static void a_table_is_saved_and_loaded(void **state)
{
    (void)state;
    gib_tilt_table t = published(), back;
    gib_error_detail detail;
    t.load_std[1] = 0.001;
    memset(&back, 0, sizeof back);
    back.struct_size = sizeof back;
    assert_int_equal(gib_tilt_table_save(&t, file, &detail), GIB_OK);
    assert_int_equal(gib_tilt_table_load(&back, file, &detail), GIB_OK);
    assert_memory_equal(&t, &back, sizeof t);
    /* What cannot be read leaves the table as it was, and says where. */
    FILE *broken = fopen(file, "w");
    fputs("{ \"schema\": \"gib.tilt_table/1\",\n  oh dear", broken);
    fclose(broken);
    assert_int_equal(gib_tilt_table_load(&back, file, &detail), GIB_ERR_FORMAT);
    assert_string_equal(detail.field, "line");
    assert_true(detail.value == 2.0);
    assert_memory_equal(&t, &back, sizeof t);
    assert_int_equal(gib_tilt_table_load(&back, "/nowhere/at/all.json", &detail), GIB_ERR_IO);
    assert_int_equal(gib_tilt_table_load(&back, NULL, &detail), GIB_ERR_NULL);
    assert_int_equal(gib_tilt_table_load(NULL, file, &detail), GIB_ERR_NULL);
    t.load[2] = 1.0;
    assert_int_equal(gib_tilt_table_save(&t, file, &detail), GIB_ERR_TILT_TABLE);
    unlink(file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_published_example),
        cmocka_unit_test(two_points_refuse),
        cmocka_unit_test(what_does_not_rise_is_refused),
        cmocka_unit_test(a_table_is_saved_and_loaded),
    };
    snprintf(file, sizeof file, "/tmp/gib-tilt-table-%d.json", (int)getpid());
    return cmocka_run_group_tests(tests, NULL, NULL);
}
