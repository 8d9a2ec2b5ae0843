"""The command line: one file per command."""

from glassslam.cli.app import main

__all__ = ["main"]
