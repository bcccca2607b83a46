# SPDX-License-Identifier: BSD-3-Clause
"""What several tests of the delivered files need."""

import pytest
from lxml import etree

from scripts.package import ipxact

S = {"s": ipxact.SPIRIT}


@pytest.fixture(scope="module")
def facts(tmp_path_factory):
    """component.xml in the words of support/vivado/stub.tcl."""
    component = etree.parse(ipxact.PATH).getroot()

    def tcl(elements) -> str:
        return "{" + " ".join(e.findtext("s:name", namespaces=S) for e in elements) + "}"

    vlnv = ":".join(component.findtext(f"s:{part}", namespaces=S) for part in ("vendor", "library", "name"))
    path = tmp_path_factory.mktemp("vivado") / "facts.tcl"
    path.write_text(
        f"set core_vlnv {vlnv}\n"
        f"set core_pins {tcl(component.findall('s:model/s:ports/s:port', S))}\n"
        f"set core_interfaces {tcl(component.findall('s:busInterfaces/s:busInterface', S))}\n"
        f"set core_parameters {tcl(component.findall('s:model/s:modelParameters/s:modelParameter', S))}\n"
    )
    return path
