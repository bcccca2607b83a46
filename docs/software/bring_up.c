// SPDX-License-Identifier: BSD-3-Clause
/* Brings a drive up over its registers: is it the right core, load the drive, check, find the index, enable, ramp the speed or the
 * torque current up and down, read back, stop.  The gates are off before it starts and, whatever goes wrong, when it
 * ends: signals and a bus error included.  What cannot be caught (SIGKILL, a host that hangs) only a heartbeat ends:
 * [protection] heartbeat_s.  With an A/B/Z encoder it first looks for the index: the shaft turns.
 *
 *   fluxproof registers drive.toml --format c > drive_registers.h
 *   cc -Wall -Wextra -I docs/software -I . docs/software/bring_up.c docs/software/bus_uio.c -lm -o bring_up
 *   ./bring_up 300             speed mode: speed in rpm
 *   ./bring_up 0.5 A 200       torque mode: current i_q in A, and the speed in rpm at which it gives up
 *   ./bring_up 1.2 Nm 200      torque mode in Nm: by the torque table, else by i_q of the magnets' flux linkage
 */

#define _POSIX_C_SOURCE 200809L

#include "fluxproof_bus.h"
#include "fluxproof_registers.h" /* generated with the core: addresses of the registers */
#include "drive_registers.h"     /* generated from your drive.toml: their values */

#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))
#define COUNT(list) (sizeof(list) / sizeof(list)[0])

enum { STEPS = 20, STEP_US = 10000, SETTLE_STEPS = 20 };

static const double PI = 3.14159265358979;

static volatile sig_atomic_t asked_to_stop; /* the number of the signal */

/* ------------------------------------------------------------------ small helpers */

static bool ours; /* the core is the one that this program was compiled for */

/* The gates off; then the encoder's own angle again, with every fault of the front ends, whoever left them otherwise. */
static bool rest(void)
{
    bool done = bus_write(AT(enable), 0);
    if (!ours)
        return done;
#ifdef FLUXPROOF_ENCODER
    done = bus_write(AT(forced_rate), 0) && done;
    done = bus_write(AT(position_source), 0) && done;
    done = bus_write(AT(board_ignore), 0) && done;
#endif
    return done;
}

/* Turn the gates off before printing the message. */
static void fail(const char *format, ...)
{
    rest();
    va_list arguments;
    va_start(arguments, format);
    fputs("bring_up: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(1);
}

/* Ctrl-C, Ctrl-\, SIGTERM or a terminal that is closed: noticed at the next access, so that none is cut in half. */
static void note_signal(int number)
{
    asked_to_stop = number;
}

/* A bus error or a fault of the program leaves no way back: gates off here.  A second one ends the process. */
static void on_error(int number)
{
    static const char bus[] = "bring_up: bus error, gates off\n", other[] = "bring_up: a fault of the program, gates off\n";
    bus_write(AT(enable), 0);
    if (write(STDERR_FILENO, number == SIGBUS ? bus : other, number == SIGBUS ? sizeof bus - 1 : sizeof other - 1) < 0)
        _exit(2);
    _exit(1);
}

static void catch_signals(void)
{
    const int stops[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT}, errors[] = {SIGBUS, SIGSEGV, SIGFPE, SIGILL, SIGABRT};
    struct sigaction stop = {.sa_handler = note_signal}, error = {.sa_handler = on_error};
    stop.sa_flags = SA_RESTART;
    error.sa_flags = SA_RESETHAND | SA_NODEFER;
    for (size_t k = 0; k < COUNT(stops); k++)
        sigaction(stops[k], &stop, NULL);
    for (size_t k = 0; k < COUNT(errors); k++)
        sigaction(errors[k], &error, NULL);
    signal(SIGPIPE, SIG_IGN); /* `| head` closes the output, which is no reason to leave the motor running */
}

static void heed_signals(void)
{
    if (asked_to_stop)
        fail("stopped by signal %d, gates off", (int)asked_to_stop);
}

static void put(uint32_t offset, uint32_t value)
{
    heed_signals();
    if (!bus_write(offset, value))
        fail("the core refused 0x%08x at 0x%03x", (unsigned)value, (unsigned)offset);
}

static uint32_t get(uint32_t offset)
{
    uint32_t value;
    heed_signals();
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

/* Waits, and writes ``value`` again so often that the core's heartbeat (register heartbeat, in sample times; 0: none)
 * does not end: a third of it apart.  Without writes the core trips with host_lost. */
static void wait_writing(uint32_t microseconds, uint32_t offset, uint32_t value)
{
    double third = get(AT(heartbeat)) * FLUXPROOF_BASE_SAMPLE_TIME_S * 1e6 / 3.0;
    uint32_t most = third > 0.0 && third < microseconds ? (uint32_t)fmax(third, 1.0) : microseconds;
    for (uint32_t left = microseconds; left > 0;) {
        uint32_t part = most < left ? most : left;
        wait_us(part);
        put(offset, value);
        left -= part;
    }
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

/* The register values were calculated for these widths, this carrier and this clock: at another clock the PWM frequency
 * and the dead time would be others. */
static void check_generics(void)
{
    const struct {
        const char *name;
        uint32_t offset, wanted;
    } list[] = {
        {"ADC_BITS", AT(adc_bits), FLUXPROOF_ADC_BITS},
        {"POSITION_BITS", AT(position_bits), FLUXPROOF_POSITION_BITS},
        {"CARRIER_HALF", AT(carrier_half), FLUXPROOF_CARRIER_HALF},
        {"CLOCK_HZ", AT(clock_hz), FLUXPROOF_CLOCK_HZ},
        {"ESTIMATORS", AT(estimators), FLUXPROOF_ESTIMATORS},
#ifdef FLUXPROOF_TORQUE_TABLE
        {"REFERENCES", AT(references), 1},
#endif
        {"POSITION_LOOP", AT(position_loop), FLUXPROOF_POSITION_LOOP},
#if FLUXPROOF_RESIDUAL
        {"RESIDUAL", AT(residual), 1},
#endif
#if FLUXPROOF_MODES
        {"MODES", AT(modes), 1},
#endif
#if FLUXPROOF_GEARING
        {"GEARING", AT(gearing), 1},
#endif
#ifdef FLUXPROOF_ENCODER /* the drive file has front ends: the core must be a fluxproof_board with them */
        {"ENCODER", AT(encoder), FLUXPROOF_ENCODER},
        {"CURRENTS", AT(currents), FLUXPROOF_CURRENTS},
        {"SPI_LINES", AT(spi_lines), FLUXPROOF_SPI_LINES},
#if FLUXPROOF_MASTER
        {"MASTER", AT(master), 1},
#endif
#endif
    };
    for (size_t k = 0; k < COUNT(list); k++) {
        uint32_t got = get(list[k].offset);
        if (got != list[k].wanted)
            fail("the core has %s = %u, drive_registers.h is for %u", list[k].name, (unsigned)got,
                 (unsigned)list[k].wanted);
    }
}

static void load_drive(bool speed_mode)
{
    ours = true;
    if (!rest())
        fail("the core refused to be put to rest");
    put(AT(omega_ref), 0);
    put(AT(i_d_ref), 0);
    put(AT(i_q_ext), 0);
    put(AT(speed_mode), speed_mode);
#ifdef FLUXPROOF_TORQUE_TABLE /* [core] references = true: i_q_ext is a torque per FLUXPROOF_BASE_TORQUE_NM */
    for (size_t k = 0; k < COUNT(fluxproof_torque_table); k++)
        put(AT(table_word), fluxproof_torque_table[k]);
#endif
    for (size_t k = 0; k < COUNT(fluxproof_settings); k++)
        put(fluxproof_settings[k].offset, (uint32_t)fluxproof_settings[k].value);
    for (size_t k = 0; k < COUNT(fluxproof_settings); k++) {
        uint32_t got = get(fluxproof_settings[k].offset);
        if (got != (uint32_t)fluxproof_settings[k].value)
            fail("0x%03x holds 0x%08x, wanted 0x%08x", (unsigned)fluxproof_settings[k].offset, (unsigned)got,
                 (unsigned)fluxproof_settings[k].value);
    }
    printf("%u registers loaded and read back\n", (unsigned)COUNT(fluxproof_settings));
}

/* With the gates off: check settings and sensors, clear old faults. */
static void check_at_rest(void)
{
    wait_us(1000);
    if (flag(FLUXPROOF__FLAGS__SETTING_REFUSED_bm))
        fail("dead_time and min_pulse contradict each other");
    if (flag(FLUXPROOF__FLAGS__CURRENT_AT_RAIL_bm))
        fail("a current code is at its end: is the converter connected?");
    if (flag(FLUXPROOF__FLAGS__U_DC_LOW_bm))
        fail("no bus voltage");
    if (flag(FLUXPROOF__FLAGS__TRIPPED_bm)) /* whoever starts this in a loop sees what it clears */
        printf("tripped before by first_fault 0x%02x, cleared\n", (unsigned)get(AT(first_fault)));
    put(AT(clear_trip), 1);
    put(AT(clear_faults), 1);
    wait_us(1000);
    if (flag(FLUXPROOF__FLAGS__TRIPPED_bm))
        fail("tripped, and the cause is still there: fault_flags 0x%03x", (unsigned)get(AT(fault_flags)));
    printf("bus %.1f V\n", get(AT(u_dc)) / 65536.0 * FLUXPROOF_BASE_VOLTAGE_V);
}

/* The zero of the current sensors is judged over 64 samples with the gates off. */
static void enable_gates(void)
{
    wait_writing((uint32_t)(1 + 66 * 2e6 * get(AT(carrier_half)) / get(AT(clock_hz))), AT(enable), 0);
    put(AT(enable), 1);
    /* the gates go on at a valley; the bootstraps charge first */
    wait_writing((uint32_t)(1000 + 2e6 * get(AT(charge_samples)) * get(AT(carrier_half)) / get(AT(clock_hz))), AT(enable), 1);
    if (!flag(FLUXPROOF__FLAGS__RUNNING_bm))
        fail("gates do not start: flags 0x%04x, first_fault 0x%02x", (unsigned)get(AT(flags)),
             (unsigned)get(AT(first_fault)));
}

/* Mechanical speed in rpm from and to the core's per unit of electrical speed. */
static double rpm_per_unit(void)
{
    return FLUXPROOF_BASE_OMEGA_ME_RAD_S / FLUXPROOF_POLE_PAIRS * 30.0 / PI / 65536.0;
}

static double speed_rpm(void)
{
    return get_signed(AT(omega_me)) * rpm_per_unit();
}

static double current_a(uint32_t offset)
{
    return get_signed(offset) / 65536.0 * FLUXPROOF_BASE_CURRENT_A;
}

static void check_running(double most_rpm)
{
    if (flag(FLUXPROOF__FLAGS__TRIPPED_bm))
        fail("tripped at %.0f rpm: first_fault 0x%02x", speed_rpm(), (unsigned)get(AT(first_fault)));
    if (fabs(speed_rpm()) > most_rpm)
        fail("%.0f rpm, %.0f allowed", speed_rpm(), most_rpm);
}

/* A reference in steps from one value to another, then some time at it; lsb: value of one in the register. */
static void ramp(uint32_t reference, double lsb, double from, double to, double most_rpm)
{
    for (int k = 1; k <= STEPS + SETTLE_STEPS; k++) {
        double part = k < STEPS ? (double)k / STEPS : 1.0;
        uint32_t value = (uint32_t)(int32_t)lround((from + (to - from) * part) / lsb);
        put(reference, value);
        wait_writing(STEP_US, reference, value);
        check_running(most_rpm);
    }
}

static void turn_at(double rpm)
{
    double lsb = rpm_per_unit();
    ramp(AT(omega_ref), lsb, 0.0, rpm, HUGE_VAL);
    double reached = speed_rpm();
    printf("%.0f rpm wanted, %.1f rpm measured, i_d %.2f A, i_q %.2f A\n", rpm, reached, current_a(AT(i_d)),
           current_a(AT(i_q)));
    if (fabs(reached - rpm) > 0.02 * fabs(rpm) + 5.0)
        fail("%.1f rpm instead of %.0f", reached, rpm);
    ramp(AT(omega_ref), lsb, rpm, 0.0, HUGE_VAL);
}

static double torque_nm(void)
{
    return get_signed(AT(torque)) / 65536.0 * FLUXPROOF_BASE_TORQUE_NM;
}

/* Newton metres of one in i_q_ext: of the torque with the table, of i_q and the magnets without it. */
static double nm_per_lsb(void)
{
    if (get(AT(use_table)))
        return FLUXPROOF_BASE_TORQUE_NM / 65536.0;
    double flux_wb = get_signed(AT(lambda_mg)) / 65536.0 * FLUXPROOF_BASE_FLUX_WB;
    if (flux_wb <= 0.0)
        fail("a torque needs the torque table or magnets: lambda_mg is zero");
    return 1.5 * get(AT(pole_pairs)) * flux_wb * FLUXPROOF_BASE_CURRENT_A / 65536.0;
}

static void push_by(double torque, double most_rpm)
{
    double lsb = nm_per_lsb();
    if (fabs(torque / lsb) > 131071.0)
        fail("%.3g Nm is out of range: allowed is +-%.3g Nm", torque, 131071.0 * lsb);
    ramp(AT(i_q_ext), lsb, 0.0, torque, most_rpm);
    double reached = torque_nm();
    printf("%.3f Nm wanted, %.3f Nm estimated, i_d %.2f A, i_q %.2f A, %.1f rpm\n", torque, reached, current_a(AT(i_d)),
           current_a(AT(i_q)), speed_rpm());
    if (fabs(reached - torque) > 0.1 * fabs(torque) + 0.01 * FLUXPROOF_BASE_TORQUE_NM)
        fail("%.3f Nm instead of %.3f", reached, torque);
    ramp(AT(i_q_ext), lsb, torque, 0.0, most_rpm);
}

static void push_with(double current, double most_rpm)
{
    double lsb = FLUXPROOF_BASE_CURRENT_A / 65536.0;
    put(AT(use_table), 0); /* with the table i_q_ext would be a torque */
    ramp(AT(i_q_ext), lsb, 0.0, current, most_rpm);
    double reached = current_a(AT(i_q));
    printf("%.2f A wanted, i_q %.2f A measured, %.1f rpm, torque %.3f Nm\n", current, reached, speed_rpm(),
           torque_nm());
    if (fabs(reached - current) > 0.1 * fabs(current) + 0.01 * FLUXPROOF_BASE_CURRENT_A)
        fail("i_q is %.2f A instead of %.2f", reached, current);
    ramp(AT(i_q_ext), lsb, current, 0.0, most_rpm);
}

#if defined(FLUXPROOF_ENCODER) && (FLUXPROOF_ENCODER == 1 || FLUXPROOF_ENCODER == 3)
/* An A/B/Z encoder knows its angle when it has passed its index and met it again (index_once = 1: at the first pass);
 * before, the gates are off by no_index.  A field that the host turns takes the rotor there, with 0.6 of the current
 * limit: a turn of the shaft in 0.8 s, at most 6 electrical turns a second. */
static void find_index(void)
{
    if (get(AT(encoder_flags)) & 1)
        return;
    uint32_t most = get(AT(i_max)) * 6 / 10;
    double turn_s = fmax(0.8, get(AT(pole_pairs)) / 6.0), turns = get(AT(index_once)) ? 1.2 : 2.2;
    uint32_t mode = get(AT(speed_mode)), table = get(AT(use_table));
    put(AT(speed_mode), 0);
    put(AT(use_table), 0); /* with the table i_d_ref is not read */
    put(AT(forced_angle), 0);
    put(AT(forced_rate), 0);
    put(AT(position_source), 1);
    enable_gates();
    ramp(AT(i_d_ref), 1.0, 0.0, most, HUGE_VAL);
    put(AT(forced_rate), (uint32_t)lround(4294967296.0 * FLUXPROOF_BASE_SAMPLE_TIME_S / turn_s));
    bool found = false;
    for (int k = 0; k < turns * turn_s * 1e6 / STEP_US && !found; k++) {
        wait_writing(STEP_US, AT(i_d_ref), most);
        check_running(HUGE_VAL);
        found = get(AT(encoder_flags)) & 1;
    }
    put(AT(enable), 0);
    put(AT(i_d_ref), 0);
    put(AT(forced_rate), 0);
    put(AT(position_source), 0);
    put(AT(speed_mode), mode);
    put(AT(use_table), table);
    if (!found)
        fail("no index in %.1f turns, or not twice at the same place: check the line Z and index_phase", turns);
    printf("index found\n");
}
#else
static void find_index(void)
{
}
#endif

static void stop(void)
{
    put(AT(enable), 0);
    wait_us(1000);
    if (flag(FLUXPROOF__FLAGS__RUNNING_bm))
        fail("gates still switch after enable = 0");
    puts("stopped, gates off");
}

int main(int argc, char **argv)
{
    setvbuf(stdout, NULL, _IOLBF, 0);
    bool by_torque = argc > 2 && strcmp(argv[2], "Nm") == 0;
    bool torque_mode = by_torque || (argc > 2 && strcmp(argv[2], "A") == 0);
    if (argc > 2 && (!torque_mode || argc != 4)) {
        fputs("usage: bring_up [RPM], bring_up CURRENT A MOST_RPM, or bring_up TORQUE Nm MOST_RPM\n", stderr);
        return 2;
    }
    catch_signals();
    identify();
    check_generics();
    load_drive(!torque_mode);
    check_at_rest();
    find_index();
    enable_gates();
    if (by_torque)
        push_by(atof(argv[1]), atof(argv[3]));
    else if (torque_mode)
        push_with(atof(argv[1]), atof(argv[3]));
    else
        turn_at(argc > 1 ? atof(argv[1]) : 300.0);
    stop();
    return 0;
}
