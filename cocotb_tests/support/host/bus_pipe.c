// SPDX-License-Identifier: BSD-3-Clause
/* The bus of docs/software/fluxproof_bus.h over two pipes, whose numbers are in FLUXPROOF_PIPES ("3,4"): the other end is
 * cocotb_tests/support/host/golden_board.py.  Requests are "w offset value", "r offset", "t microseconds", in hexadecimal;
 * answers are the word read, "ok", or "error". */

#define _POSIX_C_SOURCE 200809L
#include "fluxproof_bus.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static FILE *answers, *requests;

static bool ask(const char *request, unsigned a, unsigned b, uint32_t *word)
{
    char line[64];
    if (answers == NULL) {
        int from, to;
        const char *numbers = getenv("FLUXPROOF_PIPES");
        if (numbers == NULL || sscanf(numbers, "%d,%d", &from, &to) != 2)
            abort();
        answers = fdopen(from, "r");
        requests = fdopen(to, "w");
    }
    fprintf(requests, request, a, b);
    fflush(requests);
    if (fgets(line, sizeof line, answers) == NULL)
        exit(3);
    if (word != NULL)
        *word = (uint32_t)strtoul(line, NULL, 16);
    return strcmp(line, "error\n") != 0;
}

bool bus_write(uint32_t offset, uint32_t value)
{
    return ask("w %x %x\n", offset, value, NULL);
}

bool bus_read(uint32_t offset, uint32_t *value)
{
    return ask("r %x\n", offset, 0, value);
}

void wait_us(uint32_t microseconds)
{
    ask("t %x\n", microseconds, 0, NULL);
}
