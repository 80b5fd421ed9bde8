/* The tick in C, as the physical limit that the tick in Python is held against: frames in, CRC, counter, range
   and rate checked, continuous skyhook, refined inverse filter, static inverse, authority weighting, slew limit,
   frame out. No states, no substitutes, no effects. The numbers come in tick_numbers.h. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "tick_numbers.h"

typedef struct { double y, b[4], a[4], s[3]; } Filter;
typedef struct { double value; long last; } Channel;
typedef struct {
    Channel velocity, body, temperature;
    double ahead[2][2]; /* value before, slope: of relative and body velocity */
    int begun;
    Filter back, made, low, more;
    double forces[LEVELS], warm_c, current_a;
    int raw;
} Corner;

static uint8_t crc_table[256];
static Corner corners[DAMPERS];
static int counters[3] = {-1, -1, -1};
static long now;

static void make_table(void) {
    for (int i = 0; i < 256; i++) {
        unsigned c = (unsigned)i;
        for (int k = 0; k < 8; k++) c = c & 0x80 ? (c << 1 ^ 0x2F) & 0xFF : c << 1;
        crc_table[i] = (uint8_t)c;
    }
}

static uint8_t crc(const uint8_t *data, uint8_t id) {
    uint8_t r = 0xFF;
    for (int i = 1; i < 8; i++) r = crc_table[r ^ data[i]];
    return crc_table[r ^ id] ^ 0xFF;
}

static double lookup(double x, const double *knots, const double *values, int n) {
    if (x <= knots[0]) return values[0];
    if (x >= knots[n - 1]) return values[n - 1];
    int low = 0, high = n - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (knots[middle] <= x) low = middle; else high = middle;
    }
    return values[low] + (values[high] - values[low]) * ((x - knots[low]) / (knots[high] - knots[low]));
}

static double filter(Filter *f, double x) {
    double y = f->b[0] * x + f->s[0];
    f->s[0] = f->b[1] * x - f->a[1] * y + f->s[1];
    f->s[1] = f->b[2] * x - f->a[2] * y + f->s[2];
    f->s[2] = f->b[3] * x - f->a[3] * y;
    return y;
}

/* One signal of 13 bits out of a frame of four: range, rate and "not available" checked. */
static void take(Channel *c, uint64_t word, int corner, double factor, const double *rule) {
    int raw = (int)(word >> (12 + 13 * corner) & 0x1FFF);
    if (raw & 0x1000) raw -= 0x2000;
    double value = raw * factor, change = rule[2] * DT * (double)(now - c->last + 1);
    if (raw == -4096 || value < rule[0] || value > rule[1]) return;
    if (value - c->value > change || c->value - value > change) return;
    c->value = value;
    c->last = now;
}

static uint64_t checked(const uint8_t *data, int kind) {
    int counter = data[1] & 0xF, step = (counter - counters[kind]) & 0xF;
    if (crc(data, DATA_IDS[kind][counter]) != data[0]) return 0;
    int first = counters[kind] < 0;
    counters[kind] = counter;
    if (!first && (step == 0 || step > 5)) return 0;
    uint64_t word;
    memcpy(&word, data, 8);
    return word;
}

static double ahead(double *state, double value, int begun) {
    double slope = state[1] + SHARE * (value - state[0] - state[1]);
    double before = state[0];
    state[0] = value;
    (void)before;
    if (!begun) return value;
    state[1] = slope;
    return value + GAIN * slope;
}

static double invert(Corner *c, double back, double g) {
    const double *forces = c->forces;
    if (back * g <= 0.0) return 0.0;
    if (g < 0.0) { back = -back; g = -g; }
    if (back >= forces[LEVELS - 1] * g) return CURRENT_MAX;
    double q = back / g;
    if (q < forces[0]) return 0.0;
    int low = 0, high = LEVELS - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (forces[middle] <= q) low = middle; else high = middle;
    }
    double w0 = ON_WEIGHT[low], w1 = ON_WEIGHT[high];
    double off = lookup(c->warm_c, T_KNOTS, H_OFF, T_COUNT), on = lookup(c->warm_c, T_KNOTS, H_ON, T_COUNT);
    double h0 = off + w0 * (on - off), h1 = off + w1 * (on - off), f0 = LEVEL_F[low], f1 = LEVEL_F[high];
    double A = (f1 - f0) * (h1 - h0), B = f0 * (h1 - h0) + h0 * (f1 - f0), C = f0 * h0 - q;
    return LEVEL_I[low] - 2.0 * C * (LEVEL_I[high] - LEVEL_I[low]) / (B + sqrt(B * B - 4.0 * A * C));
}

static int control(Corner *c) {
    double v = ahead(c->ahead[0], c->velocity.value, c->begun);
    double body = ahead(c->ahead[1], c->body.value, c->begun), warm = c->temperature.value;
    c->begun = 1;
    double wish = SKY * body * v > 0.0 ? SKY * body : 0.0;
    double slow = LOW_DAMPING * v, fast = HIGH_DAMPING * v;
    if (v < 0.0) { double t = slow; slow = fast; fast = t; }
    wish = wish < slow ? slow : wish > fast ? fast : wish;
    if (fabs(warm - c->warm_c) > 0.01) {
        double off = lookup(warm, T_KNOTS, H_OFF, T_COUNT), on = lookup(warm, T_KNOTS, H_ON, T_COUNT);
        for (int i = 0; i < LEVELS; i++) c->forces[i] = LEVEL_F[i] * (off + ON_WEIGHT[i] * (on - off));
        c->warm_c = warm;
    }
    double back = filter(&c->back, wish);
    double low = filter(&c->low, wish - filter(&c->made, back));
    back += filter(&c->more, low);
    double g = lookup(v, G_KNOTS, G_SHAPE, G_COUNT);
    double wanted = c->current_a - expm1(FADE * g * g) * (invert(c, back, g) - c->current_a);
    double change = wanted - c->current_a;
    change = change > SLEW_STEP ? SLEW_STEP : change < -SLEW_STEP ? -SLEW_STEP : change;
    int raw = (int)rint((c->current_a + change) / UNIT);
    int limit = (int)floor(SLEW_STEP / UNIT + 1e-9);
    raw = raw > c->raw + limit ? c->raw + limit : raw < c->raw - limit ? c->raw - limit : raw;
    raw = raw < 0 ? 0 : raw > RAW_MAX ? RAW_MAX : raw;
    c->raw = raw;
    c->current_a = raw * UNIT;
    return raw;
}

static void tick(const uint8_t *frames, uint8_t *out) {
    now++;
    for (int kind = 0; kind < 3; kind++) {
        if (kind == 2 && !frames[24]) continue;
        uint64_t word = checked(frames + 8 * kind, kind);
        if (!word) continue;
        for (int k = 0; k < DAMPERS; k++) {
            Corner *c = corners + k;
            take(kind == 0 ? &c->velocity : kind == 1 ? &c->body : &c->temperature, word, k, FACTORS[kind], RULES[kind]);
        }
    }
    uint64_t word = (uint64_t)(now & 0xF) << 8;
    for (int k = 0; k < DAMPERS; k++) word |= (uint64_t)control(corners + k) << (12 + 13 * k);
    memcpy(out, &word, 8);
    out[0] = crc(out, COMMAND_IDS[now & 0xF]);
}

static void set(Filter *f, const double *b, const double *a) {
    memset(f, 0, sizeof *f);
    memcpy(f->b, b, sizeof f->b);
    memcpy(f->a, a, sizeof f->a);
}

/* Arguments: ticks, repeats. Standard input: 25 bytes a tick. Standard output: the commands of the first
   round; standard error: ns a tick, the best round. */
int main(int argc, char **argv) {
    if (argc < 3) return 2;
    long ticks = atol(argv[1]), repeats = atol(argv[2]);
    uint8_t *in = malloc((size_t)ticks * 25), *out = malloc((size_t)ticks * 8);
    if (!in || !out || fread(in, 25, (size_t)ticks, stdin) != (size_t)ticks) return 2;
    make_table();
    for (int k = 0; k < DAMPERS; k++) {
        Corner *c = corners + k;
        set(&c->back, INVERSE_B, INVERSE_A);
        set(&c->made, FORWARD_B, FORWARD_A);
        set(&c->low, LOWPASS_B, LOWPASS_A);
        set(&c->more, INVERSE_B, INVERSE_A);
        c->warm_c = -1e9;
        c->temperature.value = NOMINAL_C;
        c->velocity.last = c->body.last = c->temperature.last = -1000000;
    }
    double best = 1e18;
    for (long r = 0; r < repeats; r++) {
        struct timespec from, to;
        clock_gettime(CLOCK_MONOTONIC, &from);
        for (long n = 0; n < ticks; n++) tick(in + 25 * n, out + 8 * n);
        clock_gettime(CLOCK_MONOTONIC, &to);
        double ns = ((double)(to.tv_sec - from.tv_sec) * 1e9 + (double)(to.tv_nsec - from.tv_nsec)) / (double)ticks;
        if (ns < best) best = ns;
        if (r == 0 && fwrite(out, 8, (size_t)ticks, stdout) != (size_t)ticks) return 1;
    }
    fprintf(stderr, "%.3f\n", best);
    return 0;
}
