/* The program of ../bits.c on a Cortex-M4F without an operating system, its output by semihosting. */
#include "../bits.h"

#ifdef TWO_LIBRARIES
/* Of the other Rust library in this image. */
int32_t other_sum(const int32_t *numbers, uint32_t count);
#endif

extern unsigned char stack_top[];

static int semihost(int operation, const void *argument) {
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(const char *name, uint32_t bits) {
    char digits[11] = " ........\n";
    for (int k = 0; k < 8; ++k)
        digits[8 - k] = "0123456789abcdef"[bits >> 4 * k & 15];
    semihost(4, name);
    semihost(4, digits);
}

void reset(void);
void reset(void) {
    /* The floating-point unit on, before anything uses it; flush-to-zero stays off. */
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
    int32_t status = run_bits(print);
#ifdef TWO_LIBRARIES
    const int32_t numbers[] = {1, 2, 39};
    if (other_sum(numbers, 3) != 42)
        status = -1;
#endif
    semihost(0x18, (const void *)(status < 0 ? 0x20023 : 0x20026));
    for (;;) {}
}

static void fault(void) {
    semihost(4, "fault\n");
    semihost(0x18, (const void *)0x20023);
    for (;;) {}
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (const void *)reset, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault,
    (const void *)fault,
};
