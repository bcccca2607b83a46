// SPDX-License-Identifier: BSD-3-Clause
/* The functions of the board for bring_up.c: two accesses to the core's 4 KiB window, and time.
 * bus_uio.c has them for Linux on a Zynq; write your own for anything else. */

#ifndef FLUXPROOF_BUS_H
#define FLUXPROOF_BUS_H

#include <stdbool.h>
#include <stdint.h>

/* Both return false if the bus answered with an error (SLVERR, DECERR) and the board can detect it. */
bool bus_write(uint32_t offset, uint32_t value);
bool bus_read(uint32_t offset, uint32_t *value);

void wait_us(uint32_t microseconds);

#endif
