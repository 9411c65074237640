"""Files of measured reflectance: `read` any, `write` some, `join` several of a sample."""

from data_formats.join import join
from data_formats.measurement import Channel, Measurement, MeasurementError
from data_formats.provenance import Note, Provenance
from data_formats.registry import FormatInfo, formats, read, write

__all__ = [
    "Channel",
    "FormatInfo",
    "Measurement",
    "MeasurementError",
    "Note",
    "Provenance",
    "formats",
    "join",
    "read",
    "write",
]
