/* Fewer runs with clang, and so under its sanitizers: the library is the same, and they are slower. */
#ifndef FEWER_H
#define FEWER_H

/* One run, or one moment of a run, in so many. */
#ifdef __clang__
#define ONE_IN 5
#else
#define ONE_IN 1
#endif

/* Runs of a test that has many. */
#define FEWER(runs) ((runs) / ONE_IN)

#endif
