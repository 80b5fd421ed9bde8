"""Builds the tick and the reading of logs as machine code: an option of the build, off by default.

    HATCH_BUILD_HOOK_ENABLE_CUSTOM=true pip install .     a wheel with machine code; needs a C compiler
    python hatch_build.py FOLDER                          the machine code alone, for FOLDER on PYTHONPATH

mypyc compiles the same files that the interpreter runs. They are in the wheel too, and run wherever the
machine code does not fit: nothing else changes, and every byte that is sent is the same.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent
# Not here: what numba compiles at the desk (tables, filters, effects), and what runs once at the start.
MODULES = (
    "can/e2e",
    "can/reader",
    "control/anticipation",
    "control/base",
    "control/body_velocity",
    "control/external",
    "control/groundhook",
    "control/passive",
    "control/semi_active",
    "control/skyhook",
    "model/inverse",
    "model/pipeline",
    "model/running",
    "model/static_inverse",
    "replay/candump",
    "replay/clocks",
    "replay/differences",
    "replay/player",
    "replay/source",
    "runtime/channel",
    "runtime/corner",
    "runtime/guard",
    "runtime/outgoing",
    "runtime/receiver",
    "runtime/tick",
)
# Types of other libraries matter to none of these modules: what the build environment lacks is not needed,
# and what it has is not read.
MYPY = """
[mypy]
ignore_missing_imports = true
follow_imports = silent
[mypy-can.*,cantools.*,numba.*,numpy.*,scipy.*,structlog.*,yaml.*]
follow_imports = skip
follow_imports_for_stubs = true
"""


def build(folder: Path) -> None:
    """Compile into `folder`, as a tree to be laid over the package. Raises SystemExit where it fails."""
    from mypyc.build import mypycify  # noqa: PLC0415  # only where this is asked for
    from setuptools import Distribution  # type: ignore[import-untyped]  # noqa: PLC0415  # as above
    from setuptools.command.build_ext import build_ext  # type: ignore[import-untyped]  # noqa: PLC0415  # as above

    folder.mkdir(parents=True, exist_ok=True)
    folder = folder.resolve()
    os.chdir(ROOT)
    with tempfile.TemporaryDirectory() as work:
        config = Path(work, "mypy.ini")
        config.write_text(MYPY, encoding="ascii")
        sources = [f"mrctl/{module}.py" for module in MODULES]
        extensions = mypycify(
            [f"--config-file={config}", f"--cache-dir={work}/cache", *sources],
            opt_level="3",
            debug_level="0",
            group_name="mrctl",
            target_dir=work,
        )
        for extension in extensions:
            # a * b + c rounds twice, as in the interpreter; and a compiler's new warning is no error.
            flags = [flag for flag in extension.extra_compile_args if flag != "-Werror"]
            extension.extra_compile_args = [*flags, "-ffp-contract=off"]
        command = build_ext(Distribution({"name": "mrctl", "ext_modules": extensions}))
        command.build_lib, command.build_temp = str(folder), f"{work}/objects"
        command.ensure_finalized()
        command.run()


try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # run as a script
    pass
else:

    class CompiledBuildHook(BuildHookInterface[Any]):
        """Adds the machine code to a wheel."""

        PLUGIN_NAME = "custom"

        def initialize(self, version: str, build_data: dict[str, Any]) -> None:
            """Compile, and tell hatchling."""
            if version == "editable":  # works on the files themselves
                return
            self._folder = tempfile.TemporaryDirectory()
            # A process of its own: mypyc and setuptools change folders and settings of theirs.
            words = [sys.executable, __file__, self._folder.name]
            if subprocess.run(words, check=False).returncode:  # noqa: S603  # this file
                sys.exit("error: the tick cannot be compiled, see above; a plain build needs no compiler")
            place = Path(self._folder.name)
            for file in sorted(place.rglob("*.so")):
                build_data["force_include"][str(file)] = str(file.relative_to(place))
            build_data["pure_python"] = False
            build_data["infer_tag"] = True

        def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002  # hatchling's
            """Clean up."""
            if version != "editable":
                self._folder.cleanup()


if __name__ == "__main__":
    build(Path(sys.argv[1]))
