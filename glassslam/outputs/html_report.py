"""report.html: a run on one page, for people."""

from collections.abc import Iterator, Sequence
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

from glassslam.outputs.html_page import (
    bullets,
    escaped,
    facts,
    figures,
    page,
    paragraph,
    preformatted,
    section,
)
from glassslam.outputs.html_pictures import picture_figures
from glassslam.outputs.html_rows import (
    WALL_COLUMNS,
    alarms,
    cost_rows,
    degeneracy_rows,
    glass_rows,
    recorded,
    recording_name,
    recording_rows,
    run_rows,
    sonar_rows,
    tracking_rows,
    travelled,
    volume_rows,
    wall_cells,
)
from glassslam.slam.result import MapResult

HTML_REPORT: Final = "report.html"
# A page is read by people: what is longer stands in full in the files beside it.
_MOST_LINES, _MOST_WALLS, _MOST_ROWS, _MOST_CHARACTERS = 50, 1000, 200, 2000

_ROS2 = """\
ros2 run nav2_map_server map_server --ros-args -p yaml_filename:=map.yaml
# in a second terminal
ros2 lifecycle set /map_server configure
ros2 lifecycle set /map_server activate
rviz2"""
_ROS1 = """\
rosrun map_server map_server map.yaml
# in a second terminal
rosrun rviz rviz"""


def write_html_report(result: MapResult, report: dict[str, Any], folder: Path) -> Path:
    """Write report.html: one page that needs nothing beside itself.

    It shows the pictures that are in the folder, what the run has found and cost, its glass walls and its
    configuration. Two runs on the same input differ in the section of the cost alone.

    Parameters
    ----------
    result : MapResult
        The finished run.
    report : dict
        Its report, as made by `build_report`.
    folder : Path
        The results directory, with its pictures.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OutputError
        A picture in the folder is none.
    OSError
        A picture cannot be read, or the page cannot be written.
    """
    target = folder / HTML_REPORT
    # forced endings of lines: the same bytes on every system
    target.write_bytes(page(recording_name(report), _sections(result, report, folder)).encode())
    return target


def _sections(result: MapResult, report: dict[str, Any], folder: Path) -> Iterator[str]:
    yield _head(report)
    yield _alarm(alarms(report))
    yield section("Map", picture_figures(folder))
    yield section("Run", facts(_short(run_rows(report))))
    yield section("Uncertain stretches", _uncertain(report))
    yield section("Glass", facts(_short(glass_rows(report["glass"]))) + _walls(result))
    yield section("Sonar", facts(_short(sonar_rows(report["sonar"]))))
    yield section("Volume", facts(_short(volume_rows(report["volume"]))))
    yield section("Recording", facts(_short(recording_rows(report))))
    yield section("Time and memory", facts(_short(cost_rows(report))))
    yield section("Look at it in map_server", _viewing())
    yield section("Versions", facts(report["versions"].items()))
    yield section("Configuration", _configuration(result))


def _head(report: dict[str, Any]) -> str:
    parts = (recorded(report), travelled(report), f"mapped by glassslam {report['versions']['glassslam']}")
    return f"<h1>{escaped(recording_name(report))}</h1>\n" + paragraph(", ".join(parts), "faint")


def _alarm(texts: Sequence[str]) -> str:
    if not texts:
        return ""
    shown = [_cut(text) for text in texts[:_MOST_LINES]]
    if hidden := len(texts) - len(shown):
        shown.append(f"and {hidden} more, see report.json")
    return f'<section class="alarm">\n<h2>Warnings</h2>\n{bullets(shown)}\n</section>'


def _uncertain(report: dict[str, Any]) -> str:
    rows = list(_short(islice(degeneracy_rows(report), _MOST_ROWS)))
    if (hidden := len(report["degeneracies"]) - _MOST_ROWS) > 0:
        rows.append(("more", f"{hidden}, see report.json"))
    said = "Times from the first scan, places in the map frame, in m." if rows else ""
    tracking = _tracking(report)
    listed = facts(rows) or (tracking and paragraph("none"))
    return "\n".join(filter(None, (said and paragraph(said, "faint"), listed, tracking)))


def _tracking(report: dict[str, Any]) -> str:
    rows = facts(tracking_rows(report))
    return rows and f"<details>\n<summary>Tracking in numbers</summary>\n{rows}\n</details>"


def _walls(result: MapResult) -> str:
    walls = result.glass.walls if result.glass is not None else ()
    if not walls:
        return ""
    caption = "Metres of the map frame, numbered as in glass.geojson; ± is one standard deviation."
    if len(walls) > _MOST_WALLS:
        caption += f" The first {_MOST_WALLS} of {len(walls)}."
    return "\n" + figures(caption, WALL_COLUMNS, wall_cells(walls[:_MOST_WALLS]))


def _viewing() -> str:
    return "\n".join(
        (
            paragraph("In the folder of this page, with ROS 2:"),
            preformatted(_ROS2),
            paragraph("With ROS 1 (roscore running):"),
            preformatted(_ROS1),
            paragraph(
                "In RViz set the fixed frame to map and add a Map display of the topic /map; with ROS 2 its "
                "durability policy must be Transient Local."
            ),
        )
    )


def _configuration(result: MapResult) -> str:
    said = "Every parameter that was in force; config.yaml holds the same for map --config."
    return f"<details>\n<summary>{escaped(said)}</summary>\n{preformatted(result.config.dump())}\n</details>"


def _short(rows: Iterator[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    for name, group in groupby(rows, key=itemgetter(0)):
        for _, value in islice(group, _MOST_LINES):
            yield name, _cut(value)
        if hidden := sum(1 for _ in group):
            yield name, f"and {hidden} more, see report.json"


def _cut(text: str) -> str:
    return text if len(text) <= _MOST_CHARACTERS else f"{text[:_MOST_CHARACTERS]} ..."
