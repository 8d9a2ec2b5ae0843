"""report.html: valid, self-contained, and nothing that a recording says becomes a tag."""

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import OutputError
from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import GlassWall
from glassslam.outputs import Stopwatch, Usage, build_report, html_pictures, write_results
from glassslam.outputs.html_page import escaped, facts, figures, page
from glassslam.outputs.html_report import write_html_report
from glassslam.records import Damage, RecordingInfo, SonarRing
from glassslam.slam.result import Degeneracy, SonarMaps, StageTime
from glassslam.sonar.beam_width import BeamWidth

VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """Tags must close in the order in which they were opened, and no quote may be missing."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.elements, self.texts = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), f"{tag} repeats an attribute"
        self.elements.append((tag, dict(attrs), tuple(self.open)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append((self.open[-1] if self.open else "", data))

    def tags(self, name):
        return [attributes for tag, attributes, _ in self.elements if tag == name]

    def said(self, *inside):
        return [text.strip() for tag, text in self.texts if tag in inside and text.strip()]

    def facts(self):
        """Name -> values of all tables of two columns."""
        found, name = {}, ""
        cells = [(tag, text) for tag, text in self.texts if tag in ("th", "td") and text.strip()]
        for tag, text in cells:
            name = text if tag == "th" else name
            if tag == "td":
                found.setdefault(name, []).append(text)
        return found


def html(result, tmp_path, name="run", **options):
    write_results(result, tmp_path / name, **options)
    return (tmp_path / name / "report.html").read_text(encoding="utf-8")


def wall(x, *, by_sonar=0, observations=9):
    start, end = np.array([x, 0.25]), np.array([x + 1.5, 0.25])
    return GlassWall(start, end, observations, 5, 0.987, 0.012, np.radians(0.5), 1.25, by_sonar)


def with_glass(result, *walls):
    none = np.empty((0, 2))
    return replace(result, glass=GlassLayer(walls, GlassObservations.empty(), none, np.empty(0)))


def with_sonar(result, width=12.0, readings=1847):
    ring = SonarRing(np.zeros((16, 3)), 0.5, 0.1, 5.0, "pioneer3dx")
    halves = np.radians([5.0, 6.0])
    cone = BeamWidth(
        np.radians(width), np.radians(10.0), np.radians(14.0), halves, np.ones(2), readings, -0.007, 0.034
    )
    maps = SonarMaps(
        321, np.radians(18.0), cone, result.map, result.map, np.ones(result.map.probability.shape, np.uint8)
    )
    info = replace(result.info, sonar_ring=ring, sonar_topics=("/sonar",))
    return replace(result, sonar=maps, info=info)


def named(result, text):
    """The run of a recording in which everything that has a name is called `text`."""
    result.statistics.warnings[:] = [text]
    result.statistics.scans_dropped = {text: 1}
    result.statistics.messages_dropped = {text: 2}
    result.statistics.closures_rejected = {text: 3}
    result.statistics.residuals = {text: 4.0}
    result.statistics.glass_detector, result.statistics.glass_reason = text, text
    result.statistics.stages = {text: StageTime(1.0, 2.0)}
    result.statistics.damage = [Damage(text, 1, 2, None, None, 3, text)]
    ring = SonarRing(np.zeros((2, 3)), 0.5, 0.1, 5.0, text)
    info = RecordingInfo(
        (text, f"second {text}"), text, 1.0, 1, (0.0, 0.0, 0.0), text, text, text, None, ring, (text,)
    )
    return replace(result, info=info)


def test_the_page_is_whole_and_has_one_of_what_a_page_has_once(tiny_result, tmp_path):
    text = html(with_sonar(with_glass(tiny_result, wall(0.0))), tmp_path)
    assert text.startswith("<!DOCTYPE html>\n<html lang=")
    read = Page(text)
    for once in ("html", "head", "title", "body", "h1", "style", "details", "summary"):
        assert len(read.tags(once)) == 1, once
    assert read.said("title") == read.said("h1") == ["run.clf.gz"]
    assert read.tags("meta")[0] == {"charset": "utf-8"}
    assert all(inside[:2] == ("html", "body") for tag, _, inside in read.elements if tag in ("table", "img"))
    ids = [attributes["id"] for _, attributes, _ in read.elements if "id" in attributes]
    assert len(ids) == len(set(ids))


def test_nothing_is_fetched_and_nothing_runs(tiny_result, tmp_path):
    text = html(with_sonar(with_glass(tiny_result, wall(0.0))), tmp_path)
    read = Page(text)
    assert not {"script", "link", "iframe", "object"} & {tag for tag, _, _ in read.elements}
    assert all(image["src"].startswith("data:image/png;base64,") for image in read.tags("img"))
    assert not any("href" in attributes for _, attributes, _ in read.elements)
    assert "http:" not in text
    assert "https:" not in text
    assert "@import" not in text
    assert "url(" not in text
    (policy,) = (meta["content"] for meta in read.tags("meta") if "http-equiv" in meta)
    assert policy == "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def test_it_can_be_read_on_a_telephone_and_in_the_dark(tiny_result, tmp_path):
    text = html(with_glass(tiny_result, wall(0.0)), tmp_path)
    read = Page(text)
    viewports = [meta["content"] for meta in read.tags("meta") if meta.get("name") == "viewport"]
    assert viewports == ["width=device-width, initial-scale=1"]
    (style,) = read.said("style")
    assert style.count("{") == style.count("}")
    assert "@media (prefers-color-scheme: dark)" in style
    assert re.findall(r"(?<![-\w])width: ([^;]*);", style) == ["100%", "100%", "30%"]
    colours = re.findall(r"--(\w+): #", style)
    assert sorted(colours[: len(colours) // 2]) == sorted(colours[len(colours) // 2 :])
    # tables of many columns scroll by themselves, rather than the page
    wide = [inside for tag, _, inside in read.elements if tag == "thead"]
    assert wide
    assert all(inside[-2:] == ("div", "table") for inside in wide)


def test_the_pictures_are_those_that_were_written(tiny_result, tmp_path):
    text = html(with_sonar(with_glass(tiny_result, wall(0.0))), tmp_path)
    images = {image["alt"]: image["src"].split(",")[1] for image in Page(text).tags("img")}
    assert list(images) == ["map.png", "labels.png", "fused_map.png", "source_map.png"]
    for name, data in images.items():
        assert base64.b64decode(data, validate=True) == (tmp_path / "run" / name).read_bytes()


def test_without_glass_and_sonar_there_is_the_map_alone(tiny_result, tmp_path):
    read = Page(html(tiny_result, tmp_path))
    assert [image["alt"] for image in read.tags("img")] == ["map.png"]
    assert "Sonar" not in read.said("h2")
    assert read.facts()["found"] == ["nothing: glass was not looked for"]
    assert read.tags("thead") == []


@pytest.fixture
def noise(tmp_path):
    """A picture that cannot be compressed, 600 x 400 pixels, 720 kB."""
    pixels = np.random.default_rng(1).integers(0, 256, (400, 600, 3), dtype=np.uint8)
    assert cv2.imwrite(str(tmp_path / "map.png"), pixels)
    return tmp_path


def shown(folder):
    (image,) = Page(html_pictures.picture_figures(folder)).tags("img")
    data = base64.b64decode(image["src"].split(",")[1])
    return data, cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


@pytest.mark.parametrize("most", [400_000, 50_000, 3_000])
def test_pictures_of_too_many_bytes_are_scaled_down_until_they_fit(noise, monkeypatch, most):
    monkeypatch.setattr(html_pictures, "_MOST_BYTES", most)
    data, image = shown(noise)
    assert most / 5 < len(data) <= most
    height, width = image.shape[:2]
    assert width < 600
    assert width / height == pytest.approx(1.5, rel=0.05)


def test_pictures_of_too_many_pixels_are_scaled_down(noise, monkeypatch):
    monkeypatch.setattr(html_pictures, "_MOST_PIXELS", 200_000)
    monkeypatch.setattr(html_pictures, "_SCALED_PIXELS", 30_000)
    original = cv2.imread(str(noise / "map.png"))
    _, image = shown(noise)
    assert image.shape == (133, 200, 3)
    means = original[:399].reshape(133, 3, 200, 3, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(image, means, atol=0.51)


def test_several_pictures_share_the_bytes(noise, monkeypatch):
    (noise / "labels.png").write_bytes((noise / "map.png").read_bytes())
    monkeypatch.setattr(html_pictures, "_MOST_BYTES", 300_000)
    images = Page(html_pictures.picture_figures(noise)).tags("img")
    sizes = [len(image["src"]) * 3 / 4 for image in images]
    assert all(30_000 < size < 300_000 for size in sizes)
    assert sum(sizes) < 301_000


def test_what_one_picture_takes_is_gone_for_the_next(noise, monkeypatch):
    pixels = np.random.default_rng(2).integers(0, 256, (600, 800, 3), dtype=np.uint8)
    assert cv2.imwrite(str(noise / "labels.png"), pixels)
    monkeypatch.setattr(html_pictures, "_MOST_BYTES", 1_600_000)
    smaller, larger = (
        len(image["src"]) * 3 / 4 for image in Page(html_pictures.picture_figures(noise)).tags("img")
    )
    assert smaller > 700_000
    assert 300_000 < larger < 900_000


def test_small_pictures_leave_their_bytes_to_large_ones(noise, monkeypatch):
    size = (noise / "map.png").stat().st_size
    assert cv2.imwrite(str(noise / "labels.png"), np.zeros((5, 5), np.uint8))
    monkeypatch.setattr(html_pictures, "_MOST_BYTES", size + 1000)
    image, labels = Page(html_pictures.picture_figures(noise)).tags("img")
    assert (image["alt"], labels["alt"]) == ("map.png", "labels.png")
    assert base64.b64decode(image["src"].split(",")[1]) == (noise / "map.png").read_bytes()


def test_a_picture_of_one_row_keeps_its_row(tmp_path, monkeypatch):
    assert cv2.imwrite(str(tmp_path / "map.png"), np.full((1, 900), 70, np.uint8))
    monkeypatch.setattr(html_pictures, "_MOST_PIXELS", 100)
    monkeypatch.setattr(html_pictures, "_SCALED_PIXELS", 100)
    _, image = shown(tmp_path)
    assert image.shape == (1, 300, 3)
    assert (image == 70).all()


@pytest.mark.parametrize(
    "content",
    [b"", b"GIF89a", b"\x89PNG\r\n\x1a\n", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\1\0\0\0\1\0\0" + bytes(99)],
    ids=["empty", "of another kind", "a beginning", "damaged and large"],
)
def test_what_is_no_picture_is_refused(tmp_path, content):
    (tmp_path / "map.png").write_bytes(content)
    with pytest.raises(OutputError, match=r"map\.png is no PNG picture"):
        html_pictures.picture_figures(tmp_path)


def test_the_summary_tells_what_was_read_used_and_dropped(tiny_result, tmp_path):
    tiny_result.statistics.scans_dropped = {"empty": 4, "too few returns": 0}
    tiny_result.statistics.messages_dropped = {"unreadable": 2}
    tiny_result.statistics.residuals["loop_rotation_rms"] = np.radians(2.0)
    tiny_result.statistics.residuals["mean"] = float("nan")
    tiny_result.statistics.solver_failures = 1
    told = Page(html(tiny_result, tmp_path, stopwatch=Stopwatch())).facts()
    assert told["scans"] == ["2 read, 2 used"]
    assert told["scans dropped"] == ["4 x empty"]
    assert told["messages dropped"] == ["2 x unreadable"]
    assert told["time"] == ["0.4 s recorded"]
    assert told["distance"] == ["0.5 m travelled"]
    assert told["map"] == ["2.0 x 1.5 m, 0.5 m per cell"]
    assert told["graph"] == ["2 nodes, 1 submaps"]
    assert told["constraints"] == ["1 x loop", "1 x odometry"]
    assert told["loop closures"] == ["1 accepted of 3 tried"]
    assert told["closures rejected"] == ["2 x low score"]
    assert told["residual"] == ["loop translation rms 0.01 m", "loop rotation rms 2 deg"]
    assert told["solver"] == ["failed 1 times"]
    assert told["matching"] == ["0.25 s (0.50 s CPU)"]
    assert told["peak memory"][0].endswith(" MB")
    assert told["total"][0].endswith("x real time")
    assert (told["file"], told["format"], told["odom topic"]) == (["run.clf.gz"], ["carmen"], ["none"])
    assert set(build_report(tiny_result)["versions"]) <= set(told)


def test_glass_is_told_wall_by_wall(tiny_result, tmp_path):
    tiny_result.statistics.glass_detector = "calibrated_peak"
    tiny_result.statistics.glass_reason = "calibrated on 60 scans"
    walls = wall(0.0), wall(2.0, by_sonar=4), wall(4.0, by_sonar=7, observations=7)
    text = html(with_glass(tiny_result, *walls), tmp_path)
    rows = re.findall(r"<tr>((?:<td class=\"number\">[^<]*</td>)+)</tr>", text)
    cells = [re.findall(r">([^<]+)<", row) for row in rows]
    numbers = ["1.50", "1.25", "0.987", "0.012", "0.50"]
    assert cells == [
        ["0", *numbers, "9", "lidar 9", "0.00, 0.25", "1.50, 0.25"],
        ["1", *numbers, "9", "lidar 5, sonar 4", "2.00, 0.25", "3.50, 0.25"],
        ["2", *numbers, "7", "sonar 7", "4.00, 0.25", "5.50, 0.25"],
    ]
    told = Page(text).facts()
    assert (told["detector"], told["reason"]) == (["calibrated_peak"], ["calibrated on 60 scans"])
    assert told["walls"] == ["3, 4.5 m together"]


def test_of_very_many_walls_the_first_are_shown(tiny_result, tmp_path):
    text = html(with_glass(tiny_result, *(wall(0.0) for _ in range(1001))), tmp_path)
    assert "The first 1000 of 1001." in text
    assert text.count('<td class="number">lidar 9</td>') == 1000


def test_sonar_is_told(tiny_result, tmp_path):
    told = Page(html(with_sonar(tiny_result), tmp_path)).facts()
    assert told["sweeps"] == ["321"]
    assert told["sonar map"] == ["BFA, poses FGfit"]
    assert told["joined by"] == [tiny_result.config.sonar.fusion.method]
    assert told["cone"] == ["18 deg"]
    assert told["cone as measured"] == ["12 deg (10 to 14), from 1847 readings"]
    assert told["ranges"] == ["-0.7 cm of the lidar's, spread 3.4 cm"]
    assert (told["sonar topic"], told["sonar ring"]) == (["/sonar"], ["pioneer3dx: 16 sonars"])


def test_a_cone_that_could_not_be_measured(tiny_result, tmp_path):
    result = with_sonar(tiny_result, np.nan, 12)
    assert build_report(result)["sonar"]["cone"] == {
        "used_deg": pytest.approx(18.0), "measured_deg": None, "between_deg": None, "readings": 12,
        "bias_m": None, "spread_m": None,
    }  # fmt: skip
    told = Page(html(result, tmp_path)).facts()
    assert told["cone as measured"] == ["not known: the map explains 12 readings only"]


def test_damage_and_warnings_come_before_everything_else(tiny_result, tmp_path):
    tiny_result.statistics.damage.append(Damage("run.bag", 10, 20, 1.0, 3.5, 7, "bad checksum"))
    text = html(tiny_result, tmp_path)
    lost = "run.bag: 20 bytes at offset 10 unreadable (bad checksum): about 7 messages and 2.5 s lost"
    assert Page(text).said("li") == [f"damage: {lost}", "no odometry"]
    assert text.index('<section class="alarm">') < text.index("<img")


def test_a_run_without_warnings_has_no_box_for_them(tiny_result, tmp_path):
    tiny_result.statistics.warnings.clear()
    assert 'class="alarm"' not in html(tiny_result, tmp_path)


def test_endless_lists_and_texts_are_cut(tiny_result, tmp_path):
    tiny_result.statistics.warnings[:] = [f"warning {k}" for k in range(60)]
    tiny_result.statistics.warnings[0] = "x" * 100_000
    tiny_result.statistics.messages_dropped = {f"reason {k}": 1 for k in range(500)}
    text = html(tiny_result, tmp_path)
    said = Page(text).said("li")
    assert (len(said), said[0], said[-1]) == (51, "x" * 2000 + " ...", "and 10 more, see report.json")
    told = Page(text).facts()
    dropped = told["messages dropped"]
    assert (len(dropped), dropped[-1]) == (51, "and 450 more, see report.json")
    assert told["graph"] == ["2 nodes, 1 submaps"]
    assert len(text) < 60_000


def test_the_whole_configuration_can_be_unfolded(tiny_result, tmp_path):
    read = Page(html(tiny_result, tmp_path))
    blocks = [text for tag, text in read.texts if tag == "pre"]
    assert blocks[-1] == tiny_result.config.dump()
    assert [inside[-1] for tag, _, inside in read.elements if tag == "pre"][-1] == "details"
    assert any("map_server map.yaml" in block for block in blocks)
    assert any("yaml_filename:=map.yaml" in block for block in blocks)


NAMES = [
    "<script>alert(1)</script>.bag",
    "<img src=x onerror=alert(1)>.bag",
    "\"><svg onload='alert(1)'>.bag",
    "' onmouseover='alert(1)",
    "</title></style></pre></td>",
    "]]> --> <!-- &lt;b&gt; &amp; &#60;i>",
    "{title} {body} %s $title \\u003c",
    "javascript:alert(1)",
]


@pytest.mark.parametrize("text", NAMES)
def test_names_from_a_recording_stay_text(tiny_result, tmp_path, text):
    plain = Page(html(named(tiny_result, "plain"), tmp_path, "plain"))
    read = Page(html(named(tiny_result, text), tmp_path, "odd"))
    assert read.elements == plain.elements
    # the title is the last part of a path, which a "/" in the name shortens
    odd, expected = ([said for tag, said in one.texts if tag not in ("title", "h1")] for one in (read, plain))
    assert "".join(odd).count(text) == "".join(expected).count("plain") == 18
    assert read.facts()["scan topic"] == [text]


def test_the_configuration_is_escaped_as_well(tiny_result, tmp_path, monkeypatch):
    monkeypatch.setattr(type(tiny_result.config), "dump", lambda _: "a: '</pre><script>alert(1)</script>'\n")
    read = Page(html(tiny_result, tmp_path))
    assert read.tags("script") == []
    assert [text for tag, text in read.texts if tag == "pre"][-1].startswith("a: '</pre><script>")


def test_file_names_that_are_no_text_do_not_stop_a_run(tiny_result, tmp_path):
    text = html(named(tiny_result, "a\udcff\0\x1b[31m\ufffe.bag"), tmp_path)
    assert Page(text).said("title") == ["a\ufffd\ufffd\ufffd[31m\ufffd.bag and 1 more"]
    assert not re.search("[\0-\x08\x0b-\x1f\x7f\ud800-\udfff\ufffe]", text)


@given(st.text(st.characters(), max_size=30))
def test_any_text_can_be_read_back_as_text(text):
    """Apart from the characters that no page may hold."""
    read = Page(page(text, [facts([(text, text)]), figures(text, [text], [[text]])]))
    kept = re.sub(
        "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef]",
        "\ufffd",
        "".join("\ufffd" if ord(c) & 0xFFFE == 0xFFFE else c for c in text),
    )
    found = [said for tag, said in read.texts if tag in ("title", "caption", "td")]
    assert found == ([kept] * 4 if kept else [])
    kept.encode()


def test_quotes_are_safe_in_attributes():
    assert escaped("a\"b'c") == "a&quot;b&#x27;c"


@pytest.mark.parametrize(
    ("paths", "title"),
    [
        (("/data/tour/run.bag",), "run.bag"),
        (("tour/",), "tour"),
        (("a/one.bag", "b/two.bag", "three.bag"), "one.bag and 2 more"),
        (("/",), "/"),
        ((), "glassslam map"),
    ],
)
def test_the_title_is_the_name_of_the_recording(tiny_result, tmp_path, paths, title):
    result = replace(tiny_result, info=replace(tiny_result.info, paths=paths))
    assert Page(html(result, tmp_path)).said("title") == [title]


def test_a_run_of_no_recording_has_a_page(tiny_result, tmp_path):
    read = Page(html(replace(tiny_result, info=None), tmp_path))
    assert read.said("title") == ["glassslam map"]
    assert "Recording" not in read.said("h2")


def test_numbers_that_are_none_are_question_marks(tiny_result, tmp_path):
    tiny_result.statistics.recording_seconds = float("nan")
    odd = replace(tiny_result.info, base_from_laser=(float("nan"), 0.5, float("inf")))
    told = Page(html(replace(tiny_result, info=odd), tmp_path)).facts()
    assert told["time"] == ["? s recorded"]
    assert told["laser on the robot"] == ["x ? m, y 0.500 m, yaw ? deg"]


def test_two_runs_differ_in_the_section_of_the_cost_alone(tiny_result, tmp_path):
    pages = []
    for seconds in (1.0, 20.0):
        write_results(tiny_result, tmp_path / "run", overwrite=True)
        tiny_result.statistics.stages = {"matching": StageTime(seconds, seconds)}
        report = build_report(tiny_result, Usage(seconds, 2.0 * seconds, 100.0 * seconds))
        written = write_html_report(tiny_result, report, tmp_path / "run")
        pages.append(written.read_text(encoding="utf-8").split("\n</section>\n"))
    different = [one for one, other in zip(*pages, strict=True) if one != other]
    assert [re.findall("<h2>(.*)</h2>", part) for part in different] == [["Time and memory"]]


def test_sections_come_in_the_order_of_what_matters(tiny_result, tmp_path):
    headings = Page(html(with_sonar(with_glass(tiny_result, wall(0.0))), tmp_path)).said("h2")
    order = ["Warnings", "Map", "Run", "Glass", "Sonar", "Recording", "Time and memory", "Configuration"]
    places = [headings.index(name) for name in order]
    assert all(first < second for first, second in pairwise(places))


def stretch(kind="featureless", text="9.0 m along bare walls"):
    start = 1031745824.658
    return Degeneracy(kind, 0, 1, start, start + 0.44, (1.0, -2.04), (10.0, -2.0), 9.0, text)


def test_uncertain_stretches_are_told_with_time_and_place(tiny_result, tmp_path):
    tiny_result.statistics.degeneracies = [stretch(), stretch("lost", "found again once")]
    tiny_result.statistics.tracking = {"searches_taken": 7, "stretches": 1}
    read = Page(html(tiny_result, tmp_path))
    assert "Uncertain stretches" in read.said("h2")
    assert read.facts()["featureless"] == [
        "0.0 to 0.4 s, (1.0, -2.0) to (10.0, -2.0), 9.0 m: 9.0 m along bare walls"
    ]
    assert read.facts()["lost"][0].endswith("found again once")
    assert read.facts()["searches taken"] == ["7"]


def test_a_run_without_any_has_no_such_section(tiny_result, tmp_path):
    assert "Uncertain stretches" not in html(tiny_result, tmp_path)


def test_none_is_said_where_there_are_no_uncertain_stretches(tiny_result, tmp_path):
    tiny_result.statistics.tracking = {"searches_taken": 7}
    page = html(tiny_result, tmp_path)
    assert "<h2>Uncertain stretches</h2>\n<p>none</p>\n<details>" in page


def test_very_many_stretches_are_cut(tiny_result, tmp_path):
    tiny_result.statistics.degeneracies = [stretch(("lost", "poor fit")[k % 2]) for k in range(450)]
    read = Page(html(tiny_result, tmp_path))
    assert read.facts()["more"] == ["250, see report.json"]
    assert sum("bare walls" in text for text in read.said("td")) == 200


def test_words_of_a_stretch_stay_text(tiny_result, tmp_path):
    tiny_result.statistics.degeneracies = [stretch("<b>", "</table><script>")]
    text = html(tiny_result, tmp_path)
    assert "<script>" not in text
    assert "&lt;b&gt;" in text
