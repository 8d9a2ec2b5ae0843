import numpy as np
import pytest
from pydantic import ValidationError
from tiny_scene import scene

from glassslam.errors import ConfigError
from glassslam.simulation.echo import surface_table
from glassslam.simulation.floorplan import build_floor_plan
from glassslam.simulation.materials import MATERIALS, Material


def refused(**fields):
    with pytest.raises(ValidationError) as caught:
        Material.model_validate(fields)
    return caught.value.errors()[0]["msg"]


def test_a_kind_brings_its_usual_figures():
    glass = Material(kind="glass", reflectance=0.0)
    assert (glass.haze, glass.glint, glass.mirrored) == (1.0, 1.0, 0.08)
    assert Material(kind="retroreflective", reflectance=0.2).retro == 4.0
    assert Material(reflectance=0.5).kind == "diffuse"


def test_glass_and_mirrors_need_no_reflectance():
    assert Material.model_validate({"kind": "glass"}).reflectance == 0.0
    assert "required" in refused(kind="glossy").lower()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"reflectance": 0.5, "gloss": 1.0}, "Value error, a diffuse material has no gloss"),
        ({"kind": "glass", "retro": 1.0}, "Value error, a glass material has no retro"),
        ({"kind": "mirror", "haze": 1.0}, "Value error, a mirror material has no haze"),
        ({"reflectance": 1.5}, "Input should be less than or equal to 1"),
    ],
)
def test_a_figure_that_does_not_belong_to_the_kind_is_refused(fields, message):
    assert refused(**fields) == message


def test_the_figures_of_a_material_are_those_of_its_kind():
    assert MATERIALS["plaster"].figures() == {"kind": "diffuse", "reflectance": 0.85}
    assert set(MATERIALS["reflector"].figures()) == {"kind", "reflectance", "retro"}


def glass_line(**changes):
    wall = {"name": "front", "material": "glass", "points": [[0, 0], [5, 0]], "panes": {"width": 1.3}}
    return build_floor_plan(scene(walls=[wall | changes]))


def panes_of(plan):
    return plan.segments[[plan.materials[m] == "glass" for m in plan.material]]


def test_a_line_of_glass_is_divided_into_equal_panes_between_mullions():
    plan = glass_line()
    panes = panes_of(plan)
    lengths = panes[:, 2] - panes[:, 0]
    assert len(panes) == 4
    assert lengths == pytest.approx(np.full(4, lengths[0]))
    assert lengths.sum() + 5 * 0.06 == pytest.approx(5.0)
    assert set(plan.names) == {"front", "front-mullions"}
    assert "aluminium" in plan.materials


def test_mullions_fill_the_gaps_between_panes_and_stand_proud_of_them():
    plan = glass_line()
    bars = plan.segments[[plan.materials[m] == "aluminium" for m in plan.material]].reshape(5, 8, 4)
    assert bars[..., [1, 3]].max() == pytest.approx(0.05)
    assert bars[0, :, [0, 2]].min() == pytest.approx(0.0)
    assert bars[-1, :, [0, 2]].max() == pytest.approx(5.0)
    assert bars[1, :, [0, 2]].min() == pytest.approx(panes_of(plan)[0, 2])
    assert np.array_equal(bars[:, :, 2:], np.roll(bars[:, :, :2], -1, axis=1)), "closed outlines"


def test_a_door_in_a_line_of_glass_has_mullions_for_jambs():
    panes = panes_of(glass_line(openings=[{"at": 2.0, "width": 1.0}]))
    assert panes[:, [0, 2]] == pytest.approx(
        np.array([[0.06, 0.97], [1.03, 1.94], [3.06, 3.97], [4.03, 4.94]])
    )


def test_a_stretch_too_short_for_a_pane_is_refused():
    with pytest.raises(ConfigError) as caught:
        glass_line(points=[[0, 0], [0.1, 0]])
    assert caught.value.message == "wall 'front': a stretch of 0.10 m has no room for a pane"


def test_panes_are_lines():
    with pytest.raises(ValidationError, match="wall 'front': panes have no thickness"):
        glass_line(thickness=0.1)


def test_the_mullions_are_of_a_known_material():
    with pytest.raises(ValidationError, match="'front' is made of unknown 'gold'"):
        glass_line(panes={"material": "gold"})


def test_panes_lean_by_their_wall_and_a_little_on_their_own():
    plan = glass_line(points=[[0, 0], [400, 0]], lean_deg=6.0)
    lean = np.rad2deg(surface_table(plan, MATERIALS).lean)
    glass = np.array([plan.materials[m] == "glass" for m in plan.material])
    assert lean[glass].mean() == pytest.approx(6.0, abs=0.05)
    assert lean[glass].std() == pytest.approx(MATERIALS["glass"].flatness_deg, rel=0.15)
    assert (lean[~glass] == 0.0).all()
    assert np.array_equal(np.rad2deg(surface_table(plan, MATERIALS).lean), lean)
