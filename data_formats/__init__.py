"""Files of measured reflectance: `read` any of them, `write` some of them."""

from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.registry import FormatInfo, formats, read, write

__all__ = [
    "Channel",
    "FormatInfo",
    "Measurement",
    "MeasurementError",
    "Note",
    "Provenance",
    "formats",
    "read",
    "write",
]
