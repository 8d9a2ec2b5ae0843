"""tools/fusion_causes.py."""

import fusion_causes as tool
import numpy as np
import pytest
from rich.console import Console


def test_every_cell_belongs_to_one_region_the_nearest_wall_first():
    """A wall on the left, a pane above, free space between, and more behind the pane."""
    true = np.zeros((14, 12), dtype=np.uint8)
    true[:7] = 1
    true[:8, 0] = 2
    true[7, 1:] = 3
    x = np.broadcast_to(10.0 + 0.05 * np.arange(12), true.shape)
    y = np.broadcast_to(0.95 + 0.05 * np.arange(14)[:, None], true.shape)
    number = np.zeros(true.shape, dtype=int)
    for k, mask in enumerate(tool.by_region(true, np.stack((x, y), axis=-1))):
        number[mask] += 1 + k
    names = {1 + k: name[0] for k, name in enumerate(("wall", "glass", "inside", "behind"))} | {5: "e"}
    assert ["".join(names[k] for k in row) for row in number[::-1]] == [
        *["bbbbbbbbbbbb"] * 3,
        "gggggggggggg",
        "wwgggggggggg",
        *["wwwggggggggg"] * 5,
        *["wwwiiiiiiiii"] * 4,
    ]


def test_an_experiment_that_is_none_and_a_folder_without_the_hallway_are_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        tool.main(["--data", str(tmp_path), "wieghts"])
    assert (
        "no experiment named wieghts; choose from weights, regions, revisit, truth" in capsys.readouterr().err
    )
    assert tool.main(["--data", str(tmp_path)]) == 1
    assert "does not hold pimap/scene4.bag" in capsys.readouterr().err


@pytest.fixture(scope="module")
def tables(data_dir, tmp_path_factory):
    one = tool.hallway(data_dir, tool.true_hallway(tmp_path_factory.mktemp("truth")))
    run = tool.finished(one)

    def rows(name):
        console = Console(width=180)
        with console.capture() as capture:
            console.print(tool.EXPERIMENTS[name](one, run))
        lines = (line.strip("│").split("│") for line in capture.get().splitlines() if line.startswith("│"))
        return {cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in lines}

    return rows


@pytest.mark.slow
def test_the_final_poses_of_the_nodes_are_bad_because_they_are_few(tables):
    rows = tables("poses")
    mean = {name: float(cells[1].split()[-1]) for name, cells in rows.items()}
    assert rows["Loc, nearest node"] == rows["FG (nearest node)"], "here nothing is corrected"
    assert mean["FG (nearest node)"] < mean["FG, between nodes"] <= mean["FGfit (between scans)"]


@pytest.mark.slow
def test_the_sonar_map_that_pastes_least_off_the_walls_wins(tables):
    rows = tables("algorithms")
    off = {name: int(cells[3]) for name, cells in rows.items()}
    mean = {name: float(cells[5].split()[-1]) for name, cells in rows.items()}
    for few, many in (("ICL", "ICo"), ("ICo", "BFA"), ("BFA", "BFA, a cone of 30 deg")):
        assert off[few] < off[many]
        assert mean[few] > mean[many]
    assert mean["BFA, a cone of 1 deg"] >= mean["ICL"]


@pytest.mark.slow
def test_revisited_rays_gain_inside_where_the_lidar_map_is_unknown(tables):
    error = {name: [float(cell) for cell in cells[:-1]] for name, cells in tables("regions").items()}
    lidar, revisited = error["lidar"], error["FGfit+RSF+All"]
    gained = [a - b for a, b in zip(lidar, revisited, strict=True)]
    assert gained[3] > 0.95 * gained[0]
    assert abs(gained[2]) < 0.1 * gained[0], "not at the glass"
