# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof constants``: public data sheets, every convention there and back, contradictions by name."""

import itertools
import math

import pytest
import tomllib
from hypothesis import given, settings
from hypothesis import strategies as st

from fluxproof.command import main
from fluxproof.constants.agree import FACTORS, Answer, solve
from fluxproof.constants.statements import ROOT2, ROOT3, RPM, read

# name: (statements as the maker prints them, pole pairs, R of a phase, L of a phase, psi from the maker's EMF or Kv)
SHEETS = {
    "Kollmorgen KBM-45X02-B": (
        ["poles=10", "kt=2.98 Nm/Arms", "ke=180 Vrms/krpm line", "r=0.76 ohm line", "l=12 mH line"],
        5, 0.38, 6e-3, 180e-3 / RPM * ROOT2 / ROOT3 / 5,
    ),
    "Kollmorgen KBM-88X00-B": (
        ["poles=46", "kt=3.04 Nm/Arms", "ke=184 Vrms/krpm line", "r=0.165 ohm line"],
        23, 0.0825, None, 184e-3 / RPM * ROOT2 / ROOT3 / 23,
    ),
    "Exlar with an AKD drive": (
        ["poles=8", "kt=1.693717 Nm/Arms", "ke=108.258 Vrms/krpm line", "r=2.32 ohm line", "l=11.5 mH line"],
        4, 1.16, 5.75e-3, 108.258e-3 / RPM * ROOT2 / ROOT3 / 4,
    ),
    "maxon EC 40, 24 V": (
        ["pole_pairs=1", "kt=22.1 mNm/A", "kv=433 rpm/V", "r=0.436 ohm", "l=0.106 mH line", "gradient=8.55 rpm/mNm",
         "tau_m=7.61 ms", "j=85 gcm2", "n0=10300 rpm", "u=24 V"],
        1, 0.218, 53e-6, 22.1e-3 / ROOT3,
    ),
    "maxon EC 40, 48 V": (
        ["pole_pairs=1", "kt=221 mNm/A dc", "kv=43.2 rpm/V", "r=44.8 ohm", "l=10.7 mH line", "gradient=8.75 rpm/mNm",
         "tau_m=7.78 ms", "j=85 gcm2", "n0=2020 rpm", "u=48 V"],
        1, 22.4, 5.35e-3, 0.221 / ROOT3,
    ),
    "maxon EC-4pole 22, 24 V": (
        ["poles=4", "kt=13.6 mNm/A", "kv=700 rpm/V", "r=0.102 ohm", "l=0.0163 mH line", "gradient=5.21 rpm/mNm",
         "n0=16700 rpm", "u=24 V"],
        2, 0.051, 8.15e-6, 13.6e-3 / ROOT3 / 2,
    ),
    "maxon, 48 V, 178 rpm/V": (
        ["pole_pairs=2", "kt=53.8 mNm/A", "kv=178 rpm/V", "r=2.45 ohm", "l=0.513 mH line", "gradient=8.09 rpm/mNm",
         "tau_m=2.94 ms", "j=34.7 gcm2"],
        2, 1.225, 0.2565e-3, 53.8e-3 / ROOT3 / 2,
    ),
    "servo of 310 V, conventions not stated": (
        ["poles=4", "kt=0.49 Nm/A", "ke=51 V/krpm", "r=3.07 ohm line", "l=6.57 mH line", "j=1.8 kgcm2", "n=4600 rpm"],
        2, 1.535, 3.285e-3, 51e-3 / RPM / ROOT3 / 2,
    ),
    "Teknic M-2310P, identified": (
        ["pole_pairs=4", "flux=0.0399353318 V/Hz", "r=0.393955578 ohm phase", "l=0.190442806 mH phase"],
        4, 0.393955578, 0.190442806e-3, 0.0399353318 / (2 * math.pi),
    ),
    "ODrive D5065": (
        ["pole_pairs=7", "kv=270 rpm/V", "kt=0.0306 Nm/Apk", "r=39 mohm phase", "l=15.7 uH phase"],
        7, 0.039, 15.7e-6, 8.27 / 270 / 10.5,
    ),
    "T-Motor MN4004 KV300": (["poles=24", "kv=300 rpm/V"], 12, None, None, 1.53e-3),
}  # fmt: skip


def solved(*texts: str, connection: str = "star") -> Answer:
    return solve([read(text, connection) for text in texts])


@pytest.mark.parametrize("name", SHEETS)
def test_a_data_sheet_gives_the_machine_that_its_maker_means(name):
    texts, pairs, r, inductance, psi = SHEETS[name]
    (machine,) = solved(*texts).machines
    assert machine.pole_pairs == pairs
    assert machine.psi == pytest.approx(psi, rel=0.035)
    assert machine.r == pytest.approx(r) if r else machine.r is None
    assert machine.l_q == pytest.approx(inductance) if inductance else machine.l_q is None


positive = st.floats(-3, 3).map(lambda x: 10.0**x)


@settings(max_examples=60, deadline=None)
@given(p=st.integers(1, 40), psi=st.floats(1e-4, 1.0), r=positive, inductance=positive)
def test_every_convention_leads_back_to_the_machine(p, psi, r, inductance):
    emf = p * psi / (1e3 * RPM) * 1e6 * RPM**2  # V of a phase, peak, per 1,000 rpm
    fluxes = [
        f"kt={1.5 * p * psi!r} Nm/Apk", f"kt={1.5 * ROOT2 * p * psi!r} Nm/Arms", f"kt={ROOT3 * p * psi!r} Nm/A dc",
        f"ke={emf!r} Vpk/krpm phase", f"ke={emf / ROOT2!r} Vrms/krpm phase", f"ke={emf * ROOT3!r} Vpk/krpm line",
        f"ke={emf * ROOT3 / ROOT2!r} Vrms/krpm line", f"kv={1 / (ROOT3 * p * psi * RPM)!r} rpm/V",
        f"flux={psi * 2 * math.pi!r} V/Hz", f"flux={psi * 1e3!r} mWb",
    ]  # fmt: skip
    windings = [(f"r={2 * r!r} ohm line", f"l={2 * inductance!r} H line", "star"),
                (f"r={r!r} ohm winding", f"l={inductance!r} H winding", "star"),
                (f"r={3 * r!r} ohm winding", f"l={3 * inductance!r} H winding", "delta")]  # fmt: skip
    for flux, (resistance, coil, connection) in itertools.product(fluxes, windings):
        (machine,) = solved(f"pole_pairs={p}", flux, resistance, coil, connection=connection).machines
        assert (machine.psi, machine.r, machine.l_d) == pytest.approx((psi, r, inductance))
    (machine,) = solved(f"pole_pairs={p}", *fluxes).machines  # and all of them agree
    assert machine.psi == pytest.approx(psi)


@pytest.mark.parametrize(("factor", "reason"), FACTORS)
def test_a_wrong_convention_is_a_contradiction_with_its_reason(factor, reason, capsys):
    kt = 1.5 * ROOT2 * 5 * 0.28 * factor
    answer = solved("pole_pairs=5", f"kt={kt!r} Nm/Arms", "flux=280 mWb")
    assert not answer.machines and {c.reason for c in answer.contradictions} == {reason}
    assert main(["constants", "pole_pairs=5", f"kt={kt!r} Nm/Arms", "flux=280 mWb"]) == 1
    out = capsys.readouterr().out
    assert reason in out and "[machine]\n" not in out


def test_one_wrong_number_among_several_is_the_one_that_is_named():
    good = ["poles=10", "kt=2.98 Nm/Arms", "ke=180 Vrms/krpm line", "flux=281 mWb"]
    for i in (1, 2, 3):
        name, rest = good[i].split("=")
        number, unit = rest.split(" ", 1)
        bad = [*good[:i], f"{name}={float(number) * 1.3} {unit}", *good[i + 1 :]]
        (found,) = solved(*bad).contradictions
        assert found.statement.text == bad[i] and found.ratio == pytest.approx(1.3, rel=0.03)


def test_a_resistance_that_contradicts_the_motor_constant_is_named():
    (found,) = [
        c
        for c in solved("pole_pairs=4", "flux=5 mWb", "r=1 ohm line", "gradient=16.7 rpm/mNm").contradictions
        if c.statement.name == "r"
    ]
    assert found.ratio == pytest.approx(2.1, rel=0.01) and "line-to-line" in found.reason


def test_what_is_not_said_is_asked_and_never_guessed(capsys):
    assert len(solved("pole_pairs=4", "kt=1 Nm/A").machines) == 3  # rms, peak, DC
    assert len(solved("pole_pairs=4", "flux=5 mWb", "r=2 ohm").machines) == 2
    assert main(["constants", "poles=10", "kt=2.98 Nm/A", "ke=180 V/krpm"]) == 1  # two pairs of conventions fit
    assert "say how it is meant" in capsys.readouterr().out
    # The motor constant is the same in every convention, so that it decides what a resistance is.
    (machine,) = solved("pole_pairs=4", "flux=5 mWb", "r=2 ohm", f"km={math.sqrt(1.5 * 4e-4 / 1.0)} Nm/sqrtW").machines
    assert machine.r == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["kt=3 Nm/Arms"], "the pole pairs are missing"),
        (["poles=7", "kv=300 rpm/V"], "'poles=7': expected a whole number that is even"),
        (["poles=8", "r=2 ohm line"], "nothing states the magnet flux"),
        (["poles=8", "kt=2,98 Nm/A"], "a point in place of the comma"),
        (["poles=8", "kt=3"], "the unit is missing; expected one of Nm/A"),
        (["poles=8", "kv=100"], "the unit is missing; expected one of rpm/V"),
        (["poles=8", "kt=3 foo"], "the unit 'foo' is not known here; expected one of Nm/A"),
        (["poles=8", "kt=3 Nm/A foo"], "expected words of dc, peak, rms"),
        (["poles=8", "kt=-3 Nm/A"], "expected a number above zero"),
        (["poles=8", "torque=3"], "with a name of pole_pairs, poles, kt"),
        (["poles=8", "pole_pairs=3", "kv=3 rpm/V"], "the number of pole pairs is stated twice"),
        (["poles=8", "kv=300 rpm/V", "tau_m=3 ms"], "needs the inertia"),
    ],
)
def test_bad_input_names_the_statement_and_what_was_expected(texts, words, capsys):
    assert main(["constants", *texts]) == 2
    assert words in capsys.readouterr().err


def test_the_file_is_a_section_of_a_drive_file(tmp_path, capsys):
    out = tmp_path / "machine.toml"
    assert main(["constants", *SHEETS["maxon EC 40, 24 V"][0], "i=5.78 Arms", "n=9160 rpm", "--out", str(out)]) == 0
    machine = tomllib.loads(out.read_text())["machine"]
    assert machine["rated_current_a"] == pytest.approx(5.78 * ROOT2, rel=1e-5)
    assert machine["rated_speed_rad_s"] == pytest.approx(9160 * RPM, rel=1e-5) and len(machine) == 8
    assert "read 'r=0.436 ohm' as between two lines" in capsys.readouterr().out
    before = out.read_text()
    assert main(["constants", "pole_pairs=4", "kt=1 Nm/A", "--out", str(out)]) == 1
    assert out.read_text() == before  # an ambiguity writes nothing


def test_an_ampere_of_block_commutation_and_imperial_units():
    """A DC gives the torque and the loss of 2/sqrt(3) times as large a peak."""
    texts = ["poles=8", "r=0.5 ohm phase", "i=3.21 A dc"]
    (machine,) = solved("kt=10 oz-in/A dc", *texts, "j=0.001 oz-in-s2").machines
    assert machine.i == pytest.approx(3.7066, rel=1e-4) and machine.j == pytest.approx(7.0616e-6, rel=1e-4)
    torque = 1.5 * machine.pole_pairs * machine.psi * machine.i
    assert torque == pytest.approx(10 * 0.0070615518 * 3.21, rel=1e-6)
    assert 1.5 * machine.r * machine.i**2 == pytest.approx(2.0 * machine.r * 3.21**2)
    (other,) = solved("kt=0.625 lb-in/A dc", *texts, "j=6.25e-5 lb-in-s2").machines
    assert (other.psi, other.j) == pytest.approx((machine.psi, machine.j), rel=1e-6)
    assert len(solved("kt=10 oz-in/A dc", "poles=8", "i=3.21 A").machines) == 3  # rms, peak, DC


def test_a_resistance_that_nothing_checks_is_said(capsys):
    unchecked, doubt = "no number here checks the resistance", "more heat than shaft power"
    for more, said in (
        ([], (True, False)),
        (["i=20 Arms", "n=3000 rpm"], (True, True)),
        (["tau_e=1 ms", "l=50 mH phase"], (False, False)),
    ):
        assert main(["constants", "pole_pairs=7", "kv=190 rpm/V", "r=50 ohm phase", *more]) == 0
        told = capsys.readouterr().out
        assert (unchecked in told, doubt in told) == said, told
        assert "for example n=2350 rpm" in told or "n=3000 rpm" in more
