# SPDX-License-Identifier: BSD-3-Clause
"""What the motor does beside its description: the flux that a sample should show, and the one that it shows.

    lambda    = e^(j theta) (model_d + j model_q)                 flux of the described motor at the measured current
    u         = u_applied - residual_leg s                        voltage at the motor, by the described loss of a leg
    carried   = lambda + t_s u - rho i                            flux integrated to the next sample
    e         = e^(-j theta) (lambda - (carried of the last sample - rho i))      the residual: of voltage times t_s
    sixth     = e e^(j 6 theta)                                   order -6 of the rotor, -5 of the stator
    power     = |e|**2
    mean     += (x - mean)/128 of e, sixth, power and |i_a + i_b + i_c|
    moved     = |i| >= residual_light and |omega_me| >= residual_slow
    over      = moved and |mean of e| > residual_min + residual_w |omega_me| + residual_i |i|
                or mean of |sum| > residual_sum_max + residual_sum_i |i|

Divided by L, e is measured minus predicted current.  Flux and leg loss are those of the drive's data alone, so no
estimator that follows the motor hides a fault; s are the directions of two samples ago, as in clean_voltage.  The
balance over a period is exact for the voltage and takes the mean of the currents at both ends.  Noise of current and
angle cancels in the mean, because what one sample has too much the next one lacks.  The sum of the currents is
predicted as zero; with two sensors it is zero.
``motor_differs`` when ``residual_samples`` more samples were over than not; 0: never.  A sample counts if the voltage
since the last one was known and not at its limit, where a leg that does not switch loses nothing by dead time, and if
no current is at its rail in both; otherwise e is zero and means and counter stay.  While not ``moved`` it is not
certain what a leg loses, or a leg near its zero crossing is the mean: the means of e, sixth and power stay.
``run`` = 0 sets means and counter to zero.  |x| of a vector is the larger component and half the smaller one.

Formats: fluxes S(1,30), rotated ones saturated; carried S(2,30); e S(-3,20), an eighth of the flux base in a sample,
saturated; power U(-4,36), cut; the mean of the sum U(1,20).  Multiples of theta are saturated at 2, which no sine
reaches; the cosines of 2 and 3 theta do not come there for any two numbers up to 1.  Products are rounded half up,
those of the limits cut; means are cut from seven bits below.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.control.current_pi import SAT
from golden_model.control.dead_time_compensation import S_ALPHA, S_BETA
from golden_model.estimators.flux_models import DROP_MODEL, MODEL
from golden_model.estimators.v_dead_adaline import V_LEVEL
from golden_model.estimators.winding_resistance import RHO, T_S
from golden_model.fixed import Format, length, round_half_up, round_sat, saturate, saturate_u
from golden_model.formats import BIT, FLUX, FLUX_STATE, FLUX_STATE_W, FLUX_W, PU, PU_W, SAMPLE_TIME, TRIG, TRIG_ONE
from golden_model.kernel import kernel

RESIDUAL = Format(1, -3, 20)
POWER = Format(0, -4, 36)
SUM = Format(0, 1, 16)
SUM_MEAN = Format(0, 1, 20)
LEAST, OF_OMEGA, OF_I = Format(0, -3, 20), Format(0, -4, 28), Format(0, -6, 30)
SUM_LEAST, SUM_OF_I = Format(0, -2, 20), Format(0, -2, 24)
SAMPLES = Format(0, 12, 0)
SAMPLES_HI, PU_HI = SAMPLES.hi, PU.hi
MEAN = 7  # 2**MEAN samples
RESIDUAL_W, SUM_W = RESIDUAL.width, SUM.width
FOLLOWED, PATIENT = 250, 4000  # samples of the stimuli
DROP_TRIG = TRIG.frac_bits
DROP_TWICE = TRIG.frac_bits - 1
DROP_LAMBDA = FLUX.frac_bits + TRIG.frac_bits - FLUX_STATE.frac_bits
DROP_RHO = PU.frac_bits + RHO.fmt.frac_bits - FLUX_STATE.frac_bits
DROP_LEG = PU.frac_bits + V_LEVEL.frac_bits - FLUX.frac_bits
DROP_U = FLUX.frac_bits + SAMPLE_TIME.frac_bits - FLUX_STATE.frac_bits
DROP_E = FLUX_STATE.frac_bits - RESIDUAL.frac_bits
DROP_POWER = 2 * RESIDUAL.frac_bits - POWER.frac_bits
DROP_OMEGA = PU.frac_bits + OF_OMEGA.frac_bits - LEAST.frac_bits
DROP_I = PU.frac_bits + OF_I.frac_bits - LEAST.frac_bits
DROP_SUM_I = PU.frac_bits + SUM_OF_I.frac_bits - SUM_LEAST.frac_bits
DROP_SUM = MEAN - (SUM_MEAN.frac_bits - SUM.frac_bits)


class State(NamedTuple):
    carried_alpha: int = 0  # S(2,30): integrated to this sample, without its resistive drop
    carried_beta: int = 0
    known: int = 0  # carried is valid
    s_alpha: int = 0
    s_beta: int = 0
    sum_d: int = 0  # 2**MEAN times the mean, likewise those below
    sum_q: int = 0
    sum_sixth_d: int = 0
    sum_sixth_q: int = 0
    sum_power: int = 0
    sum_sum: int = 0
    count: int = 0


@kernel
def balance(carried, lambda_, i, u, rho, t_s):
    """One axis: (flux integrated to the next sample, residual of this one)."""
    drop = round_half_up(rho * i, DROP_RHO)
    error = round_sat(lambda_ + drop - carried, DROP_E, RESIDUAL_W)
    return lambda_ - drop + round_half_up(t_s * u, DROP_U), error


@kernel
def sixth_turn(cos, sin):
    """Cosine and sine of six times the angle, by its double and its triple."""
    cos_2 = round_half_up(cos * cos, DROP_TWICE) - TRIG_ONE
    sin_2 = round_sat(sin * cos, DROP_TWICE, PU_W)
    cos_3 = round_half_up(cos * cos_2 - sin * sin_2, DROP_TRIG)
    sin_3 = round_sat(sin * cos_2 + cos * sin_2, DROP_TRIG, PU_W)
    cos_6 = saturate(round_half_up(cos_3 * cos_3, DROP_TWICE) - TRIG_ONE, PU_W)
    return cos_6, round_sat(sin_3 * cos_3, DROP_TWICE, PU_W)


@kernel
def step(state, inputs, regs):
    x, r, s = inputs, regs, state
    cos, sin = x.cos_theta, x.sin_theta
    flux_d, flux_q = saturate(x.model_d >> DROP_MODEL, FLUX_W), saturate(x.model_q >> DROP_MODEL, FLUX_W)
    lambda_alpha = round_sat(cos * flux_d - sin * flux_q, DROP_LAMBDA, FLUX_STATE_W)
    lambda_beta = round_sat(sin * flux_d + cos * flux_q, DROP_LAMBDA, FLUX_STATE_W)
    u_alpha = saturate(x.u_applied_alpha - round_half_up(s.s_alpha * r.residual_leg, DROP_LEG), FLUX_W)
    u_beta = saturate(x.u_applied_beta - round_half_up(s.s_beta * r.residual_leg, DROP_LEG), FLUX_W)
    carried_alpha, error_alpha = balance(s.carried_alpha, lambda_alpha, x.i_alpha, u_alpha, x.rho, r.t_s)
    carried_beta, error_beta = balance(s.carried_beta, lambda_beta, x.i_beta, u_beta, x.rho, r.t_s)

    sound = 1 if x.current_at_rail == 0 and x.run else 0
    used = s.known and sound
    e_d = round_sat(cos * error_alpha + sin * error_beta, DROP_TRIG, RESIDUAL_W) if used else 0
    e_q = round_sat(cos * error_beta - sin * error_alpha, DROP_TRIG, RESIDUAL_W) if used else 0
    power = (e_d * e_d + e_q * e_q) >> DROP_POWER
    cos_6, sin_6 = sixth_turn(cos, sin)
    sixth_d = round_sat(e_d * cos_6 - e_q * sin_6, DROP_TRIG, RESIDUAL_W)
    sixth_q = round_sat(e_q * cos_6 + e_d * sin_6, DROP_TRIG, RESIDUAL_W)
    total = x.i_a + x.i_b + x.i_c
    total = saturate_u(total if total >= 0 else -1 - total, SUM_W)

    sum_d, sum_q, sum_sixth_d, sum_sixth_q = s.sum_d, s.sum_q, s.sum_sixth_d, s.sum_sixth_q
    sum_power, sum_sum = s.sum_power, s.sum_sum
    current = min(length(x.i_d, x.i_q), PU_HI)
    speed = x.omega_me if x.omega_me >= 0 else -1 - x.omega_me
    moved = current >= r.residual_light and speed >= r.residual_slow
    if used and moved:
        sum_d += e_d - (sum_d >> MEAN)
        sum_q += e_q - (sum_q >> MEAN)
        sum_sixth_d += sixth_d - (sum_sixth_d >> MEAN)
        sum_sixth_q += sixth_q - (sum_sixth_q >> MEAN)
        sum_power += power - (sum_power >> MEAN)
    if used:
        sum_sum += total - (sum_sum >> MEAN)
    if not x.run:
        sum_d = sum_q = sum_sixth_d = sum_sixth_q = sum_power = sum_sum = 0

    most = r.residual_min + ((speed * r.residual_w) >> DROP_OMEGA) + ((current * r.residual_i) >> DROP_I)
    sum_most = r.residual_sum_max + ((current * r.residual_sum_i) >> DROP_SUM_I)
    over = (moved and length(sum_d >> MEAN, sum_q >> MEAN) > most) or sum_sum >> DROP_SUM > sum_most
    count = s.count
    if used:
        count = min(count + 1, SAMPLES_HI) if over else max(count - 1, 0)
    if not x.run or r.residual_samples == 0:
        count = 0
    known = 1 if sound and x.voltage_known and x.sat_d == 0 and x.sat_q == 0 else 0
    following = State(
        carried_alpha, carried_beta, known, x.s_alpha, x.s_beta, sum_d, sum_q, sum_sixth_d, sum_sixth_q, sum_power,
        sum_sum, count,
    )  # fmt: skip
    return following, (
        e_d, e_q, sum_d >> MEAN, sum_q >> MEAN, sum_sixth_d >> MEAN, sum_sixth_q >> MEAN, sum_power >> MEAN,
        sum_sum >> DROP_SUM, 1 if count > 0 and count >= r.residual_samples else 0,
    )  # fmt: skip


INPUTS = (
    *MODEL,
    Port("cos_theta", TRIG, -TRIG_ONE, TRIG_ONE, "cosine of the angle of the sample"),
    Port("sin_theta", TRIG, -TRIG_ONE, TRIG_ONE, "sine of the angle of the sample"),
    *(Port(f"i_{x}", PU, doc=f"current, phase {x}") for x in "abc"),
    *(Port(f"i_{x}", PU, doc=f"current, {x}") for x in ("alpha", "beta")),
    *(Port(f"i_{x}", PU, doc=f"current, {x} axis") for x in "dq"),
    Port("omega_me", PU, doc="electrical speed"),
    *(Port(f"u_applied_{x}", FLUX, doc=f"voltage of the coming period, {x}") for x in ("alpha", "beta")),
    S_ALPHA,
    S_BETA,
    RHO,
    *(Port(f"sat_{x}", SAT, lo=-1, hi=1, doc=f"limit of the coming voltage, {x} axis: 0 none") for x in "dq"),
    Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    T_S,
    Port("residual_leg", V_LEVEL, doc="described voltage loss of a leg by dead time and device drops"),
    Port("residual_min", LEAST, doc="voltage that the mean residual may have at rest without current, times t_s"),
    Port("residual_w", OF_OMEGA, doc="the same for each electrical speed"),
    Port("residual_i", OF_I, doc="the same for each current"),
    Port("residual_light", PU, lo=0, doc="current below which the loss of a leg is not certain"),
    Port("residual_slow", PU, lo=0, doc="electrical speed below which a mean sees a leg at one current"),
    Port("residual_sum_max", SUM_LEAST, doc="mean that the sum of the currents may have without current"),
    Port("residual_sum_i", SUM_OF_I, doc="the same for each current"),
    Port("residual_samples", SAMPLES, doc="samples over a limit, more than others, that are another motor; 0: off"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
OUTPUTS = (
    Port("residual_d", RESIDUAL, doc="voltage that the described motor does not explain, times t_s, d axis"),
    Port("residual_q", RESIDUAL, doc="the same, q axis"),
    Port("residual_mean_d", RESIDUAL, doc="mean of residual_d over about 128 samples"),
    Port("residual_mean_q", RESIDUAL, doc="mean of residual_q over about 128 samples"),
    Port("residual_sixth_d", RESIDUAL, doc="mean of the residual turned forward by six times the angle, d axis"),
    Port("residual_sixth_q", RESIDUAL, doc="the same, q axis"),
    Port("residual_power", POWER, doc="mean square of the residual"),
    Port("residual_sum", SUM_MEAN, doc="mean of the absolute sum of the phase currents"),
    Port("motor_differs", BIT, doc="1: the motor is not the one described"),
)


def _turned(v, state):
    """(residual, the one turned by six times the angle, 0.0 where the sample does not count) as real numbers."""
    turn = complex(v["cos_theta"], v["sin_theta"])
    flux = turn * complex(FLUX.limit(v["model_d"]), FLUX.limit(v["model_q"]))
    seen = []
    for part, of in ((flux.real, "alpha"), (flux.imag, "beta")):
        carried = state[0 if of == "alpha" else 1] * FLUX_STATE.lsb
        seen.append(RESIDUAL.limit(FLUX_STATE.limit(part) + v["rho"] * v[f"i_{of}"] - carried))
    used = state.known and v["run"] and not v["current_at_rail"]
    error = turn.conjugate() * complex(*seen) if used else 0.0j
    error = complex(RESIDUAL.limit(error.real), RESIDUAL.limit(error.imag))
    return error, _limited(error * six_turns(turn), RESIDUAL), used


def _limited(vector, fmt):
    return complex(fmt.limit(vector.real), fmt.limit(vector.imag))


def six_turns(turn):
    """(cos + j sin)**6 by the double and the triple of the angle; only of a unit vector is it one."""
    double = _limited(complex(2 * turn.real**2 - 1, 2 * turn.real * turn.imag), PU)
    triple = _limited(turn * double, PU)
    return _limited(complex(2 * triple.real**2 - 1, 2 * triple.real * triple.imag), PU)


def reference(v, state):
    error, sixth, used = _turned(v, state)
    total = SUM.limit(abs(v["i_a"] + v["i_b"] + v["i_c"]))
    current = min(length(*(PU.to_int(v[f"i_{x}"]) for x in "dq")), PU_HI)  # to decide is exact
    speed = abs(PU.to_int(v["omega_me"]) + (v["omega_me"] < 0.0))
    moved = current >= PU.to_int(v["residual_light"]) and speed >= PU.to_int(v["residual_slow"])
    lsb = RESIDUAL.lsb
    means = {
        "residual_mean_d": (state.sum_d * lsb, error.real, used and moved),
        "residual_mean_q": (state.sum_q * lsb, error.imag, used and moved),
        "residual_sixth_d": (state.sum_sixth_d * lsb, sixth.real, used and moved),
        "residual_sixth_q": (state.sum_sixth_q * lsb, sixth.imag, used and moved),
        "residual_power": (state.sum_power * POWER.lsb, abs(error) ** 2, used and moved),
        "residual_sum": (state.sum_sum * SUM.lsb, total, used),
    }
    out = {"residual_d": error.real, "residual_q": error.imag}
    for name, (of_sum, value, counts) in means.items():
        mean = of_sum / 2**MEAN
        out[name] = (mean + (value - mean) / 2**MEAN if counts else mean) if v["run"] else 0.0
    return out


def bound(v, state):
    """Each rounding by the gains that follow: the flux is cut, turned, compared and turned back, then averaged."""
    turn = abs(v["cos_theta"]) + abs(v["sin_theta"])
    axis = turn * FLUX.lsb + 1.5 * FLUX_STATE.lsb + RESIDUAL.lsb / 2
    error = turn * axis + RESIDUAL.lsb  # and one LSB at the end of the range
    found, _, _ = _turned(v, state)
    double = TRIG.lsb / 2 + PU.lsb  # rounded, and one LSB at the end of the range
    triple = turn * double + double
    triple_of = turn * abs(_limited(complex(2 * v["cos_theta"] ** 2 - 1, 2 * v["cos_theta"] * v["sin_theta"]), PU))
    six = 4 * min(triple_of, 3.0) * triple + 2 * triple**2 + double
    sixth = 3 * error + 2 * abs(found) * six + 2 * error * six + RESIDUAL.lsb
    power = 4 * abs(found) * error + 2 * error**2 + POWER.lsb

    def mean(of, lsb, drop=0):  # the sum loses one LSB when it is cut, the output one of its own
        return (of + lsb) / 2**MEAN + lsb / 2**drop

    means = {"mean": mean(error, RESIDUAL.lsb), "sixth": mean(sixth, RESIDUAL.lsb)}
    return (
        {f"residual_{x}": error for x in "dq"}
        | {f"residual_{name}_{x}": allowed for name, allowed in means.items() for x in "dq"}
        | {"residual_power": mean(power, POWER.lsb), "residual_sum": mean(2 * SUM.lsb, SUM.lsb, MEAN - DROP_SUM)}
    )


def stimuli(rng, _config):
    """A motor that turns with small and large residuals, each limit met within an LSB, ends of every input, gaps."""
    rest = {p.name: 0 for p in INPUTS + REGISTERS} | {"run": 1, "voltage_known": 1, "cos_theta": TRIG_ONE}
    rows = []
    ends = {p.name: (p.low, p.high) for p in INPUTS + REGISTERS if p.name not in ("run", "voltage_known")}
    for k in range(60):  # all at an end; drawn, of all sizes
        rows.append(rest | {n: int(rng.choice(v)) for n, v in ends.items()} | {"current_at_rail": 0})
        rows.append(rest | {n: int(rng.integers(lo >> k % 12, (hi >> k % 12) + 1)) for n, (lo, hi) in ends.items()})
        rows[-1] |= {"sat_d": k % 7 == 0, "sat_q": -(k % 8 == 0)}
        if k % 5 == 4:
            rows.append(rest | {"run": int(rng.integers(2)), "voltage_known": int(rng.integers(2))})
    for k in range(90):  # a turning flux, its voltage, and a residual of every size
        turn = complex(rng.normal(), rng.normal())
        turn /= abs(turn)
        row = rest | {"cos_theta": round(turn.real * TRIG_ONE), "sin_theta": round(turn.imag * TRIG_ONE)}
        row |= {n: int(rng.integers(-9999, 9999)) for n in ("i_alpha", "i_beta", "i_a", "i_b", "i_c", "i_d", "i_q")}
        row |= {f"model_{x}": int(rng.integers(-1 << 36, 1 << 36)) >> k // 6 for x in "dq"}
        row |= {f"u_applied_{x}": int(rng.integers(-1 << 23, 1 << 23)) >> k // 6 for x in ("alpha", "beta")}
        row |= {"s_alpha": int(rng.integers(-60000, 60000)), "s_beta": int(rng.integers(-60000, 60000))}
        row |= {"residual_leg": int(rng.integers(V_LEVEL.hi)) >> k // 6}
        row |= {"t_s": int(rng.integers(1 << 15)), "rho": int(rng.integers(1 << 20)), "residual_samples": 2}
        rows.append(row | {"omega_me": int(rng.integers(PU.lo, PU.hi)), "residual_w": int(rng.integers(1 << 10))})
    rows += [rest | {"run": 0}, rest, rest]
    for size in (1, 2, 77, 20000):  # the mean on its way to a steady residual, with a limit that it meets on that way
        for axis in "dq":
            for sign in (1, -1):
                push = rest | {f"u_applied_{'alpha' if axis == 'd' else 'beta'}": sign * size << 8, "t_s": 1 << 15}
                for least in (0, size // 9, size // 5):
                    rows += [push | {"residual_min": least, "residual_samples": 3}] * 14
                rows += [rest | {"run": 0}, rest]
    for name, share, drop in (("omega_me", "residual_w", DROP_OMEGA), ("i_q", "residual_i", DROP_I)):
        push = rest | {"u_applied_alpha": -1 << 21, "t_s": 1 << 16, "residual_samples": 1}
        for size in (300, -30000, PU.hi, PU.lo):
            for most in (80, 700, 4000):
                rows += [push | {name: size, share: min((most << drop) // abs(size), (1 << 24) - 1)}] * 9
            rows += [rest | {"run": 0}, rest]
    push = rest | {"u_applied_alpha": -1 << 21, "t_s": 1 << 16, "residual_samples": 1}
    for light in (0, 1, 500, PU.hi):  # on both sides of a light load
        for current in (light - 1, light, light + 1):
            current = max(0, min(current, PU.hi))
            rows += [push | {"i_d": current, "residual_light": light}] * 4
            rows += [push | {"i_q": -current, "residual_light": light, "i_a": current}] * 2
            rows += [push | {"omega_me": current, "residual_slow": light}] * 4
            rows += [push | {"omega_me": -current, "residual_slow": light}] * 4
    for total in (1, -1, 9, 600, -4000, PU.hi):  # the sum of the currents
        push = rest | {"i_a": total, "residual_samples": 2}
        for least in (0, abs(total) // 3, abs(total)):
            rows += [push | {"residual_sum_max": min(least, SUM_LEAST.hi)}] * 8
            rows += [push | {"i_q": 4096, "residual_sum_i": min(least << 12, SUM_OF_I.hi)}] * 8
        rows += [push | {"i_b": PU.hi, "i_c": PU.hi}, push | {"i_b": PU.lo, "i_c": PU.lo}, rest | {"run": 0}, rest]
    return rows + _followed(rng, rest, FOLLOWED)


def _followed(rng, rest, count):
    """Limits of flux, voltage and multiples of the angle, each followed by a flux that leaves a residual within range.

    A residual at its own limit hides what went before it.  Cosine and sine need not be those of an angle.
    """
    rows, state = [], State()
    ends = {p.name: p.high for p in INPUTS if p.name in ("u_applied_alpha", "u_applied_beta", "s_alpha", "s_beta")}
    for k in range(count):
        shift, beyond = int(rng.integers(20)), (state.carried_alpha >> 30, state.carried_beta >> 30)
        signs = [int(rng.choice((-1, 1))) if -2 <= b <= 1 else -1 if b > 0 else 1 for b in (*beyond, *beyond)]
        row = rest | {n: int(rng.integers(-TRIG_ONE, TRIG_ONE + 1)) for n in ("cos_theta", "sin_theta")}
        if k % 3 == 0:  # where the sines of 2, 3 and 6 theta are largest; where its cosine is
            row |= {n: int(rng.choice((-TRIG_ONE, TRIG_ONE))) for n in ("cos_theta", "sin_theta")}
            row["cos_theta"] = row["cos_theta"] * (100 if k % 4 == 3 else int(rng.integers(60, 101))) // 100
        for (name, most), sign in zip(ends.items(), signs, strict=True):  # near its end, or of any size
            size = most - (most >> shift + 1) if k % 4 < 2 else int(rng.integers(most + 1)) >> shift
            row[name] = sign * size if name[0] == "u" else -sign * size
        row |= {"t_s": int(rng.integers(1, T_S.high)) >> shift // 5, "residual_samples": 3}
        row |= {"residual_leg": int(rng.integers(V_LEVEL.hi + 1)) >> shift // 2, "rho": int(rng.integers(1 << 16))}
        row |= {f"i_{x}": int(rng.integers(PU.lo, PU.hi + 1)) >> shift for x in ("alpha", "beta")}
        left = [int(rng.integers(-1, 2)) << int(rng.integers(DROP_E + RESIDUAL_W - 2)) for _ in beyond]
        drops = [(row["rho"] * row[f"i_{x}"]) >> DROP_RHO for x in ("alpha", "beta")]
        turn = complex(row["cos_theta"], row["sin_theta"]) or 1.0
        wanted = complex(state.carried_alpha - drops[0] + left[0], state.carried_beta - drops[1] + left[1])
        if k % 12 == 3:  # beside the limit of a flux, or beyond it
            near = int(rng.choice((-1, 1))) * (FLUX_STATE.hi - 4 * left[0])
            wanted = complex(near, left[1]) if k % 24 == 3 else complex(left[1], near)
        flux = wanted / turn * (1 << DROP_LAMBDA)
        for x, part in (("d", flux.real), ("q", flux.imag)):
            row[f"model_{x}"] = min(max(round(part), FLUX.lo), FLUX.hi) << DROP_MODEL
        state, _ = step(state, *_taken(row))
        rows.append(row)
    return [rest | {"run": 0}, *rows]


def patient_stimuli(rng, _config):
    """As the followed ones, more of them, each with its limits beside what it compares with them."""
    rest = {p.name: 0 for p in INPUTS + REGISTERS} | {"run": 1, "voltage_known": 1, "cos_theta": TRIG_ONE}
    rows, state = [], State()
    for k, row in enumerate(_followed(rng, rest, PATIENT)):
        row = row | {n: int(rng.integers(PU.lo, PU.hi + 1)) >> k % 6 for n in ("i_a", "i_b", "i_c", "i_d", "i_q")}
        row |= {
            "omega_me": int(rng.integers(PU.lo, PU.hi + 1)),
            "residual_samples": min(max(state.count + k % 4 - 1, 1), SAMPLES_HI),
        }
        following, _ = step(state, *_taken(row))
        size = length(following.sum_d >> MEAN, following.sum_q >> MEAN)
        speed, current = abs(row["omega_me"]), min(length(row["i_d"], row["i_q"]), PU_HI)
        shares = rng.dirichlet((1.0, 1.0, 1.0)) * size
        beside = int(rng.integers(-1, 2))
        row["residual_w"] = min((int(shares[0]) << DROP_OMEGA) // (speed + 1), OF_OMEGA.hi)
        row["residual_i"] = min((int(shares[1]) << DROP_I) // (current + 1), OF_I.hi)
        left = size - (speed * row["residual_w"] >> DROP_OMEGA) - (current * row["residual_i"] >> DROP_I)
        row["residual_min"] = min(max(left + beside, 0), LEAST.hi)
        total = following.sum_sum >> DROP_SUM
        row["residual_sum_i"] = min((int(total * rng.random()) << DROP_SUM_I) // (current + 1), SUM_OF_I.hi)
        left = total - (current * row["residual_sum_i"] >> DROP_SUM_I)
        row["residual_sum_max"] = min(max(left + (k // 3 % 3 - 1), 0), SUM_LEAST.hi)
        state, _ = step(state, *_taken(row))
        rows.append(row)
    return rows


def _taken(row):
    """The records that step takes."""
    return Inputs(*(row[p.name] for p in INPUTS)), Registers(*(row[p.name] for p in REGISTERS))


BLOCK = Block(
    name="motor_residual",
    folder="estimators",
    paper="001, eq. (5) and (6), as a prediction of the next sample",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=OUTPUTS,
    state=State(),
    latency=38,
    interval=38,
    constants={
        "RESIDUAL_W": RESIDUAL_W,
        "POWER_W": POWER.width,
        "SUM_W": SUM_W,
        "MEAN": MEAN,
        "DROP_TWICE": DROP_TWICE,
        "DROP_TRIG": DROP_TRIG,
        "DROP_LAMBDA": DROP_LAMBDA,
        "DROP_RHO": DROP_RHO,
        "DROP_LEG": DROP_LEG,
        "DROP_U": DROP_U,
        "DROP_E": DROP_E,
        "DROP_POWER": DROP_POWER,
        "DROP_OMEGA": DROP_OMEGA,
        "DROP_I": DROP_I,
        "DROP_SUM_I": DROP_SUM_I,
        "DROP_SUM": DROP_SUM,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
