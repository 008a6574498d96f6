/*
 * What somebody does who means a measurement ill: troubles of some kinds that come in any cycle of a run, together or one after the
 * other, stay or pass.
 */
#ifndef TROUBLES_H
#define TROUBLES_H

#include "draws.h"

typedef struct {
    int kind, at, lasts; /* cycles */
    double size;         /* 0 to 1 */
    int begun;
} trouble;

enum { MOST_TROUBLES = 4 };

typedef struct {
    trouble one[MOST_TROUBLES];
    int count;
} troubles;

/* So many of so many kinds, in the first so many cycles: a share `at_once` of them in the first, a share `for_good` that stays. */
void troubles_draw(troubles *t, uint64_t *random, int count, int kinds, double cycles, double at_once, double for_good);
/* Begins those that are due. */
void troubles_begin(troubles *t, int cycle);
/* One of that kind that is there in this cycle, or NULL. */
const trouble *troubles_now(const troubles *t, int kind, int cycle);
/* Whether one of that kind was met; how many of any kind. */
int troubles_ever(const troubles *t, int kind);
int troubles_met(const troubles *t);
/* A line each. */
void troubles_print(const troubles *t, const char *const names[]);

#endif
