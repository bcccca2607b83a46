# SPDX-License-Identifier: BSD-3-Clause
"""Texts that users read use the words of the field: no string, template or heading contains a word of the list.

Strings are those of all modules of the package that are neither docstrings nor single words (keys, codes, names).
"""

from __future__ import annotations

import ast
import re

import pytest

from fluxproof.checkout import ROOT

# {what to avoid: what to write instead}; patterns are searched in lower case
BETTER = {
    r"\btold\b": "reported, or flagged",
    r"\bcannot tell\b|\bwhat tells\b|\bonly\b[^.]* tells\b": "cannot separate; shows",
    r"\b(what|which) (is|was|are) left\b|\bleftovers?\b|\bwhat is beside\b": "the residual",
    r"\bthe rest (is|was|looks|of the (misfit|difference))\b|\bof the rest\b": "the residual",
    r"\b(un)?explained remainder\b|\bshares? a remainder\b": "residual",
    r"\b(not |nothing |is |are )assert(s|ed)\b": "reported; not significant; rejected",
    r"\b(this|that|another|the same) course\b": "dependence",
    r"\b(is|are|it|read) as if\b": "looks as if, or the interpretation that",
    r"\bthat (was|were) not fitted\b": "held-out",
    r"\bof which\b[^.]*\bonly\b": "only one of ...; mutually exclusive",
    r"\bas (of an?|behind)\b|\bwould be like it\b": "as with, like",
    r"\b(name|file|time|speed|angle|recording|column|emf)s? says?\b|\bsays? (otherwise|so|which)\b": "states, shows",
    r"\bbesides?, it\b|\bbeside (?!this folder|this script)": "in addition, with",
    r"\b(is|was|are|were) kept\b|\bkept of\b": "retained, reused, not changed",
    r"\bspread of manufacture\b": "production tolerance",
    r"\bstands? out of it\b|\bgoes on from here\b": "is significant; resumes",
}
QUIET = ("cosim", "plant")  # rooms below the commands: what they raise is for developers


def sentences(source: str) -> list[tuple[int, str]]:
    """[(line, text)] of the string literals of a module: no docstrings, fields of f-strings as {}."""
    tree = ast.parse(source)
    skipped = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}  # docstrings
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            skipped |= {id(part) for part in node.values}
            found.append((node, "".join(p.value if isinstance(p, ast.Constant) else "{}" for p in node.values)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.append((node, node.value))
    return [(n.lineno, text) for n, text in found if id(n) not in skipped and " " in text.strip()]


def avoided(text: str) -> list[str]:
    """'phrase': better word, for everything in a text that is on the list."""
    plain = " ".join(text.lower().split())
    return [f"{hit[0]!r}: write {word}" for phrase, word in BETTER.items() if (hit := re.search(phrase, plain))]


def complaints(name: str, texts) -> list[str]:
    """'file:line: phrase: better word' of texts (line, text)."""
    return [f"{name}:{line}: {wrong}" for line, text in texts for wrong in avoided(text)]


def modules():
    rooms = ROOT / "fluxproof"
    return [p for p in sorted(rooms.rglob("*.py")) if p.relative_to(rooms).parts[0] not in QUIET]


def test_strings_of_the_package():
    wrong = [w for p in modules() for w in complaints(str(p.relative_to(ROOT)), sentences(p.read_text()))]
    assert not wrong, "\n".join(wrong)


def test_templates_and_headings():
    """Templates line by line without what Jinja fills in; headings of README and docs."""
    wrong = []
    for page in sorted((ROOT / "fluxproof").rglob("*.html")):
        lines = enumerate(page.read_text().splitlines(), 1)
        texts = [(n, re.sub(r"{%.*?%}|{{.*?}}|<[^>]*>", " ", line)) for n, line in lines]
        wrong += complaints(str(page.relative_to(ROOT)), texts)
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        lines = enumerate(page.read_text().splitlines(), 1)
        wrong += complaints(str(page.relative_to(ROOT)), [(n, line) for n, line in lines if line.startswith("#")])
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "source, found",
    [
        ('x = f"{name}: {share} of it is told"', True),
        ('x = ("Look for what rises: no effect "\n    "has this course.")', True),
        ('raise ValueError(f"{a} {b} group of which a drive has one only")', True),
        ('"""What is told and what is left."""\n# the rest is told', False),
        ('def f():\n    """Told."""\n    return "The residual is reported."', False),
    ],
)
def test_strings_are_found_and_comments_are_not(source, found):
    assert bool(complaints("x.py", sentences(source))) == found
