from __future__ import annotations

import importlib.util
import json
import pkgutil
import subprocess
import sys

import mrctl.can

HEAVY = {"pandas", "asammdf", "scipy", "matplotlib", "numba", "lxml"}


def _loaded_by(code: str) -> set[str]:
    script = (
        f"import json, sys\n{code}\nprint(json.dumps([name for name in sys.modules if sys.modules[name]]))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


def test_the_whole_can_room_loads_no_desk_library() -> None:
    assert importlib.util.find_spec("asammdf") is not None, "without asammdf this test shows nothing"
    modules = [f"mrctl.can.{module.name}" for module in pkgutil.iter_modules(mrctl.can.__path__)]
    assert len(modules) > 5
    loaded = _loaded_by("import " + ", ".join(modules))
    assert {"can", "cantools"} <= loaded
    assert not HEAVY & loaded


def test_asammdf_can_be_imported_afterwards() -> None:
    assert "asammdf" in _loaded_by("import mrctl.can.quiet_import\nimport asammdf")


def test_a_module_that_was_there_before_is_there_afterwards() -> None:
    code = "import types\nmdf = sys.modules['asammdf'] = types.ModuleType('asammdf')\n"
    code += "import mrctl.can.quiet_import\nassert sys.modules['asammdf'] is mdf"
    assert "asammdf" in _loaded_by(code)
