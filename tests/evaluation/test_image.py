"""The image metrics: alignment, MSE, SSIM, NCC, overlap of classes, and the maps they read."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.cli import main
from glassslam.errors import EvaluationError, OutputError, UsageError
from glassslam.evaluation import align_maps, evaluate_image, read_glass_cells, read_map
from glassslam.evaluation.image import normalised_cross_correlation
from glassslam.evaluation.image_kernels import closeness, closeness_of_all, distance_at
from glassslam.geometry import compose, inverse, transform_points
from glassslam.outputs import write_map
from glassslam.outputs.labels import FREE, GLASS, SOLID, UNKNOWN, write_label_image
from glassslam.simulation import draw_true_map

# An L-shaped room with a pillar: it looks like itself from no other side.
CORNERS = [[0, 0], [9, 0], [9, 4], [5, 4], [5, 7], [0, 7]]
PILLAR = [[2, 2], [3, 2], [3, 2.6], [2, 2.6]]
# Half a cell off the lattice: a wall on the border of two cells is drawn into either.
WALLS = 0.025 + np.vstack([np.hstack((ring, np.roll(ring, -1, axis=0))) for ring in (CORNERS, PILLAR)])
GLASS_WALLS = np.arange(len(WALLS)) == 4
INSIDE = np.array([[1.0, 1.0]])


def room(motion=(0.0, 0.0, 0.0), resolution=0.05):
    """The room drawn after a motion of its walls."""
    moved = transform_points(np.array(motion), WALLS.reshape(-1, 2)).reshape(-1, 4)
    return draw_true_map(moved, GLASS_WALLS, transform_points(np.array(motion), INSIDE), resolution)


def error_of(found, true):
    x, y, theta = compose(inverse(np.array(true)), np.array(found))
    middle = transform_points(np.array([x, y, theta]), np.array([[4.0, 3.0]]))[0] - [4.0, 3.0]
    return np.hypot(*middle), abs(np.rad2deg(theta))


@pytest.mark.parametrize("motion", [(0.0, 0.0, 0.0), (3.2, -1.7, 0.4), (-6.0, 2.5, 2.9), (1.0, 1.0, -1.57)])
def test_a_known_motion_is_recovered(motion):
    found = align_maps(room(motion).grid, room().grid)
    distance, turn = error_of(found, motion)
    assert distance < 0.03
    assert turn < 0.3


def test_a_truth_of_finer_cells_is_laid_onto_a_map_of_half_the_walls(draw_map):
    motion = (1.3, 0.6, -0.3)
    grid = room(motion, resolution=0.1).grid
    columns = np.arange(grid.probability.shape[1])
    grid.probability[:, columns > 60] = np.nan
    distance, turn = error_of(align_maps(grid, room(resolution=0.05).grid), motion)
    assert distance < 0.05
    assert turn < 0.5


def test_a_room_with_two_equal_ends_is_laid_down_by_what_is_free():
    box = np.array([[0, 0, 6, 0], [6, 0, 6, 3], [6, 3, 0, 3], [0, 3, 0, 0]], dtype=float)
    true = draw_true_map(box, np.zeros(4, dtype=bool), np.array([[1.0, 1.0]])).grid
    probability = true.probability.copy()
    probability[:, :40] = np.where(probability[:, :40] == 1.0, 1.0, np.nan)
    grid = type(true)(probability, true.resolution, true.origin)
    assert error_of(align_maps(grid, true), (0.0, 0.0, 0.0))[1] < 1.0


def test_the_same_maps_give_the_same_motion():
    a, b = room((3.2, -1.7, 0.4)).grid, room().grid
    assert align_maps(a, b) == align_maps(a, b)


def test_equal_maps_are_equal():
    drawn = room()
    errors = evaluate_image(drawn.grid, drawn.grid, glass=drawn.glass, true_glass=drawn.glass)
    assert (errors.mse, errors.ssim, errors.ncc) == (0.0, pytest.approx(1.0), 1.0)
    assert (errors.iou_occupied, errors.iou_free, errors.iou_unknown, errors.iou_glass) == (
        1.0,
        1.0,
        1.0,
        1.0,
    )
    assert errors.map_from_truth == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


TRUE = """
    ?????????
    ?#######?
    ?#.....#?
    ?#.....#?
    ?#.....#?
    ?#######?
    ?????????
"""
MINE = """
    ?????????
    ?#######?
    ?#.....??
    ?#.....??
    ?#....##?
    ?#######?
    ?????????
"""


def test_each_metric_of_a_drawing_counted_by_hand(draw_map):
    errors = evaluate_image(draw_map(MINE), draw_map(TRUE), map_from_truth=(0.0, 0.0, 0.0))
    # 1 m are 2 cells: 7 x 5 known cells and a margin of 2 on each side.
    assert (errors.columns, errors.rows) == (11, 9)
    assert errors.mse == pytest.approx((2 * 205**2 + 254**2) / 99)
    assert errors.iou_occupied == pytest.approx(18 / 21)
    assert errors.iou_free == pytest.approx(14 / 15)
    assert errors.iou_unknown == pytest.approx(64 / 66)
    assert errors.iou_glass is None
    assert 0.5 < errors.ssim < 1.0


def test_unknown_cells_have_the_grey_that_is_asked_for(draw_map):
    drawing = draw_map("########\n#......#\n#......#\n#...??.#\n#...??.#\n#......#\n########")
    whole = draw_map("########\n#......#\n#......#\n#......#\n#......#\n#......#\n########")
    own = (0.0, 0.0, 0.0)
    for grey in (205, 128, 0, 255):
        errors = evaluate_image(drawing, whole, map_from_truth=own, unknown_grey=grey)
        assert errors.mse * errors.rows * errors.columns == pytest.approx(4 * (254 - grey) ** 2)
    assert evaluate_image(drawing, whole, map_from_truth=own) == evaluate_image(
        drawing, whole, map_from_truth=own, unknown_grey=205
    )
    for grey in (-1, 256):
        with pytest.raises(EvaluationError, match=rf"^no grey value is {grey}$") as caught:
            evaluate_image(drawing, whole, map_from_truth=own, unknown_grey=grey)
        assert caught.value.hint == "unknown_grey lies between 0 and 255"


def test_correlation_by_hand():
    a = np.array([[0, 0], [254, 254]], dtype=np.uint8)
    b = np.array([[0, 254], [254, 254]], dtype=np.uint8)
    # about the means 127 and 190.5: products sum to 127 * 254, squares to 4 * 127^2 and 12 * 63.5^2
    assert normalised_cross_correlation(a, b) == pytest.approx(
        127 * 254 / np.sqrt(4 * 127.0**2 * 12 * 63.5**2)
    )
    assert normalised_cross_correlation(a, b) == pytest.approx(1 / np.sqrt(3))


def test_an_even_image_correlates_with_itself_only():
    grey, black = np.full((3, 3), 205, dtype=np.uint8), np.zeros((3, 3), dtype=np.uint8)
    assert normalised_cross_correlation(grey, grey) == 1.0
    assert normalised_cross_correlation(grey, black) == 0.0


IMAGES = arrays(np.uint8, (4, 5))


@given(IMAGES, IMAGES)
def test_correlation_is_symmetric_and_bounded(a, b):
    ncc = normalised_cross_correlation(a, b)
    assert -1.0 - 1e-9 <= ncc <= 1.0 + 1e-9
    assert ncc == pytest.approx(normalised_cross_correlation(b, a))


@given(arrays(np.uint8, (4, 5), elements=st.integers(0, 100)), st.integers(0, 50))
def test_correlation_does_not_mind_light_and_contrast(a, light):
    brighter = (2 * a + light).astype(np.uint8)
    expected = 1.0 if np.ptp(a) or np.array_equal(a, brighter) else 0.0
    assert normalised_cross_correlation(a, brighter) == pytest.approx(expected)


def test_the_region_does_not_grow_with_the_map():
    drawn = room()
    wide = np.pad(drawn.grid.probability, 200, constant_values=np.nan)
    wide[50, 50:400] = 1.0
    offset = 200 * 0.05
    origin = (drawn.grid.origin[0] - offset, drawn.grid.origin[1] - offset)
    grid = type(drawn.grid)(wide, 0.05, origin)
    one = evaluate_image(grid, drawn.grid, map_from_truth=(0.0, 0.0, 0.0))
    two = evaluate_image(drawn.grid, drawn.grid, map_from_truth=(0.0, 0.0, 0.0))
    assert (one.mse, one.ssim, one.rows, one.columns) == (two.mse, two.ssim, two.rows, two.columns)


def test_glass_is_a_class_of_its_own():
    drawn = room()
    half = drawn.glass.copy()
    half[:, : half.shape[1] // 3] = False
    errors = evaluate_image(drawn.grid, drawn.grid, glass=half, true_glass=drawn.glass)
    assert errors.iou_glass == pytest.approx(half.sum() / drawn.glass.sum(), abs=0.02)
    assert errors.iou_occupied == 1.0


def test_maps_without_walls_and_foreign_classes_are_refused():
    drawn, empty = room(), room().grid
    empty.probability[:] = 0.0
    with pytest.raises(EvaluationError, match="the map has no occupied cell"):
        align_maps(empty, drawn.grid)
    with pytest.raises(EvaluationError, match="the truth has no occupied cell"):
        align_maps(drawn.grid, empty)
    with pytest.raises(EvaluationError, match=r"the map has \(.*\) cells, its classes have \(2, 2\)"):
        evaluate_image(drawn.grid, drawn.grid, glass=np.zeros((2, 2), dtype=bool))
    empty.probability[:] = np.nan
    with pytest.raises(EvaluationError, match="the truth knows no cell"):
        evaluate_image(drawn.grid, empty, map_from_truth=(0.0, 0.0, 0.0))


def naive_distance(x, y, distances, low, cell, far):
    column, row = (x - low[0]) / cell - 0.5, (y - low[1]) / cell - 0.5
    i, j = int(np.floor(column)), int(np.floor(row))
    if not (0 <= i < distances.shape[1] - 1 and 0 <= j < distances.shape[0] - 1):
        return far
    weights = np.outer([1 - (row - j), row - j], [1 - (column - i), column - i])
    return float((weights * distances[j : j + 2, i : i + 2]).sum())


@given(
    arrays(np.float64, (4, 5), elements=st.floats(0, 3)),
    arrays(np.float64, (6, 2), elements=st.floats(-1, 4)),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3)),
)
def test_closeness_agrees_with_its_naive_twin(distances, points, motion):
    low, pose = np.array([-0.3, 0.2]), np.array(motion)
    moved = transform_points(pose, points)
    near = [naive_distance(x, y, distances, low, 0.5, 1e3) for x, y in moved]
    expected = np.exp(-0.5 * (np.array(near) / 0.4) ** 2).mean()
    assert closeness(pose, points, distances, low, 0.5, 0.4) == pytest.approx(expected)
    out = np.ones(2)
    closeness_of_all(np.stack((pose, pose)), points, distances, low, 0.5, 0.4, out)
    assert out == pytest.approx(np.full(2, 1.0 + expected))
    assert distance_at(moved[0, 0], moved[0, 1], distances, low, 0.5, 7.0) == pytest.approx(
        naive_distance(*moved[0], distances, low, 0.5, 7.0)
    )


@pytest.fixture
def written(tmp_path):
    drawn = room()
    write_map(drawn.grid, tmp_path / "true.yaml")
    labels = np.full(drawn.glass.shape, UNKNOWN, dtype=np.uint8)
    labels[drawn.grid.probability == 0.0] = FREE
    labels[drawn.grid.probability == 1.0] = SOLID
    labels[drawn.glass] = GLASS
    write_label_image(labels, tmp_path / "true.labels.png")
    return tmp_path, drawn


def test_a_map_reads_back_with_its_glass(written):
    folder, drawn = written
    grid = read_map(folder / "true.yaml")
    assert np.array_equal(grid.probability, drawn.grid.probability, equal_nan=True)
    assert np.array_equal(read_glass_cells(folder / "true.yaml"), drawn.glass)
    assert read_glass_cells(folder / "other.yaml") is None


def test_a_picture_needs_a_resolution(written):
    folder, drawn = written
    picture = read_map(folder / "true.pgm", 0.05)
    assert np.array_equal(picture.probability, drawn.grid.probability, equal_nan=True)
    assert picture.origin == (0.0, 0.0)
    with pytest.raises(UsageError, match=r"true\.pgm does not state its resolution"):
        read_map(folder / "true.pgm")
    with pytest.raises(UsageError, match="a resolution of -1 m makes no map"):
        read_map(folder / "true.pgm", -1.0)
    with pytest.raises(UsageError, match="states its own resolution"):
        read_map(folder / "true.yaml", 0.05)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.0]", "0.5]", "the map is turned by 0.5 rad"),
        ("mode: trinary", "mode: raw", "mode raw has no thresholds"),
        ("true.pgm", "lost.pgm", "cannot read .*lost.pgm: No such file"),
        ("resolution", "size", "a value is missing or no number: 'resolution'"),
    ],
)
def test_maps_that_cannot_be_compared_are_one_clear_line(written, old, new, message):
    folder, _ = written
    path = folder / "true.yaml"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(OutputError, match=message):
        read_map(path)


def test_classes_in_foreign_colours_are_refused(written):
    folder, _ = written
    (folder / "true.labels.png").write_bytes((folder / "true.pgm").read_bytes())
    with pytest.raises(OutputError, match="shows other colours"):
        read_glass_cells(folder / "true.yaml")


def test_negated_maps_read_the_other_way_round(written):
    folder, drawn = written
    path = folder / "true.yaml"
    image = folder / "true.pgm"
    header, pixels = image.read_bytes()[:15], np.frombuffer(image.read_bytes()[15:], dtype=np.uint8)
    size = b"P5\n%d %d\n255\n" % drawn.grid.probability.shape[::-1]
    assert header.startswith(size)
    pixels = np.frombuffer(image.read_bytes()[len(size) :], dtype=np.uint8)
    image.write_bytes(size + (255 - pixels).tobytes())
    path.write_text(path.read_text().replace("negate: 0", "negate: 1"))
    assert np.array_equal(read_map(path).probability, drawn.grid.probability, equal_nan=True)


def test_evaluate_compares_every_map_of_a_run(written, capsys):
    folder, drawn = written
    run = folder / "run"
    run.mkdir()
    write_map(drawn.grid, run / "map.yaml")
    write_map(room((0.4, 0.0, 0.0)).grid, run / "fused_map.yaml")
    assert main(["evaluate", str(run), "--truth", str(folder / "true.yaml"), "--json"]) == 0
    maps = json.loads(capsys.readouterr().out)["image"]["maps"]
    assert list(maps) == ["map", "fused_map"]
    assert (maps["map"]["mse"], maps["map"]["ncc"]) == (0.0, 1.0)
    assert maps["fused_map"]["ncc"] < 0.7, "laid down as the first map, not anew"
    assert maps["map"]["iou_glass"] is None
    assert main(["evaluate", str(run), "--truth", str(folder / "true.yaml")]) == 0
    out = capsys.readouterr().out
    assert "likeness with the true map" in out
    assert "truth moved by" in out


def test_evaluate_refuses_what_is_no_map_in_one_line(written, capsys):
    folder, _ = written
    (folder / "empty").mkdir()
    assert main(["evaluate", str(folder / "empty"), "--truth", str(folder / "true.yaml")]) == 2
    assert capsys.readouterr().err == (
        f"error: {folder / 'empty'} holds no map (name a results directory of map, or a map)\n"
    )
    assert main(["evaluate", str(folder / "true.yaml"), "--truth", str(folder / "no.yaml")]) == 1
    assert capsys.readouterr().err == f"error: cannot read {folder / 'no.yaml'}: No such file or directory\n"
    assert main(["evaluate", str(folder), "--glass", "x", "--resolution", "0.1"]) == 2
    assert "--resolution needs --truth" in capsys.readouterr().err
