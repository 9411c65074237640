"""What a column's name says: an angle and its unit, a channel, an uncertainty, a mask."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from data_formats.measurement import Channel, MeasurementError
from data_formats.metadata import Metadata

Angle = Literal["theta_i", "phi_i", "theta_r", "phi_r", "dphi"]
Unit = Literal["deg", "rad"]

MAX_COLUMNS = 10_000
MAX_NAME = 200

_ANGLES: dict[Angle, str] = {
    "theta_i": "theta_i thetai theta_in theta_l sza src_z incident_angle incident_zenith "
    "incidence_angle aoi solar_zenith source_zenith",
    "phi_i": "phi_i phii phi_in phi_l saa src_a incident_azimuth solar_azimuth "
    "source_azimuth",
    "theta_r": "theta_r theta_s theta_o theta_v thetar thetas thetao thetav theta_out vza "
    "view_z measure_angle view_zenith exit_zenith receiver_angle detector_zenith",
    "phi_r": "phi_r phi_s phi_o phi_v phir phis phio phiv phi_out vaa view_a view_azimuth "
    "exit_azimuth detector_azimuth",
    "dphi": "dphi delta_phi phi_rel raa relative_azimuth",
}
_ANGLE_OF: dict[str, Angle] = {
    name: angle for angle, names in _ANGLES.items() for name in names.split()
}
_UNIT = re.compile(
    r"^(?P<name>.*?)[\s_]*[(\[]?(?:(?P<deg>deg(?:ree)?s?|°)|(?P<rad>rad(?:ian)?s?))[)\]]?$"
)
_QUANTITY = (
    r"(?:brdf|btdf|bsdf|brf|f_?r|value|(?:reflectance|radiance|transmittance)[\s_]factor)"
)
_WAVELENGTH = re.compile(
    rf"(?:{_QUANTITY}[\s_])?(?P<number>\d+(?:[.,]\d*)?)[\s_]*(?P<unit>nm|um|µm|μm|mm|m)",
    re.ASCII | re.IGNORECASE,
)
_BAND = re.compile(rf"[RGBXYZ]|[rgb]|[Ii]ntegrated.*|(?i:{_QUANTITY}|mono|luminance)")
_NM_PER = {"nm": 1.0, "um": 1e3, "µm": 1e3, "μm": 1e3, "mm": 1e6, "m": 1e9}


# Records that begin with four angles in radians.
FOUR_ANGLES: dict[Angle, tuple[int, Unit | None]] = {
    "theta_i": (0, "rad"),
    "phi_i": (1, "rad"),
    "theta_r": (2, "rad"),
    "phi_r": (3, "rad"),
}


@dataclass(frozen=True)
class Columns:
    """Which column of a table is what, by index.

    **Arguments:**

    - `angles`: angle to (column, unit if the name states it).
    - `channels`: the channels with their columns.
    - `sigma`, `valid`: one column per channel, or none.
    - `others`: name to column of everything else.
    - `labels`: the channels' names in the file.
    """

    angles: dict[Angle, tuple[int, Unit | None]]
    channels: list[tuple[Channel, int]]
    sigma: list[int] = field(default_factory=list)
    valid: list[int] = field(default_factory=list)
    others: dict[str, int] = field(default_factory=dict)
    labels: list[str] = field(default_factory=list)


def clean(name: str) -> str:
    """A column's name without surrounding blanks and quotes."""
    return name.strip().strip("\"'").strip()


def angle_of(name: str) -> tuple[Angle, Unit | None] | None:
    """The angle that a column holds, with its unit if stated; `None` if it is no angle."""
    text = clean(name).lower()
    if len(text) > MAX_NAME:
        return None
    unit: Unit | None = None
    if match := _UNIT.match(text):
        unit = "deg" if match["deg"] else "rad"
        text = match["name"]
    angle = _ANGLE_OF.get(re.sub(r"[\s\-]+", "_", text.strip()))
    return None if angle is None else (angle, unit)


def channel_of(name: str) -> Channel | None:
    """The channel that a column holds; `None` if the name is not that of a channel."""
    text = clean(name)
    if match := _WAVELENGTH.fullmatch(text):
        number = float(match["number"].replace(",", "."))
        # The exact product of a short decimal: 0.4 um is 400 nm, not 400.00000000000006.
        wavelength = round(number * _NM_PER[match["unit"].lower()], 9)
        return Channel.at(wavelength) if wavelength > 0 else None
    return Channel(text) if _BAND.fullmatch(text) else None


def identify(names: Sequence[str], where: str, own: Metadata | None = None) -> Columns:
    """Say what each column is.

    **Arguments:**

    - `names`: of the columns.
    - `where`: file and line, for errors.
    - `own`: what the file says itself about its columns, if this program wrote it;
        columns that it does not mention are judged by their names.

    **Raises:** `MeasurementError` if two columns are the same, or there is no channel.
    """
    stated = own.channels if own else {}
    renamed = own.auxiliary if own else {}
    angles: dict[Angle, tuple[int, Unit | None]] = {}
    channels: list[tuple[Channel, int]] = []
    column_of: dict[str, int] = {}
    label_of: dict[str, int] = {}
    rest: dict[str, int] = {}
    _check_size(names, where)
    for column, name in enumerate(map(clean, names)):
        found = None if name in stated else angle_of(name)
        channel = stated.get(name) or channel_of(name)
        if found is not None:
            angle, unit = found
            if angle in angles:
                first = clean(names[angles[angle][0]])
                raise MeasurementError(f"{where}: {first} and {name} are the same angle")
            angles[angle] = (column, unit)
        elif channel is not None:
            if channel.name in column_of:
                raise MeasurementError(
                    f"{where}: columns {column_of[channel.name] + 1} and {column + 1} are "
                    f"both {channel.name}"
                )
            column_of[channel.name] = column
            label_of[name] = label_of[channel.name] = len(channels)
            channels.append((channel, column))
        elif name in rest:
            raise MeasurementError(f"{where}: two columns are called {name!r}")
        else:
            rest[name or f"column_{column + 1}"] = column
    if not channels:
        shown = ", ".join(clean(n) for n in names[:12])
        raise MeasurementError(
            f"{where}: no column is a channel ({shown[:200]}); expected names such as "
            "400nm, or R,G,B, or brdf"
        )
    sigma = _per_channel("sigma", rest, label_of, len(channels))
    valid = _per_channel("valid", rest, label_of, len(channels))
    others = {renamed.get(name, name): column for name, column in rest.items()}
    labels = [clean(names[column]) for _, column in channels]
    return Columns(angles, channels, sigma, valid, others, labels)


def _check_size(names: Sequence[str], where: str) -> None:
    if len(names) > MAX_COLUMNS:
        raise MeasurementError(
            f"{where}: {len(names)} columns; at most {MAX_COLUMNS} make sense"
        )
    if (longest := max(map(len, names))) > MAX_NAME:
        raise MeasurementError(
            f"{where}: a column name has {longest} characters; expected at most {MAX_NAME}"
        )


def _per_channel(
    word: str, rest: dict[str, int], label_of: dict[str, int], count: int
) -> list[int]:
    """Take out of `rest` the columns `<word>`, or `<word>_<channel>` for every channel."""
    if word in rest:
        return [rest.pop(word)] * count
    found: dict[int, str] = {}
    for name in rest:
        for label in (name.removeprefix(f"{word}_"), name.removesuffix(f"_{word}")):
            if label != name and label in label_of:
                found[label_of[label]] = name
    if len(found) < count:
        return []
    return [rest.pop(found[k]) for k in range(count)]
