/* See realtime.h. */
#include "realtime.h"

#include "counting_allocator.h"

#include <linux/seccomp.h>
#include <math.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

/* One fault, in the middle of the run. */
static void put_in(realtime_seed seed, const realtime_family *family)
{
    void *volatile memory;
    switch (seed) {
    case SEED_NONE:
        break;
    case SEED_ALLOCATES:
        memory = malloc(8);
        free(memory);
        break;
    case SEED_CALLS_SYSTEM:
        syscall(SYS_getppid);
        break;
    case SEED_SUBNORMAL:
        family->outputs[0] = 1e-310;
        break;
    case SEED_NON_FINITE:
        family->outputs[0] = NAN;
        break;
    }
}

static void look_at(const realtime_family *family, realtime_tally *tally)
{
    for (size_t i = 0; i < family->output_count; i++) {
        int kind = fpclassify(family->outputs[i]);
        tally->subnormals += kind == FP_SUBNORMAL;
        tally->non_finite += kind == FP_NAN || kind == FP_INFINITE;
    }
}

static void child(const realtime_family *family, uint64_t steps, realtime_seed seed, realtime_tally *tally)
{
    /* A core file of the runs that are meant to be killed helps nobody. */
    struct rlimit none = {0, 0};
    setrlimit(RLIMIT_CORE, &none);
    family->prepare();
    counting_allocator_calls = &tally->allocations;
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) {
        _exit(2);
    }
    for (uint64_t i = 0; i < steps; i++) {
        int32_t phase = family->cycle();
        if (i == steps / 2) {
            put_in(seed, family);
        }
        look_at(family, tally);
        tally->steps++;
        tally->phases[(uint32_t)phase % REALTIME_PHASES]++;
    }
    tally->finished = 1;
    /* _exit() of the C library is exit_group, which strict mode forbids too. */
    syscall(SYS_exit, 0);
}

int realtime_run(const realtime_family *family, uint64_t steps, realtime_seed seed, realtime_tally *tally)
{
    realtime_tally *shared =
        mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) {
        return -1;
    }
    pid_t pid = fork();
    if (pid == 0) {
        child(family, steps, seed, shared);
    }
    int status = 0;
    int waited = pid > 0 && waitpid(pid, &status, 0) == pid;
    *tally = *shared;
    tally->signal = waited && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    munmap(shared, sizeof *shared);
    /* 2: strict mode was not to be had, so nothing was shown. */
    return waited && !(WIFEXITED(status) && WEXITSTATUS(status) == 2) ? 0 : -1;
}
