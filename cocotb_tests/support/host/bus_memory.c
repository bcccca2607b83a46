// SPDX-License-Identifier: BSD-3-Clause
/* The bus of docs/software/fluxproof_bus.h as a memory with an A/B/Z encoder in it, for find_index of bring_up.c: the flag
 * of the index comes FLUXPROOF_INDEX_AFTER looks at it with a field that turns, and never if that is 0.  Gates that are
 * enabled without an angle, its own or a forced one, end the program with status 9, a current of the d axis while the
 * torque table is in force with status 8.  The torque is i_q_ext with the table, that of i_q and the magnets without.
 * Where the program ends with its gates on the status is 7, with a forced angle or faults ignored 6.  Whoever ran before
 * has left all of them so.  FLUXPROOF_SIGNAL is raised in the first wait with the gates on. */

#define _POSIX_C_SOURCE 200809L

#include "fluxproof_bus.h"
#include "fluxproof_registers.h"
#include "drive_registers.h"

#include <signal.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))

static uint32_t words[1024];
static long looks;
static bool begun;

static void at_the_end(void)
{
    if (words[AT(enable) / 4])
        _exit(7);
    if (words[AT(position_source) / 4] || words[AT(forced_rate) / 4] || words[AT(board_ignore) / 4])
        _exit(6);
}

static void begin(void)
{
    if (begun)
        return;
    begun = true;
    words[AT(enable) / 4] = words[AT(position_source) / 4] = words[AT(forced_rate) / 4] = 1;
    words[AT(board_ignore) / 4] = 31;
    atexit(at_the_end);
}

static uint32_t generic(uint32_t offset)
{
    const uint32_t list[] = {FLUXPROOF_ADC_BITS, FLUXPROOF_POSITION_BITS, FLUXPROOF_CARRIER_HALF,
                             FLUXPROOF_CLOCK_HZ, FLUXPROOF_ESTIMATORS, FLUXPROOF_REFERENCES,
                             FLUXPROOF_POSITION_LOOP, FLUXPROOF_RESIDUAL, FLUXPROOF_MODES,
                             FLUXPROOF_OVERMODULATION, FLUXPROOF_GEARING};
    if (offset == AT(encoder))
        return FLUXPROOF_ENCODER;
    if (offset == AT(currents))
        return FLUXPROOF_CURRENTS;
    return offset == AT(spi_lines) ? FLUXPROOF_SPI_LINES : list[(offset - AT(adc_bits)) / 4];
}

static bool known(void)
{
    const char *after = getenv("FLUXPROOF_INDEX_AFTER");
    long wanted = after == NULL ? 0 : atol(after);
    return wanted > 0 && looks >= wanted;
}

bool bus_write(uint32_t offset, uint32_t value)
{
    begin();
    words[offset / 4] = value;
    if (value && offset == AT(enable) && !known() && !words[AT(position_source) / 4])
        exit(9);
    if (offset == AT(i_d_ref) && value && words[AT(use_table) / 4])
        exit(8);
    return true;
}

static double flux(void)
{
    return 1.5 * words[AT(pole_pairs) / 4] * words[AT(lambda_mg) / 4] / 65536.0 * FLUXPROOF_BASE_FLUX_WB;
}

bool bus_read(uint32_t offset, uint32_t *value)
{
    begin();
    *value = words[offset / 4];
    if (offset == AT(identification))
        *value = FLUXPROOF__IDENTIFICATION__VALUE_reset;
    else if (offset == AT(version))
        *value = FLUXPROOF__VERSION__VALUE_reset;
    else if (offset < AT(enable) || (offset >= AT(encoder) && offset <= AT(spi_lines)))
        *value = generic(offset);
    else if (offset == AT(flags))
        *value = words[AT(enable) / 4] ? FLUXPROOF__FLAGS__RUNNING_bm : 0;
    else if (offset == AT(i_q) && !words[AT(use_table) / 4])
        *value = words[AT(i_q_ext) / 4];
    else if (offset == AT(torque)) {
        double current = (int32_t)words[AT(i_q_ext) / 4] * FLUXPROOF_BASE_CURRENT_A;
        double made = current * flux() / FLUXPROOF_BASE_TORQUE_NM;
        *value = words[AT(use_table) / 4] ? words[AT(i_q_ext) / 4] : (uint32_t)(int32_t)made;
    } else if (offset == AT(encoder_flags)) {
        looks += words[AT(forced_rate) / 4] != 0 && words[AT(i_d_ref) / 4] != 0;
        *value = known();
    }
    return true;
}

void wait_us(uint32_t microseconds)
{
    const char *number = getenv("FLUXPROOF_SIGNAL");
    (void)microseconds;
    if (number != NULL && words[AT(enable) / 4])
        raise(atoi(number));
}
