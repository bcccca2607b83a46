// SPDX-License-Identifier: BSD-3-Clause
/* See ring.h; built with the bus of your board, as bring_up.c is. */

#include "ring.h"
#include "fluxproof_bus.h"
#include "fluxproof_registers.h"

#include <stddef.h>

#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))

bool ring_start(uint32_t faults, uint32_t after)
{
    uint32_t depth;
    return bus_read(AT(ring_depth), &depth) && depth > 0 && bus_write(AT(ring_faults), faults) &&
           bus_write(AT(ring_after), after) && bus_write(AT(ring_arm), 1);
}

bool ring_has_ended(void)
{
    uint32_t state;
    return bus_read(AT(ring_state), &state) && (state & FLUXPROOF__RING_STATE__RING_ENDED_bm) != 0;
}

int ring_save(FILE *file)
{
    uint32_t state, depth, next;
    if (!ring_has_ended() || !bus_read(AT(ring_state), &state) || !bus_read(AT(ring_depth), &depth) ||
        !bus_read(AT(ring_next), &next))
        return -1;
    bool full = (state & FLUXPROOF__RING_STATE__RING_FULL_bm) != 0;
    uint32_t words = full ? depth * RING_ROW_WORDS : next, at = full ? next : 0;
    for (uint32_t k = 0; k < words; k++, at = at + 1 == depth * RING_ROW_WORDS ? 0 : at + 1) {
        uint32_t word;
        if (!bus_write(AT(ring_address), at) || !bus_read(AT(ring_data), &word))
            return -1;
        unsigned char bytes[4] = {word & 255, word >> 8 & 255, word >> 16 & 255, word >> 24};
        if (fwrite(bytes, 1, sizeof bytes, file) != sizeof bytes)
            return -1;
    }
    return (int)(words / RING_ROW_WORDS);
}
