"""Draw the README's picture from the bundled sample.

Measured values and the fit in the plane of incidence, for every angle of incidence.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from fitting import fit, read
from fitting.sample import sample_path

PICTURE = Path(__file__).with_name("readme_picture.png")
# Okabe and Ito's colours, told apart by everyone.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
CHANNEL = 5


def draw(path: Path = PICTURE) -> None:
    """Fit the sample with two lobes and draw one channel."""
    m = read(sample_path())
    result = fit(m, "lambert + 2*ggx", cross_validate=False)
    delta = m.phi_r - m.phi_i
    in_plane = np.abs(np.sin(delta)) < 1e-6
    signed = np.degrees(np.where(np.cos(delta) < 0, m.theta_r, -m.theta_r))
    figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
    line = np.linspace(-80, 80, 641)
    for theta_i, colour in zip(np.unique(m.theta_i), COLOURS, strict=True):
        rows = in_plane & (m.theta_i == theta_i)
        axes.semilogy(signed[rows], m.value[rows, CHANNEL], "o", ms=4, color=colour)
        fitted = result.evaluate(
            theta_i, 0.0, np.radians(np.abs(line)), np.where(line > 0, np.pi, 0.0)
        )
        label = rf"$\theta_i$ = {np.degrees(theta_i):.0f}°"
        axes.semilogy(line, fitted[:, CHANNEL], color=colour, lw=1.5, label=label)
    axes.set_xlabel("angle of the detector in the plane of incidence / deg")
    axes.set_ylabel("BRDF / (1/sr)")
    alpha = result.values["ggx1.alpha"], result.values["ggx2.alpha"]
    axes.set_title(
        f"bundled synthetic sample at {m.channels[CHANNEL].name}: data (dots) and fit "
        rf"($\alpha$ = {min(alpha):.3f} and {max(alpha):.3f})",
        fontsize=10,
    )
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    draw()
