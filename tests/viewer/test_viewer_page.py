"""The page in a real browser: it draws, follows its controls, and calls nobody."""

from __future__ import annotations

import base64
import io
import json

import msgspec
import numpy as np
import pytest
from matplotlib.image import imread
from opened_pages import Open, Opened

from data_formats import Measurement
from fitting.albedo import albedo_basis
from fitting.model import Model
from fitting.result import FitResult
from fitting.viewer import page
from fitting.viewer.page import fragment

# What the page says of itself: set a slider as a user's hand does, and wait for pictures.
SET = """async ([selector, value]) => {
  const input = document.querySelector(selector);
  const set = Object.getOwnPropertyDescriptor(Object.getPrototypeOf(input),
    input.type === 'checkbox' ? 'checked' : 'value').set;
  set.call(input, value);
  input.dispatchEvent(new Event(input.type === 'range' ? 'input' : 'change'));
  await new Promise((done) => setTimeout(done, 400));
}"""
PAGE = "document.querySelector('section.viewer').page"


@pytest.fixture(scope="module")
def html(glossy: FitResult, matt: FitResult, paint: Measurement) -> str:
    return page([glossy, matt], [paint, paint], ["glossy", "matt"])


@pytest.fixture(scope="module")
def shown(opened: Open, html: str) -> Opened:
    """The page as it is at first, for those who only look."""
    return opened(html)


def _shot(opened: Opened, selector: str, number: int = 0) -> np.ndarray:
    """Pixels ``(h, w, 3)`` of a canvas, on black."""
    url = (
        opened.page.locator(f"{selector} canvas")
        .nth(number)
        .evaluate("canvas => canvas.toDataURL('image/png')")
    )
    rgba = imread(io.BytesIO(base64.b64decode(url.partition(",")[2])))
    return rgba[..., :3] * rgba[..., 3:]


def _is_drawn(opened: Opened, selector: str, number: int) -> bool:
    """Whether there is something to see, or is soon: albedos wait until all else rests."""
    for _ in range(100):
        if _shot(opened, selector, number).std() > 0.02:
            return True
        opened.page.wait_for_timeout(100)
    return False


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).mean())


PICTURES = (
    ".viewer-lit-sphere", ".viewer-lobe", ".viewer-plane-of-incidence", ".viewer-albedo",
    ".viewer-image-slice",
)  # fmt: skip


def test_draws_everything_and_asks_for_nothing(shown: Opened) -> None:
    out = shown
    for selector in PICTURES:
        for number in (0, 1):
            assert _is_drawn(out, selector, number), selector
    assert out.page.locator("article").count() == 2
    assert not out.page.locator(".viewer-failed").first.is_visible()
    assert out.said == []
    assert len(out.asked) == 1
    assert out.page.title() == "glossy, matt - BRDF viewer"


def test_sphere_has_the_colour_of_the_model(
    opened: Open, glossy: FitResult, html: str
) -> None:
    out = opened(html)
    # Light from the viewer: at the centre wi = wo = n, and the cosine is 1.
    out.run(f"() => {{ {PAGE}.view.turnLight(0.8726646259971648, -0.6108652381980153);"
            f" {PAGE}.changed('sphere'); }}")  # fmt: skip
    out.page.wait_for_timeout(300)
    shot = _shot(out, ".viewer-lit-sphere")
    h, w, _ = shot.shape
    # Beside the mark of the light; a glossy peak does not change much over some pixels.
    at = shot[h // 2 + 12, w // 2 + 12]
    offset = 12 * np.sqrt(2) / (min(h, w) / 2) * 1.03
    theta = float(np.arcsin(offset))
    f = glossy.evaluate([theta], [0.0], [theta], [0.0])[0]
    weights = np.array(out.run(f"() => {PAGE}.fits[0].rgb"))
    linear = np.clip(f @ weights * np.cos(theta), 0.0, 1.0)
    encoded = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055
    )
    np.testing.assert_allclose(at, encoded, atol=0.02)


def test_curve_is_the_fit(shown: Opened, glossy: FitResult) -> None:
    out = shown
    got = json.loads(out.run(f"() => JSON.stringify({PAGE}.cards[0].slice.values)"))
    theta = np.radians(out.run(f"() => {PAGE}.view.theta"))
    angle = np.radians(got["angles"])
    phi = np.where(angle >= 0, np.pi, 0.0)
    chosen = out.run(f"() => {PAGE}.fits[0].chosen")
    for channel, curve in zip(chosen, got["curves"], strict=True):
        exact = glossy.evaluate(theta, 0.0, np.abs(angle), phi)[:, channel]
        np.testing.assert_allclose(curve, exact, rtol=3e-5)


def test_albedo_is_that_of_the_fit(shown: Opened, glossy: FitResult) -> None:
    out = shown
    got = json.loads(out.run(f"() => JSON.stringify({PAGE}.cards[0].albedo.values)"))
    model, values = Model(glossy.model), glossy.values
    channel = out.run(f"() => {PAGE}.fits[0].chosen[0]")
    linear = {n: values[n] for n, p in model.parameters().items() if p.coefficient}
    shape = {n: v for n, v in values.items() if n not in linear}
    cosines = np.cos(np.radians(got["thetas"]))
    exact = np.zeros(cosines.size)
    for index, lobe in enumerate(model.lobes):
        own = model.of_lobe(index, shape)
        basis = albedo_basis(lobe, own, cosines, nodes=32)
        ordered = [model.of_lobe(index, linear)[p.name] for p in lobe.parameters()
                   if p.coefficient]  # fmt: skip
        factors = lobe.amplitudes(own, tuple(o[channel] for o in ordered))
        exact += sum(np.asarray(b) * a for b, a in zip(basis, factors, strict=True))
    np.testing.assert_allclose(got["curves"][0], exact, rtol=1e-3)


def test_slider_changes_pictures_and_texts_and_reset_restores(
    opened: Open, html: str
) -> None:
    out = opened(html)
    before = [_shot(out, s) for s in PICTURES]
    text = out.page.locator("#viewer-0-ggx-alpha").get_attribute("aria-valuetext")
    other = _shot(out, ".viewer-lit-sphere", 1)
    out.run(SET, ["#viewer-0-ggx-alpha", "900"])
    after = [_shot(out, s) for s in PICTURES]
    assert all(_difference(a, b) > 1e-3 for a, b in zip(before, after, strict=True))
    assert out.page.locator("#viewer-0-ggx-alpha").get_attribute("aria-valuetext") != text
    # The other fit has sliders of its own.
    assert _difference(_shot(out, ".viewer-lit-sphere", 1), other) == 0.0
    out.page.get_by_role("button", name="Back to the fit").first.click()
    out.page.wait_for_timeout(400)
    for selector, then in zip(PICTURES, before, strict=True):
        assert _difference(_shot(out, selector), then) == 0.0
    assert out.page.locator("#viewer-0-ggx-alpha").get_attribute("aria-valuetext") == text
    assert out.said == []


def test_one_channel_alone(opened: Open, glossy: FitResult, html: str) -> None:
    out = opened(html)
    colour = _shot(out, ".viewer-lit-sphere")
    out.run(SET, ["#viewer-channel", "650 nm"])
    alone = _shot(out, ".viewer-lit-sphere")
    # Grey, but for the mark of the light.
    grey = np.abs(alone.max(axis=2) - alone.min(axis=2)) < 0.1
    assert grey.mean() > 0.98
    assert np.abs(colour.max(axis=2) - colour.min(axis=2)).max() > 0.2
    c = [c.name for c in glossy.channels].index("650 nm")
    said = out.page.locator("#viewer-0-lambert-albedo-about").inner_text()
    p = glossy.parameter("lambert.albedo")
    assert f"fitted {p.value[c]:.5f} ± {p.standard_uncertainty[c]:.5f}" in said
    # Its slider moves that channel and no other.
    out.run(SET, ["#viewer-0-lambert-albedo", "100"])
    now = out.run(f"() => {PAGE}.fits[0].values.get('lambert.albedo')")
    assert [k for k, v in enumerate(now) if v != p.value[k]] == [c]
    out.page.get_by_role("button", name="Reset everything").click()
    out.page.wait_for_timeout(400)
    assert _difference(_shot(out, ".viewer-lit-sphere"), colour) == 0.0
    assert out.page.locator("#viewer-channel").input_value() == ""


def test_light_is_dragged_and_moved_by_keys(opened: Open, html: str) -> None:
    out = opened(html)
    sphere = out.page.locator(".viewer-lit-sphere canvas").first
    before = _shot(out, ".viewer-lit-sphere")
    sphere.focus()
    for _ in range(5):
        sphere.press("ArrowRight")
    out.page.wait_for_timeout(700)
    by_keys = _shot(out, ".viewer-lit-sphere")
    assert _difference(before, by_keys) > 1e-3
    assert "light" in out.page.locator(".viewer-live").inner_text()
    box = sphere.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    out.page.mouse.move(x, y)
    out.page.mouse.down()
    out.page.mouse.move(x + 40, y + 10, steps=4)
    out.page.mouse.up()
    out.page.wait_for_timeout(300)
    assert _difference(_shot(out, ".viewer-lit-sphere"), by_keys) > 1e-3


def test_measured_points_are_on_the_curve(
    opened: Open, paint: Measurement, html: str
) -> None:
    out = opened(html)
    out.run(SET, ["#viewer-measured", "50"])
    said = out.page.locator(".viewer-plane-of-incidence figcaption").first.inner_text()
    delta = np.sin(paint.theta_r) * np.sin(paint.phi_r - paint.phi_i)
    here = np.isclose(np.degrees(paint.theta_i), 50.0) & (np.abs(delta) < 0.005)
    here &= paint.valid.any(axis=1)
    assert f"{here.sum()} measured points" in said
    # Values as the page has them are those of the file.
    got = np.array(out.run(f"() => Array.from({PAGE}.fits[0].measured)"), dtype=float)
    angles = np.array(out.run(f"() => Array.from({PAGE}.fits[0].angles)"), dtype=float)
    assert got.size == paint.valid.any(axis=1).sum() * 7
    rows = angles.reshape(-1, 4)
    every = np.stack([paint.theta_i, paint.phi_i, paint.theta_r, paint.phi_r], axis=1)
    first = np.argmin(np.abs(every - rows[0]).sum(axis=1))
    np.testing.assert_allclose(got[:7], paint.value[first], rtol=1e-6)


def test_shapes_of_their_own_in_every_channel(
    opened: Open, glossy: FitResult, paint: Measurement
) -> None:
    """Then the model is evaluated once per channel, and not once for all."""
    widths = np.geomspace(0.05, 0.5, 7).tolist()
    parameters = [
        msgspec.structs.replace(
            p, value=widths, standard_uncertainty=[None] * 7, interval_95=[None] * 7,
            at_bound=[False] * 7,
        ) if p.name == "ggx.alpha" else p
        for p in glossy.parameters
    ]  # fmt: skip
    result = msgspec.structs.replace(glossy, parameters=parameters)
    out = opened(page([result], [paint]))
    assert out.run(f"() => {PAGE}.fits[0].shader.shared") is False
    got = json.loads(out.run(f"() => JSON.stringify({PAGE}.cards[0].slice.values)"))
    theta = np.radians(out.run(f"() => {PAGE}.view.theta"))
    angle = np.radians(got["angles"])
    phi = np.where(angle >= 0, np.pi, 0.0)
    exact = result.evaluate(theta, 0.0, np.abs(angle), phi)
    for channel, curve in zip(
        out.run(f"() => {PAGE}.fits[0].chosen"), got["curves"], strict=True
    ):
        np.testing.assert_allclose(curve, exact[:, channel], rtol=1e-4)
    assert out.said == []


def test_tied_parameters_follow(
    opened: Open, glossy: FitResult, paint: Measurement
) -> None:
    parameters = [
        msgspec.structs.replace(p, tied_to="ggx.f0") if p.name == "ggx.f90" else p
        for p in glossy.parameters
    ]
    out = opened(page([msgspec.structs.replace(glossy, parameters=parameters)], [paint]))
    assert out.page.locator("#viewer-0-ggx-f90").is_disabled()
    assert "tied to ggx.f0" in out.page.locator("#viewer-0-ggx-f90-about").inner_text()
    out.run(SET, ["#viewer-0-ggx-f0", "600"])
    for name in ("ggx.f0", "ggx.f90"):
        now = np.array(out.run(f"() => {PAGE}.fits[0].values.get('{name}')"))
        np.testing.assert_allclose(now / glossy.parameter(name).value, 8**0.2, rtol=1e-12)


def test_without_webgl_the_page_says_so(opened: Open, html: str) -> None:
    without = html.replace('getContext("webgl2"', 'getContext("no-such-thing"')
    script = without[without.rindex('<script type="module">') :]
    # The script is another one, whose digest the policy does not know.
    start = without.index("<meta http-equiv")
    end = without.index(">", start) + 1
    out = opened(without[:start] + without[end:])
    assert "no-such-thing" in script
    assert "no WebGL 2" in out.page.locator(".viewer-failed").first.inner_text()


def test_fits_on_a_phone_and_in_the_dark(opened: Open, html: str) -> None:
    out = opened(html, viewport={"width": 360, "height": 700}, color_scheme="dark")
    assert out.run("() => document.documentElement.scrollWidth") <= 360
    screen = imread(io.BytesIO(out.page.screenshot()))[..., :3]
    assert screen.mean() < 0.4
    assert out.said == []


def test_every_control_has_a_name(shown: Opened) -> None:
    out = shown
    nameless = out.run(
        """() => [...document.querySelectorAll('input, select, button, canvas')]
          .filter((e) => !(e.labels?.length || e.textContent.trim()
            || e.getAttribute('aria-label'))).map((e) => e.outerHTML)"""
    )
    assert nameless == []
    doubled = out.run(
        """() => { const ids = [...document.querySelectorAll('[id]')].map((e) => e.id);
          return ids.filter((id, k) => ids.indexOf(id) !== k); }"""
    )
    assert doubled == []


def test_fragment_works_in_another_page(
    opened: Open, glossy: FitResult, paint: Measurement
) -> None:
    body = fragment([glossy], [None], ["a </script> name"])
    out = opened(
        f"<!DOCTYPE html><html lang='en'><title>t</title><body>{body}</body></html>"
    )
    assert out.page.locator("h3").inner_text() == "a </script> name"
    assert (
        "no measurement at hand"
        in out.page.locator(".viewer-plane-of-incidence figcaption").inner_text()
    )
    assert out.said == []
    assert len(out.asked) == 1
