"""tools/fusion_table.py."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest
from rich.console import Console

from glassslam.errors import RecordingError
from glassslam.evaluation import ImageErrors

TOOLS = Path(__file__).resolve().parents[2] / "tools"


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("fusion_table", TOOLS / "fusion_table.py")
    module = sys.modules["fusion_table"] = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(TOOLS))
    spec.loader.exec_module(module)
    yield module
    sys.path.remove(str(TOOLS))
    del sys.modules["fusion_table"]


def row(tool, ssim, ncc):
    return tool.Row(ImageErrors(100.0, ssim, ncc, None, None, None, None, 9, 9, 0.05, (0.0, 0.0, 0.0)), 0.25)


def measured(tool, name, **rows):
    return tool.Measured(name, 0.125, {key: row(tool, *value) for key, value in rows.items()})


def printed(table):
    console = Console(width=160)
    with console.capture() as capture:
        console.print(table)
    return [" ".join(line.replace("│", " ").split()) for line in capture.get().splitlines()]


def test_tables_i_and_ii_show_our_figures_beside_those_of_the_paper(tool):
    one = measured(tool, "scene", lidar=(0.8, 0.6), FG=(0.7, 0.5))
    lines = printed(tool.table_of(one, ("lidar", "FG", "Loc"), "Table I"))
    assert lines[0] == "Table I: scene"
    assert "lidar 100.00 0.8000 0.6000 0.7000 0.25 1142.70 0.8924 0.8090" in lines
    assert not any(line.startswith("Loc") for line in lines)


def test_table_iii_keeps_the_scenes_apart_that_nothing_was_chosen_on(tool):
    seen = measured(tool, tool.SCENES[1], lidar=(0.8, 0.6), ours=(0.9, 0.7))
    held = measured(tool, tool.SCENES[5], lidar=(0.6, 0.4), ours=(0.7, 0.5))
    lines = printed(tool.table_iii([seen, held], ("lidar", "ours"), "Table III"))
    assert "pimap_1_room 12.5 0.8000 0.6000 0.9000 0.7000" in lines
    assert "mean of 1-4 (development) 0.7000 0.8000" in lines
    assert "mean of 5-8 (held out) 0.5000 0.6000" in lines
    assert "mean 0.6000 0.7000" in lines


def test_every_row_of_the_tables_is_a_variant_or_a_map_of_the_lidar(tool):
    names = {*tool.TABLE_I, *tool.TABLE_II, *tool.TABLE_III, *tool.LAYERS, *tool.SIDES}
    assert names - set(tool.VARIANTS) == {tool.LIDAR, tool.CLEARED}
    methods = {variant["fusion"]["method"] for variant in tool.VARIANTS.values()}
    assert methods == set(tool.FUSIONS)


def test_a_folder_without_the_hallway_is_refused(tool, tmp_path):
    with pytest.raises(RecordingError, match=r"does not hold pimap/scene4\.bag"):
        tool.hallway(tmp_path, tmp_path)


@pytest.mark.slow
def test_on_the_real_hallway_ours_is_nearest_to_the_truth(tool, data_dir, tmp_path):
    names = (tool.RSF_ALL, tool.OURS, f"{tool.OURS}, 2 sonars")
    rows = tool.measure(tool.hallway(data_dir, tool.true_hallway(tmp_path)), names).rows
    ours, lidar = rows[tool.OURS], rows[tool.LIDAR]
    assert ours.errors.ssim - lidar.errors.ssim > 0.071
    assert ours.mean > max(lidar.mean, rows[tool.CLEARED].mean, rows[tool.RSF_ALL].mean) + 0.05
    assert rows[f"{tool.OURS}, 2 sonars"].mean > 0.98 * ours.mean
    assert json.dumps(tool.figures(tool.Measured("hallway", 0.3, rows)))
