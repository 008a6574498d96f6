/* What the components share. */
#ifndef GIB_HAL_H
#define GIB_HAL_H

#include <math.h>

/* LinuxCNC builds for size, and lets a component read a pin as 0 + pin: a sum that nothing but the sign of a zero needs. */
#pragma GCC optimize("O2", "no-signed-zeros")

/* Takes a value over when it is a number, so that what is none goes nowhere; whether it is. */
static inline int gib_hal_held(double value, double *safe)
{
    if (!isfinite(value)) {
        return 0;
    }
    *safe = value;
    return 1;
}

/* The same of two values: both, or none. Their sum is no number where one of them is none. */
static inline int gib_hal_both_held(double one, double other, double *safe_one, double *safe_other)
{
    if (!isfinite(one + other)) {
        return 0;
    }
    *safe_one = one;
    *safe_other = other;
    return 1;
}

#endif
