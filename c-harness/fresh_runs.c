#include "fresh_runs.h"

#include <stdlib.h>
#include <time.h>

int fresh_runs_main(int argc, char **argv, fresh_runs *fresh, const struct CMUnitTest *tests, size_t count)
{
    fresh->seed = argc > 1 ? strtoull(argv[1], NULL, 10) : (uint64_t)time(NULL) * 1000u;
    fresh->runs = argc > 2 ? atoi(argv[2]) : fresh->runs;
    size_t first = argc > 1 ? count - 1 : 0;
    return _cmocka_run_group_tests("tests", tests + first, count - first, NULL, NULL);
}
