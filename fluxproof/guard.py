# SPDX-License-Identifier: BSD-3-Clause
"""What surrounds every command: one line and an exit status for any error and any signal, never a traceback.

FLUXPROOF_DEBUG=1 shows the traceback, and the warnings of libraries.  Imports are made inside the functions, as Ctrl-C
during the seconds in which a command is imported is to be caught too.
"""

from __future__ import annotations

import os
import sys

STOPPED = 130  # as shells have it: 128 and the number of SIGINT
BAD_INPUT = 2
_HERE = os.path.dirname(os.path.abspath(__file__))
PACKAGES = (_HERE, os.path.join(os.path.dirname(_HERE), "golden_model"))


class CtrlC:
    """The handler of SIGINT: remembers it, as an import that it interrupts may end with another exception."""

    pressed = False

    def __call__(self, *_):
        self.pressed = True
        raise KeyboardInterrupt


def guarded(run, process: bool = False) -> int:
    """The exit status of ``run()``, or of the exception that it ended with, which is printed as one line.

    process: this process does nothing else; its streams, signals and warnings are set up for a command.
    """
    ctrl_c = CtrlC()
    try:
        if process:
            _prepare(ctrl_c)
        return _flushed(run)
    except (Exception, KeyboardInterrupt) as error:
        _no_handler(process)
        return _ended(error, ctrl_c.pressed or isinstance(error, KeyboardInterrupt))
    finally:
        _no_handler(process)


def _flushed(run) -> int:
    """The status of ``run()`` or of its SystemExit, after all of the output is out."""
    try:
        status = run()
    except SystemExit:  # of argparse
        sys.stdout.flush()
        raise
    sys.stdout.flush()
    return status


def _prepare(ctrl_c: CtrlC) -> None:
    import _thread
    import logging
    import signal
    import threading
    import warnings

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # behind `&` it is ignored, and stays so
        signal.signal(signal.SIGINT, ctrl_c)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 it stays open
        getattr(sys, name).reconfigure(errors="backslashreplace")  # file names need not be text
    if debugging():
        return

    def unraisable(entry) -> None:
        if entry.exc_type is KeyboardInterrupt:  # raised where nothing can be raised, such as in a callback from C
            threading.Timer(0.05, _thread.interrupt_main).start()

    sys.unraisablehook, threading.excepthook = unraisable, lambda entry: None
    logging.getLogger().addHandler(logging.NullHandler())
    if not sys.warnoptions:
        warnings.showwarning = lambda *_, **__: None
        os.environ.setdefault("PYTHONWARNINGS", "ignore")  # of worker processes


def debugging() -> bool:
    """Whether tracebacks and warnings are wanted."""
    return os.environ.get("FLUXPROOF_DEBUG", "") not in ("", "0")


def _no_handler(process: bool) -> None:
    """From here on a further Ctrl-C ends the process at once, without a traceback."""
    if process:
        import signal

        if callable(signal.getsignal(signal.SIGINT)):
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _ended(error: BaseException, stopped: bool) -> int:
    """Print the line of an exception; its status."""
    if debugging():
        import traceback

        traceback.print_exception(error)
    if stopped:
        exec("")  # else Python ends itself by the signal if Ctrl-C came while it ran a text, such as a dataclass
        return _told("stopped", STOPPED)
    if isinstance(error, BrokenPipeError):  # the reader, a pager or head, has closed the pipe
        _discard_output()
        return 0
    return _told(_sentence(error), BAD_INPUT)


def _told(text: str, status: int) -> int:
    from fluxproof.quote import printable

    clear = "\r\x1b[K" if sys.stderr.isatty() else ""  # a line of progress may be there
    try:  # noqa: SIM105 contextlib would be one more import, in which Ctrl-C may come
        print(f"{clear}fluxproof: {printable(text, sys.stderr.encoding)}", file=sys.stderr, flush=True)
    except OSError:  # nobody can be told
        pass
    return status


def _bad_input() -> tuple[type[Exception], ...]:
    """The exceptions whose text is the line; none where the installation is broken, which is then the error."""
    try:
        from fluxproof.diagnosis.ground.recording import RecordingError
        from golden_model.drive_keys import DriveError
    except Exception:
        return ()
    return DriveError, RecordingError


def _sentence(error: BaseException) -> str:
    if isinstance(error, _bad_input()):
        return str(error)
    if isinstance(error, OSError):
        name = error.filename if error.filename is not None else _full_output()
        return f"{os.fsdecode(name)}: {error.strerror or error}" if name else str(error.strerror or error)
    if isinstance(error, MemoryError):
        return f"not enough memory{f': {error}' if str(error) else ''}"
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return f"internal error: {what} ({_place(error)}); FLUXPROOF_DEBUG=1 shows where"


def _full_output() -> str:
    """A name for standard output if that is what cannot be written."""
    try:
        sys.stdout.flush()
    except OSError:
        _discard_output()
        return "standard output"
    return ""


def _discard_output() -> None:
    """What is still to be written to standard output goes nowhere: Python would try again at its end."""
    try:  # noqa: SIM105
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):  # no file
        pass


def _place(error: BaseException) -> str:
    """The innermost line of our packages that an exception passed, else the innermost of all."""
    import traceback

    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if frame.filename.startswith(PACKAGES)] or frames
    return f"{os.path.basename(ours[-1].filename)}:{ours[-1].lineno}" if ours else "?"
