"""Effects from outside: a file, a folder, an installed plug-in; and what is said of a broken one."""

from __future__ import annotations

import importlib
import sys

import pytest
from conftest import make_damper

from mrctl.cli.effect_template import template
from mrctl.errors import InputError
from mrctl.model.effects import registry
from mrctl.simulate.promises import broken_promises


@pytest.fixture(autouse=True)
def anew(monkeypatch):
    """No stranger's effect stays behind."""
    monkeypatch.delenv(registry.VARIABLE, raising=False)
    registry.forget()
    yield
    registry.forget()
    for name in [n for n in sys.modules if n.startswith(("mrctl_effect_", "someones_"))]:
        del sys.modules[name]


def put(folder, name, text):
    path = folder / f"{name}.py"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_that_the_environment_names_is_an_effect(tmp_path, monkeypatch):
    monkeypatch.setenv(registry.VARIABLE, str(put(tmp_path, "cubic", template("cubic"))))
    assert "cubic" in registry.effects()


def test_every_file_of_a_folder_that_the_environment_names_is_an_effect(tmp_path, monkeypatch):
    put(tmp_path, "one", template("one"))
    put(tmp_path, "two", template("two"))
    monkeypatch.setenv(registry.VARIABLE, str(tmp_path))
    assert {"one", "two"} <= set(registry.effects())


def test_what_begins_with_an_underscore_in_a_folder_is_no_effect(tmp_path, monkeypatch):
    put(tmp_path, "__init__", "")
    put(tmp_path, "_valves", "AREA_M2 = 1e-4\n")
    put(tmp_path, "cubic", template("cubic"))
    monkeypatch.setenv(registry.VARIABLE, str(tmp_path))
    assert "cubic" in registry.effects()


def test_a_generated_effect_keeps_every_promise_as_it_is(tmp_path):
    assert broken_promises(registry.load_file(put(tmp_path, "cubic", template("cubic"))), make_damper()) == []


def test_an_installed_plug_in_is_an_effect_and_keeps_its_promises(tmp_path, monkeypatch):
    put(tmp_path, "someones_effect", template("someones_effect"))
    info = tmp_path / "someones-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: someones\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[mrctl.effects]\nsomeones_effect = someones_effect\n")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.invalidate_caches()
    assert broken_promises(registry.effect("someones_effect"), make_damper()) == []


def test_an_edited_effect_is_compiled_anew(tmp_path):
    text = template("cubic")
    first = registry.load_file(put(tmp_path, "cubic", text))
    assert broken_promises(first, make_damper()) == []
    again = registry.load_file(put(tmp_path, "cubic", text.replace("return p[0] *", "return 2.0 * p[0] *")))
    assert broken_promises(again, make_damper()) == []  # among them: compiled as in plain Python


@pytest.mark.parametrize(
    ("damage", "said", "line"),
    [
        (("def step(", "def step(("), "SyntaxError", True),
        (("from mrctl.model.effects.base", "from mrctl.model.effects.bass"), "ModuleNotFoundError", True),
        (("    stage=Stage.ADDITIVE,\n", ""), "stage", True),
        (("EFFECT = Effect(", "OTHER = Effect("), "holds no EFFECT", False),
        (("    dt_s,\n):", "):"), "its stage hands it", False),
        (
            ("        Parameter(\n", "        Parameter(\n            scale=1 / 0,\n"),
            "ZeroDivisionError",
            True,
        ),
        (('unit="N*s^3/m^3"', 'unit=""'), "lacks its unit", False),
        (("high=1e5", "high=-1.0"), "bounds", False),
        (("Undo.SUBTRACT", "Undo.DIVIDE"), "not undone by divide", False),
        (("        ),\n    ),\n", "        )\n    ),\n"), "missing behind it: (Parameter(...),)", False),
        (("frozenset(),", '"displacement",'), 'write frozenset({"displacement"})', False),
        (('frozenset({"velocity"})', '{"velocity"}'), 'write frozenset({"velocity"})', False),
        (("N*s^3/m^3", "N^0.5*s"), "has the unit N^0.5*s; write N, kg, J and W in whole powers", False),
        (("Stage.ADDITIVE,", '"additive",'), "take one of Stage.CURRENT, ", False),
        (("low=0.0", 'low="0"'), "has the low '0'; make it a number", False),
        (("step=step", "step=max"), "step is a builtin_function_or_method, not a plain", False),
        (("step=step", "step=step,\n    states=('force')"), 'behind it: ("...",)', False),
        (("step=step", "step=step,\n    guesses=[(1.0,)]"), "guesses is a list, not a plain function", False),
        (("step=step", "step=step,\n    rank='first'"), "rank is a str; make it a whole number", False),
    ],
)
def test_a_broken_file_is_named_with_what_is_wrong(tmp_path, monkeypatch, damage, said, line):
    path = put(tmp_path, "cubic", template("cubic").replace(*damage))
    monkeypatch.setenv(registry.VARIABLE, str(path))
    with pytest.raises(InputError) as caught:
        registry.effects()
    (problem,) = caught.value.problems
    assert problem.file == str(path)
    assert said in problem.what
    assert len(str(caught.value).splitlines()) == 1
    assert (problem.line is not None) == line


def test_what_looking_through_a_description_raises_is_told_with_the_file(tmp_path, monkeypatch):
    def stumble(_):
        raise TypeError("unhashable")

    monkeypatch.setattr(registry, "faults", stumble)
    path = put(tmp_path, "cubic", template("cubic"))
    with pytest.raises(InputError, match=r"cubic\.py.*cannot be loaded \(TypeError: unhashable\)"):
        registry.load_file(path)


def test_all_broken_files_are_named_at_once(tmp_path, monkeypatch):
    put(tmp_path, "one", "EFFECT = 1\n")
    put(tmp_path, "two", "nonsense(\n")
    monkeypatch.setenv(registry.VARIABLE, str(tmp_path))
    with pytest.raises(InputError) as caught:
        registry.effects()
    assert len(caught.value.problems) == 2


def test_a_name_that_is_taken_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv(registry.VARIABLE, str(put(tmp_path, "mine", template("gas_spring"))))
    with pytest.raises(InputError, match="already there"):
        registry.effects()


def test_a_file_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv(registry.VARIABLE, str(tmp_path / "none.py"))
    with pytest.raises(InputError, match=r"none\.py: there is no such file"):
        registry.effects()


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (("return p[0] *", "return 1.0 + p[0] *"), "neutral"),
        (("return p[0] *", "return 0.0 * p[0] *"), "do not change"),
        (("return p[0] *", "return 1e308 * p[0] * 1e10 *"), "finite"),
        (("return p[0] *", "return eval('1.0') * p[0] *"), "cannot be compiled"),
        (("return p[0] *", "import math; return p[0] *"), "cannot be compiled"),
        (("return p[0] *", "s[0] = s[0] + dt_s; return p[0] *"), "a state is made by `start`"),
        (("return p[0] *", "return p[0] / velocity_m_s *"), "division by zero"),
        (("return p[0] *", "return p[0] * displacement_m *"), "`needs` does not name"),
        (("return p[0] *", "return p[0] * velocty_m_s *"), "'velocty_m_s' is not defined"),
    ],
)
def test_a_broken_promise_is_told(tmp_path, damage, said):
    effect = registry.load_file(put(tmp_path, "cubic", template("cubic").replace(*damage)))
    assert any(said in what for what in broken_promises(effect, make_damper()))


def test_where_a_step_fails_is_told_with_its_line(tmp_path):
    text = template("cubic").replace("return p[0] *", "return p[0] / velocity_m_s *")
    line = next(n for n, one in enumerate(text.splitlines(), 1) if "/ velocity_m_s" in one)
    (said,) = broken_promises(registry.load_file(put(tmp_path, "cubic", text)), make_damper())
    assert f"line {line}: float division by zero" in said
