"""`mrctl effects`: the list, one card, JSON, a new effect, a check."""

from __future__ import annotations

import argparse
import json
import shlex

import pytest

from mrctl.cli import effects as command
from mrctl.cli.main import main
from mrctl.cli.own_effects import try_own_effects
from mrctl.errors import InputError
from mrctl.model.effects import registry


@pytest.fixture(autouse=True)
def anew(monkeypatch):
    monkeypatch.delenv(registry.VARIABLE, raising=False)
    registry.forget()
    yield
    registry.forget()


def mrctl_effects(*words: object) -> int:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(word) for word in words]))


def test_the_list_tells_everything_of_every_effect(capsys):
    assert mrctl_effects() == 0
    text = " ".join(capsys.readouterr().out.split())
    for effect in registry.effects().values():
        assert " ".join(effect.equation.split()) in text
        assert effect.source in text
        assert f"undone: {effect.inverse}" in text
        for parameter in effect.parameters:
            assert f"{parameter.name}: {parameter.help}; {parameter.low:g} to {parameter.high:g}" in text


def test_a_name_shows_its_card_alone(capsys):
    assert mrctl_effects("gas_spring") == 0
    out = capsys.readouterr().out
    assert out.startswith("gas_spring  (rod, needs displacement)")
    assert "fluid_inertia" not in out


def test_json_goes_to_standard_output_alone(capsys):
    assert mrctl_effects("--json", "-") == 0
    cards = json.loads(capsys.readouterr().out)["effects"]
    assert [c["name"] for c in cards] == list(registry.effects())


def test_json_goes_to_a_file_beside_the_list(tmp_path, capsys):
    assert mrctl_effects("current_lag", "--json", tmp_path / "e.json") == 0
    assert "current_lag" in capsys.readouterr().out
    assert json.loads((tmp_path / "e.json").read_text())["effects"][0]["stage"] == "current"


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"there is no effect gravity; there are .*gas_spring"):
        mrctl_effects("gravity")


def test_a_name_with_a_slip_is_answered_with_the_one_that_was_meant():
    with pytest.raises(InputError, match=r"there is no effect gas_sprnig; did you mean gas_spring\?"):
        mrctl_effects("gas_sprnig")


def test_a_new_effect_is_found_and_keeps_its_promises(tmp_path, monkeypatch, capsys):
    path = tmp_path / "bypass_groove.py"
    assert mrctl_effects("--new", "bypass_groove", "-o", path) == 0
    monkeypatch.setenv(registry.VARIABLE, str(path))
    registry.forget()
    assert mrctl_effects("bypass_groove", "--check") == 0
    assert "bypass_groove: keeps its promises" in capsys.readouterr().out


def test_a_broken_promise_is_told_and_makes_the_status_1(tmp_path, monkeypatch, capsys):
    path = tmp_path / "bypass_groove.py"
    mrctl_effects("--new", "bypass_groove", "-o", path)
    path.write_text(path.read_text().replace("return p[0] *", "return 1.0 + p[0] *"))
    monkeypatch.setenv(registry.VARIABLE, str(path))
    registry.forget()
    assert mrctl_effects("bypass_groove", "--check") == 1
    assert "its neutral values change the force" in capsys.readouterr().out
    assert mrctl_effects("bypass_groove", "--check", "--json", "-") == 1
    (shown,) = json.loads(capsys.readouterr().out)["effects"]
    assert shown["broken_promises"] == ["its neutral values change the force"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["gas_spring", "--new", "groove"], "NAME: does nothing beside --new"),
        (["--new", "groove", "--json", "groove.json"], "--json: does nothing beside --new"),
        (["--new", "groove", "--check"], "--check: does nothing beside --new"),
        (["gas_spring", "-o", "spring.txt"], "-o: does nothing without --new; name the effect to write"),
    ],
)
def test_what_would_be_passed_over_is_refused_in_a_line(tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    assert main(["effects", *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"error: {said}")
    assert not list(tmp_path.iterdir())


def test_the_line_to_try_a_new_effect_can_go_into_a_shell_as_it_is(tmp_path, capsys):
    path = tmp_path / "my own $effects.py"
    assert mrctl_effects("--new", "groove", "-o", path) == 0
    line = capsys.readouterr().out.splitlines()[-1].removeprefix("try it:")
    assert shlex.split(line) == [f"{registry.VARIABLE}={path}", "mrctl", "effects", "groove", "--check"]


def test_a_python_keyword_is_called_one(tmp_path):
    with pytest.raises(InputError, match="'if' is a Python keyword; choose another name"):
        mrctl_effects("--new", "if", "-o", tmp_path / "x.py")


@pytest.mark.parametrize("name", ["gas_spring", "Gas", "my effect", "class", "../x", "_x", ""])
def test_a_name_that_cannot_be_is_refused_and_nothing_written(name, tmp_path):
    with pytest.raises(InputError):
        mrctl_effects("--new", name, "-o", tmp_path / "x.py")
    assert not list(tmp_path.iterdir())


def test_a_name_too_long_for_a_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="cannot be written"):
        mrctl_effects("--new", "x" * 300)


@pytest.mark.parametrize(
    ("factor", "said"), [("1.0 / 0.0", "division by zero"), ("float('nan')", "not finite within its bounds")]
)
def test_a_division_by_zero_and_a_nan_are_one_line_with_file_and_effect(
    tmp_path, monkeypatch, capsys, factor, said
):
    path = tmp_path / "groove.py"
    mrctl_effects("--new", "groove", "-o", path)
    path.write_text(path.read_text().replace("return p[0] *", f"return {factor} * p[0] *"))
    monkeypatch.setenv(registry.VARIABLE, str(path))
    registry.forget()
    capsys.readouterr()
    assert mrctl_effects("groove", "--check") == 1
    (line,) = [line for line in capsys.readouterr().out.splitlines() if said in line]
    assert f"{path}: groove: " in line
    with pytest.raises(InputError, match=said) as caught:
        try_own_effects()
    (problem,) = caught.value.problems
    assert (problem.file, problem.what.partition(":")[0]) == (str(path), "groove")


def test_a_sound_effect_of_ones_own_passes_the_trial_before_a_fit(tmp_path, monkeypatch):
    path = tmp_path / "groove.py"
    mrctl_effects("--new", "groove", "-o", path)
    monkeypatch.setenv(registry.VARIABLE, str(path))
    registry.forget()
    try_own_effects()


def test_no_file_is_overwritten(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("precious")
    with pytest.raises(InputError, match="already there"):
        mrctl_effects("--new", "mine", "-o", path)
    assert path.read_text() == "precious"


def test_help_shows_an_example():
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    assert "mrctl effects --new" in " ".join(parser.format_help().split())  # wherever its lines end
