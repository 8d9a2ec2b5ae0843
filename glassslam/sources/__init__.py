"""Recordings of every format become one stream of plain records."""

from glassslam.sources.options import SourceOptions
from glassslam.sources.recording import Recording, open_recording

__all__ = ["Recording", "SourceOptions", "open_recording"]
