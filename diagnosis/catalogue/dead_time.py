"""What the inverter loses: dead time, device drops and how both fade near zero current."""

import numpy as np

from diagnosis.effect import Effect, Parameter, voltage
from diagnosis.curves import clipped_ramps
from diagnosis.result import Estimate

# None is so wide that it would pass for a resistance over most of the current.
CORE_WIDTHS = (0.02, 0.12)  # of rated current: where the loss has reached its full value
FREE_WIDTHS = (0.005, 0.05, 0.3)


def _losses(view, widths, factor=1.0):
    """Loss of the legs for each width, positive along the current, in dq.

    The measured current, for what counts is when it crosses zero; the mean of an interval's two samples
    does not correlate with their difference, which is the misfit's noise.
    """
    ramps = clipped_ramps(
        view.phases(view.with_raw_current().i_mid), [w * view.machine.rated_current_a for w in widths]
    )
    return {w: voltage(view.from_phases(ramp) * factor) for w, ramp in zip(widths, ramps, strict=True)}


class DeadTime(Effect):
    def core(self, view):
        factor = view.u_dc / view.nominal.inverter.dc_bus_v
        return {f"v_{w:g}": column for w, column in _losses(view, CORE_WIDTHS, factor).items()}

    def free(self, view):
        factor = view.u_dc / view.nominal.inverter.dc_bus_v
        out = {f"v_{w:g}": column for w, column in _losses(view, FREE_WIDTHS, factor).items()}
        if np.ptp(view.u_dc.mean(axis=1)) > 0.04 * view.nominal.inverter.dc_bus_v:
            out["drop"] = _losses(view, (0.05,))[0.05]  # device drops do not follow the bus
        return out

    def floor(self, nominal):
        return 0.0002 * nominal.inverter.dc_bus_v

    def ceiling(self, nominal):
        return 0.15 * nominal.inverter.dc_bus_v

    def size(self, c, nominal):
        return abs(sum(c.values()))

    def estimates(self, c, covariance, nominal):
        every = np.ones(len(c))
        # A loss that still grows towards rated current has not shown its full value.
        growing = c.get(f"v_{FREE_WIDTHS[-1]:g}", 0.0)
        spread = float(np.hypot(np.sqrt(max(every @ covariance @ every, 0.0)), growing))
        return {"v_dead_v": Estimate(float(sum(c.values())), spread, "V")}

    def plant(self, c, nominal):
        v_dead = max(0.0, float(sum(c.values())))
        zone = sum(abs(v) * float(k[2:]) for k, v in c.items() if k.startswith("v_")) / max(
            sum(map(abs, c.values())), 1e-12
        )
        return {
            "inverter.dead_time_s": v_dead / nominal.inverter.dc_bus_v / nominal.inverter.pwm_frequency_hz,
            "inverter.zero_current_a": zone * nominal.machine.rated_current_a,
        }


EFFECT = DeadTime(
    name="dead_time",
    title="dead time and device drops of the inverter",
    equation="u_x = u_x,asked - v_dead s(i_x), s odd, one beyond a small current",
    signature="order 0 along the current, (4/pi) v_dead, and orders 6 and 12; not in proportion to the speed",
    confounders=("resistance", "emf_harmonics"),
    separated_by="several currents, i_q reversed; another bus voltage or PWM frequency splits dead time from drops",
    parameters=(Parameter("v_dead_v", "V", "loss of a leg, full value"),),
    positive=True,
    smoothed=True,
)
