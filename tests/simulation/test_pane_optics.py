"""The optics reproduce what was measured on real panes at 1 to 2 m, and what is known of far ones."""

import numpy as np
import pytest
from optics_worlds import NOBODY, facing, look, many, plan_of

from detectors.labels import GHOST, GLASS, NO_RETURN, SOLID
from glassslam.simulation import lidar
from glassslam.simulation.echo import Optics
from glassslam.simulation.materials import MATERIALS, Material

PANES = many("glass")
NEAR = (1.0, 2.0)


def answered(seen):
    return (seen.labels == GLASS).mean()


@pytest.mark.parametrize(
    ("angles", "share", "tolerance"),
    [((0, 10), 1.0, 0.005), ((10, 30), 1.0, 0.01), ((30, 40), 0.92, 0.04), ((40, 50), 0.67, 0.06)],
)
def test_a_near_pane_answers_as_many_beams_as_measured(angles, share, tolerance):
    assert answered(facing(PANES, "utm30lx", NEAR, angles)) == pytest.approx(share, abs=tolerance)


@pytest.mark.parametrize(
    ("angles", "median"),
    [
        ((0, 1), 3421),
        ((1, 2), 2886),
        ((3, 5), 2395),
        ((8, 12), 1328),
        ((16, 20), 698),
        ((20, 30), 426),
        ((40, 50), 150),
    ],
)
def test_a_near_pane_is_as_bright_as_measured(angles, median):
    seen = facing(PANES, "utm30lx", NEAR, angles)
    assert np.median(seen.intensities[seen.labels == GLASS]) == pytest.approx(median, rel=0.15)


def test_the_spike_at_normal_incidence_stands_far_above_the_halo():
    seen = facing(PANES, "utm30lx", NEAR, (0.0, 0.1))
    assert np.percentile(seen.intensities, 75) > 10_000


@pytest.mark.parametrize(("ranges", "widest"), [((2.2, 2.8), 40), ((4.5, 5.5), 12), ((9, 11), 4)])
def test_a_far_pane_answers_only_near_normal_incidence(ranges, widest):
    assert answered(facing(PANES, "utm30lx", ranges, (0.0, 0.3))) > 0.9
    assert answered(facing(PANES, "utm30lx", ranges, (widest, widest + 5))) < 0.03


def test_the_widest_angle_of_an_answer_shrinks_with_the_range():
    angles = np.arange(0.0, 60.0, 3.0)

    def widest(distance):
        shares = [
            answered(facing(PANES, "utm30lx", (distance, distance), (a, a + 3), n=1500)) for a in angles
        ]
        return angles[np.flatnonzero(np.array(shares) >= 0.5)[-1]]

    reach = [widest(distance) for distance in (1.0, 1.5, 2.0, 3.0, 5.0, 8.0)]
    assert reach == sorted(reach, reverse=True)
    assert reach[0] >= 42
    assert reach[-1] <= 6


def test_the_same_pane_is_compared_with_the_diffuse_level_of_the_sensor():
    """A threshold in the unit of one lidar means nothing to another; the ratio to a white wall does."""

    def ratio(sensor):
        seen = facing(PANES, sensor, (1.0, 1.0), (2, 3))
        return np.median(seen.intensities) / lidar(sensor).intensity_at_1m

    assert ratio("ust10lx") == pytest.approx(ratio("utm30lx"), rel=0.03)


def test_neighbouring_beams_of_a_pane_are_alike():
    plan = plan_of(("glass", 0, 1.3, 3, 1.3))
    seen = look(plan, "utm30lx", 1.5, 0.0, np.arange(70.0, 85.0, 0.25))
    steps = np.diff(np.log(seen.intensities))
    assert np.abs(steps).mean() < 0.08


def test_a_mullion_flashes_at_other_angles_than_its_panes():
    seen = facing(many("aluminium"), "utm30lx", NEAR, (0.0, 5.0))
    assert np.median(seen.intensities) > 7000


def test_a_reflector_is_very_bright_at_all_angles():
    seen = facing(many("reflector"), "utm30lx", NEAR, (0.0, 70.0))
    assert seen.intensities.min() > 20_000
    assert set(seen.labels) == {SOLID}


def test_glossy_paint_has_a_lobe_on_a_diffuse_floor():
    lobe = facing(many("glossy_paint"), "utm30lx", (1.0, 1.0), (0.0, 1.0)).intensities
    floor = facing(many("glossy_paint"), "utm30lx", (1.0, 1.0), (30.0, 31.0)).intensities
    assert np.median(lobe) == pytest.approx(1.5 * 5400, rel=0.02)
    assert np.median(floor) == pytest.approx(0.6 * np.cos(np.deg2rad(30.5)) * 5400, rel=0.02)


def test_a_clean_leaning_pane_never_answers():
    leaning = many("clean_glass", lean_deg=14.0)
    for sensor in ("ust10lx", "utm30lx", "lms200", "rplidar"):
        assert answered(facing(leaning, sensor, (0.8, 3.0), (0.0, 60.0))) == 0.0
    assert answered(facing(many("clean_glass"), "utm30lx", NEAR, (0.0, 0.1))) > 0.8


def behind(distance):
    return plan_of(("clean_glass", 0, 2, 4, 2), ("plaster", 0, distance, 4, distance), lean_deg=14.0)


def test_an_object_behind_a_pane_is_a_ghost_weaker_by_two_passes():
    plan = behind(3.0)
    through = look(plan, "utm30lx", 2.0, 0.0, [90.0] * 2000)
    direct = look(plan, "utm30lx", 2.0, 6.0, [-90.0] * 2000)
    assert set(through.labels) == {GHOST}
    assert set(through.mirrored) == {0}
    assert set(direct.labels) == {SOLID}
    assert np.median(through.ranges) == pytest.approx(3.0, abs=0.002)
    passes = np.median(through.intensities) / np.median(direct.intensities)
    assert passes == pytest.approx(0.92**2, rel=0.01)


def test_the_loss_grows_towards_grazing_incidence():
    def level(angle):
        away = 3.0 / np.cos(np.deg2rad(angle))
        plan = plan_of(("clean_glass", -5, 2, 60, 2), ("sheet", -5, 3, 60, 3), lean_deg=14.0)
        table = MATERIALS | {"sheet": Material(kind="retroreflective", reflectance=0.0, retro=1.0)}
        seen = look(plan, "utm30lx", 0.0, 0.0, [90.0 - angle] * 500, material_table=table)
        return np.median(seen.intensities) / (5400 * away**-0.59)

    assert level(10) == pytest.approx(0.92**2, rel=0.02)
    assert level(50) < level(10)
    assert level(80) < 0.4


def test_at_grazing_incidence_a_pane_mirrors_the_end_of_the_corridor():
    plan = plan_of(("clean_glass", 0, 0, 12, 0), ("plaster", 12, 0.1, 12, 2.4))
    bearing = np.deg2rad(10.0)
    seen = look(plan, "utm30lx", 5.0, 0.4, [-10.0] * 200)
    assert set(seen.labels) == {GHOST}
    assert seen.mirrored.all()
    assert np.median(seen.ranges) == pytest.approx(7.0 / np.cos(bearing), abs=0.005)
    assert set(seen.segment) == {1}
    assert np.median(seen.along) == pytest.approx(7.0 * np.tan(bearing) - 0.4 - 0.1, abs=1e-4)


def test_a_mirrored_wall_too_weak_for_the_lidar_is_not_seen():
    plan = plan_of(("clean_glass", 0, 0, 20, 0), ("plaster", 0, 2.4, 20, 2.4))
    assert set(look(plan, "utm30lx", 5.0, 0.4, [-20.0] * 200).labels) == {NO_RETURN}


def test_the_mirror_image_of_a_leaning_pane_is_not_in_the_plane_of_the_scan():
    plan = plan_of(("clean_glass", 0, 0, 12, 0), ("plaster", 12, 0.1, 12, 2.4), lean_deg=14.0)
    assert set(look(plan, "utm30lx", 5.0, 0.4, [-10.0] * 200).labels) == {NO_RETURN}


def test_a_pane_seen_square_on_mirrors_nothing():
    plan = plan_of(("glass", 0, 2, 4, 2), ("plaster", 0, -1, 4, -1))
    assert set(look(plan, "utm30lx", 2.0, 0.0, [90.0] * 200).labels) == {GLASS}


def test_polished_steel_shows_the_room_mirrored_and_is_bright_square_on():
    plan = plan_of(("polished_steel", 0, 3.5, 8, 3.5), ("plaster", 0, -1, 8, -1))
    seen = look(plan, "utm30lx", 2.0, 0.0, [60.0] * 200)
    assert (seen.labels == GHOST).all()
    assert seen.mirrored.all()
    assert np.median(seen.ranges) == pytest.approx((3.5 + 4.5) / np.sin(np.deg2rad(60)), abs=0.02)
    square = look(plan, "utm30lx", 2.0, 2.0, [90.0] * 200)
    assert set(square.labels) == {SOLID}
    assert np.median(square.intensities) > 7000


def test_two_mirrors_do_not_trap_a_beam():
    plan = plan_of(("polished_steel", 0, 1, 8, 1), ("polished_steel", 0, -1, 8, -1))
    seen = look(plan, "ust10lx", 4.0, 0.0, np.arange(0.0, 360.0, 0.5))
    assert np.isfinite(seen.ranges).any()


def glass_before_a_wall(gap):
    return plan_of(("glass", 0, 1.0, 4, 1.0), ("plaster", 0, 1.0 + gap, 4, 1.0 + gap))


def test_a_time_of_flight_lidar_reports_the_first_echo_even_if_it_is_weaker():
    seen = look(glass_before_a_wall(0.5), "utm30lx", 2.0, 0.0, np.arange(60.0, 70.0, 0.25))
    unhindered = look(behind(1.5), "utm30lx", 2.0, 0.0, np.arange(60.0, 70.0, 0.25))
    assert (seen.labels == GLASS).all()
    assert (unhindered.labels == GHOST).all() or (unhindered.labels == SOLID).all()
    assert np.median(seen.intensities) < 0.6 * np.median(unhindered.intensities)


def test_a_triangulating_lidar_reports_the_strongest_echo():
    model = lidar("rplidar")
    assert model.echo == "strongest"
    spikes = look(glass_before_a_wall(9.0), model, 2.0, 0.0, np.arange(84.0, 96.0, 0.05))
    hidden = look(glass_before_a_wall(0.1), model, 2.0, 0.0, np.arange(84.0, 96.0, 0.05))
    assert answered(hidden) < answered(spikes)


def drive_along(distance, seed=0, panes=19):
    """Returns of a 23 m glass wall as an RPLidar drives along it: counts, places, incidence, offsets."""
    model = lidar("rplidar")
    wall = [("glass", 1.2 * k + 0.03, 0, 1.2 * k + 1.17, 0) for k in range(panes)]
    plan = plan_of(*wall, ("plaster", -10, 2, 35, 2), ("plaster", -10, -3, 35, -3))
    optics, random = Optics.build(plan, MATERIALS, model), np.random.default_rng(seed)
    beam = np.arange(model.beams)
    counts, places, angles, offsets = [], [], [], []
    for x in np.arange(0.0, 1.2 * panes, 0.028):
        seen = optics.observe(np.tile([x, -distance, 0.3], (model.beams, 1)), NOBODY, random)
        glass = seen.labels == GLASS
        heading = 0.3 + model.angle_min + beam[glass] * model.angle_increment
        counts.append(int(glass.sum()))
        places += list(x + seen.ranges[glass] * np.cos(heading))
        angles += list(np.rad2deg(heading) - 90.0)
        offsets += list(seen.ranges[glass] * np.sin(heading) - distance)
    return np.array(counts), np.sort(places), np.array(angles), np.array(offsets)


def test_an_rplidar_sees_a_glass_wall_in_rare_narrow_returns():
    counts, places, angles, offsets = drive_along(1.1)
    some = counts[counts > 0]
    assert 0.08 < (counts > 0).mean() < 0.3
    assert (some <= 3).mean() > 0.9
    assert np.percentile(np.abs(angles), 95) < 6.0
    assert offsets.std() == pytest.approx(0.038, rel=0.15)
    assert 1.2 < np.diff(places).max() < 5.0


def test_an_rplidar_reports_nothing_beyond_five_metres():
    assert np.isposinf(facing(many("plaster"), "rplidar", (5.2, 6.0), (0, 10), n=200).ranges).all()
    assert np.isfinite(facing(many("plaster"), "rplidar", (4.5, 4.8), (0, 10), n=200).ranges).all()
