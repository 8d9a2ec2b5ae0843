"""The true map of scene 4 of pi-map that we measured."""

from dataclasses import replace

import numpy as np
import pimap_bow as bow
import pimap_truth as tool
import pytest

from glassslam.evaluation import evaluate_image, read_glass_cells, read_map
from glassslam.outputs import write_map
from glassslam.yamlmodel import load_yaml_model


@pytest.fixture(scope="module")
def plan():
    return load_yaml_model(tool.PLAN, tool.Plan)


def test_every_line_says_how_it_was_measured(plan):
    for line in plan.segments:
        if line.kind == "edge":
            continue
        assert 0.0 < line.sigma <= 0.1
        if line.by == "lidar":
            assert line.points > 20
            assert 0.0 < line.scatter < 0.03
        else:
            assert line.sigma >= 0.02


def test_the_hallway_is_as_large_as_published(plan):
    drawn = tool.draw(plan)
    rows, columns = np.nonzero(~np.isnan(drawn.grid.probability))
    assert 0.05 * (np.ptp(columns) + 1) == pytest.approx(30.5, abs=0.2)
    assert 0.05 * (np.ptp(rows) + 1) == pytest.approx(5.4, abs=0.25)
    assert drawn.glass_share == pytest.approx(0.32, abs=0.04)


def test_less_the_bend_of_the_poses_the_walls_of_the_hallway_are_straight(plan):
    pairs = list(zip(plan.segments, plan.lines(straight=True), strict=True))
    south = np.array(
        [ends[[1, 3]] for line, ends in pairs if line.name in {f"south-{k}" for k in range(1, 9)}]
    )
    glass = np.array([ends[[1, 3]] for line, ends in pairs if line.name.startswith("glass-wall")])
    assert np.abs(south + 0.78).max() < 0.025
    assert np.abs(glass - 1.26).max() < 0.015
    bent = plan.lines(straight=False)
    assert np.array([[line.start, line.end] for line in plan.segments]).reshape(-1, 4) == pytest.approx(bent)


def test_as_measured_the_glass_lies_near_the_line_that_sonars_see(plan):
    """y = 1.22 + 0.0036 x between x = 4.2 and 27 m, straight through the bend."""
    ends = plan.lines(straight=False)
    for line, (x0, y0, x1, y1) in zip(plan.segments, ends, strict=True):
        if line.name.startswith("glass-wall"):
            assert np.abs(np.array([y0, y1]) - 1.22 - 0.0036 * np.array([x0, x1])).max() < 0.12


def test_edges_bound_what_is_free_and_are_not_drawn(plan):
    drawn = tool.draw(plan, straight=False)
    names = {line.name: line for line in plan.segments}

    def at(x, y):
        column, row = np.floor((np.array([x, y]) - drawn.grid.origin) / 0.05).astype(int)
        return drawn.grid.probability[row, column]

    limit = names["crossing-south-limit"]
    middle = np.mean([limit.start, limit.end], axis=0)
    assert np.isnan(at(*middle))
    assert at(middle[0], middle[1] + 0.15) == 0.0
    assert np.isnan(at(middle[0], middle[1] - 0.15))
    assert at(12.0, 0.2) == 0.0
    assert np.isnan(at(12.0, 1.6)), "behind the glass nothing is known"


def test_the_program_writes_a_map_that_evaluate_reads(tmp_path, capsys):
    assert tool.main(["-o", str(tmp_path / "truth")]) == 0
    assert "30.55 m x 5." in capsys.readouterr().out
    path = tmp_path / "truth" / "pimap_scene4.yaml"
    assert np.array_equal(
        read_map(path).probability == 1.0,
        tool.draw(load_yaml_model(tool.PLAN, tool.Plan)).grid.probability == 1.0,
    )
    assert read_glass_cells(path).sum() > 400
    assert tool.main(["--measure", str(tmp_path)]) == 1
    assert "does not hold scene4.bag and scene4_pose.txt" in capsys.readouterr().err


def test_the_lines_lie_where_the_recording_shows_walls(plan, data_dir):
    points = tool.returns(data_dir / "pimap")
    for line in plan.segments:
        if line.by == "lidar" and line.points > 300:
            near = tool.across(points, line)
            assert near.size == pytest.approx(line.points, rel=0.3)
            assert abs(near.mean()) < 0.006


BOW = (np.array([-2.0, 13.0, 29.0]), np.array([-0.05, 0.08, -0.03]))


@pytest.fixture(scope="module")
def bowed_map(plan):
    return tool.draw(plan, bow=BOW)


class TestBow:
    """A map that is bowed, as a trajectory is, tells it by its opaque walls."""

    def test_lines_follow_it_without_gaps(self):
        pieces, of_line = bow.bowed(np.array([[0.0, 1.0, 10.0, 1.0], [5.0, 0.0, 5.0, 0.2]]), BOW)
        assert of_line.tolist() == [0] * 20 + [1]
        assert np.array_equal(pieces[1:20, :2], pieces[:19, 2:])
        expected = np.interp(pieces[:20, 0::2], *BOW) + 1.0
        assert pieces[:20, 1::2] == pytest.approx(expected)

    def test_it_is_found_to_a_cell_by_a_map_without_glass(self, plan, bowed_map):
        opaque = np.where(bowed_map.glass, np.nan, bowed_map.grid.probability)
        knots, offsets = bow.bow_of(plan, replace(bowed_map.grid, probability=opaque), (0.0, 0.0, 0.0))
        places = np.linspace(0.0, 28.0, 57)
        error = np.interp(places, knots, offsets) - np.interp(places, *BOW)
        assert np.abs(error).max() < 0.04
        assert np.abs(error).mean() < 0.02

    def test_walls_from_either_end_and_things_off_the_wall_do_not_mislead_it(self, plan):
        wall = next(line for line in plan.segments if line.name == "south-4")
        turned = wall.model_copy(update={"start": wall.end, "end": wall.start})
        points = np.array([[11.0, -0.74], [12.0, -0.74], [12.0, 0.5], [20.0, -0.74]])
        for line in (wall, turned):
            x, offset = bow.wall_offsets(plan.model_copy(update={"segments": (line,)}), points)
            assert x.tolist() == [11.0, 12.0]
            assert offset == pytest.approx([0.045, 0.045], abs=0.03)

    def test_the_truth_is_laid_onto_a_map_by_the_program(self, plan, bowed_map, tmp_path, capsys):
        write_map(bowed_map.grid, tmp_path / "map.yaml")
        assert tool.main(["-o", str(tmp_path), "--onto", str(tmp_path / "map.yaml")]) == 0
        laid, straight = read_map(tmp_path / "pimap_scene4.yaml"), tool.draw(plan).grid

        def likeness(truth):
            return evaluate_image(bowed_map.grid, truth).ncc

        assert likeness(laid) > likeness(straight) + 0.1
        assert "30.5" in capsys.readouterr().out

    def test_it_excludes_the_bend_of_the_published_poses(self, tmp_path, capsys):
        with pytest.raises(SystemExit):
            tool.main(["-o", str(tmp_path), "--as-measured", "--onto", "map.yaml"])
        assert "--as-measured and --onto exclude each other" in capsys.readouterr().err
