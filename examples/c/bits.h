#ifndef BITS_H
#define BITS_H

#include <stdint.h>

typedef void (*print_bits)(const char *name, uint32_t bits);

/* Prints the bits of all answers; a status. */
int32_t run_bits(print_bits print);

#endif
