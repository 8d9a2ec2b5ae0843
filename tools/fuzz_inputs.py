"""Damaged inputs by kind, and the command that reads each."""

import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import TypeAlias

from fuzz_bytes import damaged_bytes, damaged_log, damaged_words, damaged_yaml
from fuzz_commands import make_scene, make_session, make_unmerged, make_volume
from fuzz_messages import damaged, write_take
from fuzz_seeds import Seeds, calibration_file, parameter_files

Words: TypeAlias = list[str]
_RECORDING_OPTIONS: tuple[Words, ...] = (
    *([[]] * 8),
    ["--set", "glass.detector=narrow_return"],
    ["--set", "glass.detector=intensity_peak"],
    ["--set", "glass.detector=wang_wang"],
    ["--sensor", "utm30lx"],
    ["--sensor", "ust10lx", "--set", "glass.scheme=global"],
    ["--set", "glass.detector=narrow_return", "--set", "glass.scheme=local"],
    ["--set", "glass.detector=narrow_return", "--set", "glass.scheme=lite"],
    ["--odom-topic", "none"],
    ["--odom-topic", "tf"],
    ["--imu-topic", "none"],
    ["--every", "2"],
    ["--start", "0.5", "--duration", "1"],
    ["--echo", "last"],
    ["--require-intensity"],
    ["--laser-pose", "0.1,0,3.14"],
    ["--set", "sensor.max_range=20000"],
    ["--set", "submap.num_range_data=4", "--set", "loop_closure.min_node_gap=1"],
    ["--set", "local.solver=casadi", "--set", "optimization.solver=casadi"],
)


def make_case(kind: str, random: Random, seeds: Seeds, folder: Path) -> Words:
    """Write the damaged input of a case into a folder; the words of the command."""
    return KINDS[kind](random, seeds, folder)


def _read(recording: str, random: Random) -> Words:
    """A command that reads a recording."""
    share = random.random()
    if share < 0.25:
        return ["inspect", recording, *random.choice(([], ["--json"]))]
    if share < 0.33:
        options = random.choice(([], ["--distance", "1"], ["--geometry"], ["--material", "matte"]))
        return ["calibrate", recording, "-o", "out", "--quiet", *options]
    if share < 0.36:
        return ["volume", recording, "-o", "out"]
    options = random.choice(_RECORDING_OPTIONS)
    return ["map", recording, "-o", "out", random.choice(("--quiet", "--json")), *options]


def _bag(random: Random, seeds: Seeds, folder: Path) -> Words:
    name = random.choice(sorted(seeds.bags))
    (folder / name).write_bytes(damaged_bytes(seeds.bags[name], random))
    return _read(name, random)


def _folder(random: Random, seeds: Seeds, folder: Path) -> Words:
    """A ROS2 directory with damaged metadata, storage or names."""
    if not seeds.folders:
        return _messages(random, seeds, folder)
    files = seeds.folders[random.choice(sorted(seeds.folders))]
    target = folder / random.choice(("run", "é run"))
    target.mkdir()
    broken = random.choice(("metadata.yaml", "metadata.yaml", random.choice(sorted(files))))
    for name, content in files.items():
        if name == broken and name.endswith("yaml"):
            content = damaged_yaml(content.decode(), random)  # noqa: PLW2901
        elif name == broken:
            content = damaged_bytes(content, random)  # noqa: PLW2901
        (target / name).write_bytes(content)
    return _read(target.name, random)


def _messages(random: Random, seeds: Seeds, folder: Path) -> Words:
    take = random.choice(seeds.takes)
    storage = random.choice(("none", "bz2") if take.ros == 1 else ("sqlite3", "mcap"))
    return _read(write_take(damaged(take, random), folder / "run", storage).name, random)


def _log(kind: str) -> Callable[[Random, Seeds, Path], Words]:
    def make(random: Random, seeds: Seeds, folder: Path) -> Words:
        name = random.choice(sorted(seeds.logs[kind]))
        (folder / name).write_bytes(damaged_log(seeds.logs[kind][name], random))
        return _read(name, random)

    return make


def _pimap(random: Random, seeds: Seeds, folder: Path) -> Words:
    name = random.choice(sorted(seeds.logs["pimap"]))
    (folder / name).write_bytes(damaged_log(seeds.logs["pimap"][name], random))
    ring = ["--sonar-ring", "pioneer-3dx"]
    if random.random() < 0.4:
        return ["inspect", name, *ring, *random.choice(([], ["--json"]))]
    log = Path(shutil.copy(seeds.log, folder / "run.log")).name
    return ["map", log, "-o", "out", "--quiet", "--sonar", name, *ring]


def _ring(random: Random, seeds: Seeds, folder: Path) -> Words:
    (folder / "ring.yaml").write_bytes(damaged_yaml(_parameters()["ring"], random))
    shutil.copy(seeds.sonar, folder / "sonar.txt")
    shutil.copy(seeds.log, folder / "run.log")
    if random.random() < 0.5:
        return ["inspect", "sonar.txt", "--sonar-ring", "ring.yaml"]
    return ["map", "run.log", "-o", "out", "--quiet", "--sonar", "sonar.txt", "--sonar-ring", "ring.yaml"]


def _config(random: Random, seeds: Seeds, folder: Path) -> Words:
    (folder / "robot.yaml").write_bytes(damaged_yaml(_parameters()["config"], random))
    share = random.random()
    if share < 0.3:
        return ["config", "--config", "robot.yaml"]
    if share < 0.4:
        return ["config", "--diff", "default", "robot.yaml"]
    shutil.copy(seeds.log, folder / "run.log")
    return ["map", "run.log", "-o", "out", "--quiet", "--config", "robot.yaml"]


def _calibration(random: Random, seeds: Seeds, folder: Path) -> Words:
    (folder / "calibration.yaml").write_bytes(damaged_yaml(_parameters()["calibration"], random))
    bag = Path(shutil.copy(seeds.fine, folder / "run.bag")).name
    return ["map", bag, "-o", "out", "--quiet", "--calibration", "calibration.yaml"]


@cache
def _parameters() -> dict[str, str]:
    return {**parameter_files(), "calibration": calibration_file()}


def _truth(random: Random, seeds: Seeds, folder: Path) -> Words:
    """Results or truths with one damaged file, and the comparison that reads it."""
    run = folder / "run"
    run.mkdir()
    options, names = random.choice(_COMPARISONS)
    for name in names:
        shutil.copy(seeds.run / name, run / name)
    broken = run / random.choice(names)
    content = broken.read_bytes()
    is_text = broken.suffix not in {".npz", ".pgm", ".png"} and random.random() < 0.7
    broken.write_bytes(damaged_words(content, random) if is_text else damaged_bytes(content, random))
    return ["evaluate", "run", *options, *random.choice(([], ["--json"]))]


_TUM, _TRUTH = "trajectory.tum", "room.bag.truth"
_COMPARISONS: tuple[tuple[Words, Words], ...] = (
    (["--relations", "run/true.relations"], [_TUM, "true.relations"]),
    (["--trajectory", f"run/{_TRUTH}.tum"], [_TUM, f"{_TRUTH}.tum"]),
    (["--glass", f"run/{_TRUTH}.glass.geojson"], ["glass.geojson", f"{_TRUTH}.glass.geojson"]),
    (["--glass", f"run/{_TRUTH}.glass.geojson", "--align"], ["glass.geojson", f"{_TRUTH}.glass.geojson"]),
    (["--labels", f"run/{_TRUTH}.labels.npz"], ["glass_beams.npz", f"{_TRUTH}.labels.npz"]),
    (
        ["--truth", f"run/{_TRUTH}.map.yaml"],
        [
            "map.yaml",
            "map.pgm",
            "labels.png",
            f"{_TRUTH}.map.yaml",
            f"{_TRUTH}.map.pgm",
            f"{_TRUTH}.map.labels.png",
        ],
    ),
    (
        ["--truth", f"run/{_TRUTH}.map.pgm", "--resolution", "0.05"],
        ["map.yaml", "map.pgm", f"{_TRUTH}.map.pgm"],
    ),
)

KINDS: dict[str, Callable[[Random, Seeds, Path], Words]] = {
    "bag": _bag,
    "folder": _folder,
    "messages": _messages,
    "carmen": _log("carmen"),
    "player": _log("player"),
    "pimap": _pimap,
    "ring": _ring,
    "config": _config,
    "calibration": _calibration,
    "truth": _truth,
    "unmerged": make_unmerged,
    "scene": make_scene,
    "volume": make_volume,
    "session": make_session,
}
"""How every kind of input is made."""
