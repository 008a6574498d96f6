/*
 * Random axes to home: cycle, stiffness of drive and stop, friction, break-away, Stribeck, gravity, clearance, inertia, servo
 * gains, encoder and noise. One state of a generator, one axis.
 */
#ifndef HOMING_AXES_H
#define HOMING_AXES_H

#include "homing_plant.h"

/* Even between two bounds, and even in the logarithm. */
double homing_between(uint64_t *random, double low, double high);
double homing_over(uint64_t *random, double low, double high);
homing_plant_config homing_random_axis(uint64_t *random);

#endif
