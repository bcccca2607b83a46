# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof/quote.py: any string of Unicode in, read back the same by the language itself, or refused by name."""

from __future__ import annotations

import json
import re
import warnings

import jinja2
import pytest

from cocotb_tests.support.untrusted.foreign_text import PIECES, Page, c_tokens, tcl_calls, unescaped, vhdl_analysed
from fluxproof import quote
from fluxproof.command import main
from fluxproof.diagnosis.report import page, theme
from fluxproof.files import write_json
from fluxproof.fleet import page as fleet_page
from fluxproof.simulate import page as simulation_page
from golden_model.drive_file import tomllib
from golden_model.drive_keys import DriveError

hypothesis = pytest.importorskip("hypothesis")
st = hypothesis.strategies

TEXT = st.lists(st.one_of(st.sampled_from(PIECES), st.integers(0, 0x10FFFF).map(chr)), max_size=8).map("".join)
MANY = st.lists(TEXT, min_size=40, max_size=80)  # for one run of a program


def examples(count: int):
    """Settings of a test: the same strings each time, no files in the checkout."""
    checks = [hypothesis.HealthCheck.function_scoped_fixture, hypothesis.HealthCheck.too_slow]
    more = {"deadline": None, "derandomize": True, "database": None, "suppress_health_check": checks}
    return hypothesis.settings(max_examples=count, **more)


def with_pieces(strategy):
    """The strategy, and first all pieces at once, each alone and between letters."""
    each = [*PIECES, *(f"a{piece}b" for piece in PIECES), ""]
    return lambda test: hypothesis.example(each)(hypothesis.given(strategy)(test))


@examples(8)
@with_pieces(MANY)
def test_a_word_of_tcl(tmp_path, texts):
    """Alone and inside braces; what Vivado's Tcl cannot hold is refused."""
    held = []
    for text in texts:
        if re.search("[\ud800-\udfff\U00010000-\U0010ffff]", text):
            with pytest.raises(DriveError, match=r"U\+[0-9A-F]{4,6} cannot be written into a script of Tcl"):
                quote.tcl_word(text)
        else:
            held.append(text)
    words = [quote.tcl_word(text) for text in held]
    script = "".join(f"keep {word}\nif 1 {{\n  keep {word}\n}}\n" for word in words)
    assert tcl_calls(script, tmp_path) == [text for text in held for _ in range(2)]


@examples(8)
@with_pieces(MANY)
def test_a_comment_of_tcl(tmp_path, texts):
    script = "".join(
        f'{c}\nkeep "{k}"\nif 1 {{\n{c}\nkeep "{k} inside"\n}}\n' for k, c in enumerate(map(quote.tcl_comment, texts))
    )
    assert tcl_calls(script, tmp_path) == [f"{k}{more}" for k in range(len(texts)) for more in ("", " inside")]
    for text in texts:
        assert unescaped(quote.tcl_comment(text)) == f"# {text}".rstrip(" ")


@examples(8)
@with_pieces(MANY)
def test_a_comment_of_c_and_of_a_device_tree(tmp_path, texts):
    comments = [f(text) for text in texts for f in (quote.c_comment, lambda t: quote.c_comment(t, "", t))]
    script = "".join(f"{comment}\nk{n}\n" for n, comment in enumerate(comments))
    assert c_tokens(script, tmp_path) == [f"k{n}" for n in range(len(comments))]
    for text in texts:
        assert unescaped(quote.c_comment(text)) == f"/* {text} */"
        assert quote.c_comment(text, text).count("\n") == 2


@examples(4)
@with_pieces(MANY)
def test_a_comment_of_vhdl(tmp_path, texts):
    lines = [f"{quote.vhdl_comment(text)}\n  constant c{n} : natural := {n};" for n, text in enumerate(texts)]
    total = " + ".join(f"c{n}" for n in range(len(texts)))
    head, end = "package p is", f"  constant total : natural := {total};\nend package p;\n"
    vhdl_analysed("\n".join([head, *lines, end]), tmp_path)
    for text in texts:
        assert unescaped(quote.vhdl_comment(text)) == f"-- {text.strip(' ')}".rstrip(" ")


@pytest.mark.parametrize("order", ["pragma translate_off", " synthesis translate_off", "PSL assert x;", "synopsys off"])
def test_a_comment_of_vhdl_is_no_order_to_a_tool(order):
    found = quote.vhdl_comment(order)
    assert order.strip().split()[0] not in found and unescaped(found) == f"-- {order.strip()}"


@examples(300)
@hypothesis.given(TEXT, TEXT)
def test_a_key_and_a_comment_of_toml(text, other):
    import tomlkit

    document, table, item = tomlkit.document(), tomlkit.table(), tomlkit.item(1)
    item.comment(quote.toml_comment(other))
    document["columns"] = table
    if re.search("[\ud800-\udfff]", text):
        with pytest.raises(DriveError, match="cannot be written into a TOML file"):
            quote.toml_key(text)
        return
    table[quote.toml_key(text)] = item
    assert tomllib.loads(tomlkit.dumps(document)) == {"columns": {text: 1}}


@examples(300)
@hypothesis.given(TEXT)
def test_a_value_of_a_page(text):
    """In a text and in an attribute; a control character, which a browser drops or replaces, is shown instead."""
    template = '<p title="{{ x }}">{{ x }}</p><b>{{ "a" ~ x }}</b>{{ x | replace("_", " ") }}'
    html = quote.pages().from_string(template).render(x=text)
    html.encode()
    found, seen = Page(html), quote.visible(text)
    assert found.tags == [("p", ["title"]), ("b", [])] and found.values == [seen]
    assert found.text == f"{seen}a{seen}{quote.visible(text.replace('_', ' '))}"
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\ud800-\udfff]", html)


def test_every_template_of_the_product_escapes():
    templates = [path for room in (page, fleet_page, simulation_page) for path in room.FOLDER.glob("*.html")]
    assert len(templates) >= 4
    for path in templates:
        assert "|safe" not in path.read_text().replace(" ", "") and "autoescape" not in path.read_text(), path
    assert quote.pages(page.FOLDER).autoescape is True
    with pytest.raises(jinja2.UndefinedError):
        quote.pages().from_string("{{ nothing }}").render()


@examples(300)
@hypothesis.given(TEXT)
def test_a_label_of_a_picture_is_no_formula(text):
    from matplotlib.text import Text

    assert Text(0, 0, "")._preprocess_math(quote.mathtext(text)) == (text, False)
    label, math = Text(0, 0, "")._preprocess_math(theme.plain(text))
    assert not math and "\n" not in label and len(label) <= 40


@pytest.mark.parametrize("text", ["".join(PIECES[:30]), "".join(PIECES[30:]), "$\\frac{a}{b$", "a" * 38 + "$$$$"])
def test_a_picture_holds_text_as_text(text):
    figure, axis = theme.axes(height=1.0)
    axis.set(title=theme.plain(text))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a font may lack a glyph
        found = Page(str(theme.picture("name", figure, text).svg))
    assert quote.visible(text) in found.values and found.text.strip() == ""
    assert {tag for tag, _ in found.tags} <= {"svg", "g", "path", "defs", "use", "clippath", "rect"}


@examples(300)
@hypothesis.given(TEXT, st.sampled_from(["utf-8", "ascii", "cp1252", "cp932", None]))
def test_a_line_of_a_terminal(text, encoding):
    found = quote.printable(text, encoding)
    assert found.isprintable() and found.encode(encoding or "utf-8").decode(encoding or "utf-8") == found


@examples(200)
@hypothesis.given(TEXT)
def test_a_string_of_json(tmp_path, text):
    found = json.loads(write_json(tmp_path / "x.json", {text: text}).read_bytes().decode("ascii"))
    same = text.encode("utf-16", "surrogatepass").decode("utf-16", "surrogatepass")  # two halves are one character
    assert found == {same: same}


def test_a_mistaken_argument_is_repeated_without_its_control_characters(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["registers", "d.toml", "--x\x1b]0;title\x07"])
    assert "\x1b" not in capsys.readouterr().err
