"""True glass found, and glass made up."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.cli import main
from glassslam.errors import EvaluationError
from glassslam.evaluation import evaluate_glass, read_glass_walls, read_true_glass
from glassslam.evaluation.glass_alignment import best_alignment
from glassslam.evaluation.glass_lines import distances, midpoints
from glassslam.geometry import inverse, transform_points


def line(*points):
    """Segments of a polyline."""
    return np.array([points[k : k + 2] for k in range(len(points) - 1)], dtype=np.float64)


def moved(motion, lines):
    return [transform_points(np.array(motion), s.reshape(-1, 2)).reshape(-1, 2, 2) for s in lines]


def feature(kind, *points, geometry="LineString"):
    return {
        "type": "Feature",
        "geometry": {"type": geometry, "coordinates": [list(point) for point in points]},
        "properties": {"kind": kind},
    }


def collection(*features):
    return {"type": "FeatureCollection", "features": list(features)}


@pytest.fixture
def written(tmp_path):
    def write(content, name="truth.geojson"):
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write


def by_tolerance(errors, name):
    return [getattr(row, name) for row in errors.within]


PANE = line((0, 0), (4, 0))


def test_a_wall_on_the_pane_finds_it():
    errors = evaluate_glass([PANE], [PANE])
    assert (errors.panes, errors.walls) == (1, 1)
    assert (errors.true_length, errors.wall_length) == (pytest.approx(4.0), pytest.approx(4.0))
    assert by_tolerance(errors, "tolerance") == [0.10, 0.15, 0.25]
    assert by_tolerance(errors, "found") == pytest.approx([4.0] * 3)
    assert by_tolerance(errors, "found_percent") == pytest.approx([100.0] * 3)
    assert by_tolerance(errors, "false") == [0.0] * 3
    assert errors.false_length == 0.0
    assert errors.true_from_map is None


def test_a_wall_beside_the_pane_is_found_or_false_by_tolerance():
    errors = evaluate_glass([line((0, 0.12), (4, 0.12))], [PANE])
    assert by_tolerance(errors, "found") == pytest.approx([0.0, 4.0, 4.0])
    assert by_tolerance(errors, "panes_found") == [0, 1, 1]
    assert by_tolerance(errors, "false") == pytest.approx([4.0, 0.0, 0.0])
    assert errors.false_length == 0.0


def test_part_of_a_pane_counts_by_its_length():
    """A wall of a metre finds what lies beside it and, past its end, as far as the tolerance."""
    errors = evaluate_glass([line((0, 0), (1, 0))], [PANE])
    assert by_tolerance(errors, "found") == pytest.approx([1.10, 1.15, 1.25], abs=0.011)
    assert by_tolerance(errors, "found_percent") == pytest.approx([27.5, 28.75, 31.25], abs=0.3)
    assert by_tolerance(errors, "panes_found") == [0, 0, 0]


def test_a_wall_that_goes_on_past_the_pane_is_false_there():
    errors = evaluate_glass([line((0, 0), (5, 0))], [PANE])
    assert by_tolerance(errors, "false") == pytest.approx([0.90, 0.85, 0.75], abs=0.011)
    assert errors.false_length == by_tolerance(errors, "false")[-1]


def test_walls_where_there_is_no_glass_are_false():
    errors = evaluate_glass([PANE, line((0, 3), (2, 3))], [])
    assert errors.false_length == pytest.approx(6.0)
    assert by_tolerance(errors, "found_percent") == [None] * 3


def test_no_walls_find_nothing():
    errors = evaluate_glass([], [PANE])
    assert (errors.wall_length, errors.false_length) == (0.0, 0.0)
    assert by_tolerance(errors, "found_percent") == [0.0] * 3


def test_panes_are_counted_one_by_one():
    panes = [line((k, 0), (k + 1, 0)) for k in range(4)]
    errors = evaluate_glass([line((0, 0), (1.9, 0))], panes)
    assert (errors.panes, by_tolerance(errors, "panes_found")) == (4, [2, 2, 2])


@given(st.lists(st.tuples(*[st.floats(-5, 5)] * 4), min_size=1, max_size=4), st.integers(0, 10**6))
def test_distances_are_those_of_the_nearest_of_many_points(ends, seed):
    segments = np.array(ends).reshape(-1, 2, 2)
    points = np.random.default_rng(seed).uniform(-6.0, 6.0, (5, 2))
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    along = np.concatenate([start + share * (end - start) for start, end in segments])
    naive = np.hypot(*(points[:, None] - along[None]).transpose(2, 0, 1)).min(axis=1)
    assert distances(points, segments) == pytest.approx(naive, abs=0.01)
    assert (distances(points, segments) <= naive + 1e-9).all()


@given(st.lists(st.tuples(*[st.floats(-5, 5)] * 4), max_size=4))
def test_pieces_are_short_and_make_up_the_whole_length(ends):
    segments = np.array(ends).reshape(-1, 2, 2)
    points, lengths = midpoints(segments, 0.1)
    assert len(points) == len(lengths)
    assert (lengths <= 0.1 + 1e-9).all()
    assert lengths.sum() == pytest.approx(np.hypot(*(segments[:, 1] - segments[:, 0]).T).sum())
    assert (distances(points, segments) < 1e-9).all()


def test_nothing_is_infinitely_far():
    assert distances(np.zeros((1, 2)), np.empty((0, 2, 2))).tolist() == [math.inf]


BUILDING = [line((0, 0), (6, 0)), line((6, 0), (6, 3)), line((1, 5), (3, 5)), line((8, 1), (9, 2))]


@pytest.mark.parametrize("motion", [(0.3, -0.2, 0.05), (12.0, -7.0, 2.0), (1.0, 4.0, -math.pi / 2)])
def test_glass_in_another_frame_is_laid_onto_the_truth(motion):
    errors = evaluate_glass(moved(inverse(np.array(motion)), BUILDING), BUILDING, align=True)
    assert by_tolerance(errors, "found_percent")[0] == pytest.approx(100.0)
    assert errors.true_from_map[:2] == pytest.approx(motion[:2], abs=0.02)
    assert errors.true_from_map[2] == pytest.approx(motion[2], abs=0.005)
    assert evaluate_glass(moved(motion, BUILDING), BUILDING).within[0].found_percent < 60.0


def test_false_glass_stays_false_when_aligned():
    motion = (2.0, 1.0, 0.4)
    walls = moved(inverse(np.array(motion)), [*BUILDING, line((-3, -4), (-1, -4))])
    errors = evaluate_glass(walls, BUILDING, align=True)
    assert errors.false_length == pytest.approx(2.0, abs=0.05)


def test_a_corridor_is_not_turned_around_for_a_little_more_cover():
    truth = [line((0, 0), (4, 0)), line((6, 0), (11, 0))]
    walls = [line((0.1, 0.1), (4.8, 0.1)), line((7, 0.1), (11, 0.1))]
    motion = best_alignment(np.concatenate(walls), np.concatenate(truth))
    assert motion == pytest.approx([0.0, -0.1, 0.0], abs=0.7)


@pytest.mark.parametrize(("walls", "truth"), [([], [PANE]), ([PANE], []), ([], [])])
def test_where_there_is_nothing_to_align_nothing_moves(walls, truth):
    assert evaluate_glass(walls, truth, align=True).true_from_map == (0.0, 0.0, 0.0)


def test_true_panes_are_lines_of_kind_wall_or_glass(written):
    path = written(
        collection(
            feature("wall", (0, 0), (1, 0)),
            feature("glass", (0, 1, 9), (1, 1, 9), (1, 2, 9)),
            feature("opaque", (0, 2), (1, 2)),
            {"type": "Feature", "geometry": None, "properties": None},
        )
    )
    panes = read_true_glass(path)
    assert [pane.tolist() for pane in panes] == [[[[0, 0], [1, 0]]], [[[0, 1], [1, 1]], [[1, 1], [1, 2]]]]


def test_walls_of_a_run_are_lines_of_kind_wall(written):
    path = written(
        collection(
            feature("wall", (0, 0), (1, 0)),
            feature("glass", (5, 5), (6, 6)),
            {"geometry": {"type": "Point", "coordinates": [0, 0]}, "properties": {"kind": "observation"}},
        )
    )
    assert [wall.tolist() for wall in read_glass_walls(path)] == [[[[0, 0], [1, 0]]]]


def test_a_truth_may_be_that_there_is_no_glass(written):
    assert read_true_glass(written(collection())) == []


def test_lines_by_run_are_panes_between_mullions(written):
    lines = [
        {"x_of_y": [0.5, 1.0], "y_from": 0.0, "y_to": 4.0, "mullions_y": [1.0, 3.0]},
        {"x_of_y": [0.0, 7.0], "y_from": 0.0, "y_to": 1.0},
    ]
    panes = read_true_glass(written({"note": "by hand", "runs": {"morning": lines}}))
    assert [pane.tolist() for pane in panes] == [
        [[[1.0, 0.0], [1.5, 1.0]]],
        [[[1.5, 1.0], [2.5, 3.0]]],
        [[[2.5, 3.0], [3.0, 4.0]]],
        [[[7.0, 0.0], [7.0, 1.0]]],
    ]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("not json", "{} is no JSON"),
        ("[1, 2]", "{} is no GeoJSON"),
        ({"type": "FeatureCollection", "features": 3}, "{} is no GeoJSON"),
        (collection({"type": "Feature", "properties": {}}), "no feature of {} has properties.kind"),
        (
            collection(feature("opaque", (0, 0), (1, 1)), feature("wall", (0, 0), geometry="Polygon")),
            "feature 2 of {} is glass but no LineString",
        ),
        (collection(feature("wall", (0, 0))), "feature 1 of {} is no line of finite coordinates"),
        (collection(feature("wall", (0,), (1,))), "feature 1 of {} is no line of finite coordinates"),
        (collection(feature("wall", (0, 0), (1, "a"))), "feature 1 of {} is no line of finite coordinates"),
        (
            collection(feature("wall", (0, 0), (1, math.nan))),
            "feature 1 of {} is no line of finite coordinates",
        ),
        ({"runs": {}}, "{} holds the glass of 0 runs"),
        ({"runs": {"a": [], "b": []}}, "{} holds the glass of 2 runs"),
        ({"runs": [1]}, "{} holds the glass of no runs"),
        ({"runs": {"a": [{"x_of_y": [1.0, 2.0]}]}}, "run a of {} has a line that cannot be read"),
        (
            {"runs": {"a": [{"x_of_y": [1.0], "y_from": 0, "y_to": 1}]}},
            "run a of {} has a line that cannot be read",
        ),
    ],
)
def test_a_truth_that_does_not_fit_is_one_line(written, content, message):
    path = written(content)
    with pytest.raises(EvaluationError) as caught:
        read_true_glass(path)
    assert caught.value.message == message.format(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(EvaluationError, match=r"cannot read .*truth: No such file or directory"):
        read_true_glass(tmp_path / "truth")
    with pytest.raises(EvaluationError) as caught:
        read_glass_walls(tmp_path / "glass.geojson")
    assert caught.value.hint == "it is written by map when a glass detector is on"


def test_the_glass_corridor_has_thirteen_panes(data_dir):
    panes = read_true_glass(data_dir / "glass_corridor" / "glass_line_approx.json")
    assert len(panes) == 13
    lengths = [float(np.hypot(*(pane[0, 1] - pane[0, 0]))) for pane in panes]
    assert sum(lengths) == pytest.approx(11.65, abs=0.01)
    assert 0.5 < min(lengths) < max(lengths) < 1.2


@pytest.fixture
def run(tmp_path):
    """Results directory with one wall and a half-found truth beside it."""
    (tmp_path / "run").mkdir()
    wall = collection(feature("wall", (0, 0.12), (2, 0.12)))
    (tmp_path / "run" / "glass.geojson").write_text(json.dumps(wall))
    truth = collection(feature("wall", (0, 0), (2, 0)), feature("glass", (0, 5), (2, 5)))
    (tmp_path / "truth.geojson").write_text(json.dumps(truth))
    return tmp_path


def test_the_command_shows_one_table(run, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["evaluate", str(run / "run"), "--glass", str(run / "truth.geojson")]) == 0
    text = capsys.readouterr().out
    assert "glass: 4.00 m true, 2.00 m of walls" in text
    rows = [row.replace("│", " ").split("m") for row in text.splitlines() if row.startswith("│")]
    assert [" ".join("m".join(row).split()) for row in rows] == [
        "0.10 m 0.00 m 0.0 % 0 of 2 2.00 m",
        "0.15 m 2.00 m 50.0 % 1 of 2 0.00 m",
        "0.25 m 2.00 m 50.0 % 1 of 2 0.00 m",
    ]
    assert text.endswith("false glass: 0.00 m, more than 0.25 m from all true glass\n")


def test_the_command_tells_how_it_has_aligned(run, capsys):
    assert main(["evaluate", str(run / "run"), "--glass", str(run / "truth.geojson"), "--align"]) == 0
    assert "aligned by " in capsys.readouterr().out


def test_the_command_writes_json(run, capsys):
    words = ["evaluate", str(run / "run" / "glass.geojson"), "--glass", str(run / "truth.geojson"), "--json"]
    assert main(words) == 0
    glass = json.loads(capsys.readouterr().out)["glass"]
    assert (glass["panes"], glass["walls"], glass["true_from_map"]) == (2, 1, None)
    assert glass["within"][1] == pytest.approx(
        {"tolerance": 0.15, "found": 2.0, "found_percent": 50.0, "panes_found": 1, "false": 0.0}
    )


def test_glass_and_trajectory_are_evaluated_together(run, tiny_result, capsys):
    from glassslam.outputs import write_tum

    truth = run / "run" / "trajectory.tum"
    write_tum(tiny_result.trajectory, truth)
    stamps = tiny_result.trajectory.stamps
    (run / "relations").write_text(f"{stamps[0]:.6f} {stamps[1]:.6f} 0.3 0.4 0 0 0 0.1\n")
    words = ["--relations", str(run / "relations"), "--glass", str(run / "truth.geojson")]
    assert main(["evaluate", str(run / "run"), *words]) == 0
    text = capsys.readouterr().out
    assert "relations, error" in text
    assert "false glass" in text


@pytest.mark.parametrize(
    ("words", "code", "line"),
    [
        (
            ["{}/run"],
            2,
            "error: nothing to compare with "
            "(give --relations FILE, --trajectory TUM, --glass FILE or --truth MAP)",
        ),
        (
            ["{}/run", "--align", "--trajectory", "x"],
            2,
            "error: --align needs --glass (a trajectory is always aligned)",
        ),
        (
            ["{}", "--glass", "{}/truth.geojson"],
            1,
            "error: cannot read {}/glass.geojson: No such file or directory "
            "(it is written by map when a glass detector is on)",
        ),
    ],
)
def test_wrong_use_is_one_line(run, capsys, words, code, line):
    assert main(["evaluate", *(word.format(run) for word in words)]) == code
    assert capsys.readouterr().err == line.format(run) + "\n"
