/* What the simulated parts share. */
#ifndef GIB_SIM_H
#define GIB_SIM_H

/* About normal with standard deviation 1: the sum of twelve uniform numbers. */
static double gib_sim_normal(unsigned *seed)
{
    double sum = -6.0;
    int i;
    for (i = 0; i < 12; i++) {
        *seed = *seed * 1664525u + 1013904223u;
        sum += (*seed >> 8) / 16777216.0;
    }
    return sum;
}

#endif
