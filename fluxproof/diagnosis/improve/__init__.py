# SPDX-License-Identifier: BSD-3-Clause
"""From a Decision to the files with the identified values: drive_improved.toml and flux_map.csv."""
