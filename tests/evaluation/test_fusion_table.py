"""tools/fusion_table.py."""

import json
from typing import get_args

import fusion_rows
import fusion_table as tool
import pytest
from rich.console import Console

from glassslam.config import FusionConfig
from glassslam.errors import RecordingError
from glassslam.evaluation import ImageErrors


def row(rows, ssim, ncc, worse=0.25):
    """A row of such figures, and worse ones for the map as it is saved."""

    def errors(by):
        return ImageErrors(100.0, ssim - by, ncc - by, None, None, None, None, 9, 9, 0.05, (0.0, 0.0, 0.0))

    return rows.Row(errors(0.0), 0.25, errors(worse))


def measured(name, **figures):
    return tool.Measured(name, 0.125, {key: row(fusion_rows, *value) for key, value in figures.items()})


def printed(table):
    console = Console(width=160)
    with console.capture() as capture:
        console.print(table)
    return [" ".join(line.replace("│", " ").split()) for line in capture.get().splitlines()]


def test_tables_i_and_ii_show_our_figures_beside_those_of_the_paper():
    one = measured("scene", lidar=(0.8, 0.6), FG=(0.7, 0.5))
    lines = printed(tool.table_of(one, ("lidar", "FG", "Loc"), "Table I"))
    assert lines[0] == "Table I: scene"
    ours, saved, published = "100.00 0.8000 0.6000 0.7000", "0.5500 0.3500 0.4500", "1142.70 0.8924 0.8090"
    assert f"lidar {ours} {saved} 0.25 {published}" in lines
    assert not any(line.startswith("Loc") for line in lines)


def test_table_iii_keeps_the_scenes_apart_that_nothing_was_chosen_on():
    seen = measured(tool.SCENES[1], lidar=(0.8, 0.6), ours=(0.9, 0.7))
    held = measured(tool.SCENES[5], lidar=(0.6, 0.4), ours=(0.7, 0.5))
    lines = printed(tool.table_iii([seen, held], ("lidar", "ours"), "Table III"))
    assert "pimap_1_room 12.5 0.8000 0.6000 0.9000 0.7000" in lines
    assert "mean of 1-4 (development) 0.7000 0.8000" in lines
    assert "mean of 5-8 (held out) 0.5000 0.6000" in lines
    assert "mean 0.6000 0.7000" in lines
    assert "mean, as saved 0.3500 0.4500" in lines


def test_every_row_of_the_tables_is_a_variant_or_a_map_of_the_lidar():
    names = {*tool.TABLE_I, *tool.TABLE_II, *tool.TABLE_III, *tool.OTHERS, *tool.SIDES}
    assert names - set(tool.VARIANTS) == {tool.LIDAR, tool.CLEARED}
    methods = {variant["fusion"]["method"] for variant in tool.VARIANTS.values()}
    assert methods == set(get_args(FusionConfig.model_fields["method"].annotation))


def test_as_in_pi_map_every_scan_counts_in_two_submaps_of_cartographer():
    assigned = dict(word.split("=") for word in fusion_rows.CARTOGRAPHER)
    for name, once in (("hit", 0.55), ("miss", 0.49)):
        odds = (once / (1.0 - once)) ** 2
        assert float(assigned[f"map.{name}_probability"]) == pytest.approx(odds / (1.0 + odds), abs=1e-3)


def test_the_figures_name_the_way_of_drawing_both_greys_and_the_mean():
    plain = tool.figures(measured("scene", lidar=(0.8, 0.6)))
    assert (plain["name"], plain["glass_share"]) == ("scene", 0.125)
    figures = plain["rows"]["lidar"]
    assert (figures["ssim"], figures["mean"], figures["seconds"]) == (0.8, pytest.approx(0.7), 0.25)
    assert figures["saved"]["mean"] == pytest.approx(0.45)
    assert json.dumps(plain)


def test_a_folder_without_the_hallway_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"does not hold pimap/scene4\.bag"):
        tool.hallway(tmp_path, tmp_path)


@pytest.fixture(scope="module")
def real(data_dir, tmp_path_factory):
    names = (tool.RSF_ALL, tool.OURS, *tool.SIDES)
    one = tool.hallway(data_dir, tool.true_hallway(tmp_path_factory.mktemp("truth")))
    return tool.measure(one, names)


@pytest.mark.slow
def test_on_the_real_hallway_revisited_rays_gain_at_least_what_the_paper_reports(real):
    rows = real["drawn as in pi-map"].rows
    lidar, revisited = rows[tool.LIDAR].errors, rows[tool.RSF_ALL].errors
    assert revisited.ssim - lidar.ssim > 0.071
    assert revisited.ncc - lidar.ncc > 0.154


@pytest.mark.slow
@pytest.mark.parametrize("way", ["drawn as in pi-map", "drawn as by default"])
def test_on_the_real_hallway_ours_is_nearest_to_the_truth(real, way):
    rows = real[way].rows
    ours = rows[tool.OURS]
    for other in (tool.LIDAR, tool.CLEARED, tool.RSF_ALL, f"{tool.RSF_ALL}, 2 sonars"):
        assert ours.mean > rows[other].mean
        assert ours.saved_mean > rows[other].saved_mean + 0.03
    sides = [rows[f"{name}, 2 sonars"].mean for name in (tool.OURS, tool.RSF_ALL)]
    assert sides[0] > sides[1] + 0.03
    assert sides[0] > 0.98 * ours.mean
