/*
 * gib as a vendor's kernel loads it: dlopen at run time, one symbol looked up, everything else through its table.
 * This program is not linked with gib.
 */
#include "kernel.h"

#include <dlfcn.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef const gib_api_table *(*gib_api_function)(uint32_t version);

static void *library;
static const gib_api_table *api;

/* The library beside the harness, or the one that GIB_LIBRARY names; symbols global, as kernels load their modules. */
static int load(void **state)
{
    (void)state;
    const char *path = getenv("GIB_LIBRARY");
    library = dlopen(path != NULL ? path : "../build/lib/libgib.so.0", RTLD_NOW | RTLD_GLOBAL);
    if (library == NULL) {
        print_error("%s\n", dlerror());
        return -1;
    }
    gib_api_function look_up;
    *(void **)&look_up = dlsym(library, "gib_api");
    api = look_up != NULL ? look_up(GIB_ABI_VERSION) : NULL;
    return api != NULL ? 0 : -1;
}

static int unload(void **state)
{
    (void)state;
    return dlclose(library);
}

static void table_is_whole(void **state)
{
    (void)state;
    assert_int_equal(api->struct_size, sizeof *api);
    assert_int_equal(api->abi_version(), GIB_ABI_VERSION);
    assert_string_equal(api->status_text(GIB_OK), "ok");
    void (*const *function)(void) = (void (*const *)(void))(const void *)&api->abi_version;
    for (size_t i = 0; i < (sizeof *api - offsetof(gib_api_table, abi_version)) / sizeof *function; i++) {
        assert_true(function[i] != NULL);
    }
}

static void every_entry_is_the_symbol_of_its_name(void **state)
{
    (void)state;
    assert_ptr_equal(*(void *const *)&api->backlash_step, dlsym(library, "gib_backlash_step"));
    assert_ptr_equal(*(void *const *)&api->status_text, dlsym(library, "gib_status_text"));
    assert_null(dlsym(library, "step"));
}

static void versions_it_cannot_serve_get_no_table(void **state)
{
    (void)state;
    gib_api_function look_up;
    *(void **)&look_up = dlsym(library, "gib_api");
    assert_null(look_up(GIB_ABI_VERSION + 0x10000));
    assert_null(look_up(GIB_ABI_VERSION + 1));
}

/* Two axes measured side by side, one in memory of the kernel's own. */
static void two_axes_are_measured_through_the_table(void **state)
{
    (void)state;
    enum { AXES = 2 };
    static plant axis[AXES];
    static kernel k[AXES];
    gib_backlash *gib[AXES];
    int32_t status[AXES] = {GIB_BUSY, GIB_BUSY};
    const double clearance_um[AXES] = {20.0, 45.0};
    void *memory = NULL;

    assert_int_equal(posix_memalign(&memory, 16, api->backlash_size()), 0);
    assert_int_equal(api->backlash_init_in(memory, api->backlash_size(), &gib[0]), GIB_OK);
    gib[1] = api->backlash_new();
    assert_non_null(gib[1]);
    for (int i = 0; i < AXES; i++) {
        gib_backlash_config c = {0};
        c.struct_size = sizeof c;
        c.cycle_s = 0.001;
        c.travel_min_mm = -20.0;
        c.travel_max_mm = 20.0;
        c.torque_bound_nm = 12.0;
        plant_config p = plant_default();
        p.clearance_mm = clearance_um[i] / 1000.0;
        plant_init(&axis[i], &p);
        kernel_init(&k[i], &axis[i]);
        assert_int_equal(api->backlash_start(gib[i], &c), GIB_OK);
    }
    for (long cycle = 0; status[0] == GIB_BUSY || status[1] == GIB_BUSY; cycle++) {
        assert_true(cycle < 2000000);
        for (int i = 0; i < AXES; i++) {
            gib_backlash_input in = kernel_sense(&k[i]);
            status[i] = api->backlash_step(gib[i], &in, &k[i].out);
        }
    }
    for (int i = 0; i < AXES; i++) {
        gib_backlash_report report;
        assert_int_equal(status[i], GIB_DONE);
        assert_int_equal(api->backlash_result(gib[i], &report), GIB_OK);
        assert_true(fabs(report.mean.clearance_um - clearance_um[i]) < 3.0);
        assert_true(fabs(axis[i].compensation_um - report.value_written_um) < 1e-9);
    }
    api->backlash_free(gib[1]);
    free(memory);
}

static void may_be_unloaded_and_loaded_again(void **state)
{
    for (int i = 0; i < 3; i++) {
        assert_int_equal(unload(state), 0);
        assert_int_equal(load(state), 0);
        table_is_whole(state);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(table_is_whole),
        cmocka_unit_test(every_entry_is_the_symbol_of_its_name),
        cmocka_unit_test(versions_it_cannot_serve_get_no_table),
        cmocka_unit_test(two_axes_are_measured_through_the_table),
        cmocka_unit_test(may_be_unloaded_and_loaded_again),
    };
    return cmocka_run_group_tests(tests, load, unload);
}
