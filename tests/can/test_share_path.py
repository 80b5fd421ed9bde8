from __future__ import annotations

from pathlib import Path

import pytest

from mrctl import share_path
from mrctl.errors import InputError


def test_shipped_files_are_found_in_a_checkout_and_in_a_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert share_path.share_file("dbc/mrctl.dbc").is_file()
    package = tmp_path / "site-packages" / "mrctl"
    (package / "share" / "dbc").mkdir(parents=True)
    shipped = package / "share" / "dbc" / "mrctl.dbc"
    shipped.touch()
    monkeypatch.setattr(share_path, "_PACKAGE", package)
    assert share_path.share_file("dbc/mrctl.dbc") == shipped


def test_a_file_that_is_not_shipped_is_said() -> None:
    with pytest.raises(InputError, match=r"^dbc/other.dbc: is not among the files"):
        share_path.share_file("dbc/other.dbc")
