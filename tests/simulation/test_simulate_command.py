import json

import pytest

from glassslam.cli import main
from glassslam.evaluation import absolute_trajectory_error
from glassslam.outputs import read_tum

ROOM = """
name: room
walls: [{name: room, material: plaster, points: [[0, 0], [6, 0], [6, 6], [0, 6]], closed: true}]
drive: {waypoints: [{at: [2, 3]}, {at: [4, 3]}]}
"""


@pytest.fixture
def room(tmp_path):
    path = tmp_path / "room.yaml"
    path.write_text(ROOM, encoding="utf-8")
    return path


def test_simulate_writes_the_bag_and_the_truth_and_says_so(room, tmp_path, capsys):
    bag = tmp_path / "out" / "room.bag"
    assert main(["simulate", str(room), "-o", str(bag), "--sensor", "rplidar"]) == 0
    out = capsys.readouterr().out
    assert "scans of a rplidar, 2.0 m in" in out
    for name in (
        "room.bag",
        *(
            f"room.bag.truth.{end}"
            for end in ("tum", "json", "labels.npz", "glass.geojson", "map.yaml", "map.pgm")
        ),
    ):
        assert f"wrote {tmp_path / 'out' / name}" in out
        assert (tmp_path / "out" / name).is_file()


def test_simulate_tells_scripts_in_json(room, tmp_path, capsys):
    bag = tmp_path / "room.bag"
    assert main(["simulate", str(room), "-o", str(bag), "--sensor", "lms200", "--seed", "4", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["scene"], told["sensor"], told["seed"], told["bag"]) == ("room", "lms200", 4, str(bag))
    assert told["scans"] == read_tum(told["true_trajectory"]).stamps.size


def test_simulate_thins_the_scans_to_a_rate(room, tmp_path, capsys):
    counts = []
    for rate in ("10", "5"):
        bag = tmp_path / f"{rate}.bag"
        assert main(["simulate", str(room), "-o", str(bag), "--rate", rate, "--json"]) == 0
        counts.append(json.loads(capsys.readouterr().out)["scans"])
    assert counts[0] == pytest.approx(2 * counts[1], abs=1)


def test_simulate_does_not_replace_a_bag_unasked(room, tmp_path, capsys):
    bag = tmp_path / "room.bag"
    bag.write_text("precious")
    assert main(["simulate", str(room), "-o", str(bag)]) == 2
    assert capsys.readouterr().err == f"error: {bag} exists already (use --overwrite to replace it)\n"
    assert bag.read_text() == "precious"
    assert main(["simulate", str(room), "-o", str(bag), "--sensor", "rplidar", "--overwrite"]) == 0
    assert bag.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["castle"], "error: no scene 'castle' (give the path of a scene file or one of: glass"),
        (
            ["office", "--rate", "50"],
            "error: a ust10lx does not give 50 scans per second (choose a rate above 0, at most 40)",
        ),
        (["office", "--sensor", "vlp16"], "error: no lidar 'vlp16' (known: ust10lx, "),
    ],
)
def test_simulate_refuses_what_it_does_not_know(words, message, tmp_path, capsys):
    assert main(["simulate", *words, "-o", str(tmp_path / "x.bag")]) == 2
    assert capsys.readouterr().err.startswith(message)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["room.mcap", "room", "."])
def test_simulate_writes_bags_under_names_of_bags_only(name, room, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", str(room), "-o", name]) == 2
    words = f"error: -o {name}: a ROS 1 bag is written (give it a name that ends in .bag)\n"
    assert capsys.readouterr().err == words
    assert list(tmp_path.iterdir()) == [room]


def test_demo_does_not_mix_with_other_files(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("precious")
    assert main(["demo", "-o", str(tmp_path)]) == 1
    assert (
        capsys.readouterr().err
        == f"error: {tmp_path} holds other files: thesis.tex (choose a new directory)\n"
    )
    (tmp_path / "file").write_text("")
    assert main(["demo", "-o", str(tmp_path / "file")]) == 1
    assert "is a file (name a directory for the demo)" in capsys.readouterr().err


@pytest.mark.slow
def test_demo_maps_the_office_and_says_how_good_the_map_is(tmp_path, capsys):
    folder = tmp_path / "demo"
    assert main(["demo", "-o", str(folder)]) == 0
    out = capsys.readouterr().out
    assert f"look at {folder / 'map' / 'map.png'}" in out
    assert (folder / "map" / "map.yaml").is_file()
    truth = read_tum(folder / "demo.bag.truth.tum")
    estimate = read_tum(folder / "map" / "trajectory.tum")
    errors = absolute_trajectory_error(estimate, truth)
    assert errors.count == truth.stamps.size
    assert errors.translation.rmse < 0.05
    assert f"against the truth: {100 * errors.translation.rmse:.1f} cm rms" in out
