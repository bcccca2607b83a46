// SPDX-License-Identifier: BSD-3-Clause
/* Finds the home of an axis in position mode: at a switch, or at the encoder's zero (its index) beside the switch.
 * The drive runs (bring_up.c); homing() ends with the shaft at rest where it ended, position_mode = 1, or says by name why not. */

#ifndef FLUXPROOF_HOMING_H
#define FLUXPROOF_HOMING_H

#include <stdbool.h>
#include <stdint.h>

enum homing {
    HOMED,
    HOMING_BUS_ERROR,        /* an access failed: enable = 0 was written */
    HOMING_NO_POSITION_LOOP, /* the core was built with POSITION_LOOP = 0 */
    HOMING_NOT_RUNNING,      /* the gates are off, or a trip came */
    HOMING_NO_INDEX,         /* the encoder has not found its zero, without which a turn has none */
    HOMING_SWITCH_STUCK,     /* the switch stays closed over `most` */
    HOMING_NO_SWITCH,        /* the switch does not close within `most` */
    HOMING_BLOCKED,          /* the shaft does not follow: more than `error_most` */
    HOMING_INDEX_AT_SWITCH   /* the edge of the switch is within an eighth of a turn of the zero: turn one against the other */
};

struct homing_plan {
    int32_t direction;            /* 1 or -1: where the switch is */
    int32_t most;                 /* longest way of a search, 2^-18 turns of the shaft */
    int32_t error_most;           /* of position_error, the same unit */
    uint32_t fast, slow;          /* speeds of both searches as the register move_speed: 2^-34 turns per sample */
    uint32_t poll_us;             /* from look to look; the edge is known to slow*poll; shorter than heartbeat_s */
    bool at_index;                /* false: home is the edge; true: the encoder's zero before the switch */
    bool absolute;                /* true: the encoder needs no index (SSI, BiSS-C, EnDat, external code) */
    bool (*closed)(void *switch_); /* the switch, from wherever the board has it */
    void *switch_;
};

/* home: position of the home as shaft_position counts it; a target is home + way. */
enum homing homing(const struct homing_plan *plan, int32_t *home);

/* The name in words. */
const char *homing_says(enum homing result);

#endif
