"""The truth of a simulated recording, written beside it."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from glassslam.errors import OutputError
from glassslam.geometry import compose, inverse, transform_points
from glassslam.outputs.labels import FREE, GLASS, SOLID, UNKNOWN, write_label_image
from glassslam.outputs.map_server import write_map
from glassslam.outputs.trajectory import write_tum
from glassslam.records import FloatArray
from glassslam.simulation.floorplan import FloorPlan, scene_pieces
from glassslam.simulation.scene import Scene
from glassslam.simulation.simulate import Simulation
from glassslam.simulation.truth_log import TruthLog
from glassslam.simulation.truth_map import TrueMap, draw_true_map, in_map_frame, in_sight


class TruthPaths(NamedTuple):
    """The files of truth that belong to a bag."""

    trajectory: Path
    plan: Path
    labels: Path
    glass: Path
    map: Path
    image: Path
    classes: Path


def truth_paths(bag: str | Path) -> TruthPaths:
    """Names of the true trajectory, floor plan, beam labels, glass and map that belong to a bag."""
    bag = Path(bag)
    endings = ("tum", "json", "labels.npz", "glass.geojson", "map.yaml", "map.pgm", "map.labels.png")
    return TruthPaths(*(bag.with_name(f"{bag.name}.truth.{ending}") for ending in endings))


def write_truth(simulation: Simulation, bag: str | Path, log: TruthLog) -> TruthPaths:
    """Write poses, surfaces, the label of every beam, the glass, and the map (map_server) with its classes.

    Trajectory and plan are in the world frame of the scene; glass and map are in the map frame of a run,
    which is the frame of the base at the first scan.

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
        log.save(paths.labels, simulation.truth.stamps, _lasers(simulation))
        glass = json.dumps(_glass(simulation, log.answered()), indent=1)
        paths.glass.write_text(glass + "\n", encoding="utf-8")
        write_true_map(true_map(simulation), paths)
    except OSError as error:
        raise OutputError(f"cannot write the truth beside {bag}: {error.strerror}") from error
    return paths


def true_map(simulation: Simulation, *, seen: bool = False) -> TrueMap:
    """The map a perfect sensor would have drawn, in the map frame of a run.

    Parameters
    ----------
    simulation : Simulation
        The scene and the path.
    seen : bool
        Only what can be seen from the path (see `in_sight`), else all that can be reached.
    """
    world_from_map = simulation.truth.poses[0]
    path = transform_points(inverse(world_from_map), simulation.motion.poses[::20, :2])
    segments = in_map_frame(simulation.plan.segments, world_from_map)
    drawn = draw_true_map(segments, _is_glass(simulation), path)
    return in_sight(drawn, segments, path) if seen else drawn


def write_true_map(drawn: TrueMap, paths: TruthPaths) -> None:
    """Write a true map and the class of its cells.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    write_map(drawn.grid, paths.map)
    occupied, free = drawn.grid.probability == 1.0, drawn.grid.probability == 0.0
    labels = np.select((drawn.glass, occupied, free), (GLASS, SOLID, FREE), UNKNOWN)
    write_label_image(labels.astype(np.uint8), paths.classes)


def _lasers(simulation: Simulation) -> FloatArray:
    """True poses of the laser at the stamps of the scans, world frame, shape (n, 3)."""
    return compose(simulation.truth.poses, np.array(simulation.scene.laser_pose))


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
    } | _solids(simulation.scene)


def _solids(scene: Scene) -> dict[str, Any]:
    """Heights of all things, for a robot that hears above and below its lidar."""
    if scene.ultrasonic is None:
        return {}
    return {
        "laser_height": scene.laser_height,
        "ceiling": scene.ceiling,
        "solids": [
            {
                "name": piece.name,
                "material": piece.material,
                "z_low": piece.z_low,
                "z_high": piece.z_high,
                "segments": [_rounded(segment) for segment in piece.outline],
            }
            for piece in scene_pieces(scene)
        ],
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
