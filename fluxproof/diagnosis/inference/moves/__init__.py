# SPDX-License-Identifier: BSD-3-Clause
"""The moves of the search, one a file: each judges or linearises sets that the others miss.

A move is a function of the sets judged so far and of the names of the best one, and adds to the former.
"""

from fluxproof.diagnosis.inference.moves.alike import alike
from fluxproof.diagnosis.inference.moves.corrections import corrections
from fluxproof.diagnosis.inference.moves.far import far
from fluxproof.diagnosis.inference.moves.grow import grow
from fluxproof.diagnosis.inference.moves.leaders import leaders
from fluxproof.diagnosis.inference.moves.neighbours import neighbours
from fluxproof.diagnosis.inference.moves.other_errors import other_errors
from fluxproof.diagnosis.inference.moves.parts import parts
from fluxproof.diagnosis.inference.moves.rivals import rivals
from fluxproof.diagnosis.inference.moves.simpler import simpler
from fluxproof.diagnosis.inference.moves.stand import stand
from fluxproof.diagnosis.inference.moves.within_errors import within_errors

FIRST = [corrections, leaders, grow, far, alike]  # once, on the recording as it is
AROUND = [neighbours, other_errors, within_errors, simpler]  # around the best set
LAST = [stand, parts, rivals]  # the best set and what it is compared with
