/*
 * The part of an NC kernel that serves tilt: drives a list of passes over the workpiece, says when the tool is in the
 * cut, adds the offsets, and answers the warning. And the teaching of a load table, and whole runs from cut to cut.
 */
#ifndef TILT_RUN_H
#define TILT_RUN_H

#include "tilt_plant.h"

#include <math.h>
#include <string.h>

typedef struct {
    double from[2], to[2];
} tilt_pass;

typedef struct {
    tilt_plant *plant;
    gib_tilt *gib;
    gib_tilt_output out;
    int accept;  /* the operator accepts the warning */
    int pass, n; /* in which pass, at which cycle of it */
    double least_mm, most_mm; /* true depth over the flat of the passes */
} tilt_kernel;

enum { TILT_APART_CYCLES = 50, TILT_PASSES = 6 };

/* Forth and back over the width, and back again between: no direction goes one way with time. */
static inline void tilt_raster(const tilt_plant_config *c, tilt_pass passes[TILT_PASSES])
{
    static const double ROWS[TILT_PASSES] = {0.1, 0.45, 0.8, 0.9, 0.55, 0.2};
    double over = 0.5 * c->tool_diameter_mm;
    for (int i = 0; i < TILT_PASSES; i++) {
        double ends[2] = {-over, c->length_mm + over};
        passes[i] = (tilt_pass){{ends[i % 2], ROWS[i] * c->width_mm}, {ends[1 - i % 2], ROWS[i] * c->width_mm}};
    }
}

static inline gib_tilt_config tilt_config(const tilt_plant_config *c)
{
    gib_tilt_config g;
    memset(&g, 0, sizeof g);
    g.struct_size = sizeof g;
    g.cycle_s = c->cycle_s;
    g.signal = c->dc_load ? GIB_TILT_DC_LOAD : GIB_TILT_AC_CURRENT;
    g.pole_pairs = c->pole_pairs;
    g.condition.tool_id = 12;
    g.condition.material_id = 7;
    g.condition.speed_rpm = c->speed_rpm;
    g.condition.feed_mm_min = 60.0 * c->feed_mm_s;
    g.entry_mm = c->tool_diameter_mm;
    return g;
}

/* One cycle on the passes, with `END` behind the last; returns what the step returned. Give `in` to change it first. */
static inline gib_tilt_input tilt_sense(tilt_kernel *k, const tilt_pass *passes, int count)
{
    tilt_plant *p = k->plant;
    const tilt_plant_config *c = &p->c;
    gib_tilt_input in;
    memset(&in, 0, sizeof in);
    memcpy(p->offset, k->out.offset_mm, sizeof p->offset);
    p->turned[0] = k->out.offset_deg[0];
    p->turned[1] = k->out.offset_deg[1];
    double x = p->at[0], y = p->at[1];
    if (k->pass < count) {
        const tilt_pass *way = &passes[k->pass];
        double length = hypot(way->to[0] - way->from[0], way->to[1] - way->from[1]);
        int cycles = (int)(length / (c->feed_mm_s * c->cycle_s));
        double share = fmin(fmax(k->n - TILT_APART_CYCLES, 0) / cycles, 1.0);
        x = way->from[0] + share * (way->to[0] - way->from[0]);
        y = way->from[1] + share * (way->to[1] - way->from[1]);
        in.flags = k->n > TILT_APART_CYCLES && share < 1.0 ? GIB_TILT_INPUT_CUTTING : 0;
        if (k->n++ >= TILT_APART_CYCLES + cycles) {
            k->n = 0;
            k->pass++;
        }
    } else {
        in.flags = k->out.phase == GIB_TILT_MEASURING ? GIB_TILT_INPUT_END : 0;
    }
    in.load = tilt_plant_cycle(p, x, y, 1);
    in.speed_rpm = c->speed_rpm;
    in.position_mm[0] = x;
    in.position_mm[1] = y;
    double radius = 0.5 * c->tool_diameter_mm;
    if ((in.flags & GIB_TILT_INPUT_CUTTING) && x > radius && x < c->length_mm - radius) {
        double depth = tilt_plant_depth(p);
        k->least_mm = fmin(k->least_mm, depth);
        k->most_mm = fmax(k->most_mm, depth);
    }
    if (k->out.warning && k->accept) {
        in.acknowledged_id = k->out.request_id;
    }
    return in;
}

static inline int32_t tilt_cycle(tilt_kernel *k, const tilt_pass *passes, int count)
{
    gib_tilt_input in = tilt_sense(k, passes, count);
    return gib_tilt_step(k->gib, &in, &k->out);
}

/* To the first pass again. */
static inline void tilt_rewind(tilt_kernel *k)
{
    k->pass = k->n = 0;
    k->least_mm = INFINITY;
    k->most_mm = -INFINITY;
}

/* Difference of the largest and the smallest depth over the passes with the offsets in force. */
static inline double tilt_plane_error(tilt_kernel *k, const tilt_pass *passes, int count)
{
    tilt_rewind(k);
    while (k->pass < count) {
        tilt_cycle(k, passes, count);
    }
    return k->most_mm - k->least_mm;
}

/* Cuts of known depth on a true workpiece, so many a row, make a table; returns the first status that is no GIB_DONE. */
static inline int32_t tilt_teach_again(tilt_plant_config c, gib_tilt *gib, double from_mm, double to_mm, double step_mm,
                                       int cuts, gib_tilt_table *table)
{
    gib_tilt_config g = tilt_config(&c);
    memset(table, 0, sizeof *table);
    table->struct_size = sizeof *table;
    table->condition = g.condition;
    table->signal = g.signal;
    g.purpose = GIB_TILT_TEACH;
    c.about_x_deg = c.about_y_deg = c.wear_1_m = 0.0; /* a sharp tool on a true workpiece */
    for (int cut = 0; from_mm + cut / cuts * step_mm < to_mm + 1e-9; cut++) {
        double depth = from_mm + cut / cuts * step_mm;
        tilt_plant p;
        tilt_pass passes[TILT_PASSES];
        tilt_kernel k = {.plant = &p, .gib = gib};
        int32_t status = gib_tilt_start(gib, &g, NULL);
        c.depth_mm = depth;
        c.seed += 101u;
        tilt_plant_init(&p, &c);
        tilt_raster(&c, passes);
        while (status == GIB_OK || status == GIB_BUSY) {
            status = tilt_cycle(&k, passes, 2);
        }
        gib_tilt_report report;
        gib_tilt_result(gib, &report);
        if (status != GIB_DONE) {
            return status;
        }
        status = gib_tilt_table_add(table, depth, report.load, report.load_std, NULL);
        if (status != GIB_OK) {
            return status;
        }
    }
    return GIB_DONE;
}

/* The same with one cut a row. */
static inline int32_t tilt_teach(tilt_plant_config c, gib_tilt *gib, double from_mm, double to_mm, double step_mm,
                                 gib_tilt_table *table)
{
    return tilt_teach_again(c, gib, from_mm, to_mm, step_mm, 1, table);
}

/* From the start to the offsets in force, or to the end without. */
static inline int32_t tilt_measure(tilt_kernel *k, const gib_tilt_config *g, const gib_tilt_table *table,
                                   const tilt_pass *passes, int count)
{
    int32_t status = gib_tilt_start(k->gib, g, table);
    tilt_rewind(k);
    while (status == GIB_OK || (status == GIB_BUSY && k->out.phase != GIB_TILT_ACTIVE)) {
        status = tilt_cycle(k, passes, count);
    }
    return status;
}

#endif
