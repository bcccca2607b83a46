# SPDX-License-Identifier: BSD-3-Clause
"""Every block of the core by its name: the BLOCK of each file golden_model/ROOM/NAME.py, in alphabetical order."""

from importlib import import_module
from pkgutil import iter_modules

import golden_model
from golden_model.block import Block


def found() -> dict[str, Block]:
    """{name: block} of all rooms; ValueError for a block that declares another place than that of its file."""
    blocks = {}
    for room in [module.name for module in iter_modules(golden_model.__path__) if module.ispkg]:
        for file in iter_modules(import_module(f"golden_model.{room}").__path__):
            block = getattr(import_module(f"golden_model.{room}.{file.name}"), "BLOCK", None)
            if block is None:
                continue
            if (block.folder, block.name) != (room, file.name):
                declared = f'folder = "{block.folder}" and name = "{block.name}"'
                raise ValueError(
                    f"golden_model/{room}/{file.name}.py: BLOCK declares {declared}, not those of its file"
                )
            blocks[block.name] = block
    return blocks


BLOCKS = found()
