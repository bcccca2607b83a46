# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof constants`: every convention there and back, contradictions and open readings by name, a drive file."""

from __future__ import annotations

import math

import pytest

from fluxproof.checkout import DRIVES
from fluxproof.command import main
from fluxproof.constants.meanings import NUMBERS
from golden_model.drive import load

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

PSI, PAIRS = 6.2959e-3, 4  # of servo_24v
RPM = 2.0 * math.pi / 60.0
EMF = PAIRS * PSI  # peak of a phase per rad/s of the shaft
# What each meaning of a data sheet shows for this motor, from the machine's equations and not from the factors
SHOWN = {
    ("ke", "line-rms"): EMF * 1000 * RPM * math.sqrt(3) / math.sqrt(2),
    ("ke", "line-peak"): EMF * 1000 * RPM * math.sqrt(3),
    ("ke", "phase-rms"): EMF * 1000 * RPM / math.sqrt(2),
    ("ke", "phase-peak"): EMF * 1000 * RPM,
    ("ke_rad", "line-rms"): EMF * math.sqrt(3) / math.sqrt(2),
    ("ke_rad", "line-peak"): EMF * math.sqrt(3),
    ("ke_rad", "phase-rms"): EMF / math.sqrt(2),
    ("ke_rad", "phase-peak"): EMF,
    ("kt", "rms"): 1.5 * PAIRS * PSI * math.sqrt(2),
    ("kt", "peak"): 1.5 * PAIRS * PSI,
    ("kv", "line-peak"): 1 / (EMF * math.sqrt(3) * RPM),
    ("kv", "line-rms"): math.sqrt(2) / (EMF * math.sqrt(3) * RPM),
    ("v_per_hz", "phase-peak"): 2 * math.pi * PSI,
    ("v_per_hz", "phase-rms"): 2 * math.pi * PSI / math.sqrt(2),
    ("v_per_hz", "line-rms"): 2 * math.pi * PSI * math.sqrt(1.5),
}


def run(capsys, *options) -> tuple[int, str, str]:
    """(status, stdout, stderr) of the command with four pole pairs."""
    status = main(["constants", "--pole-pairs", str(PAIRS), *map(str, options)])
    return status, *capsys.readouterr()


def psi_of(text: str) -> float:
    return tomllib.loads(text)["machine"]["magnet_flux_wb"]


def option(kind: str) -> str:
    return "--" + kind.replace("_", "-")


def test_every_meaning_gives_the_same_flux(capsys):
    assert set(SHOWN) == {(kind, m.name) for kind, (_, meanings) in NUMBERS.items() for m in meanings}
    for (kind, meaning), value in SHOWN.items():
        status, out, err = run(capsys, option(kind), value, meaning)
        assert status == 0 and err == "" and psi_of(out) == pytest.approx(PSI, rel=1e-5), (kind, meaning)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("ke", "line-rms"), ("kt", "rms")), (("ke", "line-peak"), ("kt", "peak")),
        (("ke", "phase-rms"), ("kt", "rms")), (("ke", "phase-peak"), ("kt", "peak")),
        (("kv", "line-peak"), ("kt", "peak")),
    ],
)  # fmt: skip
def test_two_numbers_tell_what_they_mean(capsys, first, second):
    """Rounded to three digits, no meaning stated: the pair of meanings that agrees is the one of the maker."""
    values = [float(f"{SHOWN[number]:.3g}") for number in (first, second)]
    status, out, err = run(capsys, option(first[0]), values[0], option(second[0]), values[1])
    assert status == 0 and err == "" and psi_of(out) == pytest.approx(PSI, rel=0.01)
    assert "they agree within" in out and "V/krpm rms between lines" in out


def test_what_two_numbers_leave_open_is_told(capsys):
    """Peak between lines per rms ampere, or rms between lines per peak ampere: both agree with themselves."""
    status, out, err = run(capsys, "--ke", SHOWN["ke", "line-peak"], "--kt", SHOWN["kt", "rms"])
    assert status == 1 and out == "" and err.count("psi = ") == 2 and "state the meaning" in err
    status, out, err = run(capsys, "--ke", SHOWN["ke", "line-peak"], "line-peak", "--kt", SHOWN["kt", "rms"])
    assert status == 0 and psi_of(out) == pytest.approx(PSI, rel=1e-4)
    status, out, err = run(capsys, "--ke", 4)
    assert status == 1 and err.count("psi = ") == 4 and "second number" in err


def test_contradictions_are_named(capsys):
    for numbers, words in (
        (("--ke", SHOWN["ke", "line-rms"], "line-rms", "--kt", SHOWN["kt", "peak"], "rms"), "which is sqrt(2): peak"),
        (("--v-per-hz", PSI, "phase-peak", "--kt", SHOWN["kt", "peak"], "peak"), "2 pi"),
        (("--kv", SHOWN["kv", "line-peak"] / PAIRS, "line-peak", "--kt", SHOWN["kt", "rms"], "rms"), "pole pairs"),
        (("--kv", 100, "line-peak", "--kt", 1, "peak"), "times as much"),
    ):
        status, out, err = run(capsys, *numbers)
        assert status == 1 and out == "" and err.count("\n") == 1 and "contradict" in err and words in err, err


def test_a_drive_file_comes_back(capsys):
    """The numbers that a maker would give of servo_24v, between terminals: [machine] is that of the file."""
    m = load(DRIVES / "servo_24v.toml").machine
    status, out, _ = run(
        capsys, "--ke", SHOWN["ke", "line-rms"], "--kt", SHOWN["kt", "rms"], "--r-terminals", 2 * m.resistance_ohm,
        "--l-terminals", 2 * m.inductance_d_h, 2.4 * m.inductance_q_h, "--current", m.rated_current_a / math.sqrt(2),
        "rms", "--speed", m.rated_speed_rad_s / RPM, "--inertia", m.inertia_kgm2,
    )  # fmt: skip
    found = tomllib.loads(out)["machine"]
    assert status == 0 and found["pole_pairs"] == PAIRS
    for key in ("resistance_ohm", "inductance_d_h", "magnet_flux_wb", "rated_current_a", "rated_speed_rad_s"):
        assert found[key] == pytest.approx(getattr(m, key), rel=1e-3), key
    assert found["inductance_q_h"] == pytest.approx(1.2 * m.inductance_q_h, rel=1e-4)
    assert found["inertia_kgm2"] == pytest.approx(m.inertia_kgm2)
    _, delta, _ = run(capsys, "--ke", 4, "phase-peak", "--r-winding", 0.9, "--l-winding", 3e-3, "--delta")
    assert "resistance_ohm = 0.3\n" in delta and "inductance_q_h = 0.001\n" in delta
    assert "# rated_current_a is missing" in delta


def test_bad_input_is_one_line(capsys):
    for options, words in (
        ((), "one of them tells psi"),
        (("--ke", "x"), "--ke x: allowed is a number above 0"),
        (("--ke", -1), "--ke -1"),
        (("--ke", 4, "rms"), "allowed is line-rms, line-peak, phase-rms, phase-peak"),
        (("--ke", 4, "line-rms", "--current", 4, "eff"), "rms or peak"),
        (("--ke", 4, "line-rms", "--r-terminals", 1, "--r-winding", 1), "both given"),
    ):
        status, out, err = run(capsys, *options)
        assert status == 2 and out == "" and err.count("\n") == 1 and words in err, err
    assert main(["constants", "--poles", "7", "--ke", "4", "line-rms"]) == 2
    assert "even number" in capsys.readouterr().err
