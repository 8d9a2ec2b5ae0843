"""Sound inputs that the fuzzer damages: short recordings, logs, parameter files, truths and results."""

import gzip
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import yaml
from fuzz_messages import Take, take_of, write_take
from fuzz_states import Files, as_ros2, points, scene_text, sessions, unmerged

from glassslam.cli import main
from glassslam.simulation import Scene, simulate, write_recording

CALIBRATED = "ust10lx"
_SCANS = 14
_ROOM = {
    "name": "room",
    "walls": [
        {"name": "room", "material": "plaster", "points": [[0, 0], [6, 0], [6, 5], [0, 5]], "closed": True},
        {"name": "pane", "material": "glass", "points": [[1, 4], [4, 4]]},
    ],
    "drive": {"waypoints": [{"at": [2, 2.5]}, {"at": [4, 2.5]}]},
}
_REAL_BAGS = (
    "freiburg/aces.bag",
    "glass_corridor/67807dc50e.bag",
    "museum/b0-2014-07-21-12-42-53-tiny.bag",
    "pimap/scene4.bag",
    "sick/rms_1xxx_lms_1xx_movement_off.bag",
    "tiago/sonar.bag",
    "toposens/test.bag",
    "turtlebot3/rosbag2_2026_02_02-14_33_55_0.mcap",
    "urg04/before1.bag",
    "ust10lx/localization_bag1_2022-03-29-19-23-29.bag",
    "ust10lx/rosbag2_2026_03_07-23_31_14_0.db3",
)
_REAL_LOGS = ("intel", "mit-csail", "mit-killian")


@dataclass(frozen=True)
class Seeds:
    """What is damaged.

    Attributes
    ----------
    takes : tuple of Take
        Short recordings as decoded messages.
    bags : dict
        File name -> bytes of bags and mcaps.
    folders : dict
        Name -> files of ROS2 directories.
    logs : dict
        Kind of text log -> file name -> bytes.
    run, log, sonar, fine : Path
        A results directory with truths beside it, a CARMEN log, a pi-map sonar log, a bag of the lidar that
        was calibrated: used undamaged.
    scene : str
        YAML of a scene to simulate.
    points : dict
        A recording with points of a 3D sensor, and a trajectory.
    unmerged, sessions : dict
        Name -> files of databases with their logs, and of runs that are finished or were killed.
    """

    takes: tuple[Take, ...]
    bags: dict[str, bytes]
    folders: dict[str, dict[str, bytes]]
    logs: dict[str, dict[str, bytes]]
    run: Path
    log: Path
    sonar: Path
    fine: Path
    scene: str
    points: Files
    unmerged: dict[str, Files]
    sessions: dict[str, Files]


def make_seeds(folder: Path, data: Path | None) -> Seeds:
    """Simulate, cut and map what is needed; `data` holds real recordings."""
    simulated = _simulated(folder, "rplidar", "turtlebot-9")
    fine = write_take(take_of(_simulated(folder, CALIBRATED, None), 8), folder / "sound", "none")
    made = take_of(simulated, _SCANS)
    takes = [made, as_ros2(made), *_real_takes(data)]
    logs = {"carmen": _carmen(data), "player": {"run.log": _player()}, "pimap": _pimap(data)}
    bags, folders = {}, {}
    for number, take in enumerate(takes):
        for storage in ("none", "bz2", "lz4") if take.ros == 1 else ("sqlite3", "mcap"):
            written = write_take(take, folder / f"seed-{number}-{storage}", storage)
            if written.is_dir():
                folders[written.name] = {file.name: file.read_bytes() for file in written.iterdir()}
                written = next(file for file in written.iterdir() if file.suffix in {".db3", ".mcap"})
            bags[f"{number}-{storage}{written.suffix}"] = written.read_bytes()
    log, sonar = folder / "sound.log", folder / "sonar.txt"
    log.write_bytes(logs["carmen"]["simple.log"])
    sonar.write_bytes(logs["pimap"]["sonar.txt"])
    return Seeds(
        tuple(takes), bags, folders, logs, _run(folder, simulated), log, sonar, fine,
        scene_text(), points(folder), unmerged(takes[1], folder), sessions(log, folder),
    )  # fmt: skip


def _simulated(folder: Path, sensor: str, sonar: str | None) -> Path:
    bag = folder / f"{'room' if sonar else 'fine'}.bag"
    write_recording(simulate(Scene.model_validate(_ROOM), sensor, 0, 4.0, sonar), bag)
    return bag


def _real_takes(data: Path | None) -> Iterator[Take]:
    for name in _REAL_BAGS if data else ():
        with suppress(FileNotFoundError):
            yield take_of(Path(data or ".", name), 8 if "ust10lx" in name or "museum" in name else _SCANS)


def _run(folder: Path, bag: Path) -> Path:
    """Results that look for glass, so that every kind of file is there."""
    run = folder / "run"
    words = ["map", str(bag), "-o", str(run), "--quiet", "--set", "glass.detector=narrow_return"]
    if main(words) not in {0, 3}:
        raise SystemExit("the simulated recording cannot be mapped")
    for truth in folder.glob("room.bag.truth.*"):
        (run / truth.name).write_bytes(truth.read_bytes())
    stamps = [line.split()[0] for line in (run / "trajectory.tum").read_text().splitlines()]
    pairs = zip(stamps, stamps[3:], strict=False)
    (run / "true.relations").write_text("".join(f"{a} {b} 0.3 0 0 0 0 0.01\n" for a, b in pairs))
    return run


def _carmen(data: Path | None) -> dict[str, bytes]:
    """CARMEN logs, the first lines of the real ones and a made one with both kinds of laser lines."""
    logs = {"simple.log": _simple_carmen(), "robot.log": _robot_carmen()}
    for name in _REAL_LOGS if data else ():
        path = Path(data or ".", "freiburg", f"{name}.clf.gz")
        if path.exists():
            with gzip.open(path) as file:
                logs[f"{name}.log"] = b"".join(islice(file, 60))
            logs[f"{name}.clf.gz"] = gzip.compress(logs[f"{name}.log"], mtime=0)
    return logs


def _simple_carmen() -> bytes:
    lines = ["PARAM robot_frontlaser_offset 0.1 nohost 0"]
    for k in range(16):
        x, t = 0.15 * k, 100 + 0.2 * k
        ranges = " ".join(f"{2 + 0.01 * ((7 * j + 3 * k) % 5):.2f}" for j in range(90))
        lines.append(f"ODOM {x:.3f} 0 0 0 0 0 {t:.3f} host {t:.3f}")
        lines.append(f"FLASER 90 {ranges} {x:.3f} 0 0 {x:.3f} 0 0 {t:.3f} host {t:.3f}")
    return ("\n".join(lines) + "\n").encode()


def _robot_carmen() -> bytes:
    lines = []
    for k in range(16):
        t = 100 + 0.2 * k
        ranges = " ".join(f"{2.5 - 0.01 * k:.2f}" for _ in range(60))
        strengths = " ".join(str(900 + j) for j in range(60))
        lines.append(
            f"ROBOTLASER1 0 -1.570796 3.141592 0.053248 20.0 0.01 0 60 {ranges} 60 {strengths} "
            f"0 0 0 {0.1 * k:.2f} 0 0 0 0 0 0 0 {t:.3f} host {t:.3f}"
        )
    return ("\n".join(lines) + "\n").encode()


def _player() -> bytes:
    def line(time: float, device: str, kind: str, payload: str) -> str:
        return f"{time:014.3f} 16777343 6665 {device} 00 {kind} {payload}"

    lines = [
        "## Player version 2.1.1",
        line(0, "sonar", "004 001", "2 +00.100 +00.200 +1.5708 +00.100 -00.200 -1.5708"),
        line(0, "laser", "004 001", "+0.030 -0.010 0.500 0.140 0.140"),
    ]
    for k in range(16):
        t = 10 + 0.2 * k
        beams = " ".join(f"{2 + 0.01 * (j % 7):.3f} {j % 9}" for j in range(61))
        lines += [
            line(t, "position2d", "001 001", f"{0.1 * k:+07.3f} +00.000 +0.000 +00.100 +00.000 -00.010 0"),
            line(t + 0.1, "laser", "001 001", f"0007 -1.5708 +1.5708 +0.05236 +08.0000 0061 {beams}"),
            line(t + 0.15, "sonar", "001 001", f"2 1.500 {1 + 0.1 * k:.3f}"),
        ]
    return ("\n".join(lines) + "\n").encode()


def _pimap(data: Path | None) -> dict[str, bytes]:
    ticks = 637009341791590928
    lines = (
        f"{k} {1032 + 20 * k} 1 {ticks + 10**6 * k} " + " ".join("5" if j % 3 else "1.25" for j in range(16))
        for k in range(60)
    )
    logs = {"sonar.txt": ("\n".join(lines) + "\n").encode()}
    path = Path(data or ".", "pimap", "scene4_sonar.txt")
    if data and path.exists():
        with path.open("rb") as file:
            logs["scene4.txt"] = b"".join(islice(file, 400, 520))
    return logs


def parameter_files() -> dict[str, str]:
    """YAML texts of parameters by kind: configuration and ring of sonars."""
    from glassslam.config import Config  # noqa: PLC0415  (loads pydantic)

    ring = {
        "what": "sixteen",
        "field_of_view_deg": 25.0,
        "range_min": 0.1,
        "range_max": 5.0,
        "sonars": [[0.1, 0.1 * k, 22.5 * k] for k in range(16)],
    }
    return {"config": Config().dump(), "ring": yaml.safe_dump(ring)}


def calibration_file() -> str:
    """The text of a calibration: the one shipped for the lidar of the bag `fine`."""
    from detectors.profiles import load_profile  # noqa: PLC0415  (loads numpy)
    from glassslam.outputs.calibration_file import as_yaml  # noqa: PLC0415

    text: str = as_yaml(load_profile(CALIBRATED))
    return text
