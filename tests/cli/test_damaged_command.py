"""`glassslam map` and `inspect` on damaged bags: exit code 3, the loss told; `--strict` refuses."""

import json

import numpy as np
import pytest

from glassslam.cli import main
from glassslam.outputs import build_report
from glassslam.records import Damage, LaserScan
from glassslam.simulation.rosbag1 import write_rosbag1

WALL = 2.0 / np.cos(-0.8 + 0.0175 * np.arange(90)).astype(np.float32)


@pytest.fixture
def cut_bag(tmp_path):
    path = tmp_path / "run.bag"
    scans = (LaserScan(0.1 * k, WALL, -0.8, 0.0175, 0.1, 10.0, record_stamp=0.1 * k) for k in range(40))
    write_rosbag1(scans, path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    return path


def test_a_cut_bag_is_mapped_as_far_as_it_goes(cut_bag, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["map", str(cut_bag), "-o", str(out)]) == 3
    captured = capsys.readouterr()
    assert captured.err == ""
    report = json.loads((out / "report.json").read_text())
    (damage,) = report["damage"]
    assert 10 < report["scans"]["read"] < 40
    assert damage["file"] == str(cut_bag)
    assert damage["offset"] + damage["bytes"] == cut_bag.stat().st_size
    assert damage["messages_lost"] > 0
    assert damage["last_stamp"] > damage["first_stamp"]
    assert f"about {damage['messages_lost']} messages" in " ".join(captured.out.split())


def test_strict_refuses_a_cut_bag(cut_bag, tmp_path, capsys):
    out = tmp_path / "out"
    for command in (["map", str(cut_bag), "-o", str(out)], ["inspect", str(cut_bag)]):
        assert main([*command, "--strict"]) == 1
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.startswith(f"error: cannot read {cut_bag}: ")
        assert captured.err.count("\n") == 1
    assert not out.exists()


def test_inspect_tells_the_damage(cut_bag, capsys):
    assert main(["inspect", str(cut_bag)]) == 3
    assert "the file is cut off here" in " ".join(capsys.readouterr().out.split())
    assert main(["inspect", str(cut_bag), "--json"]) == 3
    (damage,) = json.loads(capsys.readouterr().out)["damage"]
    assert damage["file"] == str(cut_bag)


def test_strict_reaches_the_source(asked_runs, tmp_path):
    words = ["map", "run.bag", "-o", str(tmp_path / "out"), "-q", "--overwrite"]
    assert main(words) == 0
    assert main([*words, "--strict"]) == 0
    assert [asked.options.strict for asked in asked_runs] == [False, True]


def test_the_report_lists_damage(tiny_result):
    assert build_report(tiny_result)["damage"] == []
    tiny_result.statistics.damage.append(Damage("a.bag", 5, 7, 1.0, 3.5, 9, "cut"))
    assert build_report(tiny_result)["damage"] == [
        {
            "file": "a.bag",
            "offset": 5,
            "bytes": 7,
            "first_stamp": 1.0,
            "last_stamp": 3.5,
            "messages_lost": 9,
            "reason": "cut",
        }
    ]


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (
            Damage("a.bag", 5, 7, 1.0, 3.5, 9, "cut"),
            "a.bag: 7 bytes at offset 5 unreadable (cut): about 9 messages and 2.5 s lost",
        ),
        (
            Damage("a.bag", 5, 7, None, None, 9, "cut"),
            "a.bag: 7 bytes at offset 5 unreadable (cut): about 9 messages and 0.0 s lost",
        ),
        (
            Damage("a.bag", 5, 0, 1.0, 1.0, 0, "no index"),
            "a.bag: 0 bytes at offset 5 unreadable (no index): no message lost",
        ),
    ],
)
def test_damage_is_one_line(damage, text):
    assert damage.text == text
