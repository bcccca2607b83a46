# SPDX-License-Identifier: BSD-3-Clause
"""Input of delta-sigma modulators and the fast overcurrent filter; the bench shows that their RTL is the same.

The models of the modulators are not derived from the blocks.
"""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from cocotb_tests.support.peripherals.converter_model import modulate
from golden_model.converters import modulator_input, sinc_overcurrent

VALID, HOLD = 3, 1  # clocks: a bit is on the line so long after the edge that launches it, the one before stays so long


def received(ratio: int, sample_delay: int, follow: int, count: int) -> tuple[list[int], list[int]]:
    """(bits sent, bits received): a modulator launches a bit at each rising edge, the line is random meanwhile."""
    rng = Random(ratio * 31 + sample_delay)
    state, sent, got = modulator_input.State(), [0], []
    was, moved, clock_pin = 0, -100, 0
    for now in range(count * ratio):
        if follow:  # the modulator's own clock
            clock_pin = int(now % ratio < ratio // 2)
        if clock_pin and not was:
            sent.append(rng.getrandbits(1))
            moved = now
        was = clock_pin
        age = now - moved + (0 if follow else 1)  # a pin driven by the last clock's register has moved a clock ago
        line = sent[-2] if age <= HOLD and len(sent) > 1 else sent[-1] if age >= VALID else rng.getrandbits(1)
        state, (mod_clock, bits, valid) = modulator_input.step(
            state, line, clock_pin if follow else 0, ratio, sample_delay, follow, 1
        )
        if not follow:
            clock_pin = mod_clock
        if valid:
            got.append(bits)
    return sent, got


@pytest.mark.parametrize("follow", [0, 1])
def test_every_bit_arrives_once(follow):
    """Ratios 4 to 32, each sample_delay within the first period at which the line is stable."""
    tried = 0
    for ratio in range(4, 33):
        # Followed, the data are taken 2 + sample_delay clocks after the edge was seen
        for delay in range(16):
            after = delay + (2 if follow else 0)
            if not VALID <= after <= ratio + HOLD:
                continue
            sent, got = received(ratio, delay, follow, 60)
            start = next(k for k in range(4) if got[:40] == sent[k : k + 40])
            assert got[:50] == sent[start : start + 50]
            tried += 1
    assert tried > 150


@pytest.mark.parametrize("oversampling", [8, 11, 16, 32])
def test_overcurrent_total_is_the_filter(oversampling):
    """Every total is the weighted sum of the last bits, 0 to oversampling**3."""
    rng = np.random.default_rng(oversampling)
    box = np.ones(oversampling, np.int64)
    weights = np.convolve(np.convolve(box, box), box)
    bits = (rng.random(80 * oversampling) < np.repeat(rng.random(80), oversampling)).astype(int)
    bits[: 6 * oversampling] = 1
    full = oversampling**3
    state, seen = sinc_overcurrent.State(), []
    for n, bit in enumerate(np.repeat(bits, 2)):  # a bit every second clock
        state, (over, total, valid) = sinc_overcurrent.step(
            state, bit, 1 - n % 2, oversampling, full * 3 // 4, full // 4
        )
        if valid:
            seen.append((total, over))
    wanted = [weights @ bits[k : k + weights.size] for k in range(0, bits.size - weights.size, oversampling)]
    assert [t for t, _ in seen[3:]] == wanted[: len(seen) - 3] and wanted[0] == full
    assert [o for _, o in seen[3:]] == [int(t >= full * 3 // 4 or t <= full // 4) for t in wanted[: len(seen) - 3]]
    assert not any(o for _, o in seen[:3])


@pytest.mark.parametrize("oversampling", [8, 16, 32])
def test_overcurrent_trips_in_time_and_not_by_noise(oversampling):
    """A modulated current just below the limit never trips; a step beyond it trips within four filter lengths."""
    full, step_at, bits = oversampling**3, 4000, 6000
    u = np.full(bits, 0.55)
    u[step_at:] = 0.85
    stream = modulate(u)
    limit = round(full * (1 + 0.7) / 2)
    state, tripped = sinc_overcurrent.State(), None
    for n, bit in enumerate(stream):
        for valid in (1, 0, 0, 0, 0):  # every fifth clock
            state, (over, _, _) = sinc_overcurrent.step(state, int(bit), valid, oversampling, limit, full - limit)
        if over and tripped is None:
            tripped = n
    assert tripped is not None and step_at < tripped <= step_at + 4 * oversampling


def below_theory(amplitude: float, oversampling: int = 64) -> tuple[float, float, float]:
    """Of a sine against a white error of variance 1/3: bits lost in all, variance of the error, part of overload.

    e = v - w is the error of the one-bit quantiser; v - u = (1 - z**-1)**2 e gives it from the bits alone.
    """
    u = amplitude * np.sin(2.0 * np.pi * np.arange(1 << 17) * 7.13 / (oversampling * 997) + 0.3)
    shaped = 2.0 * modulate(u) - 1.0 - u
    e = np.cumsum(np.cumsum(shaped))
    box = np.ones(oversampling) / oversampling
    weights = np.convolve(np.convolve(box, box), box)
    out = np.convolve(shaped, weights, "valid")[::oversampling]
    white = np.sum(np.convolve(weights, [1.0, -2.0, 1.0]) ** 2)
    return 0.5 * np.log2(out.var() / (white / 3.0)), e.var(), np.mean(np.abs(e) > 1.0)


def test_the_modulator_and_not_the_filter_loses_bits_near_overload():
    """The filter here is exact, and bits are missing all the same: the error grows and has colour."""
    lost = {}
    for amplitude in (0.2, 0.35, 0.5, 0.7):
        in_all, variance, overload = below_theory(amplitude)
        by_variance = 0.5 * np.log2(3.0 * variance)
        print(
            f"{amplitude}: |w| > 2 {100 * overload:.0f} %, variance {variance:.2f}, {in_all:.2f} bit below theory, "
            f"{by_variance:.2f} by the variance, {in_all - by_variance:.2f} by colour"
        )
        lost[amplitude] = in_all, by_variance
        assert 0.0 <= in_all - by_variance < 0.3
    assert 0.05 < lost[0.2][0] < 0.3 < lost[0.5][0] < 0.65 < lost[0.7][0] < 1.0
    assert lost[0.5][1] > 0.3
