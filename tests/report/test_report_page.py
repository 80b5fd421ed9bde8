from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from sample_report import sample_page

import mrctl
from mrctl.errors import InputError
from mrctl.report.page import Card, Page, file_digest
from mrctl.report.plots import line_plot
from mrctl.report.series import Series
from mrctl.report.tables import Cell

VOID = {"meta", "link", "br", "hr", "img"}


class Outline(HTMLParser):
    """Checks that tags nest, and collects ids, links, texts and whatever would be fetched."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.tags: list[str] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            elif name == "href" and tag == "a":
                self.links.append(value or "")
            elif name in {"src", "href", "xlink:href", "srcset", "data"} and not (value or "").startswith(
                "data:"
            ):
                self.fetched.append(f"{tag} {name}={value}")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def outline(page: Page) -> Outline:
    found = Outline()
    found.feed(page.html())
    found.close()
    assert found.open == []
    return found


@pytest.fixture(scope="module")
def sample() -> Page:
    return sample_page()


def test_a_page_nests_fetches_nothing_and_runs_nothing(sample: Page) -> None:
    found = outline(sample)
    assert found.fetched == []
    assert "script" not in found.tags
    assert not re.search(r"url\(|@import|https?://(?!www\.w3\.org/2000/svg)", sample.html())
    assert "default-src 'none'" in sample.html()


def test_every_entry_of_the_contents_leads_to_its_section(sample: Page) -> None:
    found = outline(sample)
    assert [link.removeprefix("#") for link in found.links] == found.ids
    assert len(set(found.ids)) == len(found.ids) == 6


def test_a_page_of_every_part_is_far_below_the_limit(sample: Page) -> None:
    assert len(sample.html().encode()) < 600_000


def test_a_page_has_the_same_bytes_in_every_process(sample: Page) -> None:
    code = (
        "import hashlib; from sample_report import sample_page;"
        "print(hashlib.sha256(sample_page().html().encode()).hexdigest())"
    )
    root = Path(mrctl.__file__).parent.parent
    path = os.pathsep.join([str(root), str(Path(__file__).parent)])
    environment = {**os.environ, "PYTHONHASHSEED": "12345", "PYTHONPATH": path}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == hashlib.sha256(sample.html().encode()).hexdigest()


def test_text_from_outside_is_shown_as_it_is() -> None:
    evil = "<img src=x onerror=alert(1)>\"'&\x07"
    page = Page(evil, evil, command=evil, inputs=[(evil, evil)])
    page.section(evil, evil)
    page.section(evil)
    page.paragraph(evil)
    page.code(evil)
    page.table([evil], [[evil], [Cell(evil, evil, "bad")]], evil)
    page.figure(line_plot(evil, evil, evil, [Series(evil, [1, 2], [1, 2])]), evil)
    page.key_figures([(evil, evil, evil)])
    page.cards([Card(evil, evil, "warn", [(evil, evil)], evil, evil)])
    with page.details(evil):
        page.paragraph(evil)
    found = outline(page)
    assert "img" not in found.tags
    assert found.fetched == []
    assert sum("<img src=x" in text for text in found.texts) >= 20


def test_code_and_strong_are_marked_up_after_escaping() -> None:
    page = Page("t")
    page.paragraph("run `a<b` **now**")
    assert "<p>run <code>a&lt;b</code> <strong>now</strong></p>" in page.html()


def test_a_table_marks_the_best_and_dashes_the_missing() -> None:
    page = Page("t")
    page.table(
        ["Model", "RMSE (N)"], [["a", 12.0], ["b", None], ["c", 3.5], ["d", float("nan")]], best={1: "min"}
    )
    html = page.html()
    assert html.count('class="r best"') == 1
    assert '<td class="r best">3.5</td>' in html
    assert html.count('<td class="r">–</td>') == 2


def test_a_row_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="3 cells under 2 headers"):
        Page("t").table(["a", "b"], [[1, 2, 3]])


def test_tables_have_captions_headers_and_can_be_scrolled_by_keyboard(sample: Page) -> None:
    html = sample.html()
    assert html.count("<table>") == html.count("<caption>") == html.count('role="region" tabindex="0"')
    assert 'scope="col"' in html
    assert 'scope="row"' in html


def test_the_footer_says_version_command_and_inputs(sample: Page) -> None:
    footer = sample.html().partition("<footer>")[2]
    assert mrctl.__version__ in footer
    assert "mrctl diagnose bench_2024.yaml" in footer
    assert "9f2b6c01d4e8a375" in footer


def test_writing_leaves_one_whole_file(tmp_path: Path) -> None:
    page = Page("Report")
    target = tmp_path / "deep" / "report.html"
    target.parent.mkdir()
    target.write_text("old")
    assert page.write(target) == len(target.read_bytes())
    assert target.read_text() == page.html()
    assert [p.name for p in target.parent.iterdir()] == ["report.html"]
    assert target.stat().st_mode & 0o044


def test_a_failed_write_keeps_the_old_file_and_leaves_no_scraps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "report.html"
    target.write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        Page("Report").write(target)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    assert target.read_text() == "old"


def test_a_place_that_is_no_folder_is_an_input_error_of_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError) as caught:
        Page("Report").write(tmp_path / "file" / "report.html")
    assert "\n" not in str(caught.value)
    assert "choose another place" in str(caught.value)


def test_a_digest_is_the_start_of_the_sha256(tmp_path: Path) -> None:
    (tmp_path / "cal.yaml").write_bytes(b"schema: 1\n")
    assert file_digest(tmp_path / "cal.yaml") == hashlib.sha256(b"schema: 1\n").hexdigest()[:16]
    with pytest.raises(InputError, match="cannot be read"):
        file_digest(tmp_path / "missing.yaml")


def test_the_kit_needs_numpy_alone_and_the_terminal_not_even_that() -> None:
    heavy = "{m for m in ('numpy', 'scipy', 'matplotlib', 'numba', 'pandas') if m in sys.modules}"
    for modules, allowed in (("sample_report", {"numpy"}), ("mrctl.report.terminal", set())):
        path = os.pathsep.join([str(Path(mrctl.__file__).parent.parent), str(Path(__file__).parent)])
        done = subprocess.run(
            [sys.executable, "-c", f"import sys, {modules}; print(sorted({heavy}))"],
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.strip() == str(sorted(allowed))
