/* Random numbers that a seed repeats: splitmix64, one word of state. */
#ifndef DRAWS_H
#define DRAWS_H

#include <stdint.h>

/* The next random number between two bounds, and one whose logarithm is even between theirs. */
double random_between(uint64_t *state, double low, double high);
double random_over(uint64_t *state, double low, double high);
/* True with that probability. */
int random_chance(uint64_t *state, double share);

#endif
