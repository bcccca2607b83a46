// SPDX-License-Identifier: BSD-3-Clause
// Drives one mutated block with the schedule of its bench and looks for the first difference.
//
// scripts/mutate/harness.py writes ports.inc with a line PORT(name, width, is_signed) for each port but the control
// input, `mutant`, which selects one of the mutations in the netlist; 0 is none.  Rows are clock, port, value, sorted
// by clock; a port is named by its line number, from 0.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>

#include "Vcore.h"
#include "verilated.h"

namespace {

struct Row {
    int64_t clock, port, value;
};

struct Port {
    void* at;
    int bytes, width;
    bool is_signed;

    int64_t get() const {
        uint64_t raw = 0;
        std::memcpy(&raw, at, bytes);
        const int unused = 64 - width;
        const uint64_t left = raw << unused;
        return is_signed ? static_cast<int64_t>(left) >> unused : static_cast<int64_t>(left >> unused);
    }

    void set(int64_t value) const {
        const uint64_t bits = static_cast<uint64_t>(value) & (~uint64_t{0} >> (64 - width));
        std::memcpy(at, &bits, bytes);
    }
};

constexpr int PORTS = sizeof(
#define PORT(name, width, is_signed) "x"
#include "ports.inc"
#undef PORT
                          "") - 1;

}  // namespace

extern "C" {

// The first clock before whose edge a port differs from `checks`, or a port of `kept` has moved at a clock of `still`;
// -1 where there is none.  `before` ticks come first.  Registers without a reset start at random, as `seed` has it.
int64_t judge(int64_t mutant, int seed, int64_t before, int64_t clocks, const Row* writes, int64_t write_count,
              const Row* checks, int64_t check_count, const int64_t* still, int64_t still_count, const int64_t* kept,
              int64_t kept_count) {
    VerilatedContext context;
    context.randReset(2);
    context.randSeed(seed);
    const auto top = std::make_unique<Vcore>(&context, "core");
    const Port ports[PORTS] = {
#define PORT(name, width, is_signed) {&top->name, sizeof(top->name), width, is_signed != 0},
#include "ports.inc"
#undef PORT
    };
    for (const Port& port : ports) port.set(0);
    top->mutant = mutant;
    top->eval();
    const auto tick = [&] {
        top->CORE_CLOCK = 1;
        top->eval();
        top->CORE_CLOCK = 0;
        top->eval();
    };
    const Row* const last_write = writes + write_count;
    const Row* const last_check = checks + check_count;
    const int64_t* const last_still = still + still_count;
    int64_t held[PORTS], now[PORTS];
    for (int64_t clock = -before; clock < clocks; ++clock) {
        for (; checks != last_check && checks->clock == clock; ++checks)
            if (ports[checks->port].get() != checks->value) return clock;
        if (still_count) {
            for (int64_t k = 0; k < kept_count; ++k) now[k] = ports[kept[k]].get();
            if (still != last_still && *still == clock) {
                ++still;
                if (!std::equal(now, now + kept_count, held)) return clock;
            }
            std::copy(now, now + kept_count, held);
        }
        for (; writes != last_write && writes->clock == clock; ++writes) ports[writes->port].set(writes->value);
#ifdef CORE_HAS_ASYNC
        top->eval();  // what acts without a clock has acted before its edge
#endif
        tick();
    }
    return -1;
}
}
