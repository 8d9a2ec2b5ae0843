"""What the shipped scenes promise: paths that are free, so much glass, and that it can be seen."""

import numpy as np
import pytest

from detectors.labels import GHOST, GLASS
from glassslam.simulation import Scene, TruthLog, find_scene, simulate

BUILDINGS = {"glass_building_1": 140.0, "glass_building_2": 110.0}


@pytest.fixture(scope="module", params=[*BUILDINGS, "laboratory", "no_glass_building", "office"])
def shipped(request):
    """The scene, its glass, the share of every surface that answered at two scans a second, all labels."""
    simulation = simulate(Scene.load(find_scene(request.param)), scan_rate=2.0)
    log, seen = TruthLog(simulation.plan.segments), []

    def watch(observation):
        log.add(observation)
        seen.append((observation.labels, observation.mirrored, observation.intensities))

    for _ in simulation.records(watch):
        pass
    palette, plan = simulation.scene.palette(), simulation.plan
    glass = np.array([palette[plan.materials[m]].kind == "glass" for m in plan.material])
    lengths = np.hypot(*(plan.segments[:, 2:] - plan.segments[:, :2]).T)
    labels, mirrored, intensities = (np.array(rows) for rows in zip(*seen, strict=True))
    return request.param, simulation, glass, lengths, log.answered(), labels, mirrored, intensities


def test_a_recording_lasts_minutes_and_ends_where_a_loop_closes(shipped):
    _, simulation, *_ = shipped
    assert 60.0 < simulation.motion.times[-1] < 600.0
    poses = simulation.motion.poses[:, :2]
    assert np.hypot(*(poses[-1] - poses[0])) < 1.5
    assert simulation.motion.speeds.max() <= 1.0


def test_the_buildings_hold_the_glass_they_promise_and_the_robot_can_see_it(shipped):
    name, _, glass, lengths, answered, labels, mirrored, _ = shipped
    if name in BUILDINGS:
        assert lengths[glass].sum() == pytest.approx(BUILDINGS[name], abs=2.5)
        assert answered[glass].sum() / lengths[glass].sum() > 0.97
        assert 0.05 < ((labels == GHOST) & (mirrored == 0)).mean() < 0.4
        assert mirrored.mean() > 0.002
    if name == "no_glass_building":
        assert not glass.any()
        assert not (labels == GLASS).any()
        assert mirrored.any(), "polished steel shows the corridor mirrored"


def test_long_hallways_are_passed_twice(shipped):
    name, simulation, *_ = shipped
    if name not in BUILDINGS:
        return
    near = {"glass_building_1": (24.0, 6.1), "glass_building_2": (18.0, 8.9)}[name]
    distance = np.hypot(*(simulation.motion.poses[:, :2] - near).T)
    passes = np.flatnonzero(np.diff((distance < 1.0).astype(int)) == 1)
    assert passes.size == 2


def test_the_building_without_glass_is_full_of_bright_flashes(shipped):
    name, _, _, _, _, labels, _, intensities = shipped
    if name == "no_glass_building":
        assert (intensities > 7000).any(axis=1).mean() > 0.3
        assert labels.size


def test_the_laboratory_shows_every_panel_above_the_threshold_of_the_paper(shipped):
    name, simulation, glass, _, _, _, _, _ = shipped
    if name != "laboratory":
        return
    brightest = dict.fromkeys(np.flatnonzero(glass), 0.0)

    def watch(seen):
        for panel in brightest:
            mine = seen.intensities[(seen.labels == GLASS) & (seen.segment == panel)]
            brightest[panel] = max(brightest[panel], float(mine.max(initial=0.0)))

    for _ in simulation.records(watch):
        pass
    assert len(brightest) == 4
    assert min(brightest.values()) > 3000


def test_the_office_shows_glass_in_several_rooms(shipped):
    name, simulation, glass, lengths, answered, *_ = shipped
    if name == "office":
        rooms = {simulation.plan.names[k] for k in np.flatnonzero(glass)}
        assert len(rooms) == 5
        assert answered[glass].sum() / lengths[glass].sum() > 0.8
