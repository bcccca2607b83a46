// SPDX-License-Identifier: BSD-3-Clause
/* Loads the motor of fluxproof_hil: everything that motor_registers.h lists, then it checks that the rotor is free.
 * The motor keeps it until the FPGA is configured anew; afterwards bring_up.c turns it like any other.
 *
 *   fluxproof project drive.toml --hil --part xc7z020clg484-1 --out project
 *   cc -Wall -Wextra -I docs/software -I project docs/software/load_motor.c docs/software/bus_uio.c -o load_motor
 *   ./load_motor
 */

#include "fluxproof_bus.h"
#include "fluxproof_registers.h"
#include "motor_registers.h" /* generated from your drive.toml */

#include <stddef.h>
#include <stdio.h>

#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))
#define COUNT(list) (sizeof(list) / sizeof(list)[0])

int main(void)
{
    uint32_t gates_on, ready = 0;
    if (!bus_read(AT(enable), &gates_on) || gates_on) {
        fputs("load_motor: enable is set: turn the gates off first\n", stderr);
        return 1;
    }
    for (size_t k = 0; k < COUNT(fluxproof_motor); k++) {
        if (!bus_write(fluxproof_motor[k].offset, (uint32_t)fluxproof_motor[k].value)) {
            fprintf(stderr, "load_motor: no register at 0x%03x: is this a fluxproof_hil?\n",
                    (unsigned)fluxproof_motor[k].offset);
            return 1;
        }
    }
    wait_us(1000);
    if (!bus_read(AT(motor_ready), &ready) || !ready) {
        fputs("load_motor: the rotor is not free\n", stderr);
        return 1;
    }
    printf("%zu words of the motor loaded\n", COUNT(fluxproof_motor));
    return 0;
}
