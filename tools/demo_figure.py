"""Draw docs/images/demo_map.png: what odometry alone says of the simulated office, and the finished map.

python tools/demo_figure.py [DEMO_DIR]     DEMO_DIR as written by `glassslam demo`; made anew when left out
"""

import argparse
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

import glassslam as gs
from glassslam.cli import main as glassslam
from glassslam.evaluation import align, associate, read_glass_walls
from glassslam.geometry import compose
from glassslam.records import FloatArray

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "docs" / "images" / "demo_map.png"
SCALE = 18.0
"""Pixels per metre."""
FREE, UNKNOWN, WALL, INK = (255, 255, 255), (232, 232, 232), (40, 40, 40), (70, 70, 70)
# Blue, green, red: the order of OpenCV.
DRIFTING, FOUND, GLASS = (40, 120, 235), (190, 100, 20), (170, 190, 0)

Image = NDArray[np.uint8]


def odometry_map(demo: Path, corner: FloatArray, shape: tuple[int, int]) -> tuple[Image, FloatArray]:
    """Ends of the beams as odometry alone would place them, and the path it reports.

    Both in the frame of the finished map, in which the first pose is that of the trajectory.
    """
    start = gs.read_tum(demo / "map" / "trajectory.tum").poses[0]
    source = gs.open_recording(demo / "demo.bag")
    laser = np.array(source.info.base_from_laser)
    image: Image = np.full((*shape, 3), UNKNOWN, dtype=np.uint8)
    path: list[FloatArray] = []
    for number, record in enumerate(source.records()):
        if isinstance(record, gs.Odometry):
            path.append(compose(start, np.array(record.pose)))
        elif isinstance(record, gs.LaserScan) and path and number % 12 == 0:
            pose = compose(path[-1], laser)
            angle = pose[2] + record.angle_min + np.arange(record.ranges.size) * record.angle_increment
            seen = np.isfinite(record.ranges) & (record.ranges < 12.0)
            rays = np.stack((np.cos(angle), np.sin(angle)), axis=1)[seen]
            pixels = to_pixels(pose[:2] + record.ranges[seen, None] * rays, corner, shape[0])
            inside = ((pixels >= 0) & (pixels < np.array(shape[::-1]))).all(axis=1)
            image[pixels[inside, 1], pixels[inside, 0]] = WALL
    return image, np.array(path)


def to_pixels(points: FloatArray, corner: FloatArray, height: int) -> NDArray[np.int64]:
    """Columns and rows of points (n, 2) in the map frame."""
    column = (points[:, 0] - corner[0]) * SCALE
    row = height - 1 - (points[:, 1] - corner[1]) * SCALE
    return np.stack((column, row), axis=1).round().astype(np.int64)


def finished_map(demo: Path, shape: tuple[int, int]) -> Image:
    """The map as written, enlarged to the scale of the picture."""
    probability = gs.read_map(demo / "map").probability[::-1]
    shades = np.full((*probability.shape, 3), UNKNOWN, dtype=np.uint8)
    shades[probability == 0.0] = FREE
    shades[probability == 1.0] = WALL
    return np.asarray(cv2.resize(shades, shape[::-1], interpolation=cv2.INTER_AREA), dtype=np.uint8)


def draw_path(image: Image, poses: FloatArray, corner: FloatArray, colour: tuple[int, int, int]) -> None:
    """Draw a path through poses (n, 3)."""
    pixels = to_pixels(poses[:, :2], corner, image.shape[0]).astype(np.int32)
    cv2.polylines(
        image, [pixels.reshape(-1, 1, 2)], isClosed=False, color=colour, thickness=2, lineType=cv2.LINE_AA
    )


def draw_glass(image: Image, walls: Path, corner: FloatArray) -> None:
    """Draw the glass walls of a results directory."""
    for wall in read_glass_walls(walls):
        for ends in wall:
            (x0, y0), (x1, y1) = to_pixels(ends, corner, image.shape[0]).tolist()
            cv2.line(image, (x0, y0), (x1, y1), GLASS, 4, cv2.LINE_AA)


def titled(image: Image, title: str) -> Image:
    """Add a line of text above."""
    strip: Image = np.full((30, image.shape[1], 3), 255, dtype=np.uint8)
    cv2.putText(strip, title, (6, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA)
    return np.vstack((strip, image))


def draw(demo: Path) -> Image:
    """Both pictures, one beside the other."""
    grid = gs.read_map(demo / "map")
    corner = np.array(grid.origin)
    rows, columns = grid.probability.shape
    shape = round(rows * grid.resolution * SCALE), round(columns * grid.resolution * SCALE)
    raw, path = odometry_map(demo, corner, shape)
    draw_path(raw, path, corner, DRIFTING)
    trajectory = gs.read_tum(demo / "map" / "trajectory.tum")
    found = finished_map(demo, shape)
    draw_glass(found, demo / "map" / "glass.geojson", corner)
    draw_path(found, trajectory.poses, corner, FOUND)
    estimated, true = associate(trajectory, gs.read_tum(demo / "demo.bag.truth.tum"))
    off = compose(align(estimated, true), estimated)[:, :2] - true[:, :2]
    error = 100.0 * float(np.sqrt((off**2).sum(axis=1).mean()))
    gap: Image = np.full((shape[0] + 30, 16, 3), 255, dtype=np.uint8)
    return np.hstack(
        (
            titled(raw, "odometry alone"),
            gap,
            titled(found, f"glassslam: {error:.1f} cm rms, glass walls in green"),
        )
    )


def main() -> None:
    """Make the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("demo", nargs="?", type=Path, metavar="DEMO_DIR")
    parser.add_argument("-o", "--output", type=Path, default=TARGET)
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        demo = words.demo or Path(folder) / "demo"
        if words.demo is None and (code := glassslam(["demo", "-o", str(demo)])):
            raise SystemExit(code)
        words.output.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(words.output), draw(demo), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"wrote {words.output}, {words.output.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
