# SPDX-License-Identifier: BSD-3-Clause
"""From the posterior to the answer: names, ambiguities, sizes, verdict, sentence."""
