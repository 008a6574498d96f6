/* What the components share. */
#ifndef GIB_HAL_H
#define GIB_HAL_H

#include <math.h>
#include <stddef.h>
#include <string.h>

/* LinuxCNC builds for size, and lets a component read a pin as 0 + pin: a sum that nothing but the sign of a zero needs. To
 * pack two values into one store takes longer than two stores. */
#pragma GCC optimize("O2", "no-signed-zeros", "no-tree-slp-vectorize")

/* Takes a value over when it is a number, so that what is none goes nowhere; whether it is. What is infinite, less itself,
 * is no number either. */
static inline int gib_hal_held(double value, double *safe)
{
    if (isnan(value - value)) {
        return 0;
    }
    *safe = value;
    return 1;
}

/* The same of two values: both, or none. Their sum is no number where one of them is none. */
static inline int gib_hal_both_held(double one, double other, double *safe_one, double *safe_other)
{
    double sum = one + other;
    if (isnan(sum - sum)) {
        return 0;
    }
    *safe_one = one;
    *safe_other = other;
    return 1;
}

/* Whether two outputs of gib differ from one field to another. */
#define gib_hal_differ(one, other, first, last) \
    (memcmp(&(one).first, &(other).first, \
            offsetof(__typeof__(one), last) + sizeof(one).last - offsetof(__typeof__(one), first)) != 0)

#endif
