/*
 * Shows that a family's step is fit for a servo cycle: runs it in a child process that the kernel kills at the first
 * system call (seccomp strict mode), counts its allocations, and looks at every number it puts out.
 */
#ifndef REALTIME_H
#define REALTIME_H

#include <stddef.h>
#include <stdint.h>

/* Faults put in on purpose, to see that they are caught. */
typedef enum { SEED_NONE, SEED_ALLOCATES, SEED_CALLS_SYSTEM, SEED_SUBNORMAL, SEED_NON_FINITE } realtime_seed;

#define REALTIME_PHASES 32

/* A family under test. `prepare` is called once before the gate closes; `cycle` is one servo cycle with its step. */
typedef struct {
    const char *name;
    void (*prepare)(void);
    int32_t (*cycle)(void); /* returns the phase, 0 to REALTIME_PHASES - 1 */
    double *outputs;        /* the numbers that the step has put out */
    size_t output_count;
} realtime_family;

typedef struct {
    uint64_t steps, allocations, subnormals, non_finite;
    uint64_t phases[REALTIME_PHASES]; /* steps in each */
    int finished;                     /* 1: all steps were made */
    int signal;                       /* that ended the child; 0: none */
} realtime_tally;

/* Makes `steps` cycles; returns 0, or -1 when no child or shared memory was to be had. */
int realtime_run(const realtime_family *family, uint64_t steps, realtime_seed seed, realtime_tally *tally);

#endif
