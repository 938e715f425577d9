/*
 * count_steps.c - instructions of a step on a Cortex-M, counted by QEMU.
 *
 * usage: count_steps [STEPS]     for each of some inputs, default 400
 * Under `-icount shift=6` every instruction takes 64 ns of the machine's time, and SysTick counts at
 * 25 MHz, 40 ns: 1.6 counts an instruction, the same on every run. Prints, one line per input,
 *     count NAME SPEED_M_S FRICTION steps N least N mean N most N faults N
 * Steps that only hold a vehicle after a fault are shorter and are not counted. The model is linked in (-DMODEL=...), as `klingel build` wrote it.
 */
#include <stdio.h>
#include <stdlib.h>

#include "klingel.h"
#include "mps2.h"

#define NS_PER_INSTRUCTION 64u
#define NS_PER_COUNT (1000000000u / MPS2_CLOCK_HZ)

extern const struct kl_model MODEL;

static struct kl_state state;
static struct kl_output output;
static struct kl_work work;

struct counted {
    uint32_t least;
    uint32_t most;
    uint64_t sum;
    unsigned long steps;
};

static uint32_t instructions(uint32_t before, uint32_t after) {
    const uint32_t counts = (before - after) & MPS2_SYSTICK_MAX; /* it counts down */
    return (counts * NS_PER_COUNT + NS_PER_INSTRUCTION / 2) / NS_PER_INSTRUCTION;
}

/* What reading the counter twice takes by itself. */
static uint32_t overhead(void) {
    const uint32_t before = MPS2_SYSTICK_VALUE;
    return instructions(before, MPS2_SYSTICK_VALUE);
}

/* One step, counted unless it is the one that ends the motion: that does less. */
static void count_one(struct counted *counted, const struct kl_input *input) {
    const uint32_t before = MPS2_SYSTICK_VALUE;
    const uint32_t faults = kl_step(&MODEL, &state, input, &output, &work);
    const uint32_t took = instructions(before, MPS2_SYSTICK_VALUE) - overhead();
    if ((faults & KL_FAULTS_HOLD) != 0) {
        return;
    }
    counted->least = took < counted->least ? took : counted->least;
    counted->most = took > counted->most ? took : counted->most;
    counted->sum += took;
    counted->steps++;
}

/* From rest and from rolling, on the edge of the track's table and inside, with and without grip. */
static int run(double speed_m_s, double friction, unsigned long steps) {
    struct counted counted = {.least = ~0u};
    struct kl_input input;
    kl_input_init(&input);
    for (int i = 0; i < KL_MAX_WHEELSETS; i++) {
        input.friction_factor[i][KL_RIGHT] = (kl_real)friction;
        input.friction_factor[i][KL_LEFT] = (kl_real)friction;
    }
    input.speed_m_s = (kl_real)(speed_m_s + 5.0);
    if (kl_init(&MODEL, &state, (kl_real)50, (kl_real)speed_m_s, &work) != KL_OK) {
        return 1;
    }
    state.x[kl_wheelset_state_index(&MODEL, 0, KL_WS_Y)] = (kl_real)3e-3;
    for (unsigned long i = 0; i < steps && (state.faults & KL_FAULTS_HOLD) == 0; i++) {
        count_one(&counted, &input);
    }
    if (counted.steps == 0) {
        return 1;
    }
    printf("count %s %g %g steps %lu least %lu mean %lu most %lu faults %lu\n", MODEL.name,
           speed_m_s, friction, counted.steps, (unsigned long)counted.least,
           (unsigned long)(counted.sum / counted.steps), (unsigned long)counted.most,
           (unsigned long)output.faults);
    return 0;
}

int main(int argc, char **argv) {
    static const double speeds_m_s[] = {0.0, 1.0, 27.0, 80.0, 140.0};
    unsigned long steps = argc > 1 ? strtoul(argv[1], NULL, 10) : 400;
    int failed = kl_model_check(&MODEL) != KL_OK || steps == 0;
    if (failed != 0) {
        printf("%s is not whole\n", MODEL.name);
    }
    MPS2_SYSTICK_LOAD = MPS2_SYSTICK_MAX;
    MPS2_SYSTICK_VALUE = 0;
    MPS2_SYSTICK_CTRL = MPS2_SYSTICK_COUNT_ONLY;
    for (unsigned i = 0; failed == 0 && i < sizeof speeds_m_s / sizeof speeds_m_s[0]; i++) {
        failed |= run(speeds_m_s[i], 1.0, steps);
        failed |= run(speeds_m_s[i], 0.05, steps);
    }
    return failed;
}
