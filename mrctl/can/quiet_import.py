"""python-can and cantools without the weight they drag in: import them here and nowhere else.

`import can` imports every log format, MDF4 among them, and that imports asammdf, pandas and more wherever
asammdf is installed: hundreds of milliseconds and over 100 MB in a process that must be small and start fast.
cantools imports can. While the two are imported here, asammdf looks absent; whoever needs it imports it
directly.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_ABSENT = object()


@contextmanager
def without(name: str) -> Iterator[None]:
    """While it holds, `import NAME` raises ImportError; afterwards all is as it was."""
    modules: dict[str, Any] = sys.modules
    before = modules.get(name, _ABSENT)
    modules[name] = None  # how Python marks a module that must not be imported
    try:
        yield
    finally:
        if before is _ABSENT:
            del modules[name]
        else:
            modules[name] = before


with without("asammdf"):
    import can
    import cantools.database

# What goes wrong is said by mrctl in its own words, not a second time by logging's handler of last resort.
for _name in ("can", "cantools"):
    logging.getLogger(_name).addHandler(logging.NullHandler())

__all__ = ["can", "cantools"]
