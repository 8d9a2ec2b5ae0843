"""What surfaces are made of: how much light they scatter, send straight back, mirror and let through."""

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

# No building needs numbers beyond these, and their squares and quotients stay numbers.
Finite = Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False)]
Positive = Annotated[float, Field(ge=1e-9, le=1e9, allow_inf_nan=False)]
Rate = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Kind = Literal["diffuse", "glossy", "retroreflective", "mirror", "glass"]


class Part(BaseModel):
    """One frozen piece of a scene; unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


_PARAMETERS: Final[dict[str, dict[str, float]]] = {
    "diffuse": {},
    "glossy": {"gloss": 1.0, "gloss_width_deg": 8.0},
    "retroreflective": {"retro": 4.0},
    "mirror": {"reflectance": 0.01, "gloss": 2.5, "gloss_width_deg": 3.0, "mirrored": 0.55},
    "glass": {"reflectance": 0.0, "haze": 1.0, "glint": 1.0, "mirrored": 0.08, "flatness_deg": 0.18},
}
"""What each kind has besides its reflectance, and the value taken where a scene gives none."""
_COMMON: Final = frozenset({"kind", "reflectance", "sonar_limit_deg", "sonar_reach"})


class Material(Part):
    """How a surface answers a laser beam; levels are relative to white paper, square on."""

    kind: Kind = "diffuse"
    """Law of reflection; only a mirror and glass send a beam on."""
    reflectance: Share
    """Share of the light that is scattered evenly (Lambert), 1 = white paper."""
    gloss: NonNegative = 0.0
    """Height of the lobe around the surface normal."""
    gloss_width_deg: Positive = 8.0
    """Standard deviation of that lobe in incidence, deg."""
    retro: NonNegative = 0.0
    """Level sent back to where the light came from, whatever the incidence."""
    mirrored: Share = 0.0
    """Share of the light mirrored at normal incidence."""
    haze: NonNegative = 0.0
    """Halo of a pane around normal incidence; 1 as measured on the panes of an office corridor."""
    glint: NonNegative = 0.0
    """Spike of a pane at normal incidence; 1 as measured on the same panes."""
    flatness_deg: NonNegative = 0.0
    """How far single panes lean out of the vertical, standard deviation, deg."""
    sonar_limit_deg: Positive = 8.0
    """Largest incidence at which ultrasound comes straight back, deg; small for what is smooth."""
    sonar_reach: Share = 1.0
    """Share of the range of a sonar up to which the surface is heard; soft things swallow sound."""

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        return _PARAMETERS.get(str(data.get("kind", "diffuse")), {}) | data

    @model_validator(mode="after")
    def _fits_its_kind(self) -> "Material":
        foreign = self.model_fields_set - {*_COMMON, *_PARAMETERS[self.kind]}
        if foreign:
            raise ValueError(f"a {self.kind} material has no {sorted(foreign)[0]}")
        return self

    def figures(self) -> dict[str, Any]:
        """The values that matter for this kind, by name."""
        return self.model_dump(include={"kind", "reflectance", *_PARAMETERS[self.kind]})


MATERIALS: Final = {
    "plaster": Material(reflectance=0.85),
    "concrete": Material(reflectance=0.45, sonar_limit_deg=15.0),
    "brick": Material(reflectance=0.35, sonar_limit_deg=35.0),
    "wood": Material(reflectance=0.55),
    "painted_metal": Material(reflectance=0.6),
    "cardboard": Material(reflectance=0.65, sonar_limit_deg=15.0),
    "fabric": Material(reflectance=0.3, sonar_limit_deg=50.0, sonar_reach=0.5),
    "black_plastic": Material(reflectance=0.08),
    "glossy_paint": Material(kind="glossy", reflectance=0.6, gloss=0.9, gloss_width_deg=6.0),
    "aluminium": Material(kind="glossy", reflectance=0.3, gloss=2.0, gloss_width_deg=14.0),
    "reflector": Material(kind="retroreflective", reflectance=0.3, retro=6.0),
    "polished_steel": Material(
        kind="mirror", reflectance=0.01, gloss=2.5, gloss_width_deg=3.0, mirrored=0.55
    ),
    "glass": Material(kind="glass", reflectance=0.0),
    "clean_glass": Material(kind="glass", reflectance=0.0, haze=0.02),
    "acrylic": Material(kind="glass", reflectance=0.0, haze=1.2, glint=0.9, flatness_deg=0.2),
    "polycarbonate": Material(kind="glass", reflectance=0.0, haze=1.5, glint=0.75, flatness_deg=0.25),
}
"""Materials every scene knows; a scene may add its own or redefine these."""
