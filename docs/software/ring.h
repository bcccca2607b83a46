// SPDX-License-Identifier: BSD-3-Clause
/* The last telemetry rows out of the core's ring (generic RING_ROWS): armed before the drive runs, read after a trip. */

#ifndef FLUXPROOF_RING_H
#define FLUXPROOF_RING_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { RING_TRIP = 1 << 16, RING_ROW_WORDS = 24 };

/* Forget the rows and record.  The ring ends ``after`` rows behind the first trip (RING_TRIP) or fault (bit x of
 * fault_flags) of ``faults``.  False if the core has no ring. */
bool ring_start(uint32_t faults, uint32_t after);

bool ring_has_ended(void);

/* The rows of a ring that has ended, the oldest first, into ``file``: what `fluxproof dump` reads as a capture.  The
 * drive may run meanwhile.  Returns the rows; -1 if the ring has not ended, or an access or the file failed. */
int ring_save(FILE *file);

#endif
