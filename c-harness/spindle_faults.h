/* What the tests of the spindle families' faults share: the table that they print. */
#ifndef SPINDLE_FAULTS_H
#define SPINDLE_FAULTS_H

#include "spindle_run.h"


#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { MEMORY = 32768, STATES = 10 };
static const double CYCLE_S = 0.001;

/* Cells of the table: most cycles from the fault to the end, 0: the state was never met. */
typedef struct {
    int cycles[STATES];
} row;

/* Columns are the states from `first` to `last`. */
static inline void print_table(const char *title, const char *const *states, int first, int last, const char *const *faults,
                        const int32_t *codes, const row *rows, int fault_count)
{
    print_message("\n%s: cycles from a fault to its end, at most\n%-24s %6s", title, "", "status");
    for (int s = first; s <= last; s++) {
        print_message(" %9s", states[s]);
    }
    print_message("\n");
    for (int f = 0; f < fault_count; f++) {
        print_message("%-24s %6d", faults[f], (int)codes[f]);
        for (int s = first; s <= last; s++) {
            print_message(" %9d", rows[f].cycles[s]);
        }
        print_message("\n");
    }
}

#endif
