/* See troubles.h. */
#include "troubles.h"

#include <stddef.h>
#include <stdio.h>

void troubles_draw(troubles *t, uint64_t *random, int count, int kinds, double cycles, double at_once, double for_good)
{
    t->count = count;
    for (int i = 0; i < count; i++) {
        trouble *one = &t->one[i];
        one->kind = (int)random_between(random, 0.0, kinds);
        one->at = 1 + (int)(random_chance(random, at_once) ? 0.0 : random_between(random, 0.0, cycles));
        one->lasts = random_chance(random, for_good) ? 1 << 30 : (int)random_over(random, 1.0, cycles);
        one->size = random_between(random, 0.0, 1.0);
    }
}

void troubles_begin(troubles *t, int cycle)
{
    for (int i = 0; i < t->count; i++) {
        t->one[i].begun |= t->one[i].at == cycle;
    }
}

const trouble *troubles_now(const troubles *t, int kind, int cycle)
{
    for (int i = 0; i < t->count; i++) {
        const trouble *one = &t->one[i];
        if (one->kind == kind && one->begun && cycle - one->at < one->lasts) {
            return one;
        }
    }
    return NULL;
}

int troubles_ever(const troubles *t, int kind)
{
    for (int i = 0; i < t->count; i++) {
        if (t->one[i].kind == kind && t->one[i].begun) {
            return 1;
        }
    }
    return 0;
}

int troubles_met(const troubles *t)
{
    int met = 0;
    for (int i = 0; i < t->count; i++) {
        met += t->one[i].begun;
    }
    return met;
}

void troubles_print(const troubles *t, const char *const names[])
{
    for (int i = 0; i < t->count; i++) {
        const trouble *one = &t->one[i];
        printf("    %s %.2f in cycle %d for %d%s\n", names[one->kind], one->size, one->at, one->lasts, one->begun ? "" : ": not met");
    }
}
