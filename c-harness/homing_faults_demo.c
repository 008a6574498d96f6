/*
 * Homing: every fault in every state. One homing is run; from many of its cycles, and from those of the ways out, a copy
 * is broken and run to its end. Prints what gib names it, how long that takes, and whether all stayed safe. Exit 1 when
 * something is not as it must be.
 *
 *   homing_faults_demo [STRIDE [MOTORS [DIRECTION]]]    breaks every STRIDE-th cycle (default 61), and the first ones of
 *                                                        each state; 1 or 2 motors, +1 or -1 toward the stop
 */
#include "homing_faults.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NAMES 4

typedef struct {
    int32_t names[NAMES];
    int breaks, bad;
} cell;

static cell table[FAULTS][STATES];
static int named[FAULTS], out[FAULTS], breaks;

static void note(homing_fault fault, homing_state state, const homing_branch *b, int good, int cycle)
{
    cell *c = &table[fault][state];
    int i = 0;
    while (i < NAMES && c->names[i] != 0 && c->names[i] != b->status) {
        i++;
    }
    if (i < NAMES) {
        c->names[i] = b->status;
    }
    if (!good && c->bad == 0) {
        printf("  %s in %s, cycle %d: %s, %s\n", homing_fault_names[fault], homing_state_names[state], cycle,
               gib_status_text(b->status), b->unsafe ? b->unsafe : "the wrong name");
    }
    c->breaks++;
    c->bad += !good;
    breaks++;
    named[fault] = b->named > named[fault] ? b->named : named[fault];
    out[fault] = b->out > out[fault] ? b->out : out[fault];
}

/* Runs `w` to its end and breaks copies of it on the way, those of the ways out only while it is on one. */
static void follow(homing_world *w, int stride, int ways_out)
{
    static homing_world copy;
    homing_state state, before = STATES;
    int in_state = 0;
    while (w->status == GIB_BUSY) {
        homing_world_step(w);
        state = homing_world_state(w);
        in_state = state == before ? in_state + 1 : 0;
        before = state;
        int due = w->cycles % stride == 0 || in_state == 0 || in_state == 3 || in_state == 11;
        if (state == IN_REST || !due || (state >= IN_STOPPING) != ways_out) {
            continue;
        }
        for (int f = FAULT_ABORT; f < FAULTS; f++) {
            memcpy(&copy, w, sizeof copy);
            int32_t first = ways_out ? GIB_ERR_ABORTED : 0;
            homing_branch b = homing_world_break(&copy, (homing_fault)f);
            note((homing_fault)f, state, &b, b.safe && homing_names((homing_fault)f, first, &b), w->cycles);
        }
    }
}

/* A homing that is cut off by its time limit at any moment. */
static void time_limits(const homing_plant_config *c, const gib_homing_config *g, int cycles, int stride, int *bad)
{
    static homing_world w;
    int worst = 0;
    for (int at = 3; at < cycles - 5; at += stride) {
        gib_homing_config short_of = *g;
        short_of.time_limit_s = at * g->cycle_s;
        homing_world_start(&w, c, &short_of);
        homing_branch b = homing_world_break(&w, FAULT_NONE);
        worst = b.out > worst ? b.out : worst;
        if (b.status != GIB_ERR_HOMING_TIME_LIMIT || !b.safe || abs(b.named - at) > 2) {
            printf("  time limit of %d cycles: %s, %s\n", at, gib_status_text(b.status), b.unsafe ? b.unsafe : "");
            ++*bad;
        }
        breaks++;
    }
    printf("Time limits of every length: named in their cycle, out within %d cycles.\n", worst);
}

static void print_table(void)
{
    printf("\nWhat gib names it (2: homed, and rightly), and cycles at most until it is named, and from there to the end.\n\n");
    printf("| fault | named within | out within |");
    for (int s = 0; s < STATES; s++) {
        printf(" %s |", homing_state_names[s]);
    }
    printf("\n|---|---|---|");
    for (int s = 0; s < STATES; s++) {
        printf("---|");
    }
    for (int f = FAULT_ABORT; f < FAULTS; f++) {
        printf("\n| %s | %d | %d |", homing_fault_names[f], named[f], out[f]);
        for (int s = 0; s < STATES; s++) {
            const cell *c = &table[f][s];
            for (int i = 0; i < NAMES && c->names[i] != 0; i++) {
                printf(" %d", c->names[i]);
            }
            printf("%s |", c->bad ? " !" : c->breaks ? "" : " -");
        }
    }
    printf("\n\n");
}

int main(int argc, char **argv)
{
    static homing_world w;
    int stride = argc > 1 ? atoi(argv[1]) : 61, bad = 0;
    homing_plant_config c = homing_plant_default();
    c.motors = argc > 2 ? atoi(argv[2]) : 1;
    c.sense = argc > 3 ? atof(argv[3]) : 1.0;
    c.beam_nm_mm = c.motors == 2 ? 20.0 : 0.0;
    c.stop_mm[0] = c.stop_mm[1] = 2.2;
    c.answer_cycles = 15;
    c.substeps = 10;
    gib_homing_config g = {.struct_size = sizeof g,
                           .direction = c.sense > 0.0 ? 1 : -1,
                           .motors = c.motors,
                           .cycle_s = c.cycle_s,
                           .torque_limit_nm = 5.0,
                           .distance_min_mm = 1.5,
                           .distance_max_mm = 4.0,
                           .touches = 2,
                           .zero_offset_mm = 0.5,
                           .ack_timeout_s = 0.1};
    printf("Faults in states of a homing; the way out may take %d cycles.\n", homing_way_out(&g));
    homing_world_start(&w, &c, &g);
    follow(&w, stride, 0);
    int cycles = w.cycles;
    /* Ways out: from the first approach, under pressure, on the way back. */
    for (int from = 0; from < 3; from++) {
        static const homing_state STATE[3] = {IN_APPROACH, IN_PRESS, IN_RETRACT};
        homing_world_start(&w, &c, &g);
        while (homing_world_state(&w) != STATE[from]) {
            homing_world_step(&w);
        }
        for (int i = 0; i < 70; i++) {
            homing_world_step(&w);
        }
        gib_homing_abort(homing_world_gib(&w));
        follow(&w, stride / 4 + 1, 1);
    }
    for (int f = 0; f < FAULTS; f++) {
        for (int s = 0; s < STATES; s++) {
            bad += table[f][s].bad > 0;
        }
    }
    time_limits(&c, &g, cycles, 3 * stride, &bad);
    print_table();
    printf("%d branches, %s\n", breaks, bad ? "not all as they must be" : "all named and safe");
    return bad != 0;
}
