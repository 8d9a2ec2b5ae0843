import numpy as np
import pytest
from tiny_scene import scene

from detectors.labels import SOLID
from glassslam.errors import ConfigError
from glassslam.simulation import simulate
from glassslam.simulation.people import Crowd, feet
from glassslam.simulation.scene import Person


def walker(**changes):
    return Person.model_validate({"name": "p", "points": [[0, 0], [4, 0], [4, 3]], "speed": 1.0} | changes)


def middle(person, time):
    return feet([person], time).mean(axis=0)


def test_a_person_walks_to_the_end_of_the_line_and_back():
    places = [middle(walker(), t) for t in (0.0, 4.0, 7.0, 10.0, 14.0)]
    assert np.array(places) == pytest.approx(np.array([[0, 0], [4, 0], [4, 3], [4, 0], [0, 0]]), abs=1e-9)


def test_a_person_may_start_anywhere_on_the_line():
    assert middle(walker(start=5.0), 0.0) == pytest.approx([4, 1])


def test_the_legs_stand_apart_and_swing_against_each_other():
    left, right = np.array([feet([walker(stance=0.3)], t) for t in np.arange(0.3, 3.6, 0.1)]).swapaxes(0, 1)
    assert left[:, 1] - right[:, 1] == pytest.approx(np.full(len(left), 0.3))
    assert np.ptp(left[:, 0] - right[:, 0]) > 0.8


def test_legs_move_evenly_during_a_sweep():
    crowd = Crowd.of(scene(people=[{"name": "p", "points": [[1, 1], [5, 1]]}]))
    legs = crowd.legs(1.0, 0.02)
    assert legs.circles.shape == (2, 5)
    moved = legs.circles[:, :2] + 0.02 * legs.circles[:, 2:4]
    assert moved == pytest.approx(feet(crowd.people, 1.02))
    assert legs.reflectance.tolist() == [0.3, 0.3]


def test_people_hide_the_wall_behind_them_and_are_solid():
    alone = simulate(scene(), "lms200")
    crossed = simulate(
        scene(people=[{"name": "p", "points": [[1, 4.2], [5, 4.2]], "speed": 0.5, "start": 3.5}]), "lms200"
    )
    truths = []
    crossed_scans = [r for r in crossed.records(truths.append) if hasattr(r, "ranges")]
    alone_scans = [r for r in alone.records() if hasattr(r, "ranges")]
    shorter = [(b.ranges < a.ranges - 0.5) for a, b in zip(alone_scans, crossed_scans, strict=True)]
    assert np.mean([row.any() for row in shorter]) > 0.5
    for row, truth in zip(shorter, truths, strict=True):
        assert (truth.labels[row] == SOLID).all()
        assert (truth.segment[row] == -1).all()


def test_a_person_who_walks_into_the_robot_is_refused():
    with pytest.raises(ConfigError) as caught:
        simulate(scene(people=[{"name": "cleaner", "points": [[4, 3], [2, 3]]}]))
    assert caught.value.message.startswith("people: 'cleaner' walks into the robot after ")
    assert caught.value.hint == "move the line walked, or change `start`"
