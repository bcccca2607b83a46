// SPDX-License-Identifier: BSD-3-Clause
/* Sends the telemetry that a DMA driver hands out (a character device, a FIFO, a file, - for stdin) to one client after the
 * other: `fluxproof watch tcp://HOST:PORT`.  The device is read whether somebody listens or not, so that the DMA never
 * waits; where the client is too slow, whole packets are left out, and their numbers show it.
 *
 *   cc -O2 -Wall -Wextra docs/software/telemetry_server.c -o telemetry_server
 *   ./telemetry_server /dev/fluxproof_dma 5555               loopback only: reach it through ssh -L
 *   ./telemetry_server /dev/fluxproof_dma 5555 192.168.1.10  at this address: whoever reaches it can read
 *   ./telemetry_server /dev/fluxproof_dma 5555 127.0.0.1 /dev/uio0
 *
 * With the core's registers (userspace I/O) it reads first_fault when a packet says that the gates went off, and sends it
 * as a note behind that packet, see telemetry_packet.h.
 */

#define _POSIX_C_SOURCE 200809L

#include "fluxproof_registers.h"
#include "telemetry_packet.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

enum { PACKET = 4 * TELEMETRY_WORDS, PACKETS = 40000, SIZE = PACKET * PACKETS }; /* two seconds at 20 kHz */

static unsigned char queue[SIZE];
static size_t first, used; /* bytes; ``first + used`` is a packet's begin whenever no packet is cut */
static unsigned char packet[PACKET];
static size_t got; /* bytes of ``packet`` */
static int ran;    /* the gates of the last packet */
static volatile const uint32_t *registers; /* NULL: not given */

static void quit(const char *what)
{
    perror(what);
    exit(1);
}

static int listening(const char *address, int port)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((unsigned short)port)};
    int yes = 1, made = socket(AF_INET, SOCK_STREAM, 0);
    if (inet_pton(AF_INET, address, &at.sin_addr) != 1) {
        fprintf(stderr, "%s: expected an IPv4 address\n", address);
        exit(2);
    }
    if (made < 0 || setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) < 0 ||
        bind(made, (struct sockaddr *)&at, sizeof at) < 0 || listen(made, 1) < 0)
        quit("listen");
    return made;
}

static void map_registers(const char *path)
{
    enum { WINDOW = 4096 };
    int file = open(path, O_RDWR | O_SYNC);
    void *memory = file < 0 ? MAP_FAILED : mmap(NULL, WINDOW, PROT_READ, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED)
        quit(path);
    registers = memory;
}

/* One packet into the queue, or none of it. */
static void keep(const unsigned char *bytes)
{
    if (used + PACKET > SIZE)
        return;
    for (size_t k = 0; k < PACKET; k++)
        queue[(first + used + k) % SIZE] = bytes[k];
    used += PACKET;
}

static uint32_t word(int number)
{
    const unsigned char *at = packet + 4 * number;
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

/* 1 if the gates went off with this packet. */
static int went_off(void)
{
    if (word(0) != TELEMETRY_HEADER)
        return 0;
    int runs = word(TELEMETRY_RUN_WORD) >> TELEMETRY_RUN_BIT & 1, off = ran && !runs;
    ran = runs;
    return off;
}

/* Why, behind the packet. */
static void tell_why(void)
{
    const uint32_t words[] = {TELEMETRY_NOTE, word(TELEMETRY_COUNTER), registers[offsetof(fluxproof_t, first_fault) / 4]};
    unsigned char note[PACKET] = {0};
    for (size_t k = 0; k < sizeof words; k++)
        note[k] = words[k / 4] >> 8 * (k % 4) & 255;
    keep(note);
}

/* What the device has; 0 at its end. */
static int take(int device, int wanted)
{
    ssize_t n = read(device, packet + got, PACKET - got);
    if (n < 0)
        return errno == EAGAIN || errno == EINTR;
    got += (size_t)n;
    if (got == PACKET) {
        int off = went_off();
        if (wanted)
            keep(packet);
        if (wanted && off && registers)
            tell_why();
        got = 0;
    }
    return n > 0;
}

/* What the client takes now; 0 when it has gone. */
static int give(int client)
{
    size_t run = used < SIZE - first ? used : SIZE - first;
    ssize_t n = run ? write(client, queue + first, run) : 0;
    if (n < 0)
        return errno == EAGAIN || errno == EINTR;
    first = (first + (size_t)n) % SIZE;
    used -= (size_t)n;
    return 1;
}

int main(int argc, char **argv)
{
    if (argc < 3 || argc > 5) {
        fputs("usage: telemetry_server DEVICE PORT [ADDRESS [UIO]]\n", stderr);
        return 2;
    }
    int device = strcmp(argv[1], "-") ? open(argv[1], O_RDONLY) : STDIN_FILENO;
    if (device < 0)
        quit(argv[1]);
    if (argc == 5)
        map_registers(argv[4]);
    signal(SIGPIPE, SIG_IGN);
    int server = listening(argc > 3 ? argv[3] : "127.0.0.1", atoi(argv[2])), client = -1, more = 1;
    while (more || (client >= 0 && used)) {
        struct pollfd list[] = {{more ? device : -1, POLLIN, 0},
                                {client < 0 ? server : client, client < 0 ? POLLIN : used ? POLLOUT : 0, 0}};
        if (poll(list, 2, -1) < 0 && errno != EINTR)
            quit("poll");
        if (client < 0 && list[1].revents & POLLIN) {
            client = accept(server, NULL, NULL);
            if (client >= 0)
                fcntl(client, F_SETFL, O_NONBLOCK);
            first = used = 0; /* a new client begins with a whole packet of now */
        } else if (client >= 0 && list[1].revents && (list[1].revents & (POLLERR | POLLHUP) || !give(client))) {
            close(client);
            client = -1;
        }
        for (int k = 0; k < 256 && list[0].revents; k++) {
            if (!(more = take(device, client >= 0)))
                break;
            struct pollfd again = {device, POLLIN, 0};
            if (poll(&again, 1, 0) <= 0)
                break;
        }
    }
    return 0;
}
