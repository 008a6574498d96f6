/* The models of the plant benchmark as plain C loops: what a person would write by hand for just these two axes.
 * Usage: plant <model 0|1> <cycles>. Prints: seconds of computing, last encoder position in mm. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define STEPS 40
static const double PI2 = 6.283185307179586, H = 25e-6, TS = 1e-3, TAU = 0.5e-3, LEAD = 10.0;
static const double J = 0.0028, TC = 0.9, TV = 0.008, KP = 40.0, KV = 0.528, TI = 0.02, LIMIT = 16.0;

static double command(long k) { return 20.0 * (1.0 - cos(PI2 * 0.5 * (double)k * TS)); }

typedef struct { double integral, last; } servo;

static double servo_cycle(servo *s, double target, double speed, double read) {
    double v = (read - s->last) / TS;
    double e = KP * (target - read) + speed - v;
    double asked = KV * (e + s->integral), u = asked;
    if (u > LIMIT) u = LIMIT;
    if (u < -LIMIT) u = -LIMIT;
    if (u == asked) s->integral += e * TS / TI;
    s->last = read;
    return u;
}

static double rigid(long cycles) {
    const double scale = PI2 / LEAD, decay = exp(-H / TAU), mean = -expm1(-H / TAU) / (H / TAU);
    const double half = 0.5 * H * TV, mass = J + half;
    double q = 0, w = 0, torque = 0;
    servo s = {0, 0};
    double read = 0;
    for (long k = 0; k < cycles; k++) {
        long before = k > 0 ? k - 1 : 0, after = k + 1 < cycles ? k + 1 : cycles - 1;
        read = q;
        double speed = (command(after) - command(before)) / ((double)(after - before) * TS) * scale;
        double u = servo_cycle(&s, command(k) * scale, speed, read);
        for (int i = 0; i < STEPS; i++) {
            double excess = torque - u, acting = u + excess * mean;
            torque = u + excess * decay;
            double middle = q + 0.5 * H * w;
            double b = (J - half) * w + H * acting;
            double left = fabs(b) - H * TC;
            double next = left > 0 ? copysign(left, b) / mass : 0.0;
            q = middle + 0.5 * H * next;
            w = next;
        }
    }
    return read / scale;
}

/* One step of a mass on its share of LuGre friction (no micro-damping), implicit in the bristle. */
static double kick(double inertia, double share, double w, double change, double torque, double level, double stiffness, double *force) {
    double half = 0.5 * H * share * TV, mass = inertia + half, b = (inertia - half) * w + H * torque;
    double d = level + stiffness * H * fabs(w + change);
    double next = (b * d - H * *force * level) / (mass * d + stiffness * H * H * level);
    *force = (*force + stiffness * H * next) * level / d;
    return next;
}

static double two_masses(long cycles) {
    const double scale = PI2 / LEAD, per_um = scale / 1000.0, decay = exp(-H / TAU), mean = -expm1(-H / TAU) / (H / TAU);
    const double f = PI2 * 60.0, k = 30.0 * 1e-6 / (per_um * per_um), gap = 20.0 * per_um;
    const double jt = 0.5 * J * (1.0 - sqrt(1.0 - 4.0 * k / (J * f * f))), jm = J - jt, damping = 2.0 * 0.05 * k / f;
    const double ts = 0.3, vs = 4.0, stiffness = 0.5 * TC / (8.0 * per_um);
    double qm = 0, wm = 0, qt = 0, wt = 0, fm = 0, ft = 0, torque = 0, read = 0, cm = 0, ct = 0;
    servo s = {0, 0};
    for (long c = 0; c < cycles; c++) {
        long before = c > 0 ? c - 1 : 0, after = c + 1 < cycles ? c + 1 : cycles - 1;
        read = qm;
        double speed = (command(after) - command(before)) / ((double)(after - before) * TS) * scale;
        double u = servo_cycle(&s, command(c) * scale, speed, read);
        for (int i = 0; i < STEPS; i++) {
            double excess = torque - u, acting = u + excess * mean;
            torque = u + excess * decay;
            double mm = qm + 0.5 * H * wm, mt = qt + 0.5 * H * wt;
            double wind = mm - mt, beyond = fabs(wind) - 0.5 * gap, push = 0;
            if (beyond > 0) {
                double out = wind > 0 ? wm - wt : wt - wm;
                push = k * beyond + damping * out;
                push = push > 0 ? copysign(push, wind) : 0;
            }
            double rm = (wm + 0.5 * cm) / scale / vs, rt = (wt + 0.5 * ct) / scale / vs; /* at the middle of the step */
            double lm = 0.5 * (TC + ts * exp(-rm * rm)), lt = 0.5 * (TC + ts * exp(-rt * rt));
            double nm = kick(jm, 0.5, wm, cm, acting - push, lm, stiffness, &fm);
            double nt = kick(jt, 0.5, wt, ct, push, lt, stiffness, &ft);
            cm = nm - wm; ct = nt - wt;
            qm = mm + 0.5 * H * nm; wm = nm;
            qt = mt + 0.5 * H * nt; wt = nt;
        }
    }
    return read / scale;
}

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    long cycles = atol(argv[2]);
    struct timespec a, b;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    double end = argv[1][0] == '0' ? rigid(cycles) : two_masses(cycles);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    printf("%.9f %.12f\n", (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec), end);
    return 0;
}
