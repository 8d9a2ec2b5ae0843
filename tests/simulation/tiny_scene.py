"""Tiny worlds for the tests of the simulation."""

from typing import Any

from glassslam.simulation import Scene

SQUARE = [[0, 0], [6, 0], [6, 6], [0, 6]]


def scene(**changes: Any) -> Scene:
    """A square room of 6 m and a robot that drives 2 m along its middle."""
    plan: dict[str, Any] = {
        "name": "room",
        "walls": [{"name": "room", "material": "plaster", "points": SQUARE, "closed": True}],
        "drive": {"waypoints": [{"at": [2, 3]}, {"at": [4, 3]}]},
    }
    return Scene.model_validate(plan | changes)
