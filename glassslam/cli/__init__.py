"""The command line: one file per command."""

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; see `glassslam.cli.app.main`."""
    try:
        from glassslam.cli.app import main as run  # noqa: PLC0415  (a Ctrl-C while it is loaded is met here)
    except KeyboardInterrupt:
        sys.stderr.write("error: interrupted\n")
        return 130
    return run(arguments)


__all__ = ["main"]
