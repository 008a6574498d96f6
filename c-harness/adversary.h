/*
 * What those have in common who mean a family ill: a random machine, troubles that come in the first of two runs, and the laws that must
 * hold whatever comes. Each begins with this.
 */
#ifndef ADVERSARY_H
#define ADVERSARY_H

#include "troubles.h"

typedef struct {
    uint64_t random;
    troubles troubles;
    int run, cycle, ended; /* and the cycle in which a run has ended, 0 before: no trouble is there any more */
    const char *broken; /* first law broken, or NULL */
    int broken_at;      /* and in which cycle */
} adversary;

/* A law, which holds or is the first that is broken. */
void law(adversary *a, int holds, const char *what);

/* A random number between two bounds; one whose logarithm is even between theirs; true with that probability. */
double between(adversary *a, double low, double high);
double over(adversary *a, double low, double high);
int chance(adversary *a, double share);

/* A trouble of a kind that is there in this cycle, or NULL; whether one begins in it; whether one was met in this run. */
const trouble *now(const adversary *a, int kind);
int begins(const adversary *a, int kind);
int ever(const adversary *a, int kind);

#endif
