from __future__ import annotations

import io
import os
import shutil

import pytest

from mrctl.report.tables import Cell, Value
from mrctl.report.terminal import Progress, display_width, paint, table


class Terminal(io.StringIO):
    """A stream that claims to be a terminal."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


class Ascii(io.StringIO):
    encoding = "ascii"


class Clock:
    """A clock that is set by hand."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr(shutil, "get_terminal_size", lambda *_: os.terminal_size((80, 24)))


HEADERS = ["File", "RMSE (N)", "Note"]
ROWS: list[list[Value | Cell]] = [
    [
        "dyno/cold/run_01_1in_2.387Hz_0A.csv",
        12.345,
        "a long remark that wraps at spaces when there is no room",
    ],
    ["b.csv", 3.2, Cell("clipped", tone="warn")],
    ["c.csv", None, ""],
]


def test_columns_line_up_and_numbers_stand_to_the_right() -> None:
    lines = table(
        ["Effect", "RMSE (N)"], [["gas_spring", 12.34], ["none", 9.1]], stream=io.StringIO()
    ).splitlines()
    assert lines == ["Effect      RMSE (N)", "─" * 20, "gas_spring      12.3", "none             9.1"]


@pytest.mark.parametrize("width", [30, 36, 44, 60, 100, 200])
def test_no_line_is_wider_than_asked(width: int) -> None:
    text = table(HEADERS, ROWS, width=width, stream=io.StringIO())
    assert max(map(display_width, text.splitlines())) <= width
    flat = "".join(text.split())
    assert "12.3" in flat
    assert "clipped" in flat


def test_wrapping_loses_no_letter() -> None:
    text = table(["Note"], [["one two three four five"]], width=9, stream=io.StringIO())
    assert " ".join(text.split()).endswith("one two three four five")


def test_a_table_in_a_pipe_is_neither_wrapped_nor_coloured() -> None:
    text = table(HEADERS, ROWS, best={1: "min"}, title="Runs", stream=io.StringIO())
    assert "a long remark that wraps at spaces when there is no room" in text
    assert "\x1b" not in text


def test_a_table_on_a_terminal_fits_it_and_colours_the_best() -> None:
    text = table(HEADERS, ROWS, best={1: "min"}, stream=Terminal())
    assert "\x1b[32m3.2\x1b[0m" in text
    assert "\x1b[33mclipped\x1b[0m" in text
    assert max(map(display_width, text.splitlines())) <= 80


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_colours_stay_away_where_they_are_not_wanted(
    name: str, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    assert "\x1b" not in table(HEADERS, ROWS, best={1: "min"}, stream=Terminal())
    assert paint("x", "bad", Terminal()) == "x"


def test_wide_letters_and_accents_count_as_they_are_shown() -> None:
    assert display_width("漢字") == 4
    assert display_width("e\u0301\x1b[31mx\x1b[0m") == 2
    lines = table(["Name", "N"], [["漢字", 1], ["ab", 2]], stream=io.StringIO()).splitlines()
    assert {display_width(line) for line in lines[2:]} == {7}


def test_a_file_name_cannot_steer_the_terminal() -> None:
    assert "\x1b" not in table(["File"], [["a\x1b[2Jb\r\n.csv"]], stream=io.StringIO())


def test_a_terminal_without_unicode_gets_plain_letters() -> None:
    text = table(["Temp. (°C)", "Gain"], [["25", None]], stream=Ascii())
    assert text.encode("ascii").splitlines()[1] == b"-" * 19


def test_an_empty_table_shows_its_headers() -> None:
    assert table(["File", "RMSE"], [], stream=io.StringIO()).splitlines()[0] == "File  RMSE"


def test_a_bar_shows_share_and_time_left_on_one_line() -> None:
    stream, clock = Terminal(), Clock()
    with Progress("Identifying", total=40, stream=stream, clock=clock) as progress:
        for _ in range(10):
            clock.now += 2.0
            progress.advance(note="run_11.csv")
    drawn = stream.getvalue().split("\r")
    assert all(display_width(line.replace("\x1b[K", "").strip("\n")) < 80 for line in drawn)
    assert " 25 %  1 min 00 s left  run_11.csv" in drawn[-2]
    assert stream.getvalue().count("\n") == 1
    assert drawn[-1] == "Identifying: 20 s\x1b[K\n"


def test_a_bar_is_redrawn_ten_times_a_second_at_most() -> None:
    stream, clock = Terminal(), Clock()
    with Progress("Fit", total=1000, stream=stream, clock=clock) as progress:
        for _ in range(1000):
            clock.now += 0.001
            progress.advance()
    assert stream.getvalue().count("\r") <= 13


@pytest.mark.parametrize("columns", [10, 20, 40])
def test_a_bar_never_wraps_on_a_narrow_terminal(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "get_terminal_size", lambda *_: os.terminal_size((columns, 24)))
    stream, clock = Terminal(), Clock()
    with Progress("Identifying", total=4, stream=stream, clock=clock) as progress:
        clock.now += 1
        progress.advance(note="a_rather_long_file_name.csv")
    lines = stream.getvalue().replace("\x1b[K", "").replace("\n", "").split("\r")
    assert max(map(len, lines)) < columns


def test_in_a_log_lines_come_every_ten_seconds() -> None:
    stream, clock = io.StringIO(), Clock()
    with Progress("Fit", total=60, stream=stream, clock=clock) as progress:
        for _ in range(60):
            clock.now += 1.0
            progress.advance()
    lines = stream.getvalue().splitlines()
    assert lines[0] == "Fit: 17 %, 50 s left"
    assert len(lines) == 7
    assert lines[-1] == "Fit: 1 min 00 s"


def test_quiet_is_silent_and_a_closed_standard_error_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    with Progress("Fit", total=2, quiet=True, stream=stream) as progress:
        progress.advance()
    assert stream.getvalue() == ""
    monkeypatch.setattr("sys.stderr", None)
    with Progress("Fit", total=2) as progress:
        progress.advance()


@pytest.mark.parametrize(("error", "word"), [(KeyboardInterrupt, "interrupted"), (ValueError, "failed")])
def test_an_interrupted_bar_ends_its_line_and_passes_the_error_on(
    error: type[BaseException], word: str
) -> None:
    stream = Terminal()
    with pytest.raises(error), Progress("Fit", total=2, stream=stream):
        raise error
    assert stream.getvalue().endswith("\n")
    assert f"Fit: {word} after" in stream.getvalue()


def test_work_of_unknown_length_counts() -> None:
    stream, clock = Terminal(), Clock()
    with Progress("Reading", stream=stream, clock=clock) as progress:
        for _ in progress.track(range(3), note=lambda k: f"frame {k}"):
            clock.now += 1.0
    assert "Reading  3  frame 2" in stream.getvalue()
