/* Brings a drive up over its registers: is it the right core, load the drive, check, enable, ramp the speed up and
 * down, read back, stop.  The gates are off before it starts and, whatever goes wrong, when it ends.
 *
 *   fluxproof registers drive.toml --format c > drive_registers.h
 *   cc -Wall -Wextra -I software -I . software/bring_up.c software/bus_uio.c -o bring_up
 *   ./bring_up 300          speed in rpm
 */

#include "fluxproof_bus.h"
#include "fluxproof_registers.h" /* generated with the core: where each register is */
#include "drive_registers.h"     /* generated from your drive.toml: what goes into it */

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))
#define COUNT(list) (sizeof(list) / sizeof(list)[0])

enum { STEPS = 50, STEP_US = 10000, SETTLE_STEPS = 50 };

static const double PI = 3.14159265358979;

/* ------------------------------------------------------------------ small helpers */

/* Off first, words later. */
static void fail(const char *format, ...)
{
    bus_write(AT(enable), 0);
    va_list arguments;
    va_start(arguments, format);
    fputs("bring_up: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(1);
}

static void put(uint32_t offset, uint32_t value)
{
    if (!bus_write(offset, value))
        fail("the core refused 0x%08x at 0x%03x", (unsigned)value, (unsigned)offset);
}

static uint32_t get(uint32_t offset)
{
    uint32_t value;
    if (!bus_read(offset, &value))
        fail("nothing to read at 0x%03x", (unsigned)offset);
    return value;
}

static int32_t get_signed(uint32_t offset)
{
    return (int32_t)get(offset);
}

static bool flag(uint32_t mask)
{
    return (get(AT(flags)) & mask) != 0;
}

/* ------------------------------------------------------------------ the steps */

static void identify(void)
{
    uint32_t letters = get(AT(identification)), version = get(AT(version));
    if (letters != FLUXPROOF__IDENTIFICATION__VALUE_reset)
        fail("no Fluxproof core here: identification is 0x%08x", (unsigned)letters);
    if (version >> 16 != FLUXPROOF__VERSION__VALUE_reset >> 16)
        fail("core version 0x%06x, header 0x%06x", (unsigned)version, FLUXPROOF__VERSION__VALUE_reset);
    printf("core %u.%u.%u, %u Hz\n", version >> 16 & 255, version >> 8 & 255, version & 255, get(AT(clock_hz)));
}
