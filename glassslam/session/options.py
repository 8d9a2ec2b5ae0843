"""How the options of a recording are written down in a session, and read again."""

from pathlib import Path
from typing import Any

from glassslam.session.identity import Recorded, identify
from glassslam.session.store import tupled
from glassslam.sources import SourceOptions
from glassslam.sources.rings import ring_names


def options_of(values: dict[str, Any], sonar: Recorded | None) -> SourceOptions:
    """The options of a run, with the second file of readings where it is now."""
    given: dict[str, Any] = {name: tupled(value) for name, value in values.items()}
    given["sonar"] = None if sonar is None else sonar.found()
    if (ring := ring_file(values)) is not None:
        given["sonar_ring"] = ring.path
    return SourceOptions(**given)


def stored_ring(value: str | Path | None) -> str | dict[str, str] | None:
    """Where the sonars sit, by name or as a file: that by its whole path, which leads there from anywhere."""
    if value is None or str(value) in ring_names() or not Path(value).is_file():
        return None if value is None else str(value)
    known = identify(value)
    return {"path": known.path, "digest": known.digest}


def ring_file(values: dict[str, Any]) -> Recorded | None:
    """The file that tells where the sonars sit; None where it is a name, or none is given."""
    ring = values["sonar_ring"]
    return Recorded(given=ring["path"], **ring) if isinstance(ring, dict) else None
