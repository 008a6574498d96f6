/*
 * Recorders under callgrind: rows of 1, 12 and 24 channels from one array and from scattered places, and cycles between two
 * rows. See count_backlash.c.
 */
#include "gib.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <valgrind/callgrind.h>

static int count(uint32_t channels, uint32_t every, const char *label, const char *between)
{
    char name[32], columns[512] = "";
    double values[24];
    const double *sources[24];
    for (uint32_t i = 0; i < channels; i++) {
        snprintf(columns + strlen(columns), sizeof columns - strlen(columns), "%sc%u.position_mm", i ? "," : "", i);
        values[i] = 0.25 * i;
        sources[i] = &values[i];
    }
    snprintf(name, sizeof name, "count-%d", (int)getpid());
    gib_recorder_config config = {.struct_size = sizeof config,
                                  .channels = channels,
                                  .capacity_rows = 16, /* goes round several times */
                                  .every_cycles = every,
                                  .cycle_s = 0.001,
                                  .name = name,
                                  .machine = "rig",
                                  .columns = columns};
    gib_recorder *gib = gib_recorder_new();
    if (gib_recorder_start(gib, &config) != GIB_OK) {
        gib_recorder_free(gib);
        return 1;
    }
    for (uint32_t i = 0; i < 60; i++) {
        CALLGRIND_ZERO_STATS;
        gib_recorder_step(gib, values, channels);
        CALLGRIND_DUMP_STATS_AT(i % every ? between : label);
    }
    for (uint32_t i = 0; every == 1 && i < 60; i++) {
        char scattered[32];
        snprintf(scattered, sizeof scattered, "%s scattered", label);
        CALLGRIND_ZERO_STATS;
        gib_recorder_step_from(gib, sources, channels);
        CALLGRIND_DUMP_STATS_AT(scattered);
    }
    gib_recorder_abort(gib);
    for (int i = 0; i < 5; i++) {
        CALLGRIND_ZERO_STATS;
        gib_recorder_step(gib, values, channels);
        CALLGRIND_DUMP_STATS_AT("ended");
    }
    gib_recorder_free(gib);
    return 0;
}

int main(void)
{
    return count(1, 1, "1 channel", "") || count(12, 1, "12 channels", "") || count(24, 1, "24 channels", "") ||
           count(12, 4, "12 of 4", "between");
}
