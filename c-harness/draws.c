/* See draws.h. */
#include "draws.h"

#include <math.h>

double random_between(uint64_t *state, double low, double high)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return low + (high - low) * (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

double random_over(uint64_t *state, double low, double high)
{
    return exp(random_between(state, log(low), log(high)));
}

int random_chance(uint64_t *state, double share)
{
    return random_between(state, 0.0, 1.0) < share;
}
