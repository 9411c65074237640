"""The lights of a scene, as a scene file declares them, and their spectra."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Degrees = Annotated[float, Meta(ge=0, le=180, extra={"unit": "deg"})]
Azimuth = Annotated[float, Meta(ge=-360, le=360, extra={"unit": "deg"})]
Wavelength = Annotated[float, Meta(ge=100, le=100_000, extra={"unit": "nm"})]
NotNegative = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]


class Spectrum(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A spectral power, of which only the shape counts. Exactly one of its keys."""

    illuminant: Annotated[
        str | None,
        Meta(description="Name of a CIE illuminant, such as D65, A, FL2 or LED-B3."),
    ] = None
    blackbody_kelvin: Annotated[
        Annotated[float, Meta(ge=500, le=100_000, extra={"unit": "K"})] | None,
        Meta(description="Temperature of a black body (Planck's law)."),
    ] = None
    file: Annotated[
        str | None,
        Meta(
            description="A table with a wavelength in nm and a power per line; linear "
            "between them, 0 outside of them."
        ),
    ] = None
    bands: Annotated[
        Annotated[
            tuple[tuple[Wavelength, Wavelength, NotNegative], ...], Meta(min_length=1)
        ]
        | None,
        Meta(
            description="[from, to, power] in nm: a constant power per nm in each, 0 "
            "elsewhere; overlapping ones add up.",
        ),
    ] = None
    rgb: Annotated[
        tuple[NotNegative, NotNegative, NotNegative] | None,
        Meta(description="Linear sRGB; 1, 1, 1 has the spectrum of D65."),
    ] = None

    def __post_init__(self) -> None:
        given = [n for n in self.__struct_fields__ if getattr(self, n) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            known = ", ".join(self.__struct_fields__)
            raise ValueError(f"found {found}; expected exactly one of {known}")
        for low, high, _ in self.bands or ():
            if not low < high:
                raise ValueError(
                    f"found the band {low:g} to {high:g} nm; expected from < to"
                )
        powers = self.rgb or [power for _, _, power in self.bands or ()]
        if given[0] in ("rgb", "bands") and not any(powers):
            raise ValueError(f"{given[0]} is 0 everywhere; expected some light")


class _Light(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    name: Annotated[
        str, Meta(description="What reports call it; by default its kind and number.")
    ] = ""
    brightness: Annotated[
        Annotated[float, Meta(gt=0)],
        Meta(
            description="Illuminance that it alone gives, relative to the other lights': "
            "of a direction or disk on a surface that faces it, of a sky on a horizontal "
            "one, of a map or a surround on the facing that gets most."
        ),
    ] = 1.0
    spectrum: Annotated[
        str | Spectrum,
        Meta(
            description="Spectral power: the name of a CIE illuminant, or a table with one "
            "of the keys of Spectrum."
        ),
    ] = "D65"


class Direction(_Light, frozen=True, kw_only=True, tag_field="kind", tag="direction"):
    """Light from one direction: a collimated beam, or a source too small to matter."""

    theta_deg: Annotated[Degrees, Meta(description="Zenith angle.")] = 0.0
    phi_deg: Annotated[Azimuth, Meta(description="Azimuth.")] = 0.0


class Disk(_Light, frozen=True, kw_only=True, tag_field="kind", tag="disk"):
    """A disk of constant radiance: a softbox, a lamp's opening, the sun."""

    theta_deg: Annotated[Degrees, Meta(description="Zenith angle of its centre.")] = 0.0
    phi_deg: Annotated[Azimuth, Meta(description="Azimuth of its centre.")] = 0.0
    diameter_deg: Annotated[
        Annotated[float, Meta(ge=0.01, le=180, extra={"unit": "deg"})],
        Meta(description="Angle from edge to edge; the sun's is 0.53."),
    ]


class Uniform(_Light, frozen=True, kw_only=True, tag_field="kind", tag="uniform"):
    """The same radiance from everywhere: a sky above the horizon, or a surround."""

    below_horizon: Annotated[
        bool, Meta(description="Whether it comes from below the horizon as well.")
    ] = False


class Sky(_Light, frozen=True, kw_only=True, tag_field="kind", tag="sky"):
    """A standard general sky of ISO 15469:2004 (CIE S 011), without the sun's disk.

    Type 1 is the CIE overcast sky, 5 the uniform one, 12 the clear one; 16 is the
    traditional overcast sky, (1 + 2 cos theta) / 3.
    """

    type: Annotated[
        Annotated[int, Meta(ge=1, le=16)],
        Meta(description="1 to 15 of the standard, or 16, the traditional overcast sky."),
    ]
    sun_theta_deg: Annotated[
        Annotated[float, Meta(ge=0, le=90, extra={"unit": "deg"})] | None,
        Meta(
            description="Zenith angle of the sun; needed where the sky depends on it, "
            "which 1, 3, 5 and 16 do not."
        ),
    ] = None
    sun_phi_deg: Annotated[Azimuth, Meta(description="Azimuth of the sun.")] = 0.0

    def __post_init__(self) -> None:
        if self.sun_theta_deg is None and self.type not in (1, 3, 5, 16):
            raise ValueError(
                f"a sky of type {self.type} depends on the sun; expected sun_theta_deg"
            )


class Map(_Light, frozen=True, kw_only=True, tag_field="kind", tag="map"):
    """An environment map: a picture of all directions in latitude and longitude.

    The zenith is its upper edge. Its centre is at ``phi_deg``, and azimuths grow to the
    left, as OpenEXR has it and as one sees who stands inside. Three channels R, G, B are
    linear sRGB; each has its part of ``spectrum`` (Mallett and Yuksel 2019), and together
    they have all of it. One channel has all of it.
    """

    file: Annotated[str, Meta(description="Radiance HDR (.hdr, .pic) or OpenEXR (.exr).")]
    phi_deg: Annotated[Azimuth, Meta(description="Azimuth of the map's centre.")] = 0.0
    smallest_detail_deg: Annotated[
        Annotated[float, Meta(ge=0.1, le=30, extra={"unit": "deg"})],
        Meta(
            description="Finer pixels are averaged up to about this size, their light "
            "kept; smaller details take longer."
        ),
    ] = 1.0


Light = Direction | Disk | Uniform | Sky | Map
