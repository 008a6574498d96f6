/*
 * Faults put in on purpose, to see that the sanitizers and memcheck catch them: without these it exits with 0.
 *
 *   seeded_memory_fault overread     a config that ends before its struct_size: gib reads past the caller's memory
 *   seeded_memory_fault undefined    a signed sum that overflows
 *   seeded_memory_fault none         the same calls without a fault
 */
#include "gib.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv)
{
    const char *fault = argc > 1 ? argv[1] : "none";
    volatile int sum = INT_MAX - 1;
    size_t size = sizeof(gib_backlash_config) - (strcmp(fault, "overread") == 0 ? 8 : 0);
    gib_backlash *gib = gib_backlash_new();
    gib_backlash_config *config = calloc(1, size);
    if (!gib || !config) {
        return 2;
    }
    config->struct_size = sizeof *config;
    int32_t status = gib_backlash_start(gib, config);
    sum = sum + (strcmp(fault, "undefined") == 0 ? 2 : 1);
    printf("%s: %d %d\n", fault, (int)status, sum);
    free(config);
    gib_backlash_free(gib);
    return 0;
}
