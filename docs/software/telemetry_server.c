// SPDX-License-Identifier: BSD-3-Clause
/* Sends the telemetry that a DMA driver hands out (a character device, a FIFO, a file, - for stdin) to one client after the
 * other: `fluxproof watch tcp://HOST:PORT`.  The device is read whether somebody listens or not, so that the DMA never
 * waits; where the client is too slow, whole packets are left out, and their numbers show it.
 *
 *   cc -O2 -Wall -Wextra docs/software/telemetry_server.c -o telemetry_server
 *   ./telemetry_server /dev/fluxproof_dma 5555               loopback only: reach it through ssh -L
 *   ./telemetry_server /dev/fluxproof_dma 5555 192.168.1.10  at this address: whoever reaches it can read
 */

#define _POSIX_C_SOURCE 200809L

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { PACKET = 96, PACKETS = 40000, SIZE = PACKET * PACKETS }; /* two seconds at 20 kHz */

static unsigned char queue[SIZE];
static size_t first, used; /* bytes; ``first + used`` is a packet's begin whenever no packet is cut */
static unsigned char packet[PACKET];
static size_t got; /* bytes of ``packet`` */

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

/* One packet into the queue, or none of it. */
static void keep(void)
{
    if (used + PACKET > SIZE)
        return;
    for (size_t k = 0; k < PACKET; k++)
        queue[(first + used + k) % SIZE] = packet[k];
    used += PACKET;
}

/* What the device has; 0 at its end. */
static int take(int device, int wanted)
{
    ssize_t n = read(device, packet + got, PACKET - got);
    if (n < 0)
        return errno == EAGAIN || errno == EINTR;
    got += (size_t)n;
    if (got == PACKET) {
        if (wanted)
            keep();
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
    if (argc != 3 && argc != 4) {
        fputs("usage: telemetry_server DEVICE PORT [ADDRESS]\n", stderr);
        return 2;
    }
    int device = strcmp(argv[1], "-") ? open(argv[1], O_RDONLY) : STDIN_FILENO;
    if (device < 0)
        quit(argv[1]);
    signal(SIGPIPE, SIG_IGN);
    int server = listening(argc == 4 ? argv[3] : "127.0.0.1", atoi(argv[2])), client = -1, more = 1;
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
