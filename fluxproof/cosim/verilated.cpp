// SPDX-License-Identifier: BSD-3-Clause
// The converted core behind a C interface, so that Python can run millions of clocks per second.
//
// One source for every set of generics: cosim/verilator.py writes ports.inc with a line
//     PORT(name, width, is_signed)
// for each port of the top, and defines CORE_CLOCK, the name of its clock, CORE_HAS_GATES where it has gates,
// CORE_TAKES_SAMPLES where a sample comes from outside (a single block has neither), CORE_SHOWS_VALIDS where it has
// duty_valid and values_valid, and CORE_SLEEPS, CORE_HAS_WITNESS for a text of sleeping.py.  Functions name a port by its
// line number, from 0.
//
// A tick is one rising edge of the clock: inputs set before it are seen by it, outputs read after it are what the
// registers hold from this edge on.

#include <cstdint>
#include <memory>

#include "Vcore.h"
#include "verilated.h"

namespace {

// Where Verilator keeps one port: an unsigned integer of `bytes` bytes, of which `width` bits are used.
struct Port {
    void* at;
    int bytes;
    int width;
    bool is_signed;

    uint64_t raw() const {
        switch (bytes) {
            case 1: return *static_cast<const uint8_t*>(at);
            case 2: return *static_cast<const uint16_t*>(at);
            case 4: return *static_cast<const uint32_t*>(at);
            default: return *static_cast<const uint64_t*>(at);
        }
    }

    int64_t get() const {
        const int unused = 64 - width;
        const uint64_t left = raw() << unused;
        return is_signed ? static_cast<int64_t>(left) >> unused : static_cast<int64_t>(left >> unused);
    }

    void set(int64_t value) const {
        const uint64_t bits = static_cast<uint64_t>(value) & (~uint64_t{0} >> (64 - width));
        switch (bytes) {
            case 1: *static_cast<uint8_t*>(at) = static_cast<uint8_t>(bits); break;
            case 2: *static_cast<uint16_t*>(at) = static_cast<uint16_t>(bits); break;
            case 4: *static_cast<uint32_t*>(at) = static_cast<uint32_t>(bits); break;
            default: *static_cast<uint64_t*>(at) = bits; break;
        }
    }
};

struct Core {
    VerilatedContext context;
    Vcore top{&context, "core"};
    int64_t clock = 0;       // ticks since construction
    int64_t missed = 0;      // of them with a register that changed while it would have slept
    uint8_t reported = 0;    // gate word that the last run_period ended with
    const Port ports[sizeof(
#define PORT(name, width, is_signed) "x"
#include "ports.inc"
#undef PORT
        "") - 1] = {
#define PORT(name, width, is_signed) {&top.name, sizeof(top.name), width, is_signed != 0},
#include "ports.inc"
#undef PORT
    };

    Core() {
        for (const Port& port : ports) port.set(0);
        top.eval();
    }

    ~Core() { top.final(); }

    // An input that is set wakes what sleeps between samples.
    void wake() {
#ifdef CORE_SLEEPS
        top.core_wakes = 1;
#endif
    }

    void set(int port, int64_t value) {
        ports[port].set(value);
        wake();
    }

    void tick() {
        top.CORE_CLOCK = 1;
        top.eval();
        top.CORE_CLOCK = 0;
#ifdef CORE_SLEEPS
        top.core_wakes = 0;
#endif
        top.eval();
        ++clock;
#ifdef CORE_HAS_WITNESS
        missed += top.core_missed;
#endif
    }

    // Bits 0..2: upper gates of legs a, b, c; bits 3..5: lower gates.
#ifdef CORE_HAS_GATES
    uint8_t gate_word() const { return static_cast<uint8_t>(top.gate_high | top.gate_low << 3); }
#endif
};

}  // namespace

extern "C" {

Core* core_new() { return new Core; }

void core_delete(Core* core) { delete core; }

int64_t core_clock(const Core* core) { return core->clock; }

int64_t core_missed(const Core* core) { return core->missed; }

void core_set(Core* core, int port, int64_t value) { core->set(port, value); }

int64_t core_get(const Core* core, int port) { return core->ports[port].get(); }

void core_eval(Core* core) { core->top.eval(); }

void core_tick(Core* core, int64_t ticks) {
    for (int64_t k = 0; k < ticks; ++k) core->tick();
}

// Ticks until `port` is not zero, at least once; the number of ticks, or -1 after `most` without success.
int64_t core_until(Core* core, int port, int64_t most) {
    for (int64_t k = 1; k <= most; ++k) {
        core->tick();
        if (core->ports[port].raw() != 0) return k;
    }
    return -1;
}

// values[k][j] is ports[j] after tick k; `ticks` rows.
void core_trace(Core* core, int64_t ticks, const int32_t* ports, int64_t count, int64_t* values) {
    for (int64_t k = 0; k < ticks; ++k) {
        core->tick();
        for (int64_t j = 0; j < count; ++j) *values++ = core->ports[ports[j]].get();
    }
}

// Before tick k, drives given[j] with inputs[k][j]; values[k][j] is seen[j] after it; `ticks` rows of each.
void core_play(Core* core, int64_t ticks, const int32_t* given, int64_t inputs_count, const int64_t* inputs,
               const int32_t* seen, int64_t count, int64_t* values) {
    for (int64_t k = 0; k < ticks; ++k) {
        for (int64_t j = 0; j < inputs_count; ++j) core->set(given[j], *inputs++);
        core->tick();
        for (int64_t j = 0; j < count; ++j) *values++ = core->ports[seen[j]].get();
    }
}

void core_read(const Core* core, const int32_t* ports, int64_t count, int64_t* values) {
    for (int64_t j = 0; j < count; ++j) values[j] = core->ports[ports[j]].get();
}

// Ticks until sample_trigger is high again, at most `most` times; returns the ticks made.  The tick with number
// `sample_at` sees sample_valid high (none does if that is never reached).  clocks[] and words[] take at
// most `most` + 1 entries: the number of the tick after which the gate word was new, and that word; number 0
// means that it had changed before, since the last call.  facts: entries written; the tick after which
// duty_valid was high, and values_valid (0: none); `running` as the tick `sample_at` finds it.
// A top without gates makes no period: -1.
int64_t core_run_period(Core* core, int64_t most, int64_t sample_at, int32_t* clocks, uint8_t* words,
                        int64_t* facts) {
#ifndef CORE_HAS_GATES
    return -1;
#else
    Vcore& top = core->top;
    int64_t found = 0;
    const auto look = [&](int64_t k) {
        const uint8_t word = core->gate_word();
        if (word == core->reported) return;
        clocks[found] = static_cast<int32_t>(k);
        words[found++] = word;
        core->reported = word;
    };
    look(0);
    int64_t k = 0;
    facts[1] = facts[2] = facts[3] = 0;
    while (k < most) {
        ++k;
#ifdef CORE_TAKES_SAMPLES
        if (k == sample_at) core->wake();
        top.sample_valid = k == sample_at;
#endif
#ifdef CORE_SHOWS_VALIDS
        if (k == sample_at) facts[3] = top.running;
#endif
        core->tick();
        look(k);
#ifdef CORE_SHOWS_VALIDS
        if (top.duty_valid) facts[1] = k;
        if (top.values_valid) facts[2] = k;
#endif
        if (top.sample_trigger) break;
    }
#ifdef CORE_TAKES_SAMPLES
    top.sample_valid = 0;
#endif
    facts[0] = found;
    return k;
#endif
}

}  // extern "C"
