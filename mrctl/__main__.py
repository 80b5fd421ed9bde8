"""`python -m mrctl`."""

from __future__ import annotations

from mrctl.cli.main import entry_point

if __name__ == "__main__":
    entry_point()
