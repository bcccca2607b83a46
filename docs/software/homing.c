// SPDX-License-Identifier: BSD-3-Clause
/* Homing, see homing.h: off the switch if it is closed, towards it fast, off it, towards it slowly; the edge of the slow
 * search counts.  All moves are position_target's, so speed, acceleration and jerk stay within their limits. */

#include "homing.h"

#include "fluxproof_bus.h"
#include "fluxproof_registers.h"

#include <stddef.h>

#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))

enum { TURN = 1 << 18, REST_LOOKS = 3 };

static bool put(uint32_t offset, int32_t value)
{
    return bus_write(offset, (uint32_t)value);
}

static bool get(uint32_t offset, int32_t *value)
{
    uint32_t word;
    if (!bus_read(offset, &word))
        return false;
    *value = (int32_t)word;
    return true;
}

static int32_t plus(int32_t position, int64_t way) /* positions wrap */
{
    return (int32_t)(uint32_t)((uint64_t)(uint32_t)position + (uint64_t)way);
}

static int64_t size(int64_t x)
{
    return x < 0 ? -x : x;
}

static enum homing look(const struct homing_plan *plan, int32_t *position)
{
    int32_t flags, error;
    if (!get(AT(flags), &flags) || !get(AT(shaft_position), position) || !get(AT(position_error), &error))
        return HOMING_BUS_ERROR;
    if (!(flags & FLUXPROOF__FLAGS__RUNNING_bm) || (flags & FLUXPROOF__FLAGS__TRIPPED_bm))
        return HOMING_NOT_RUNNING;
    return size(error) > plan->error_most ? HOMING_BLOCKED : HOMED;
}

/* Until the shaft has not moved for some looks; each writes the target again, which is what a heartbeat wants. */
static enum homing rest(const struct homing_plan *plan, int32_t target)
{
    int32_t before, position;
    enum homing result = look(plan, &before);
    for (int calm = 0; result == HOMED && calm < REST_LOOKS;) {
        wait_us(plan->poll_us);
        if (!put(AT(position_target), target))
            return HOMING_BUS_ERROR;
        result = look(plan, &position);
        calm = size((int64_t)position - before) <= 2 ? calm + 1 : 0;
        before = position;
    }
    return result;
}

/* Holds where the shaft is. */
static enum homing hold(const struct homing_plan *plan)
{
    int32_t position;
    if (!get(AT(shaft_position), &position) || !put(AT(position_target), position))
        return HOMING_BUS_ERROR;
    return rest(plan, position);
}

/* Moves in a direction until the switch is as wanted; ``edge``: where that was. */
static enum homing search(const struct homing_plan *plan, int32_t direction, uint32_t speed, bool wanted, int32_t *edge)
{
    int32_t start;
    enum homing result = look(plan, &start);
    if (result != HOMED)
        return result;
    int32_t target = plus(start, (int64_t)direction * plan->most);
    if (!put(AT(move_speed), (int32_t)speed))
        return HOMING_BUS_ERROR;
    for (;;) {
        if (!put(AT(position_target), target))
            return HOMING_BUS_ERROR;
        bool there = plan->closed(plan->switch_) == wanted;
        result = look(plan, edge);
        if (result != HOMED || there)
            break;
        if (size((int64_t)*edge - start) >= plan->most - 2) {
            result = wanted ? HOMING_NO_SWITCH : HOMING_SWITCH_STUCK;
            break;
        }
        wait_us(plan->poll_us);
    }
    enum homing stopped = hold(plan);
    return result != HOMED ? result : stopped;
}

/* The encoder's zero before the switch, seen from its edge. */
static enum homing zero_before(const struct homing_plan *plan, int32_t edge, int32_t *home)
{
    int32_t within = edge & (TURN - 1), off = within < TURN / 2 ? within : TURN - within;
    if (off < TURN / 8)
        return HOMING_INDEX_AT_SWITCH;
    *home = plus(edge, plan->direction > 0 ? -within : TURN - within);
    return HOMED;
}

static enum homing sequence(const struct homing_plan *plan, int32_t *home)
{
    int32_t edge, encoder = 1;
    enum homing result = HOMED;
    if (plan->at_index && !plan->absolute) {
        if (!get(AT(encoder_flags), &encoder))
            return HOMING_BUS_ERROR;
        if (!(encoder & 1))
            return HOMING_NO_INDEX;
    }
    if (plan->closed(plan->switch_))
        result = search(plan, -plan->direction, plan->fast, false, &edge);
    if (result == HOMED)
        result = search(plan, plan->direction, plan->fast, true, &edge);
    if (result == HOMED)
        result = search(plan, -plan->direction, plan->slow, false, &edge);
    if (result == HOMED)
        result = search(plan, plan->direction, plan->slow, true, &edge);
    if (result != HOMED)
        return result;
    *home = edge;
    return plan->at_index ? zero_before(plan, edge, home) : HOMED;
}

static enum homing begun(const struct homing_plan *plan, int32_t *home)
{
    int32_t built, position, speed;
    if (!get(AT(position_loop), &built) || !get(AT(move_speed), &speed))
        return HOMING_BUS_ERROR;
    if (!built)
        return HOMING_NO_POSITION_LOOP;
    enum homing result = look(plan, &position);
    if (result != HOMED)
        return result;
    if (!put(AT(position_target), position) || !put(AT(position_mode), 1))
        return HOMING_BUS_ERROR;
    result = sequence(plan, home);
    return put(AT(move_speed), speed) ? result : HOMING_BUS_ERROR;
}

enum homing homing(const struct homing_plan *plan, int32_t *home)
{
    enum homing result = begun(plan, home);
    if (result == HOMING_BUS_ERROR) /* nobody sees the switch any more, and a search would run on to its end */
        bus_write(AT(enable), 0);
    return result;
}

const char *homing_says(enum homing result)
{
    static const char *const words[] = {
        "homed", "an access to the core failed", "the core was built without a position loop",
        "the gates are off, or a trip came", "the encoder has not found its index", "the switch stays closed",
        "the switch does not close", "the shaft does not follow", "the switch is too near the index",
    };
    return words[result];
}
