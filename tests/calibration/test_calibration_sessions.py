"""What the command line says of recordings: one rule for every option."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.calibration import Roi, Session, make_sessions
from glassslam.errors import UsageError

ONE, TWO, THREE = (Path(f"{name}.bag") for name in ("one", "two", "three"))


def test_a_value_is_for_all_recordings_or_one_for_each():
    sessions = make_sessions([ONE, TWO], distances=["1", "2"], materials=["acrylic"])
    assert [(s.material, s.distance) for s in sessions] == [("acrylic", 1.0), ("acrylic", 2.0)]


def test_a_dash_leaves_a_recording_out():
    sessions = make_sessions(
        [ONE, TWO, THREE],
        distances=["1", "-", "-"],
        panes=["-", "p.json", "-"],
        materials=["-", "-", "no-glass"],
    )
    assert [s.distance for s in sessions] == [1.0, None, None]
    assert [s.panes for s in sessions] == [None, Path("p.json"), None]
    assert [s.material for s in sessions] == ["glass", "glass", "no-glass"]


def test_what_is_not_said_is_glass_where_it_has_a_place_and_else_unknown():
    assert make_sessions([ONE], distances=["1"])[0].material == "glass"
    assert make_sessions([ONE])[0].material == "unknown"


@pytest.mark.parametrize(
    ("given_values", "message"),
    [
        ({"distances": ["1", "2"]}, "2 values of --distance for 3 recordings"),
        ({"materials": ["glass"] * 4}, "4 values of --material for 3 recordings"),
        ({"distances": ["near"]}, "--distance near: not a number of metres"),
        ({"distances": ["0"]}, "--distance 0: not above 0 m"),
        ({"distances": ["nan"]}, "--distance nan: not above 0 m"),
        ({"materials": ["brick"]}, "--material brick: not known"),
        ({"materials": ["glass"]}, "one.bag: nothing says where the glass is"),
        ({"materials": ["matte"]}, "one.bag: nothing says where the matte wall is"),
        (
            {"materials": ["no-glass"], "distances": ["1"]},
            "one.bag: --distance, but its material is no-glass",
        ),
        ({"materials": ["matte"], "panes": ["p"]}, "one.bag: --panes, but its material is matte"),
        ({"distances": ["1"], "panes": ["p"]}, "one.bag: both a distance and a file of panes"),
        ({"rois": ["left"]}, "--roi left: no region"),
    ],
)
def test_what_does_not_fit_is_refused(given_values, message):
    with pytest.raises(UsageError) as caught:
        make_sessions([ONE, TWO, THREE], **given_values)
    assert caught.value.message == message
    assert caught.value.exit_code == 2


def test_a_session_checks_itself():
    assert Session(ONE, "glass", 1.0).name == "one.bag"
    with pytest.raises(UsageError, match="nothing says where the polycarbonate is"):
        Session(ONE, "polycarbonate")


def degrees(*values):
    return np.radians(np.array(values, dtype=float))


def test_a_region_of_bearings():
    roi = Roi.parse("-110:-70")
    assert roi.covers(degrees(-111, -109, -90, -71, -69, 250, 270)).tolist() == [
        False, True, True, True, False, True, True,
    ]  # fmt: skip
    assert str(roi) == "at bearings from -110 to -70 deg"


def test_a_region_may_lie_behind():
    assert Roi.parse("170:-170").covers(degrees(180, -175, 169, 0)).tolist() == [True, True, False, False]


def test_all_around():
    assert Roi.parse("-180:180").covers(degrees(0, 179, -179, 90)).all()


@given(st.floats(-180, 180), st.floats(1, 359), st.floats(0, 1), st.integers(-2, 2))
def test_every_bearing_inside_is_covered_whatever_its_turn(low, width, share, turns):
    roi = Roi(math.radians(low), math.radians(low + width))
    assert roi.covers(degrees(low + share * width + 360 * turns)).all()


def test_a_box_hides_what_ends_outside():
    roi = Roi.parse("0.5,-1,2,1")
    ranges, angles = np.array([1.0, 3.0, 1.0, 0.3]), degrees(0, 0, 90, 0)
    assert roi.hide(ranges, angles).tolist() == pytest.approx([1.0, np.nan, np.nan, np.nan], nan_ok=True)
    assert str(roi) == "in the box 0.5,-1,2,1"


def test_a_box_behind_the_laser_and_one_around_it():
    assert Roi.parse("-2,-1,-1,1").covers(degrees(180, -170, 0)).tolist() == [True, True, False]
    assert Roi.parse("-1,-1,1,1").covers(degrees(0, 90, 180, -90)).all()


@pytest.mark.parametrize("text", ["1:2:3", "a:b", "1,2,3", "0,0,0,1", "-200:200", "nan:3", ""])
def test_no_region(text):
    with pytest.raises(UsageError) as caught:
        Roi.parse(text)
    assert f"--roi {text}: " in caught.value.message
    assert "LOW:HIGH in deg" in caught.value.hint
