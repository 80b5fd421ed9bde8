"""Files are whole or not there; what is no regular file stays what it is."""

from __future__ import annotations

import os
import stat
from threading import Thread

import pytest

from mrctl.whole_file import whole_file


def test_the_file_takes_its_place_when_the_block_ends(tmp_path):
    place = tmp_path / "f"
    with whole_file(place) as stream:
        stream.write("all")
        assert not place.exists()
    assert place.read_text() == "all"
    assert [p.name for p in tmp_path.iterdir()] == ["f"]


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path):
    place = tmp_path / "f"
    place.write_text("old")

    def half() -> None:
        with whole_file(place) as stream:
            stream.write("half")
            raise ValueError

    with pytest.raises(ValueError):  # noqa: PT011 - its own
        half()
    assert place.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["f"]


def test_a_replaced_file_keeps_its_permissions_and_a_link_stays_a_link(tmp_path):
    place, link = tmp_path / "f", tmp_path / "link"
    place.write_text("old")
    place.chmod(0o600)
    link.symlink_to(place)
    with whole_file(link, "wb") as stream:
        stream.write(b"new")
    assert link.is_symlink()
    assert place.read_bytes() == b"new"
    assert stat.S_IMODE(place.stat().st_mode) == 0o600


def test_a_pipe_or_a_device_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got: list[str] = []
    reader = Thread(target=lambda: got.append(pipe.read_text()))
    reader.start()
    with whole_file(pipe) as stream:
        stream.write("through")
    reader.join(5.0)
    assert got == ["through"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
