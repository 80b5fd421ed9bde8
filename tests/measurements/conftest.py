from __future__ import annotations

from pathlib import Path

import pytest
from utfsm_maps import RAW_MAP, SINES_MAP, UTFSM


@pytest.fixture(scope="session")
def utfsm() -> Path:
    """The folder of real measurements; tests that need it are skipped, loudly, where it is not."""
    missing = [str(path) for path in (UTFSM, UTFSM / "raw_10mm_2Hz.txt") if not path.exists()]
    if missing:
        pytest.skip(f"REAL DATA NOT TESTED: missing {', '.join(missing)}")
    return UTFSM


@pytest.fixture
def sines_map(tmp_path) -> Path:
    path = tmp_path / "sines.yaml"
    path.write_text(SINES_MAP)
    return path


@pytest.fixture
def raw_map(tmp_path) -> Path:
    path = tmp_path / "raw.yaml"
    path.write_text(RAW_MAP)
    return path
