"""The truth of a simulated recording, written beside it."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from glassslam.errors import OutputError
from glassslam.geometry import inverse, transform_points
from glassslam.outputs.trajectory import write_tum
from glassslam.records import FloatArray
from glassslam.simulation.floorplan import FloorPlan
from glassslam.simulation.simulate import Simulation
from glassslam.simulation.truth_log import TruthLog


class TruthPaths(NamedTuple):
    """The files of truth that belong to a bag."""

    trajectory: Path
    plan: Path
    labels: Path
    glass: Path


def truth_paths(bag: str | Path) -> TruthPaths:
    """Names of the true trajectory, floor plan, beam labels and glass that belong to a bag."""
    bag = Path(bag)
    endings = (".truth.tum", ".truth.json", ".truth.labels.npz", ".truth.glass.geojson")
    return TruthPaths(*(bag.with_name(bag.name + ending) for ending in endings))


def write_truth(simulation: Simulation, bag: str | Path, log: TruthLog) -> TruthPaths:
    """Write poses, surfaces, the label of every beam, and the glass.

    Trajectory and plan are in the world frame of the scene; the glass is in the map frame of a run, which is
    the frame of the base at the first scan.

    Parameters
    ----------
    simulation : Simulation
        What was recorded.
    bag : str or Path
        The recording the truth belongs to.
    log : TruthLog
        What its beams met.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    paths = truth_paths(bag)
    try:
        write_tum(simulation.truth, paths.trajectory)
        paths.plan.write_text(json.dumps(_describe(simulation), indent=1) + "\n", encoding="utf-8")
        log.save(paths.labels, simulation.truth.stamps)
        glass = json.dumps(_glass(simulation, log.answered()), indent=1)
        paths.glass.write_text(glass + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write the truth beside {bag}: {error.strerror}") from error
    return paths


def _describe(simulation: Simulation) -> dict[str, Any]:
    palette, plan = simulation.scene.palette(), simulation.plan
    return {
        "scene": simulation.scene.name,
        "sensor": simulation.sensor.name,
        "seed": simulation.seed,
        "driven_m": round(simulation.driven, 3),
        "laser_pose": list(simulation.scene.laser_pose),
        "world_from_map": _rounded(simulation.truth.poses[0]),
        "materials": {name: palette[name].figures() for name in plan.materials},
        "glass_m": round(float(_lengths(plan)[_is_glass(simulation)].sum()), 3),
        "opaque_m": round(float(_lengths(plan)[~_is_glass(simulation)].sum()), 3),
        "walls": _walls(plan),
    }


def _walls(plan: FloorPlan) -> list[dict[str, Any]]:
    """Segments gathered by the thing they belong to, in the order of the scene."""
    walls: dict[tuple[str, int], dict[str, Any]] = {}
    for name, material, segment in zip(plan.names, plan.material, plan.segments, strict=True):
        entry = {"name": name, "material": plan.materials[material], "segments": []}
        walls.setdefault((name, int(material)), entry)["segments"].append(_rounded(segment))
    return list(walls.values())


def _glass(simulation: Simulation, answered: FloatArray) -> dict[str, Any]:
    """One line for every pane, with how much of it has answered at least one beam."""
    plan, world_from_map = simulation.plan, simulation.truth.poses[0]
    corners = transform_points(inverse(world_from_map), plan.segments.reshape(-1, 2)).reshape(-1, 2, 2)
    lengths = _lengths(plan)
    return {
        "type": "FeatureCollection",
        "frame": "map: the base at the first scan; metres",
        "world_from_map": _rounded(world_from_map),
        "features": [
            {
                "type": "Feature",
                "geometry": {"type": "LineString", "coordinates": [_rounded(end) for end in corners[k]]},
                "properties": {
                    "kind": "wall",
                    "name": plan.names[k],
                    "material": plan.materials[plan.material[k]],
                    "lean_deg": round(float(np.rad2deg(plan.lean[k])), 3),
                    "length_m": round(float(lengths[k]), 3),
                    "answered_m": round(float(answered[k]), 3),
                },
            }
            for k in np.flatnonzero(_is_glass(simulation))
        ],
    }


def _is_glass(simulation: Simulation) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    palette, plan = simulation.scene.palette(), simulation.plan
    return np.array([palette[plan.materials[m]].kind == "glass" for m in plan.material], dtype=np.bool_)


def _lengths(plan: FloorPlan) -> FloatArray:
    lengths: FloatArray = np.hypot(*(plan.segments[:, 2:] - plan.segments[:, :2]).T)
    return lengths


def _rounded(values: FloatArray) -> list[float]:
    return [round(float(value), 6) for value in values]
