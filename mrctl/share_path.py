"""Where the shipped files stand: in a wheel inside the package, in a checkout beside it."""

from __future__ import annotations

from pathlib import Path

from mrctl.errors import InputError

_PACKAGE = Path(__file__).resolve().parent


def share_file(relative: str) -> Path:
    """The path of a shipped file or folder.

    relative: for example `dbc/mrctl.dbc` or `config/vehicle.yaml`. Raises InputError where the installation
    has no such file.
    """
    for root in (_PACKAGE / "share", _PACKAGE.parent):
        path = root / relative
        if path.exists():
            return path
    raise InputError.at(relative, "is not among the files of this installation", "reinstall mrctl")
