# SPDX-License-Identifier: BSD-3-Clause
"""The only room that makes sentences: headline, details, advice and notes of an answer."""
