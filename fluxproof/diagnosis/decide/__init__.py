# SPDX-License-Identifier: BSD-3-Clause
"""From a posterior to a Decision: every rule that makes a verdict or withholds a name.

rules.py applies them in order; verdict.py, names.py, ambiguity.py, credibility.py, sized.py, interpretation.py and
one_point.py hold one kind each.  Sentences are made in words/, the next recording in plan/.
"""
