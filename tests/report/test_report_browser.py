"""A report in a browser: on a phone, by keyboard, in the dark, on paper, for everyone."""

from __future__ import annotations

from pathlib import Path

import pytest

from fitting.report import Reported, page

PHONE = {"width": 360, "height": 740}
DESK = {"width": 1280, "height": 800}
MOST_TABS = 200


@pytest.fixture
def opened(browser, written: Path):
    """Opens the report; at the end nothing may have been requested or complained about."""
    complaints, contexts = [], []

    def open_(file: Path = written, **options):
        context = browser.new_context(**options)
        contexts.append(context)
        found = context.new_page()
        found.on("console", lambda m: m.type == "error" and complaints.append(m.text))
        found.on("pageerror", lambda e: complaints.append(str(e)))

        def note(request):
            if not request.url.startswith(("data:", "blob:", file.as_uri())):
                complaints.append(request.url)

        found.on("request", note)
        found.goto(file.as_uri())
        return found

    yield open_
    for context in contexts:
        context.close()
    assert complaints == []


@pytest.fixture
def with_viewer(kept, data, tmp_path, monkeypatch) -> Path:
    """A report with the viewer, and without figures."""
    monkeypatch.setattr("fitting.report.figures.FIRST", ())
    monkeypatch.setattr("fitting.report.figures.MORE", ())
    file = tmp_path / "viewer.report.html"
    file.write_text(page([Reported(kept, data, "", "a.fit.json")]), encoding="utf-8")
    return file


@pytest.mark.parametrize("width", [320, 360, 768, 1280])
def test_nothing_overflows(opened, width):
    found = opened(viewport={"width": width, "height": 740})
    found.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert found.evaluate("document.documentElement.scrollWidth") == width
    cut = found.evaluate(
        """[...document.querySelectorAll('main *, header *, nav *')]
        .filter(e => !e.closest('.scroll'))
        .filter(e => e.getBoundingClientRect().right > innerWidth + 1)
        .map(e => e.outerHTML.slice(0, 80))"""
    )
    assert cut == []


def test_wide_tables_and_figures_scroll_in_themselves(opened):
    found = opened(viewport=PHONE)
    found.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    unreachable = found.evaluate(
        """[...document.querySelectorAll('.scroll')]
        .filter(e => e.scrollWidth > e.clientWidth + 1 && e.tabIndex < 0)
        .map(e => e.innerText.slice(0, 80))"""
    )
    assert unreachable == []


def test_keyboard(opened):
    """Tab reaches the skip link first, then every control, and shows where it is."""
    found = opened(viewport=DESK)
    wanted = found.evaluate(
        """[...document.querySelectorAll('a, summary, button, input, [tabindex="0"]')]
        .filter(e => e.checkVisibility()).length"""
    )
    seen = []
    for _ in range(MOST_TABS):
        found.keyboard.press("Tab")
        at = found.evaluate(
            """(() => { const e = document.activeElement, s = getComputedStyle(e),
            r = e.getBoundingClientRect();
            if (e === document.body) return null;
            const outline = s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 2;
            return {text: e.innerText.slice(0, 30), outline, inside: r.left >= 0}})()"""
        )
        if at is None:
            break
        seen.append(at)
    assert seen[0]["text"] == "Skip to the verdict"
    assert len(seen) == wanted
    assert all(at["outline"] and at["inside"] for at in seen), seen
    found.keyboard.press("Home")
    found.locator("a.skip").focus()
    found.keyboard.press("Enter")
    assert found.evaluate("document.activeElement.id") == "main"


def test_folded_parts_open_by_keyboard(opened):
    found = opened(viewport=DESK)
    found.locator("summary").first.focus()
    assert not found.locator("img[alt*='correlation']").is_visible()
    found.keyboard.press("Enter")
    assert found.locator("img[alt*='correlation']").is_visible()


def violations(found) -> dict[str, list[str]]:
    """What axe-core finds of WCAG 2.2, levels A and AA, and of best practice."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    tags = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
    said = axe.Axe().run(found, options={"runOnly": tags}).response
    checked = {rule["id"] for rule in said["passes"]}
    assert {"color-contrast", "landmark-one-main", "skip-link"} <= checked
    return {v["id"]: [n["html"][:120] for n in v["nodes"]] for v in said["violations"]}


@pytest.mark.parametrize(("viewport", "scheme"), [(PHONE, "light"), (DESK, "dark")])
def test_rules_of_accessibility(opened, scheme, viewport):
    found = opened(viewport=viewport, color_scheme=scheme)
    found.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert violations(found) == {}
    for figure in found.locator("img").all():
        assert figure.evaluate("e => e.complete && e.naturalWidth > 0")


def test_paper(opened):
    """Everything is printed, also what is folded, but the contents and the skip link."""
    found = opened(viewport=DESK)
    found.emulate_media(media="print")
    found.locator("details img").last.wait_for(state="visible")
    hidden = found.evaluate(
        """[...document.querySelectorAll('details img, details table')]
        .filter(e => !e.checkVisibility({contentVisibilityAuto: true}) ||
          e.getBoundingClientRect().height < 10).length"""
    )
    assert hidden == 0
    assert not found.locator("nav").is_visible()
    assert not found.locator("a.skip").is_visible()
    pdf = found.pdf(format="A4")
    assert pdf.startswith(b"%PDF")
    assert pdf.count(b"/Type /Page\n") > 3


def test_the_viewer_in_the_report(opened, with_viewer):
    """It draws where there is WebGL, says so where there is none, and overflows nowhere."""
    found = opened(with_viewer, viewport=PHONE)
    found.locator("#look canvas").first.wait_for()
    assert not found.locator("#look .viewer-failed").first.is_visible()
    assert found.evaluate("document.documentElement.scrollWidth") == 360
    assert violations(found) == {}
    blind = opened(with_viewer, viewport=PHONE, java_script_enabled=False)
    assert "needs JavaScript" in blind.locator("#look").inner_text()
    assert "typically" in blind.locator("#verdict").inner_text()


def test_scripts_run_only_if_they_are_the_programs(browser, kept, tmp_path, monkeypatch):
    """The page's policy names the viewer's script; any other that got in would not run."""
    monkeypatch.setattr("fitting.report.figures.FIRST", ())
    monkeypatch.setattr("fitting.report.figures.MORE", ())
    script = "<script>document.body.dataset.own = 'ran'</script>"
    monkeypatch.setattr("fitting.report.looking.fragment", lambda *_: script)
    html = page([Reported(kept)])
    html = html.replace(
        "</main>", "<script>document.body.dataset.alien = 'ran'</script></main>"
    )
    file = tmp_path / "a.html"
    file.write_text(html, encoding="utf-8")
    found = browser.new_page()
    found.goto(file.as_uri())
    assert found.evaluate("document.body.dataset.own") == "ran"
    assert found.evaluate("document.body.dataset.alien") is None
    loaded = found.evaluate(
        "fetch('https://example.org').then(() => 'loaded', () => 'refused')"
    )
    assert loaded == "refused"
    found.close()
