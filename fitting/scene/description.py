"""What a scene declares: lights, what is seen of the sample, by whom, how well it must fit.

World coordinates: z is up. Of a ``flat`` sample z is the normal and x its azimuth zero; at
a ``sphere`` the camera looks from azimuth zero. Angles are in degrees, as in the file.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from fitting.scene.lights import (
    Azimuth,
    Degrees,
    Direction,
    Disk,
    Light,
    Map,
    NotNegative,
    Positive,
    Sky,
    Spectrum,
    Uniform,
    Wavelength,
)

__all__ = [
    "Albedo",
    "ColourDifference",
    "Direction",
    "Disk",
    "Flat",
    "Histogram",
    "Light",
    "Map",
    "RelativeRadiance",
    "Scene",
    "SceneError",
    "Seen",
    "Sky",
    "Spectrum",
    "Sphere",
    "Tolerance",
    "Uniform",
    "Viewer",
]

Polar = Annotated[float, Meta(ge=0, le=90, extra={"unit": "deg"})]


class SceneError(ValueError):
    """A scene that cannot be read or makes no sense, said in one sentence."""


class _Table(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    pass


class Flat(
    Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="kind",
    tag="flat",
):
    """A flat sample that lies horizontally, seen from a range of directions.

    Every direction of the range counts the same, per solid angle.
    """

    theta_deg: Annotated[
        tuple[Polar, Polar], Meta(description="Polar angles of the viewer, from and to.")
    ] = (0.0, 80.0)
    phi_deg: Annotated[
        tuple[Azimuth, Azimuth],
        Meta(description="Azimuths of the viewer, from and to, at most a full turn."),
    ] = (0.0, 360.0)

    def __post_init__(self) -> None:
        _ascending("theta_deg", self.theta_deg, strictly=False)
        _ascending("phi_deg", self.phi_deg, strictly=False)
        if self.phi_deg[1] - self.phi_deg[0] > 360:
            raise ValueError(
                f"phi_deg is {list(self.phi_deg)}; expected at most a full turn"
            )


class Sphere(_Table, frozen=True, kw_only=True, tag_field="kind", tag="sphere"):
    """A sphere of the material, seen by a distant camera (orthographic)."""

    pixels: Annotated[
        Annotated[int, Meta(ge=8, le=1024)],
        Meta(description="Pixels across the sphere's diameter."),
    ] = 64
    camera_theta_deg: Annotated[
        Degrees, Meta(description="Zenith angle of the camera, whose azimuth is 0.")
    ] = 75.0


class Histogram(_Table, frozen=True, kw_only=True, tag_field="kind", tag="histogram"):
    """Pairs of directions with weights: a flat sample lit and seen as often as they say.

    Needs a single light, a direction or a disk, which stands at each row's incidence.
    Exactly one of its keys.
    """

    file: Annotated[
        str | None,
        Meta(
            description="A table with the columns theta_i, phi_i, theta_r, phi_r, weight, "
            "in degrees."
        ),
    ] = None
    rows: Annotated[
        Annotated[
            tuple[tuple[Polar, Azimuth, Polar, Azimuth, NotNegative], ...],
            Meta(min_length=1),
        ]
        | None,
        Meta(
            description="The same in the scene file: [[theta_i, phi_i, theta_r, phi_r, "
            "weight], ...].",
        ),
    ] = None

    def __post_init__(self) -> None:
        if (self.file is None) == (self.rows is None):
            found = "none" if self.file is None else "both"
            raise ValueError(f"found {found} of file and rows; expected one of them")
        if self.rows and not any(row[4] > 0 for row in self.rows):
            raise ValueError("rows have no weight above 0; expected at least one")


Seen = Flat | Sphere | Histogram


class Viewer(_Table, frozen=True, kw_only=True):
    """Who looks: the wavelengths that count, the observer, exposure, and the display."""

    wavelengths_nm: Annotated[
        tuple[Wavelength, Wavelength],
        Meta(description="The wavelengths that count, from and to. Named bands all count."),
    ] = (380.0, 780.0)
    observer: Annotated[
        str,
        Meta(
            description="2 or 10, the CIE observers of 1931 and 1964, or another one of "
            "colour-science's; RGB, a renderer in linear sRGB; none, an instrument "
            "without an eye, for which all wavelengths count the same."
        ),
    ] = "2"
    exposure: Annotated[
        Positive | Literal["auto"],
        Meta(
            description="Luminance that the picture gives to a perfect diffuser facing the "
            "light (flat: lying under it; sphere: where it gets most), relative to the "
            "display's white. auto is 1, the same for every material."
        ),
    ] = "auto"
    clip: Annotated[
        bool,
        Meta(description="Whether what is brighter than the display's white is cut there."),
    ] = True

    def __post_init__(self) -> None:
        _ascending("wavelengths_nm", self.wavelengths_nm)


class ColourDifference(_Table, frozen=True, kw_only=True):
    """CIEDE2000 between the picture of the model and that of the data, where lit."""

    mean: Annotated[Positive, Meta(description="Largest mean difference.")] = 1.0
    percentile_95: Annotated[
        Positive, Meta(description="Largest 95th percentile of the differences.")
    ] = 3.0


class RelativeRadiance(_Table, frozen=True, kw_only=True):
    """|L_model - L_data| / max(L_data, floor * L_white) of every direction and channel."""

    mean: Annotated[Positive, Meta(description="Largest mean error.")] = 0.05
    percentile_95: Annotated[
        Positive, Meta(description="Largest 95th percentile of the errors.")
    ] = 0.15
    floor: Annotated[
        NotNegative,
        Meta(description="Radiance, relative to the perfect diffuser's, that is dark."),
    ] = 1e-3


class Albedo(_Table, frozen=True, kw_only=True):
    """Error of the reflected share of the light of each of the scene's incidences."""

    maximum: Annotated[
        Positive, Meta(description="Largest absolute error, of any channel that counts.")
    ] = 0.01


class Tolerance(_Table, frozen=True, kw_only=True):
    """How far the model may be from the data. Exactly one of its keys."""

    colour_difference: Annotated[
        ColourDifference | None, Meta(description="What an eye may see.")
    ] = None
    relative_radiance: Annotated[
        RelativeRadiance | None, Meta(description="What an instrument may read.")
    ] = None
    albedo: Annotated[
        Albedo | None, Meta(description="What an energy balance may be off by.")
    ] = None

    def __post_init__(self) -> None:
        given = [n for n in self.__struct_fields__ if getattr(self, n) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            known = ", ".join(self.__struct_fields__)
            raise ValueError(f"found {found}; expected exactly one of {known}")


class Scene(_Table, frozen=True, kw_only=True):
    """A scene, complete: what matters to the choice of a model, and nothing else."""

    name: Annotated[
        str, Meta(description="What reports call it; by default the file's name.")
    ] = ""
    description: Annotated[str, Meta(description="What it stands for, in words.")] = ""
    lights: Annotated[
        tuple[Light, ...],
        Meta(min_length=1, description="[[lights]], one table each, told apart by kind."),
    ]
    ground_reflectance: Annotated[
        Annotated[float, Meta(ge=0, le=1)],
        Meta(
            description="Of a matt ground below the horizon that the lights above it "
            "illuminate; 0 for none."
        ),
    ] = 0.0
    seen: Annotated[
        Seen, Meta(description="[seen], what is seen of the sample, told apart by kind.")
    ]
    viewer: Annotated[Viewer, Meta(description="[viewer], who looks at it.")] = field(
        default_factory=Viewer
    )
    tolerance: Annotated[
        Tolerance,
        Meta(description="[tolerance.NAME], how far the model may be from the data."),
    ]

    def __post_init__(self) -> None:
        if self.tolerance.colour_difference and self.viewer.observer.lower() == "none":
            raise ValueError(
                "the tolerance is a colour difference, and viewer.observer is none; "
                "expected an observer"
            )
        if isinstance(self.seen, Histogram):
            _single_light(self.lights)
        elif isinstance(self.seen, Flat):
            _above_horizon(self.lights)


def _ascending(key: str, pair: tuple[float, float], strictly: bool = True) -> None:
    low, high = pair
    if low > high or (strictly and low == high):
        raise ValueError(f"{key} is {[low, high]}; expected from and to, ascending")


def _single_light(lights: tuple[Light, ...]) -> None:
    light = lights[0]
    if len(lights) > 1 or not isinstance(light, Direction | Disk):
        found = ", ".join(type(x).__name__.lower() for x in lights)
        raise ValueError(
            f"a histogram says where light comes from, and lights are {found}; expected a "
            "single direction or disk"
        )
    if light.theta_deg or light.phi_deg:
        raise ValueError(
            "a histogram says where light comes from, and so does lights[0]; expected no "
            "theta_deg and phi_deg of the light"
        )


def _above_horizon(lights: tuple[Light, ...]) -> None:
    for i, light in enumerate(lights):
        lowest = 90.0 + 0.5 * light.diameter_deg if isinstance(light, Disk) else 90.0
        if isinstance(light, Direction | Disk) and light.theta_deg >= lowest:
            raise ValueError(
                f"lights[{i}].theta_deg is {light.theta_deg:g}, from where no light falls "
                f"on a flat sample; expected less than {lowest:g}"
            )
