# SPDX-License-Identifier: BSD-3-Clause
"""`make bench`: control periods per second of the compiled golden model.  Writes build/bench/golden.json."""

from __future__ import annotations

import statistics
import time

import numpy as np

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim.golden_loop import run_averaged, run_controller
from fluxproof.cosim.scenarios import fig9
from fluxproof.files import write_json
from fluxproof.plant import Machine, Sensors, initial_state, plant_params, sensor_params
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.registers import registers

DRIVE = ROOT / "docs" / "drives" / "paper001.toml"
RUNS = 5
CONTROLLER_PERIODS = 400_000


def rates(periods: int, run) -> list[float]:
    """Periods per second of RUNS runs, after a first one that compiles."""
    run()
    results = []
    for _ in range(RUNS):
        began = time.perf_counter()
        run()
        results.append(periods / (time.perf_counter() - began))
    return results


def controller_rate(register_set) -> list[float]:
    """The whole controller on random raw samples."""
    rng = np.random.default_rng(1)
    samples = np.zeros((CONTROLLER_PERIODS, len(fluxproof.Sample._fields)), np.int64)
    samples[:, :5] = rng.integers(0, 1 << 16, (CONTROLLER_PERIODS, 5))
    samples[:, 5] = rng.integers(-60000, 60000, CONTROLLER_PERIODS)
    samples[:, 8:] = 1
    observed = np.zeros((CONTROLLER_PERIODS, len(fluxproof.Observed._fields)), np.int64)
    values, config = register_set.values, register_set.config
    return rates(len(samples), lambda: run_controller(fluxproof.State(), samples, values, config, observed))


def closed_loop_rate(drive, register_set, repeat: int = 30) -> list[float]:
    """Fig. 9 repeated, with the averaged plant and converters."""
    scenario = fig9(drive)
    references = np.stack([scenario.omega_ref, scenario.i_d_ref, scenario.i_q_ext, scenario.speed_mode], axis=1)
    references, load = np.tile(references, (repeat, 1)), np.tile(scenario.load, repeat)
    u_dc = np.tile(scenario.u_dc, repeat)
    machine = Machine.from_mapping(vars(drive.machine))
    params = plant_params(machine)
    sensors = sensor_params(
        Sensors(
            current_bits=drive.sensors.adc_bits,
            current_full_scale_a=drive.sensors.current_range_a,
            u_dc_bits=drive.sensors.adc_bits,
            u_dc_full_scale_v=drive.sensors.u_dc_range_v,
            position_bits=drive.sensors.position_bits,
        )
    )
    out = np.zeros((len(load), 8))
    values, config = register_set.values, register_set.config

    def run():
        state = initial_state(machine, params)
        run_averaged(
            fluxproof.State(),
            references,
            u_dc,
            load,
            values,
            config,
            state,
            params,
            sensors,
            drive.sample_time_s,
            out,
        )

    return rates(len(load), run)


def main() -> None:
    drive = drives.load(DRIVE)
    register_set = registers(drive)
    figures = {
        "controller_periods_per_s": controller_rate(register_set),
        "closed_loop_periods_per_s": closed_loop_rate(drive, register_set),
    }
    result = {name: round(statistics.median(values)) for name, values in figures.items()}
    result |= {f"{name}_range": [round(min(v)), round(max(v))] for name, v in figures.items()} | {"runs": RUNS}
    path = write_json(BUILD / "bench" / "golden.json", result)
    for name, values in figures.items():
        print(f"{name:28s} median {statistics.median(values):12,.0f}  ({min(values):,.0f} .. {max(values):,.0f})")
    print(f"wrote {path.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
