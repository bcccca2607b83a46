# SPDX-License-Identifier: BSD-3-Clause
"""What an effect is: ``Effect`` for all, and the parts that some inherit in addition.

FreeCurve, Alternatives      a curve beside the formula; several formulas, of which a drive has one
FluxEffect, BentFlux         a flux linkage; one that is no line of the current
LostFlux                     a current that does not magnetise
Constant                     a wrong constant of the drive file, or a wrong scale
MeasurementError             an error of the data, which is corrected there (corrections.py)
Drift                        a slow change during the recording
LegLoss, ShaftTorque         acts at the legs of the inverter; at the shaft
Described, Relative, Caveat  may be in the drive file already; is relative to another effect; leaves something open
Restates                     changes constants of the drive file to which other effects are added
FarStart, Chosen, Spread     far from linear; columns chosen by the recording; in every drive of a fleet
"""

from fluxproof.diagnosis.effects.columns import (
    Column,
    Wave,
    angle_error,
    current_error,
    flux,
    phase_error,
    torque_of,
    voltage,
    zero_vector_slope,
)
from fluxproof.diagnosis.effects.constant import Constant
from fluxproof.diagnosis.effects.course import Drift
from fluxproof.diagnosis.effects.drive_file import Caveat, Described, Relative, Restates
from fluxproof.diagnosis.effects.effect import NEEDS, Effect, Orders
from fluxproof.diagnosis.effects.estimate import DOUBT, Parameter, believable, is_usual, one, plausible_range, sigma
from fluxproof.diagnosis.effects.flux_effect import LEAST_CURRENT, BentFlux, FluxEffect, LostFlux
from fluxproof.diagnosis.effects.free_curve import Alternatives, FreeCurve
from fluxproof.diagnosis.effects.inverter import LegLoss, ShaftTorque
from fluxproof.diagnosis.effects.measurement import MeasurementError
from fluxproof.diagnosis.effects.search import Chosen, FarStart, Spread

__all__ = [
    "DOUBT",
    "LEAST_CURRENT",
    "NEEDS",
    "Alternatives",
    "BentFlux",
    "Caveat",
    "Chosen",
    "Column",
    "Constant",
    "Described",
    "Drift",
    "Effect",
    "FarStart",
    "FluxEffect",
    "FreeCurve",
    "LegLoss",
    "LostFlux",
    "MeasurementError",
    "Orders",
    "Parameter",
    "Relative",
    "Restates",
    "ShaftTorque",
    "Spread",
    "Wave",
    "angle_error",
    "believable",
    "current_error",
    "flux",
    "is_usual",
    "one",
    "phase_error",
    "plausible_range",
    "sigma",
    "torque_of",
    "voltage",
    "zero_vector_slope",
]
