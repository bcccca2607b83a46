// SPDX-License-Identifier: BSD-3-Clause
/* The core's window through Linux' userspace I/O: give the core's node in the device tree
 * compatible = "generic-uio" (`fluxproof project` writes it as fluxproof.dtsi), and its number to FLUXPROOF_UIO
 * (0 for /dev/uio0, the default).
 * A refused access is a bus error there (SIGBUS): bring_up.c turns the gates off and ends. */

#define _DEFAULT_SOURCE
#include "fluxproof_bus.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

enum { WINDOW = 4096 };

static volatile uint32_t *window(void)
{
    static volatile uint32_t *mapped;
    if (mapped == NULL) {
        const char *number = getenv("FLUXPROOF_UIO");
        char name[32];
        snprintf(name, sizeof name, "/dev/uio%.8s", number ? number : "0");
        int file = open(name, O_RDWR | O_SYNC);
        void *memory = file < 0 ? MAP_FAILED : mmap(NULL, WINDOW, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (memory == MAP_FAILED) {
            perror(name);
            exit(2);
        }
        mapped = memory;
    }
    return mapped;
}

bool bus_write(uint32_t offset, uint32_t value)
{
    window()[offset / 4] = value;
    return true;
}

bool bus_read(uint32_t offset, uint32_t *value)
{
    *value = window()[offset / 4];
    return true;
}

void wait_us(uint32_t microseconds)
{
    usleep(microseconds);
}
