#include "fresh_runs.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

int fresh_runs_main(int argc, char **argv, fresh_runs *fresh, const struct CMUnitTest *tests, size_t count)
{
    fresh->seed = argc > 1 ? strtoull(argv[1], NULL, 10) : (uint64_t)time(NULL) * 1000u;
    fresh->runs = argc > 2 ? atoi(argv[2]) : fresh->runs;
    size_t first = argc > 1 ? count - 1 : 0;
    return _cmocka_run_group_tests("tests", tests + first, count - first, NULL, NULL);
}

void fresh_runs_mistakes(const char *(*broken_by)(int mistake, uint64_t seed), const char *const laws[], int mistakes, uint64_t seed,
                         int runs, int least)
{
    for (int m = 1; m < mistakes; m++) {
        int broken = 0, met = 0;
        for (int i = 0; i < runs; i++) {
            const char *law = broken_by(m, seed + (uint64_t)i);
            broken += law != NULL;
            met += law && strcmp(law, laws[m]) == 0;
        }
        print_message("%s: %d of %d runs of a mistake broke it, %d broke any\n", laws[m], met, runs, broken);
        assert_true(met >= least);
    }
}
