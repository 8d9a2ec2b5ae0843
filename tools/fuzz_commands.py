"""Damaged inputs of commands that read more than recordings: scenes, trajectories, sessions, databases."""

import shutil
from pathlib import Path
from random import Random
from typing import TypeAlias

from fuzz_bytes import damaged_bytes, damaged_words, damaged_yaml, odd_numbers
from fuzz_messages import damaged, write_take
from fuzz_seeds import Seeds

Words: TypeAlias = list[str]
_SCENE_OPTIONS: tuple[Words, ...] = (
    *([[]] * 6), ["--sensor", "ust10lx"], ["--sensor", "lms200"], ["--sonar", "turtlebot-9"],
    ["--rate", "0.001"], ["--rate", "1e9"], ["--rate", "nan"], ["--seed", "99999999999999999999"],
    ["--sonar", "scene.yaml"], ["--sensor", "é"], ["--json"],
)  # fmt: skip
_VOLUME_OPTIONS: tuple[Words, ...] = (
    *([[]] * 6), ["--resolution", "0.2"], ["--resolution", "0.001"], ["--resolution", "1e6"],
    ["--resolution", "nan"], ["--band", "0", "0.5"], ["--band", "-1e300", "1e300"], ["--band", "1", "0"],
    ["--lidar-height", "-3"], ["--lidar-height", "inf"], ["--pool", "lop"], ["--pool", "liop"],
    ["--pool", "iop"], ["--projection", "pool"], ["--json"],
)  # fmt: skip
_RENDER_OPTIONS: tuple[Words, ...] = (
    [], ["--set", "map.resolution=0.1"], ["--set", "map.resolution=1e-9"], ["--set", "glass.scheme=off"],
    ["--set", "glass.detector=narrow_return"], ["--set", "sensor.max_range=3"], ["--json"],
)  # fmt: skip


def make_scene(random: Random, seeds: Seeds, folder: Path) -> Words:
    """A damaged scene, and options that make no sense."""
    # Most damage makes it no scene; odd numbers leave it one.
    text = odd_numbers(seeds.scene, random) if random.random() < 0.7 else damaged_yaml(seeds.scene, random)
    (folder / "scene.yaml").write_bytes(text)
    return ["simulate", "scene.yaml", "-o", "out.bag", *random.choice(_SCENE_OPTIONS)]


def make_volume(random: Random, seeds: Seeds, folder: Path) -> Words:
    """A recording of points, damaged in its bytes or in its messages, or a damaged trajectory."""
    for name, content in seeds.points.items():
        (folder / name).write_bytes(content)
    recording, share = "points.bag", random.random()
    if share < 0.4:
        (folder / recording).write_bytes(damaged_bytes(seeds.points[recording], random))
    elif share < 0.7:
        (folder / "truth.tum").write_bytes(damaged_words(seeds.points["truth.tum"], random))
    else:
        (folder / recording).unlink()
        recording = write_take(damaged(random.choice(seeds.takes[:1]), random), folder / "run", "none").name
    poses = random.choice(([], ["--trajectory", "truth.tum"], ["--trajectory", "truth.tum"]))
    return ["volume", recording, "-o", "out", *poses, *random.choice(_VOLUME_OPTIONS)]


def make_unmerged(random: Random, seeds: Seeds, folder: Path) -> Words:
    """A database of a recorder that was killed, or what it has left beside it, damaged."""
    if not seeds.unmerged:
        return make_scene(random, seeds, folder)
    files = seeds.unmerged[random.choice(sorted(seeds.unmerged))]
    broken = random.choice([*files, *(name for name in files if "-" in name), ""])
    for name, content in files.items():
        (folder / name).write_bytes(damaged_bytes(content, random) if name == broken else content)
    if random.random() < 0.3:
        return ["inspect", "run.db3", *random.choice(([], ["--json"]))]
    return ["map", "run.db3", "-o", "out", "--quiet", *random.choice(([], [], ["--strict"]))]


def make_session(random: Random, seeds: Seeds, folder: Path) -> Words:
    """A damaged session of a run that was killed or is finished, and what goes on from it."""
    if not seeds.sessions:
        return make_scene(random, seeds, folder)
    name = random.choice(sorted(seeds.sessions))
    files, finished = dict(seeds.sessions[name]), name == "finished"
    broken = random.choice(("session.db", "session.db", "session.db", random.choice(sorted(files))))
    files[broken] = damaged_bytes(files[broken], random)
    if random.random() < 0.1:
        del files[random.choice(sorted(files))]
    if random.random() < 0.2:  # the recording has changed since
        log = folder / "run.log"
        log.write_bytes(damaged_words(seeds.log.read_bytes(), random))
    else:
        log = Path(shutil.copy(seeds.log, folder / "run.log"))
    given, share = random.choice(([], [log.name], ["-q", log.name])), random.random()
    home = folder / ("done" if finished else "out.partial")
    home.mkdir()
    for file, content in files.items():
        (home / file).write_bytes(content)
    if share < 0.35 or (not finished and share < 0.6):
        target = "done" if finished else "out"
        return ["map", "--resume", target, *given]
    if share < 0.65:
        return ["recover", home.name]
    options = random.choice(_RENDER_OPTIONS)
    return ["render", "done" if finished else "out", "-o", "out", "--quiet", *options]
