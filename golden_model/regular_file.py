# SPDX-License-Identifier: BSD-3-Clause
"""Opens regular files only: a FIFO or a device of a stranger would block the reader, or never end."""

import errno
import os
import stat

KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def open_regular(path):
    """The file, open for reading bytes; OSError if it is missing, or says what it is instead of a regular file."""
    _check(os.stat(path).st_mode, path)  # before opening, as opening a device may already have an effect
    # Another process may replace the file in between: without O_NONBLOCK, opening a FIFO waits for its writer.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        _check(os.fstat(handle).st_mode, path)
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def read_regular(path, most):
    """The bytes of a regular file; OSError as above, and if it has more than ``most`` bytes."""
    with open_regular(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"more than {most} bytes", str(path))
    return data


def _check(mode, path):
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, f"{KINDS.get(stat.S_IFMT(mode), 'not a file')}, not a regular file", str(path))
