/*
 * Counts what a program allocates: malloc, calloc, realloc, free, posix_memalign and aligned_alloc are replaced by ones
 * that count and pass on to glibc. Linked into test_realtime alone.
 */
#ifndef COUNTING_ALLOCATOR_H
#define COUNTING_ALLOCATOR_H

#include <stdint.h>

/* Where calls are counted; NULL: they are not. Memory shared with a parent outlives the process that counted. */
extern volatile uint64_t *counting_allocator_calls;

#endif
