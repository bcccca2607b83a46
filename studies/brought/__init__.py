# SPDX-License-Identifier: BSD-3-Clause
"""What people bring, as a bench would write it: a generator for each kind of file, judged as the study ``mishaps``."""
