"""The truth of a simulated recording, written beside it."""

import json
from pathlib import Path
from typing import Any

from glassslam.errors import OutputError
from glassslam.outputs.trajectory import write_tum
from glassslam.simulation.floorplan import FloorPlan
from glassslam.simulation.simulate import Simulation


def truth_paths(bag: str | Path) -> tuple[Path, Path]:
    """Names of the true trajectory and of the true floor plan that belong to a bag."""
    bag = Path(bag)
    return bag.with_name(bag.name + ".truth.tum"), bag.with_name(bag.name + ".truth.json")


def write_truth(simulation: Simulation, bag: str | Path) -> tuple[Path, Path]:
    """Write the pose of the base at every scan, and every surface with its material.

    Parameters
    ----------
    simulation : Simulation
        What was recorded.
    bag : str or Path
        The recording the truth belongs to.

    Returns
    -------
    tuple of Path
        Trajectory (TUM) and floor plan (JSON), both in the world frame of the scene.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    trajectory, plan = truth_paths(bag)
    try:
        write_tum(simulation.truth, trajectory)
        plan.write_text(json.dumps(_describe(simulation), indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write the truth beside {bag}: {error.strerror}") from error
    return trajectory, plan


def _describe(simulation: Simulation) -> dict[str, Any]:
    palette = simulation.scene.palette()
    return {
        "scene": simulation.scene.name,
        "sensor": simulation.sensor.name,
        "seed": simulation.seed,
        "driven_m": round(simulation.driven, 3),
        "laser_pose": list(simulation.scene.laser_pose),
        "materials": {name: palette[name].model_dump() for name in simulation.plan.materials},
        "walls": _walls(simulation.plan),
    }


def _walls(plan: FloorPlan) -> list[dict[str, Any]]:
    """Segments gathered by the thing they belong to, in the order of the scene."""
    walls: dict[str, dict[str, Any]] = {}
    for name, material, segment in zip(plan.names, plan.material, plan.segments, strict=True):
        entry = walls.setdefault(name, {"name": name, "material": plan.materials[material], "segments": []})
        entry["segments"].append([round(float(v), 6) for v in segment])
    return list(walls.values())
