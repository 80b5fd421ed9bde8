"""A fixed small part of the fuzzing of the loaders; `python tests/fuzz/loaders.py` is the whole."""

from __future__ import annotations

from fuzz.loaders import Fuzz


def test_no_broken_file_is_more_than_refused(tmp_path):
    fuzz = Fuzz(tmp_path, seed=1)
    for _ in range(60):
        fuzz.step()
    assert fuzz.accepted > 0
    assert len(fuzz.heard) > 10
