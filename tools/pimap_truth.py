"""Draw the true map of scene 4 of pi-map from the floor plan we measured, or measure the plan again.

python tools/pimap_truth.py -o truth                     truth/pimap_scene4.yaml, .pgm and .labels.png
python tools/pimap_truth.py -o truth --as-measured       bent as the published poses are
python tools/pimap_truth.py -o truth --onto MAP          bowed as the walls of a map are
python tools/pimap_truth.py --measure $GLASSSLAM_DATA/pimap    fit every line to the recording anew
glassslam evaluate MAP --truth truth/pimap_scene4.yaml   compare
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pimap_bow import Bow, bow_of, bowed
from pydantic import BaseModel, ConfigDict, Field
from rich.console import Console
from rich.table import Table

from glassslam.errors import GlassSlamError, OutputError, RecordingError
from glassslam.evaluation import align_maps, read_map
from glassslam.outputs import write_map
from glassslam.outputs.labels import FREE, GLASS, SOLID, UNKNOWN, write_label_image
from glassslam.records import FloatArray
from glassslam.simulation import TrueMap, draw_true_map
from glassslam.slam.result import OccupancyMap
from glassslam.yamlmodel import load_yaml_model

PLAN = Path(__file__).resolve().parents[1] / "datasets" / "pimap" / "scene4_plan.yaml"
Point = tuple[float, float]

_TICKS_TO_UNIX = 62135596800.0
_HEADER_AHEAD = 0.1
_NEAR = 0.06


class Line(BaseModel):
    """One straight piece of the plan."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    name: str
    kind: Literal["wall", "glass", "edge"]
    by: Literal["lidar", "sonar", "inferred"] = "inferred"
    start: Annotated[Point, Field(alias="from")]
    end: Annotated[Point, Field(alias="to")]
    points: int = 0
    """Returns the line was fitted to."""
    scatter: float = 0.0
    """Their standard deviation across the line, m."""
    sigma: float = 0.1
    """Uncertainty of the line across itself, m."""


class Plan(BaseModel):
    """A measured floor plan."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    resolution: Annotated[float, Field(gt=0)]
    seeds: tuple[Point, ...]
    """Places that are free."""
    bend: tuple[Point, ...]
    """x and how far the poses have left the straight line there, m."""
    segments: tuple[Line, ...]

    def lines(self, *, straight: bool) -> FloatArray:
        """End points (n, 4), in a straight hallway or as measured, m."""
        ends = np.array([(*line.start, *line.end) for line in self.segments])
        if straight:
            x, offset = np.array(self.bend).T
            ends[:, 1::2] -= np.interp(ends[:, 0::2], x, offset)
        return ends


def draw(plan: Plan, *, straight: bool = True, bow: Bow | None = None) -> TrueMap:
    """Raster the plan; the edges of the mapped area bound free space and are unknown themselves."""
    lines = plan.lines(straight=straight)
    kinds = np.array([line.kind for line in plan.segments])
    if bow is not None:
        lines, of_line = bowed(lines, bow)
        kinds = kinds[of_line]
    seeds = np.array(plan.seeds)
    drawn = draw_true_map(lines, kinds == "glass", seeds, plan.resolution)
    # the cells of everything but the edges, found as those of glass are
    real = draw_true_map(lines, kinds != "edge", seeds, plan.resolution).glass
    probability = drawn.grid.probability.copy()
    probability[(probability == 1.0) & ~real] = np.nan
    return TrueMap(replace(drawn.grid, probability=probability), drawn.glass)


def write(plan: Plan, folder: Path, *, straight: bool, bow: Bow | None = None) -> None:
    """Write the map_server files and the classes, and say how large the scene is."""
    drawn = draw(plan, straight=straight, bow=bow)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        paths = write_map(drawn.grid, folder / f"{plan.name}.yaml")
        occupied, free = drawn.grid.probability == 1.0, drawn.grid.probability == 0.0
        labels = np.select((drawn.glass, occupied, free), (GLASS, SOLID, FREE), UNKNOWN).astype(np.uint8)
        paths.append(write_label_image(labels, folder / f"{plan.name}.labels.png"))
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from error
    rows, columns = np.nonzero(~np.isnan(drawn.grid.probability))
    size = [(np.ptp(part) + 1) * plan.resolution for part in (columns, rows)]
    print(
        f"{size[0]:.2f} m x {size[1]:.2f} m, {100 * drawn.glass_share:.1f} % of the occupied cells are glass"
    )
    for path in paths:
        print(f"wrote {path}")


def onto(plan: Plan, lidar_map: OccupancyMap) -> Bow:
    """The bow of a map against the plan."""
    return bow_of(plan, lidar_map, align_maps(lidar_map, draw(plan).grid))


def returns(folder: Path) -> FloatArray:
    """All lidar returns (n, 2) in the frame of the published poses, m."""
    from rosbags.highlevel import AnyReader  # noqa: PLC0415  (only measuring needs it)

    bag, text = folder / "scene4.bag", folder / "scene4_pose.txt"
    if not (bag.is_file() and text.is_file()):
        raise RecordingError(
            f"{folder} does not hold scene4.bag and scene4_pose.txt", "see datasets/pi-map.yaml"
        )
    table = np.loadtxt(text)
    stamps = table[:, 3] / 1e7 - _TICKS_TO_UNIX
    fresh = np.r_[True, (np.diff(table[:, 4:7], axis=0) != 0.0).any(axis=1) & (np.diff(stamps) > 1e-6)]
    stamps, poses = stamps[fresh], table[fresh, 4:7]
    poses[:, 2] = np.unwrap(poses[:, 2])
    points = []
    with AnyReader([bag]) as reader:
        for connection, _, raw in reader.messages():
            scan: Any = reader.deserialize(raw, connection.msgtype)
            stamp = scan.header.stamp.sec + scan.header.stamp.nanosec * 1e-9 - _HEADER_AHEAD
            if stamps[0] <= stamp <= stamps[-1]:
                x, y, yaw = (np.interp(stamp, stamps, poses[:, k]) for k in range(3))
                angle = yaw + scan.angle_min + np.arange(len(scan.ranges)) * scan.angle_increment
                met = np.isfinite(scan.ranges) & (scan.ranges > 0.15) & (scan.ranges < 5.0)
                r, angle = scan.ranges[met], angle[met]
                points.append(np.stack((x + r * np.cos(angle), y + r * np.sin(angle)), axis=1))
    return np.concatenate(points)


def across(points: FloatArray, line: Line) -> FloatArray:
    """Signed distances from a line of the points near it, m; its ends, where other walls begin, left out."""
    a, b = np.array(line.start), np.array(line.end)
    length = float(np.hypot(*(b - a)))
    u = (b - a) / length
    along, aside = (points - a) @ u, (points - a) @ np.array([-u[1], u[0]])
    cut = min(0.05, 0.2 * length)
    near: FloatArray = aside[(along > cut) & (along < length - cut) & (np.abs(aside) < _NEAR)]
    return near


def measure(plan: Plan, folder: Path) -> Table:
    """How the returns lie around every line that was measured by lidar."""
    points = returns(folder)
    table = Table(title="returns within 6 cm of each line: number, mean offset and scatter across it, m")
    for heading in ("line", "points", "offset", "scatter", "in the plan"):
        table.add_column(heading, justify="left" if heading == "line" else "right")
    for line in plan.segments:
        if line.by != "lidar" or line.kind == "edge":
            continue
        near = across(points, line)
        table.add_row(
            line.name,
            str(near.size),
            f"{near.mean():+.3f}",
            f"{near.std():.3f}",
            f"{line.points}, {line.scatter:.3f}",
        )
    return table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="where the map is written")
    parser.add_argument("--as-measured", action="store_true", help="keep the bend of the published poses")
    parser.add_argument("--onto", type=Path, metavar="MAP", help="bow the plan as the walls of this map are")
    parser.add_argument(
        "--measure", type=Path, metavar="DATA", help="folder of scene4.bag and scene4_pose.txt"
    )
    words = parser.parse_args(arguments)
    if words.output is None and words.measure is None:
        parser.error("give -o DIR or --measure DATA")
    if words.as_measured and words.onto is not None:
        parser.error("--as-measured and --onto exclude each other")
    try:
        plan = load_yaml_model(PLAN, Plan)
        if words.measure is not None:
            Console().print(measure(plan, words.measure))
        if words.output is not None:
            bow = None if words.onto is None else onto(plan, read_map(words.onto))
            write(plan, words.output, straight=not words.as_measured, bow=bow)
    except GlassSlamError as error:
        print(f"error: {error.message}" + (f" ({error.hint})" if error.hint else ""), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
