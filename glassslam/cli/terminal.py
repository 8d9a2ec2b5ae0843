"""Writing to the terminal: results to standard output, complaints as one line to standard error."""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from glassslam.errors import OutputError

if TYPE_CHECKING:
    from rich.console import RenderableType

_LONGEST = 1000  # characters: messages quote what they have found
# Names from a recording may hold what moves the cursor or renames the window; colours are harmless.
_CONTROL = re.compile(r"\x1b(?!\[[0-9;]*m)|[\x00-\x08\x0b-\x1a\x1c-\x1f\x7f-\x9f]")


def emit(text: str) -> None:
    """Write a result to standard output; a reader that has gone away is no error.

    Raises
    ------
    OutputError
        Standard output cannot be written for another reason.
    """
    # Started with a closed descriptor, Python has no stream at all.
    if sys.stdout is None:
        return
    with _output():
        sys.stdout.write(_writable(text, sys.stdout.encoding))
        sys.stdout.flush()


def emit_rich(*parts: "RenderableType") -> None:
    """Render tables and the like for the width and the colours of standard output, and write them.

    Raises
    ------
    OutputError
        Standard output cannot be written, as by `emit`.
    """
    from rich.console import Console  # noqa: PLC0415  (40 ms)

    if sys.stdout is None:
        return
    console = Console(markup=False, highlight=False, emoji=False)
    with _output(), console.capture() as capture:  # which flushes standard output
        for part in parts:
            # a path or a warning that is cut in two can neither be copied nor searched for
            console.print(part, soft_wrap=isinstance(part, str))
    emit(capture.get())


@contextmanager
def _output() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        discard_output()
    except OSError as error:
        discard_output()
        raise OutputError(f"cannot write to standard output: {error.strerror}") from error


def complain(message: str, hint: str = "", *, code: int) -> int:
    """Write one line with cause and hint to standard error, and hand the exit code on."""
    message = message if len(message) <= _LONGEST else f"{message[:_LONGEST]} ..."
    line = f"error: {message} ({hint})" if hint else f"error: {message}"
    if sys.stderr is not None:
        try:
            sys.stderr.write(_writable(" ".join(line.split()), sys.stderr.encoding) + "\n")
            sys.stderr.flush()
        except OSError:
            pass
    return code


def discard_output() -> None:
    """Send what is still to be written nowhere: flushing at the end of the process must not fail."""
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, sys.stdout.fileno())
    finally:
        os.close(sink)


def _writable(text: str, encoding: str | None) -> str:
    """Replace what the stream cannot encode, or what commands a terminal: names may hold any byte."""
    text = _CONTROL.sub(lambda match: f"\\x{ord(match[0]):02x}", text)
    return text.encode(encoding or "utf-8", "backslashreplace").decode(encoding or "utf-8")
