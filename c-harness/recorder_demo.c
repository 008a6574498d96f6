/*
 * 24 channels at 32 kHz into a recorder, and `gib record` at the other end, for as long as asked:
 *
 *   recorder_demo GIB FILE.csv [SECONDS]
 *
 * Prints rows, lost rows, the cost of a step, and what an hour would make. Beyond five minutes the reader begins a new file
 * each minute and keeps the newest two, FILE-0001.csv and so on. Without arguments it says what it needs.
 */
#include "gib.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define CHANNELS 24u
#define RATE_HZ 32000
#define LONG_S 300.0

static double now_s(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Smooth motion on an encoder's grid, with noise in the torques: what a recording holds. */
static void fill(double *values, double t)
{
    static uint64_t random = 1;
    for (uint32_t i = 0; i < CHANNELS; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        double noise = (double)(random >> 40) / 16777216.0 - 0.5;
        values[i] = i % 2 ? 3.0 * sin(t + i) + 0.2 * noise : 1e-4 * floor(1e6 * sin(0.3 * t + i));
    }
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        printf("recorder_demo: give the gib command and a file to write, and the seconds\n");
        return 0;
    }
    double seconds = argc > 3 ? atof(argv[3]) : 10.0;
    char name[32], columns[1024] = "", length[32];
    snprintf(name, sizeof name, "demo-%d", (int)getpid());
    snprintf(length, sizeof length, "%g", seconds);
    for (uint32_t i = 0; i < CHANNELS; i++) {
        snprintf(columns + strlen(columns), sizeof columns - strlen(columns), "%sa%u.%s", i ? "," : "", i / 2,
                 i % 2 ? "torque_nm" : "position_mm");
    }
    gib_recorder_config config = {.struct_size = sizeof config,
                                  .channels = CHANNELS,
                                  .cycle_s = 1.0 / RATE_HZ,
                                  .name = name,
                                  .machine = "demo",
                                  .columns = columns};
    gib_recorder *gib = gib_recorder_new();
    gib_error_detail detail;
    gib_recorder_report report;
    int32_t status = gib_recorder_start(gib, &config);
    gib_recorder_last_error(gib, &detail);
    if (status != GIB_OK) {
        printf("recorder_demo: %s %s\n", gib_status_text(status), detail.field);
        gib_recorder_free(gib);
        return 1;
    }
    unlink(argv[2]);
    pid_t reader = fork();
    if (reader == 0) {
        char *command[] = {"gib",   "record", name, "--history", "--out", argv[2], "--for",
                           length, "--rotate", "60", "--keep",    "2",     NULL};
        if (seconds <= LONG_S) {
            command[8] = NULL;
        }
        execvp(argv[1], command);
        _exit(127);
    }
    /* A millisecond's rows at a time; late ones are caught up. */
    double values[CHANNELS] = {0}, start = now_s(CLOCK_MONOTONIC), in_steps = 0.0;
    uint64_t rows = 0;
    int ended = 0;
    while (!ended && now_s(CLOCK_MONOTONIC) - start < seconds + 30.0) {
        uint64_t due = (uint64_t)(RATE_HZ * (now_s(CLOCK_MONOTONIC) - start));
        double from = now_s(CLOCK_THREAD_CPUTIME_ID);
        for (uint64_t n = rows; n < due; n++) {
            if (n % 32 == 0) {
                in_steps += now_s(CLOCK_THREAD_CPUTIME_ID) - from;
                fill(values, (double)n / RATE_HZ);
                from = now_s(CLOCK_THREAD_CPUTIME_ID);
            }
            gib_recorder_step(gib, values, CHANNELS);
        }
        in_steps += now_s(CLOCK_THREAD_CPUTIME_ID) - from;
        rows = due;
        usleep(1000);
        ended = waitpid(reader, &status, WNOHANG) == reader;
    }
    if (!ended) {
        kill(reader, SIGINT);
        waitpid(reader, &status, 0);
    }
    struct rusage usage;
    struct stat meta = {0};
    getrusage(RUSAGE_CHILDREN, &usage);
    stat(argv[2], &meta);
    gib_recorder_result(gib, &report);
    gib_recorder_free(gib);
    double cpu = (double)usage.ru_utime.tv_sec + (double)usage.ru_stime.tv_sec +
                 1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    printf("%u channels at %d Hz for %g s: ring %.1f MB, locked: %s\n", CHANNELS, RATE_HZ, seconds,
           1e-6 * (double)report.bytes, report.locked ? "yes" : "no");
    printf("a step takes %.0f ns, %.2f %% of a core at this rate; the reader takes %.0f %% of a core\n",
           1e9 * in_steps / (double)rows, 100.0 * in_steps * RATE_HZ / (double)rows, 100.0 * cpu / seconds);
    if (seconds <= LONG_S) {
        printf("the file grows by %.1f MB/s: %.0f GB in an hour\n", 1e-6 * (double)meta.st_size / seconds,
               3.6e-6 * (double)meta.st_size / seconds);
    }
    return status;
}
