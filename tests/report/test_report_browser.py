"""Reports as people see them: a desk screen, two phones, both themes, paper."""

from __future__ import annotations

import shutil
from pathlib import Path

import browser as browser_module
import pytest
from browser import Browser, BrowserMissingError, find_chromium
from sample_report import sample_page


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    sample_page().write(path)
    return path


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [1200, 768, 375, 320])
def test_a_report_fits_the_screen_without_errors_or_requests(
    browser: Browser, report: Path, *, width: int, dark: bool
) -> None:
    with browser.open(report, width=width, dark=dark) as view:
        assert view.errors == []
        assert view.requests == []
        assert view.overflowing() == []
        assert view.colliding_texts() == []


def test_the_theme_reaches_page_and_figures(browser: Browser, report: Path) -> None:
    colours = """[getComputedStyle(document.body).backgroundColor,
        getComputedStyle(document.querySelector('.plot .line.ink')).stroke,
        getComputedStyle(document.querySelector('.plot text')).fill]"""
    with browser.open(report) as view:
        assert view.evaluate(colours) == ["rgb(255, 255, 255)", "rgb(22, 25, 29)", "rgb(22, 25, 29)"]
    with browser.open(report, dark=True) as view:
        assert view.evaluate(colours) == ["rgb(20, 23, 26)", "rgb(228, 231, 234)", "rgb(228, 231, 234)"]


@pytest.mark.parametrize("width", [1200, 768, 375, 320])
def test_text_in_figures_is_large_enough_to_read(browser: Browser, report: Path, width: int) -> None:
    smallest = """Math.min(...[...document.querySelectorAll('svg.plot')].filter(s => s.clientWidth).map(
        s => 11 * s.getBoundingClientRect().width / s.viewBox.baseVal.width))"""
    with browser.open(report, width=width) as view:
        assert view.evaluate(smallest) >= 9.0


def test_one_drawing_of_each_figure_is_shown(browser: Browser, report: Path) -> None:
    shown = """[...document.querySelectorAll('figure')].map(
        f => [...f.querySelectorAll('svg.plot')].filter(s => s.clientWidth).length)"""
    for width in (1200, 375):
        with browser.open(report, width=width) as view:
            counts = view.evaluate(shown)
            assert set(counts) == {1}
            assert len(counts) == 14


def test_paper_is_light_even_from_a_dark_screen_and_shows_what_is_folded(
    browser: Browser, report: Path, tmp_path: Path
) -> None:
    with browser.open(report, dark=True, media="print") as view:
        assert view.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert view.evaluate("document.querySelector('details table').getBoundingClientRect().height") > 100
        assert view.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
        assert view.pdf(tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_the_helper_sees_errors_requests_and_overflow(browser: Browser, tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text(
        '<!DOCTYPE html><meta name="viewport" content="width=device-width"><body>'
        '<div style="width:900px">wide</div>'
        '<img src="missing.png"><script>console.error("oops")</script>'
        '<svg class="plot" width="100" height="50"><title>t</title>'
        '<text y="20">one</text><text y="22">two</text>'
        '<text x="90" y="40">outside</text></svg>'
    )
    with browser.open(bad, width=375) as view:
        assert any("oops" in error for error in view.errors)
        assert view.requests == [(tmp_path / "missing.png").as_uri()]
        assert any("wide" in element for element in view.overflowing())
        assert view.colliding_texts() == ["t: touching: one | two", "t: outside: outside"]


def test_a_missing_browser_is_said_loudly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(BrowserMissingError, match="apt-get install chromium"):
        find_chromium()
    with pytest.raises(BrowserMissingError):
        browser_module.Browser()
