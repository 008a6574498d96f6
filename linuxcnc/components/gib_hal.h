/* What the components share. */
#ifndef GIB_HAL_H
#define GIB_HAL_H

#include <math.h>

/* Takes a value over when it is a number, so that what is none goes nowhere; whether it is. */
static inline int gib_hal_held(double value, double *safe)
{
    if (!isfinite(value)) {
        return 0;
    }
    *safe = value;
    return 1;
}

#endif
