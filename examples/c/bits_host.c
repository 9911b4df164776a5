#include "bits.h"

#include <stdio.h>

static void print(const char *name, uint32_t bits) { printf("%s %08x\n", name, (unsigned)bits); }

int main(void) { return run_bits(print) < 0; }
