/* See adversary.h. */
#include "adversary.h"

#include <stddef.h>

void law(adversary *a, int holds, const char *what)
{
    if (!holds && !a->broken) {
        a->broken = what;
        a->broken_at = a->cycle;
    }
}

double between(adversary *a, double low, double high)
{
    return random_between(&a->random, low, high);
}

double over(adversary *a, double low, double high)
{
    return random_over(&a->random, low, high);
}

int chance(adversary *a, double share)
{
    return random_chance(&a->random, share);
}

const trouble *now(const adversary *a, int kind)
{
    return a->run == 0 && !a->ended ? troubles_now(&a->troubles, kind, a->cycle) : NULL;
}

int begins(const adversary *a, int kind)
{
    const trouble *t = now(a, kind);
    return t && t->at == a->cycle;
}

int ever(const adversary *a, int kind)
{
    return a->run == 0 && troubles_ever(&a->troubles, kind);
}
