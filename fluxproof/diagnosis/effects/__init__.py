# SPDX-License-Identifier: BSD-3-Clause
"""What an effect is (effect.py); corrections.py removes measurement errors from the data in turn."""
