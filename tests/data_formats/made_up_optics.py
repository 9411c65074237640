"""Files of optics programs and scatterometers, made up from a BSDF that shows directions.

The value is linear in the components of `wi` and `wo`: a direction that a reader turns or
mirrors has another value.
"""

from __future__ import annotations

import struct

import numpy as np

from data_formats import Measurement

Array = np.ndarray

INCIDENCES = (0.0, 25.0, 60.0)


def unit(theta_deg: Array | float, phi_deg: Array | float) -> Array:
    theta, phi = np.deg2rad(theta_deg), np.deg2rad(phi_deg)
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack(np.broadcast_arrays(x, y, np.cos(theta)))


def bsdf(wi: Array, wo: Array) -> Array:
    """(...) values of directions (3, ...); positive."""
    return (
        1 + np.tensordot([0.11, 0.13, 0.17], wi, 1) + np.tensordot([0.2, 0.3, 0.07], wo, 1)
    )


def of(m: Measurement) -> Array:
    """What the values of a measurement should be."""
    wi = unit(np.rad2deg(m.theta_i), np.rad2deg(m.phi_i))
    return bsdf(wi, unit(np.rad2deg(m.theta_r), np.rad2deg(m.phi_r)))


def in_plane_frame(m: Measurement) -> Array:
    """The same for a sample turned such that the source is at azimuth 0."""
    wi = unit(np.rad2deg(m.theta_i), 0.0)
    return bsdf(wi, unit(np.rad2deg(m.theta_r), np.rad2deg(m.phi_r - m.phi_i)))


def around(incidence: float, radial: Array, azimuth: Array) -> Array:
    """(3, ...) directions at a distance from the specular one; source at azimuth 0."""
    a, r, z = (np.deg2rad(x) for x in (incidence, radial, azimuth))
    specular = np.array([-np.sin(a), 0, np.cos(a)])
    to_normal = np.array([np.cos(a), 0, np.sin(a)])
    aside = np.cross(specular, to_normal)
    frame = (np.cos(r), np.sin(r) * np.cos(z), np.sin(r) * np.sin(z))
    axes = (specular, to_normal, aside)
    return sum(np.multiply.outer(v, w) for v, w in zip(axes, frame, strict=True))


def lines_of(table: Array, number: str = ".9g") -> list[str]:
    return ["\t".join(f"{x:{number}}" for x in row) for row in table]


def zemax(
    kind: str = "BRDF", symmetry: str = "PlaneSymmetrical", content="Monochrome"
) -> str:
    """Three incidences, one rotation of 0 degrees; the channels are 1, 2, 3 times that."""
    azimuths = np.arange(0, 181 if symmetry == "PlaneSymmetrical" else 361, 30)
    radials = np.array([0, 2, 10, 40, 80, 120])
    lines = [
        "# Sample: made up, lit at 633 nm",
        f"Source  Measured\r\nSymmetry  {symmetry}\nSpectralContent\t{content}",
        f"ScatterType  {kind}\nSampleRotation  1\n0",
        f"AngleOfIncidence  {len(INCIDENCES)}\n{' '.join(f'{x:g}' for x in INCIDENCES)}\t",
        f"ScatterAzimuth {len(azimuths)}\n" + "\t".join(map(str, azimuths)) + "\t",
        f"ScatterRadial {len(radials)}\n" + "\t".join(map(str, radials)) + "\n",
    ]
    names = (
        ["Monochrome"] if content == "Monochrome" else [f"Tristimulus{c}" for c in "XYZ"]
    )
    for k, name in enumerate(names, 1):
        lines += [name, "DataBegin"]
        for incidence in INCIDENCES:
            r, z = radials, azimuths[:, None]
            wo = around(incidence, *np.broadcast_arrays(r, z))
            dark = wo[2] <= 1e-9
            if kind == "BTDF":
                wo[2] = -wo[2]
            value = bsdf(unit(incidence, 0.0)[:, None, None], wo)
            lines += ["TIS 0.5", *lines_of(np.where(dark, 0.0, k * value))]
        lines.append("DataEnd")
    return "\n".join([*lines, ""])


THETAS, PHIS = np.array([0.0, 20, 50, 80]), np.arange(0.0, 360, 45)


def fred(angles: str = "deg", values: str = "value", scale: float = 1) -> str:
    """Three specular directions, at azimuth 0, 30 and 60 degrees."""
    lines = ["type bsdf_data", f"format angles={angles} bsdf={values} scale={scale:g}"]

    def pair(theta: float, phi: float) -> str:
        x, y, _ = unit(theta, phi)
        return f"{theta:g}\t{phi:g}" if angles == "deg" else f"{x:.15g}\t{y:.15g}"

    for incidence, phi_s in zip(INCIDENCES, (0.0, 30.0, 60.0), strict=True):
        lines.append(pair(incidence, phi_s))
        for theta in THETAS:
            for phi in PHIS:
                value = bsdf(unit(incidence, phi_s + 180), unit(theta, phi)) / scale
                value = np.log10(value) if values == "log" else value
                lines.append(f"{pair(theta, phi)}\t{value:.15g}")
    return "\n".join([*lines, ""])


def pgii(*header: str, cosine: bool = False) -> str:
    """One incidence (25, 180); reflected and transmitted light."""
    lines = ['#sample_name "made up"', "#intheta\t25", "#inphi 180"]
    lines += header or ["#format: theta phi BSDF"]
    for theta in (*THETAS, 91, 130, 180):
        for phi in PHIS:
            value = bsdf(unit(25, 180), unit(theta, phi))
            value = value * (abs(np.cos(np.deg2rad(theta))) if cosine else 1)
            lines.append(f"{theta:g}\t{phi:g}\t{value:.12g}")
    return "\r\n".join([*lines, ""])


def speos_table(incidence: float, behind: bool, factor: float, zeros: int = 0) -> list[str]:
    """phi 0 is specular: the direction of the light goes on."""
    theta = np.array([90, 120, 150, 180] if behind else [0, 30, 60, 90])
    phi = np.arange(0, 361, 30)
    value = factor * bsdf(
        unit(incidence, 180.0)[:, None, None], unit(theta[:, None], phi[None])
    )
    edge = value[0 if behind else -1]
    if zeros:
        edge[:zeros] = edge[-1] = 0
    table = np.column_stack([theta, value])
    phis = "\t" + "\t".join(map(str, phi))
    return [f"{len(theta)} {len(phi)}", phis, *lines_of(table)]


def speos(flags: tuple[int, int] = (1, 1), percent: float = 25, factor: float = 3) -> str:
    lines = ["OPTIS - Anisotropic BSDF surface file v8.0", "0", "a comment", "17"]
    lines += ["Two lines\nof text.", "0\t1\t0", f"{flags[0]}\t{flags[1]}", "1"]
    incidences = "\t".join(f"{x:g}" for x in INCIDENCES)
    for _ in range(sum(flags)):
        lines += ["1", "0\t", str(len(INCIDENCES)), incidences]
    for _ in range(sum(flags)):
        lines += [f"{INCIDENCES[1]}\t0", "a spectrum", "2", f"350\t{percent}"]
        lines += [f"850\t{percent}"]
    for behind in (False, True):
        if flags[behind]:
            for incidence in INCIDENCES:
                lines += speos_table(incidence, behind, factor, zeros=4)
    return "\n".join([*lines, "End of file", ""])


def speos_spectral(percent: float = 30) -> str:
    lines = ["OPTIS - brdf surface file v9.0", "0", "Scattering surface", "0", ""]
    lines += [
        "1\t0",
        "1",
        f"{len(INCIDENCES)}\t2",
        " ".join(map(str, INCIDENCES)),
        "450 650",
    ]
    for incidence in INCIDENCES:
        for k in (1, 2):
            lines += [str(k * percent), *speos_table(incidence, False, 0.7 * k)]
    return "\n".join([*lines, ""])


def mbsdf(parts: tuple[str, ...] = ("REFLECTION", "TRANSMISSION"), n=(5, 4), k: int = 3):
    """Values at the centres of cells; the channels are 1, 2, 3 times the BSDF."""
    content = b'NVIDIA ARC MBSDF V1\nname="made up"\n'
    theta = (np.arange(n[0]) + 0.5) * 90 / n[0]
    phi = (np.arange(n[1]) + 0.5) * 180 / n[1]
    for part in parts:
        theta_r = 180 - theta if part == "TRANSMISSION" else theta
        wi = unit(theta[:, None, None], 0.0)
        value = bsdf(wi, unit(theta_r[None, :, None], phi[None, None]))
        values = np.stack([value * (c + 1) for c in range(k)], axis=-1)
        name = f"MBSDF_DATA_{part}=\n".replace("_=", "=").encode()
        content += name + struct.pack("<3I", int(k == 3), *n)
        content += values.astype("<f4").tobytes() + b"\n"
    return content


def ssdd(system: str = "spherical", kind: str = "brdf", binary: bool = False) -> bytes:
    """Two wavelengths; the second channel is twice the first."""
    p0, p2, p3 = np.array([0.0, 25, 60]), np.array([0.0, 20, 70]), np.arange(0, 360.0, 45)
    head = [f"DATA_TYPE {kind}", "COLOR_MODEL spectrum", "WAVELENGTH_LIST 450 650"]
    head += [f"PARAM_TYPE {system}_coordinate_system"]
    for k, angles in ((0, p0), (2, p2), (3, p3)):
        head.append(f"PARAM{k}_LIST " + " ".join(f"{x:g}" for x in angles))
    if system == "specular":
        head.append("PARAM4_LIST 0 -3 -8")
    head += ["NAME made up", "MEASUREMENT_DATE 2020-01-16"]
    rows = []
    for phi in p3:
        for theta in p2:
            for k, first in enumerate(p0):
                wi = unit(first, 0.0)
                if system == "spherical":
                    wo = unit(theta, phi)
                else:
                    wo = around(first + (0, -3, -8)[k], theta, phi)
                if kind == "btdf":
                    wo = wo * [1, 1, -1]
                value = bsdf(wi, wo)
                rows.append([value, 2 * value])
    mode = "binary" if binary else "ascii"
    text = "\n".join([*head, f"DATA {mode}", ""]).encode()
    if binary:
        return text + np.array(rows).astype("<f4").tobytes() + b"\n"
    return text + "\n".join(["# comment", *lines_of(np.array(rows), ".12g"), ""]).encode()


SSDD_HEAD = b"VERSION 0.2\nSOFTWARE none\n\n"

SOUND = {
    "zemax.bsdf": zemax().encode(),
    "zemax_xyz.bsdf": zemax("BTDF", "Asymmetrical", "XYZ").encode(),
    "fred.txt": fred().encode(),
    "fred_sines.txt": fred("sin", "log", 2).encode(),
    "scan.dat": pgii("#colorimetry: CIE-Y", "#format: theta phi DSF", cosine=True).encode(),
    "speos.anisotropicbsdf": speos().encode(),
    "spectral.brdf": speos_spectral().encode(),
    "measured.mbsdf": mbsdf(),
    "both.ssdd": SSDD_HEAD + ssdd(binary=True) + ssdd("specular", "btdf"),
}
