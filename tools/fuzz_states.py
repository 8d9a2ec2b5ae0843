"""Sound states that the fuzzer damages: databases still being written, sessions of runs, simulated points."""

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeAlias

import yaml
from fuzz_messages import Sent, Take, write_take
from rosbags.typesys import Stores, get_typestore

from glassslam.cli import main
from glassslam.records import Record
from glassslam.simulation import Scene, simulate, write_recording
from glassslam.sources import Recording

Files: TypeAlias = dict[str, bytes]
SCENE = {
    "name": "room",
    "scan_rate": 5.0,
    "walls": [
        {"name": "room", "material": "plaster", "points": [[0, 0], [5, 0], [5, 4], [0, 4]], "closed": True},
        {"name": "pane", "material": "glass", "points": [[1, 3], [4, 3]]},
        {"name": "table", "material": "wood", "points": [[3, 1], [4, 1]], "z_low": 0.7, "z_high": 0.8},
    ],
    "ultrasonic": {"height": 0.4, "rate": 4.0},
    "drive": {"waypoints": [{"at": [1.5, 2.0]}, {"at": [2.5, 2.0]}]},
}


def scene_text() -> str:
    """A scene with walls, glass, something above the lidar and a 3D ultrasonic sensor."""
    return yaml.safe_dump(SCENE, sort_keys=False)


def points(folder: Path) -> Files:
    """A recording of that scene, and where the robot truly was."""
    bag = folder / "points.bag"
    write_recording(simulate(Scene.model_validate(SCENE), "rplidar", 0, None, None), bag)
    return {"points.bag": bag.read_bytes(), "truth.tum": Path(f"{bag}.truth.tum").read_bytes()}


def unmerged(take: Take, folder: Path) -> dict[str, Files]:
    """Databases of a recorder that was killed, with its write-ahead log or its journal beside them."""
    whole = write_take(take, folder / "unmerged", "sqlite3")
    (file,) = whole.glob("*.db3")
    return {mode: _killed(file, folder / f"killed-{mode}", mode) for mode in ("WAL", "DELETE", "PERSIST")}


def _killed(whole: Path, folder: Path, mode: str) -> Files:
    folder.mkdir()
    path = Path(shutil.copy(whole, folder / "run.db3"))
    database = sqlite3.connect(path, isolation_level=None)
    rows = database.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id").fetchall()
    database.execute("DELETE FROM messages WHERE id > 8")
    database.execute("VACUUM")
    for setting in (f"journal_mode = {mode}", "wal_autocheckpoint = 0", "cache_size = 2"):
        database.execute(f"PRAGMA {setting}")
    for row in rows[8:-6]:
        database.execute("INSERT INTO messages VALUES (?, ?, ?, ?)", row)
    database.execute("BEGIN")
    database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows[-6:])
    files = {file.name: file.read_bytes() for file in folder.iterdir() if not file.name.endswith("-shm")}
    database.close()
    return files


def sessions(log: Path, folder: Path) -> dict[str, Files]:
    """The results of a finished run with its session, and the sessions of runs killed on their way."""
    words = ["map", str(log), "--quiet", "--set", "submap.num_range_data=4", "-o"]
    found: dict[str, Files] = {}
    for records in (3, 9, 25):
        home = folder / f"killed-{records}"
        child = os.fork()
        if child == 0:
            _run_up_to(records, [*words, str(home)])
        os.waitpid(child, 0)
        partial = home.with_name(f"{home.name}.partial")
        found[f"killed {records}"] = {file.name: file.read_bytes() for file in partial.iterdir()}
    run = folder / "finished"
    if main([*words, str(run)]) not in {0, 3}:
        raise SystemExit("the log cannot be mapped")
    found["finished"] = {file.name: file.read_bytes() for file in run.iterdir()}
    return found


def _run_up_to(records: int, words: list[str]) -> None:
    """Map, and die as by a power cut when so many records have been read."""
    whole = Recording.records

    def some(recording: Recording) -> Iterator[Record]:
        for count, record in enumerate(whole(recording)):
            if count == records:
                os._exit(9)
            yield record

    with suppress(BaseException):
        Recording.records = some  # type: ignore[method-assign]
        main(words)
    os._exit(9)


def as_ros2(take: Take) -> Take:
    """The same recording with the messages of ROS2."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    known = [one for one in take.sent if one.msgtype in store.types]
    sent = (Sent(one.topic, one.msgtype, one.time, _converted(one.message, store)) for one in known)
    return Take(2, store, tuple(sent))


def _converted(value: Any, store: Any) -> Any:
    """A message, or a part of it, without what ROS2 does not know."""
    if isinstance(value, list):
        return [_converted(part, store) for part in value]
    if not is_dataclass(value):
        return value
    kind = store.types[value.__msgtype__]  # type: ignore[attr-defined]
    return kind(**{field.name: _converted(getattr(value, field.name), store) for field in fields(kind)})
