// SPDX-License-Identifier: BSD-3-Clause
/* An axis for docs/software/homing.c: a shaft that follows position_target at move_speed, a switch, a stop.
 * homing_bus START SWITCH DIRECTION AT_INDEX FAULT: positions in 2^-18 turns; prints the result, the home, move_speed, enable, and the result's name. */

#include "../../../docs/software/homing.c"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int32_t words[1024], shaft, place, direction;
static long looks;
static const char *fault;

static bool is(const char *name)
{
    return strcmp(fault, name) == 0;
}

bool bus_write(uint32_t offset, uint32_t value)
{
    words[offset / 4] = (int32_t)value;
    return !(is("bus") && offset == AT(position_mode));
}

bool bus_read(uint32_t offset, uint32_t *value)
{
    int32_t error = words[AT(position_target) / 4] - shaft;
    *value = (uint32_t)words[offset / 4];
    if (offset == AT(position_loop))
        *value = !is("built");
    else if (offset == AT(flags))
        *value = is("trip") && ++looks > 50 ? FLUXPROOF__FLAGS__TRIPPED_bm : FLUXPROOF__FLAGS__RUNNING_bm;
    else if (offset == AT(shaft_position) && is("lost") && ++looks > 50)
        return false;
    else if (offset == AT(shaft_position))
        *value = (uint32_t)shaft;
    else if (offset == AT(position_error))
        *value = is("blocked") ? (uint32_t)(error > 5000 ? 5000 : error < -5000 ? -5000 : error) : 0;
    else if (offset == AT(encoder_flags))
        *value = !is("index");
    return true;
}

void wait_us(uint32_t microseconds) /* a sample is 100 us */
{
    int64_t most = ((int64_t)words[AT(move_speed) / 4] * (microseconds / 100)) >> 16;
    int64_t way = (int64_t)words[AT(position_target) / 4] - shaft;
    shaft += (int32_t)(is("blocked") ? 0 : way > most ? most : way < -most ? -most : way);
}

static bool closed(void *switch_)
{
    (void)switch_;
    return is("stuck") || (!is("never") && (direction > 0 ? shaft >= place : shaft <= place));
}

int main(int argc, char **argv)
{
    if (argc != 6)
        return 2;
    shaft = atoi(argv[1]), place = atoi(argv[2]), direction = atoi(argv[3]), fault = argv[5];
    words[AT(move_speed) / 4] = 12345;
    words[AT(enable) / 4] = 1;
    struct homing_plan plan = {.direction = direction, .most = 8 * TURN, .error_most = 1000, .fast = 1 << 24,
                               .slow = 1 << 18, .poll_us = 1000, .at_index = atoi(argv[4]) != 0, .closed = closed};
    int32_t home = 0;
    enum homing result = homing(&plan, &home);
    printf("%d %d %d %d: %s\n", (int)result, home, words[AT(move_speed) / 4], words[AT(enable) / 4], homing_says(result));
    return 0;
}
