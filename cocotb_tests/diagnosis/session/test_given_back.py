# SPDX-License-Identifier: BSD-3-Clause
"""Every effect of the catalogue: found in a recording, written into drive_improved.toml, and gone with that drive."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.with_effect import NOMINAL, T, healthy, usual, with_effect
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.cells import cells_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.command import answer_lines
from fluxproof.diagnosis.decide.locate import at_order, harmonic
from fluxproof.diagnosis.decide.sizes import Sizes
from fluxproof.diagnosis.effects import MeasurementError
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_section import in_addition, read_flux_map
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.improve.improve import write_improved
from fluxproof.diagnosis.session import run, work

MOST_LEFT = 0.05  # of the power of the misfit above its noise floor
STAYS = {  # beside measurement errors, which are in the recording itself
    "magnet_temperature": "the temperature of the magnets is not recorded, so that a coefficient cannot be applied",
    "demagnetisation": "a drive file has one magnet flux, and this recording has two",
}


def sizes(worked):
    """Sizes of the misfit of the drive as described, over all blocks."""
    setup = worked.decision.posterior.setup
    return Sizes(setup, setup.cells.y, setup.cells.y, np.ones(len(setup.view), bool), True)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CATALOGUE))
def test_the_improved_drive_leaves_no_misfit(name, tmp_path):
    effect = CATALOGUE[name]
    if isinstance(effect, MeasurementError) or name in STAYS:
        pytest.skip(STAYS.get(name, "an error of measurement stays in the recording"))
    recording = with_effect(effect)
    first = work(recording, NOMINAL)
    answer = first.answer()
    assert name in {e.name for e in answer.effects}, (answer.sentence, answer.notes)
    improved = write_improved(NOMINAL, answer.effects, tmp_path / "drive_improved.toml")
    second = work(recording, improved)
    again, before, after = second.answer(), sizes(first), sizes(second)
    channel = before.primary()
    left = after.channels[channel].excess / max(before.channels[channel].excess, 1e-12)
    assert again.verdict == "no_mismatch" or left < MOST_LEFT, (left, again.sentence)


@pytest.mark.slow
def test_flux_map_is_written_and_read(tmp_path):
    """The curve itself as a table, which a drive file reads by its name."""
    effect = CATALOGUE["saturation"]
    answer = run(with_effect(effect), NOMINAL, tmp_path)
    chart = read_flux_map(tmp_path / "flux_map.csv")
    assert "saturation" in {e.name for e in answer.effects} and any("flux_map.csv" in n for n in answer.notes)
    assert f"wrote {tmp_path / 'flux_map.csv'}" in answer_lines(answer, NOMINAL, tmp_path)
    m, y = NOMINAL.machine, chart.i_q_a / NOMINAL.machine.rated_current_a
    bend = usual(effect, healthy()[1])["q_3"]
    middle = np.argmin(np.abs(chart.i_d_a))
    truth = m.inductance_q_h * chart.i_q_a + m.inductance_q_h * m.rated_current_a * bend * y**3
    # The recording has 1, 2 and 5 A on the q axis and nothing between.
    assert np.abs(chart.psi_q_wb[middle] - truth).max() < 0.03 * np.abs(truth).max()
    drive = tmp_path / "drive.toml"
    drive.write_text(PAPER.read_text() + '\n[plant.machine]\nflux_map = "flux_map.csv"\n')
    again = diagnose(with_effect(effect), drive)
    assert again.fit.train_before < 0.1 * answer.fit.train_before, (again.fit, answer.fit)
    run(from_columns(healthy()[0], T), NOMINAL, tmp_path)
    assert not (tmp_path / "flux_map.csv").exists(), "of an earlier run"


def test_what_is_found_beside_the_drive_file_is_added_to_it(tmp_path):
    drive = tmp_path / "drive.toml"
    drive.write_text(PAPER.read_text() + "\n[plant.inverter]\ndead_time_s = 1e-6\n")
    nominal = load_nominal(drive)
    assert in_addition({"inverter.dead_time_s": 2e-7}, nominal)["inverter.dead_time_s"] == pytest.approx(1.2e-6)
    # The core's own section commands the gates: what is lost there is not known.
    assert in_addition({"inverter.dead_time_s": 2e-7}, NOMINAL)["inverter.dead_time_s"] == 2e-7
    drive.write_text(PAPER.read_text() + "\n[plant.timing]\nsampling_skew_s = -1e-6\n")
    more = in_addition({"timing.sampling_skew_s": 3e-7}, load_nominal(drive))
    assert more["timing.sampling_skew_s"] == pytest.approx(-7e-7)
    assert in_addition({"machine.iron_conductance_s": 1e-4}, NOMINAL) == {"machine.iron_conductance_s": 1e-4}


def test_a_constant_misfit_has_no_harmonics():
    """Blocks hold no whole turns: a weak magnet leaks into order 1."""
    weak, well = with_effect(CATALOGUE["magnet_flux"]), from_columns(healthy()[0], T)
    of = []
    for recording in (weak, well):
        view = view_of(recording, NOMINAL)
        cells = cells_of(view, [])
        of.append([rms(f) for f in (harmonic(view, cells, cells.y, 1.0), at_order(cells, cells.y, 1.0))])
    (mended, leaking), (floor, _) = of
    assert mended < 1.5 * floor < 0.2 * leaking


def rms(x):
    return float(np.sqrt(np.nanmean(np.abs(x) ** 2)))
