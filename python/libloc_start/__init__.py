"""Where the installed programs begin: Ctrl-C ends them without a traceback, however early it comes.

Outside of the package libloc, because all that is inside imports NumPy and the C++ library first: those are
most of the half second in which Ctrl-C would otherwise meet an import.
"""

from __future__ import annotations

import os
import signal
import sys
from importlib import import_module
from pathlib import Path
from types import FrameType

EXIT_INTERRUPTED = 130


def _leave(signum: int, frame: FrameType | None) -> None:
    # No exception: imports that try something, and go on without it, would catch it or make another of it.
    os._exit(EXIT_INTERRUPTED)


def _run(program: str) -> int:
    # Who started it in the background may have wished that Ctrl-C be ignored.
    interruptible = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if interruptible:
        signal.signal(signal.SIGINT, _leave)
    main = import_module(f"libloc.programs.{program}").main
    if interruptible:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return int(main())
    except KeyboardInterrupt:
        print(f"{Path(sys.argv[0]).name}: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


def animate() -> int:
    return _run("animate")


def calibrate() -> int:
    return _run("calibrate")


def evaluate() -> int:
    return _run("evaluate")


def gopro() -> int:
    return _run("gopro")


def slam() -> int:
    return _run("slam")


def study() -> int:
    return _run("study")


def view() -> int:
    return _run("view")
