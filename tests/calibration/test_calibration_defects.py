"""Every kind of defect in a calibration, made in a copy of the shipped one: the line and the mend it gets."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.calibration import load_calibration
from mrctl.errors import InputError
from mrctl.model.effects import registry
from mrctl.share_path import share_file

TEXT = share_file("config/calibration.yaml").read_text()


def broken(old, new, text=TEXT):
    """The file with one place changed."""
    assert text.count(old) >= 1, old
    return text.replace(old, new, 1)


def line_of(text, marker, after=""):
    """The number of the first line that holds the marker, behind the one that holds `after`."""
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(after)) if after else 0
    return next(i for i, line in enumerate(lines[start:], start=start + 1) if marker in line)


def complaints(text, tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_calibration(path)
    return [(p.line, f"{p.what}; {p.mend}") for p in error.value.problems]


def block(name):
    """The text of a top-level block."""
    return re.search(rf"^{name}:.*?(?=^\S|\Z)", TEXT, re.DOTALL | re.MULTILINE)[0]


DEFECTS = {
    # name: (old, new, marker of the line, block that the line is in, what is said)
    "unsorted knots": (
        "[0.0, 0.25, 0.5,", "[0.0, 0.5, 0.25,", "values", "f:",
        "`f.current`: 0.25 after 0.5 is out of order; sort the rows by current, upwards",
    ),
    "duplicate knots": (
        "[0.0, 0.25, 0.5,", "[0.0, 0.5, 0.5,", "values", "f:",
        "`f.current`: 0.5 stands twice; keep one of the two rows",
    ),
    "unsorted velocities": (
        "-0.381, -0.37,", "-0.37, -0.381,", "values", "g:",
        "`g.velocity`: -0.381 after -0.37 is out of order; sort the rows by velocity, upwards",
    ),
    "unsorted temperatures": (
        "[28.88888888888889,", "[99.0,", "values", "  temperature:",
        "`h.temperature`: 36.1111 after 99 is out of order; sort the rows by temperature, upwards",
    ),
    "f not increasing": (
        "[290.0, 530.0, 760.0", "[290.0, 530.0, 530.0", "values", "  force:",
        "`f.force` does not increase: 530 N after 530 N; the inverse needs a force that grows",
    ),
    "f not positive": (
        "[290.0, 530.0", "[0.0, 530.0", "values", "  force:",
        "`f.force` is 0 N; f is the force at full shape and must be greater than 0, at 0 A too",
    ),
    "f without 0 A": (
        "[0.0, 0.25, 0.5,", "[0.1, 0.25, 0.5,", "values", "f:",
        "`f` starts at 0.1 A; add the force without current, at 0 A",
    ),
    "lengths differ": (
        "[290.0, 530.0, 760.0", "[290.0, 760.0", "values", "  force:",
        "`f.force` has 8 values, `current` has 9; give one value a row",
    ),
    "std of another length": (
        "1830.0, 2000.0]\n", "1830.0, 2000.0]\n    std: [1.0]\n", "std", "  force:",
        "`f.force.std` has 1 values for 9; give one standard deviation a value, or leave out std",
    ),
    "g beyond 1": (
        "[-1.0, -0.997956", "[-1.1, -0.997956", "values", "  shape:",
        "`g.shape` is -1.1; g lies in -1 to 1: divide it by its largest magnitude and multiply f by that",
    ),
    "g of the wrong sign": (
        "[-1.0, -0.997956", "[1.0, -0.997956", "values", "  shape:",
        "`g.shape` is 1 at -0.381 m/s; g has the velocity's sign",
    ),
    "g not zero at rest": (
        "-0.046886, 0.0, 0.046886", "-0.046886, 0.01, 0.046886", "shape", "  shape:",
        "`g.shape` is 0.01 at 0 m/s; g must be 0 there: add the row 0 m/s, 0",
    ),
    "h not positive": (
        "0.6746, 0.655]", "0.6746, -0.655]", "0.655", "  'off':",
        "`h.off` is -0.655; h is a ratio to the nominal force and must be greater than 0",
    ),
    "h states swapped": (
        "off_below: {unit: A, value: 0.0}", "off_below: {unit: A, value: 1.5}", "on_above", "h:",
        "`h.on_above` (1 A) is below `h.off_below` (1.5 A); the off state ends before the on state begins",
    ),
    "off below a negative current": (
        "off_below: {unit: A, value: 0.0}", "off_below: {unit: A, value: -0.5}", "off_below", "h:",
        "`h.off_below` is -0.5 A; currents are 0 A or more",
    ),
    "force falls from off to on": (
        "'on':\n    unit: '1'\n    values: [1.0,", "'on':\n    unit: '1'\n    values: [0.1,", "'on'", "h:",
        "from off to on the force does not increase with the current at every temperature; lift `h.on`",
    ),
    "forward filter as printed": (
        "[1.0, -2.738, 2.4986, -0.7604]", "[1.0, -2.738, 0.0, -0.7604]", "denominator", "forward_filter",
        "pole of magnitude 2.833 lies not inside the unit circle; is its coefficient of z^1 lost? 2.4986",
    ),
    "inverse filter as printed": (
        "-0.02936151961675184]", "0.02936151961675184]", "numerator", "inverse_filter",
        "`inverse_filter` has the DC gain 0.7625, not 1; is the sign of 0.0293615 right? with -0.0293",
    ),
    "DC gain": (
        "[0.0, 0.2166, -0.4128, 0.1964]", "[0.0, 0.2166, -0.4128, 0.19641]", "numerator", "forward_filter",
        "`forward_filter` has the DC gain 1.05, not 1; scale its numerator, so that f alone sets the force",
    ),
    "filter that needs the future": (
        "[1.0, -2.738, 2.4986, -0.7604]", "[1.0, -0.5]", "forward_filter", "forward_filter",
        "`forward_filter`: the numerator is longer than the denominator",
    ),
    "denominator that starts with zero": (
        "[1.0, -2.738, 2.4986, -0.7604]", "[0.0, -2.738, 2.4986, -0.7604]", "forward_filter",
        "forward_filter",
        "`forward_filter`: the denominator has at most 4 coefficients and a non-zero first one",
    ),
    "denominator that starts with next to nothing": (
        "[1.0, -2.738, 2.4986, -0.7604]", "[1.0e-320, -2.738, 2.4986, -0.7604]", "denominator",
        "forward_filter", "the first denominator coefficient is too small to divide by; scale",
    ),
    "filter of too high an order": (
        "[1.0, -2.738, 2.4986, -0.7604]", "[1.0, 0.1, -2.738, 2.4986, -0.7604]", "forward_filter",
        "forward_filter", "the denominator has at most 4 coefficients",
    ),
    "filter that no loop rate can take": (
        "forward_filter:\n  sample_rate: {unit: Hz, value: 2000.0}",
        "forward_filter:\n  sample_rate: {unit: Hz, value: 50.0}", "sample_rate", "forward_filter",
        "`forward_filter` cannot be carried from 50 to 500 Hz",
    ),
    "NaN": (
        "[290.0, 530.0", "[290.0, .nan", "values", "  force:",
        "`f.force.values[1]` is nan; a finite number is wanted: measure it, or leave out that row",
    ),
    "infinity": (
        "1830.0, 2000.0]", "1830.0, .inf]", "values", "  force:",
        "`f.force.values[8]` is inf; a finite number",
    ),
    "1e-3 read as text": (
        "[0.0, 0.25, 0.5,", "[0.0, 25e-2, 0.5,", "values", "f:",
        "YAML reads 25e-2 as text, not as a number; write 25.0e-2",
    ),
    "a number with its unit": (
        "value: 400.0", "value: 400 A/s", "current_slew", "limits:",
        "`limits.current_slew.value` is the text '400 A/s'; write the number alone: 400; its unit is fixed",
    ),
    "a quoted number": (
        "value: 400.0", "value: '400.0'", "current_slew", "limits:", "write it without the quotation marks",
    ),
    "a truth value for a number": (
        "value: 400.0", "value: yes", "current_slew", "limits:",
        "`limits.current_slew.value`: YAML reads yes as true; a number is wanted",
    ),
    "a truth value for a name": (
        "name: MagneRide-like damper", "name: on", "name", "name",
        "`name`: YAML reads on as true; quote it if text is meant: 'on'",
    ),
    "a number for a name": (
        "name: MagneRide-like damper", "name: 17", "name", "name",
        "`name`: YAML reads 17 as a number; quote it if text is meant: '17'",
    ),
    "a clock time for a number": (
        "value: 400.0", "value: 6:40", "current_slew", "limits:", "YAML reads 6:40 as a number to base 60",
    ),
    "a scalar for a list": (
        "values: [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0]", "values: 3.0", "values", "f:",
        "`f.current.values` is 3.0; a list is wanted: [1.0, 2.0, …]",
    ),
    "an empty list": (
        "values: [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0]", "values: []", "values", "f:",
        "`f.current.values` has too few entries; at least 1 are needed",
    ),
    "an empty value": (
        "value: 400.0", "value: ", "current_slew", "limits:",
        "`limits.current_slew.value` is empty; a number is wanted",
    ),
    "mm/s": (
        "unit: m/s\n", "unit: mm/s\n", "unit", "g:",
        "`g.velocity.unit` is 'mm/s'; divide the values by 1000 and write unit: m/s",
    ),
    "degF": (
        "unit: degC\n", "unit: degF\n", "unit", "  temperature:",
        "`h.temperature.unit` is 'degF'; subtract 32 and multiply by 5/9 and write unit: degC",
    ),
    "kN": ("unit: N\n", "unit: kN\n", "unit", "  force:", "multiply the values by 1000 and write unit: N"),
    "an unknown unit": (
        "unit: N\n", "unit: dyn\n", "unit", "  force:", "convert the values and write unit: N",
    ),
    "a unit that is a number": (
        "unit: '1'\n", "unit: 1\n", "unit", "  shape:", '`g.shape.unit` is 1; write unit: "1"',
    ),
    "duplicate key": (
        "limits:\n", "limits:\n  current_max: {unit: A, value: 2.0}\n", "value: 3.0", "limits:",
        "`current_max` stands twice, here and in line",
    ),
    "a block that is missing": (
        block("g"), "", "schema", "schema",
        "`g` is missing; add `g`: shape of the force against relative velocity, -1 to 1",
    ),
    "a key that is missing": (
        "  current_slew: {unit: A/s, value: 400.0}\n", "", "limits:", "limits:",
        "`limits.current_slew` is missing; add `current_slew`",
    ),
    "a key misspelt": (
        "refine_cutoff:", "refine_cutof:", "refine_cutof", "inverse_filter:",
        "unknown key `inverse_filter.refine_cutof`; did you mean `refine_cutoff`?",
    ),
    "a key of no use": (
        "limits:\n", "limits:\n  colour: red\n", "colour", "limits:",
        "unknown key `limits.colour`; remove it; known here: current_max, current_slew",
    ),
    "a newer schema": (
        "mrctl/calibration/1", "mrctl/calibration/2", "schema", "schema",
        "which reads up to mrctl/calibration/1; the file was written by a newer mrctl: update mrctl",
    ),
    "another kind of file": (
        "mrctl/calibration/1", "mrctl/config/1", "schema", "schema",
        "schema 'mrctl/config/1' is not that of a calibration; write `schema: mrctl/calibration/1`",
    ),
    "no schema": (
        "schema: mrctl/calibration/1\n", "", "name", "name",
        "`schema` is missing; begin the file with `schema: mrctl/calibration/1`",
    ),
    "a current limit of zero": (
        "current_max: {unit: A, value: 3.0}", "current_max: {unit: A, value: 0.0}", "current_max", "limits:",
        "`limits.current_max` is 0 A; it must be greater than 0",
    ),
    "a negative slew": (
        "value: 400.0", "value: -400.0", "current_slew", "limits:",
        "`limits.current_slew` is -400 A/s; it must be greater than 0",
    ),
    "a current limit beyond f": (
        "current_max: {unit: A, value: 3.0}", "current_max: {unit: A, value: 5.0}", "current_max", "limits:",
        "`limits.current_max` (5 A) lies beyond `f`, which ends at 3 A; lower it, or add rows to f",
    ),
    "validity beyond the tables": (
        "from: -0.381, to: 0.381", "from: -0.381, to: 2.0", "velocity", "valid:",
        "`valid.velocity` (-0.381 to 2) leaves its table (-0.381 to 0.381); narrow it, or measure",
    ),
    "validity the wrong way round": (
        "from: -0.381, to: 0.381", "from: 0.381, to: -0.381", "velocity", "valid:",
        "`valid.velocity` goes from 0.381 to -0.381; `from` must be less than `to`",
    ),
    "an unknown effect": (
        "\neffects: []\n", "\neffects: [{name: gas_sprng, parameters: {}}]\n", "effects", "effects: ",
        "unknown effect 'gas_sprng'; did you mean gas_spring?",
    ),
    "a sample rate of zero": (
        "sample_rate: {unit: Hz, value: 2000.0}", "sample_rate: {unit: Hz, value: 0.0}", "sample_rate",
        "forward_filter", "`forward_filter.sample_rate.value` is 0.0; it must be greater than 0",
    ),
    "a hash that is none": (
        "  history:", "  data_sha256: abc\n  history:", "data_sha256", "provenance",
        "`provenance.data_sha256` is 'abc'; 64 hexadecimal digits",
    ),
    "a negative deviation": (
        "1830.0, 2000.0]\n", "1830.0, 2000.0]\n    std: [1, 1, 1, 1, -1, 1, 1, 1, 1]\n", "std", "  force:",
        "`f.force.std[4]` is -1; it must be at least 0",
    ),
}  # fmt: skip


@pytest.mark.parametrize("defect", DEFECTS)
def test_each_defect_gets_its_line_and_its_mend(defect, tmp_path):
    old, new, marker, after, said = DEFECTS[defect]
    text = broken(old, new)
    found = complaints(text, tmp_path)
    assert (line_of(text, marker, after), said) in [
        (line, what[: len(said)] if what.startswith(said) else (said if said in what else what))
        for line, what in found
    ], found


# These cannot help drawing others along.
FOLLOWED = {
    "unsorted temperatures": 1,  # the range of validity leaves the table
    "f without 0 A": 1,  # ditto
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_one_defect_is_one_complaint(defect, tmp_path):
    old, new, *_ = DEFECTS[defect]
    found = complaints(broken(old, new), tmp_path)
    assert len(found) <= 1 + FOLLOWED.get(defect, 0), found


OFFSET = "  - {name: force_offset, parameters: {offset_n: {value: 1, unit: N}}}\n"
EFFECT = """
effects:
  - name: gas_spring
    parameters:
      preload_n: {value: 80.0, unit: N}
      stiffness_n_m: {value: 12000.0, unit: N/m}
      progression_per_m: {value: 0.0, unit: 1/m}
"""


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("gas_spring", "anti_gravity", 3, "unknown effect 'anti_gravity'; there are: "),
        ("      preload_n: {value: 80.0, unit: N}\n", "", 4, "gas_spring lacks `preload_n`"),
        ("preload_n", "preload", 5, "gas_spring has no `preload`; it has: preload_n"),
        ("unit: N/m", "unit: N/mm", 6, "stiffness_n_m is in 'N/mm'; convert the value and write unit: N/m"),
        ("12000.0", "-1.0", 6, "gas_spring.stiffness_n_m is -1 N/m; it lies in "),
        ("12000.0", ".nan", 6, "`effects[0].parameters.stiffness_n_m.value` is nan"),
        ("12000.0, unit: N/m", "12000.0", 6, "`effects[0].parameters.stiffness_n_m.unit` is missing"),
        ("\neffects:", f"\neffects:\n{OFFSET}{OFFSET}".rstrip(), 4, "force_offset stands twice"),
    ],
)  # fmt: skip
def test_each_defect_of_an_effect_gets_its_line_and_its_mend(old, new, line, said, tmp_path):
    start = TEXT[: TEXT.index("\neffects:")]
    above = start.count("\n")
    found = complaints(start + broken(old, new, EFFECT), tmp_path)
    assert (above + line, True) in [(at, said in what) for at, what in found], found


def test_a_bridge_s_damper_has_effects_of_its_size(tmp_path):
    start = TEXT[: TEXT.index("\neffects:")]
    (tmp_path / "bridge.yaml").write_text(start + EFFECT.replace("80.0", "69969.2"))
    load_calibration(tmp_path / "bridge.yaml")
    assert complaints(start + EFFECT.replace("80.0", "7e8"), tmp_path)


def test_a_broken_plug_in_is_told_only_where_effects_are_used(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text("EFFECT = 1 / 0\n")
    monkeypatch.setenv("MRCTL_EFFECTS", str(tmp_path / "mine.py"))
    registry.forget()
    try:
        (tmp_path / "plain.yaml").write_text(TEXT)
        load_calibration(tmp_path / "plain.yaml")
        (found,) = complaints(broken("\neffects: []\n", EFFECT), tmp_path)
        assert "the effect cannot be loaded" in found[1]
    finally:
        monkeypatch.undo()
        registry.forget()


def test_all_defects_of_a_file_come_at_once(tmp_path):
    text = TEXT
    for old, new in (
        ("[0.0, 0.25, 0.5,", "[0.0, 0.5, 0.25,"),  # f: unsorted
        (block("g"), ""),  # missing
        ("value: 400.0", "value: 4e2"),  # text
        ("[1.0, -2.738, 2.4986, -0.7604]", "[1.0, -2.738, 0.0, -0.7604]"),  # unstable
        ("unit: degC\n", "unit: K\n"),
        ("mrctl/calibration/1", "mrctl/calibration/1\nname: twice"),
    ):
        text = broken(old, new, text)
    found = complaints(text, tmp_path)
    said = " | ".join(what for _, what in found)
    for part in (
        "out of order",
        "`g` is missing",
        "write 4.0e+2",
        "unstable",
        "subtract 273.15",
        "stands twice",
    ):
        assert part in said
    assert len(found) == 6, found
    assert [line for line, _ in found] == sorted(line for line, _ in found)


def test_a_poor_cascade_is_a_warning_with_its_line(tmp_path):
    path = tmp_path / "c.yaml"
    old = re.search(r"(?<=inverse_filter:\n).*?(?=  refine_cutoff)", TEXT, re.DOTALL)[0]
    text = broken(
        old,
        "  sample_rate: {unit: Hz, value: 2000.0}\n  numerator: [0.005]\n  denominator: [1.0, -0.995]\n",
    )
    path.write_text(text)
    (warning,) = load_calibration(path).warnings
    assert warning.line == line_of(text, "inverse_filter:", "inverse_filter:")
    assert "forward times inverse filter is off by" in str(warning)


def test_a_shape_that_stays_below_one_is_a_warning(tmp_path):
    path = tmp_path / "c.yaml"
    halves = re.sub(
        r"(?<=  shape:\n    unit: '1'\n    values: \[).*?(?=\])",
        lambda m: re.sub(r"-?\d+\.\d+", lambda n: str(float(n[0]) / 2), m[0]),
        TEXT,
        flags=re.DOTALL,
    )
    path.write_text(halves)
    (warning,) = load_calibration(path).warnings
    assert "`g.shape` reaches 0.5 only" in str(warning)


TOKENS = [
    "0", "-1", "1e-3", ".nan", ".inf", "1.0e+308", "1.0e-320", "9" * 30, "yes", "~", "[]", "{}", "''",
    "12:30", "010", "&a", "*a", "<<", "!x", "?", "|", ">", "\t", "---", "...", ":", ",", "]", "}", "#",
    "\u2028", "é",
]  # fmt: skip


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_however_a_file_is_mutilated_nothing_but_an_input_error_comes_out(seed, tmp_path_factory):
    rng = random.Random(seed)
    text = TEXT
    for _ in range(rng.randint(1, 6)):
        kind = rng.randrange(5)
        i = rng.randrange(len(text))
        j = min(len(text), i + rng.choice([1, 3, 20, 300]))
        if kind == 0:
            text = text[:i] + text[j:]
        elif kind == 1:
            text = text[:i] + rng.choice(TOKENS) + text[i:]
        elif kind == 2:
            text = text[:i] + text[i:j] + text[i:]
        elif kind == 3:
            numbers = list(re.finditer(r"-?\d+\.\d+", text))
            if numbers:
                m = rng.choice(numbers)
                text = text[: m.start()] + rng.choice(TOKENS) + text[m.end() :]
        else:
            lines = text.splitlines(keepends=True)
            k = rng.randrange(len(lines))
            lines[k] = " " * rng.randrange(5) + lines[k].lstrip()
            text = "".join(lines)
    path = tmp_path_factory.mktemp("fuzz") / "c.yaml"
    path.write_text(text, encoding="utf-8")
    try:
        damper = load_calibration(path).damper
    except InputError as error:
        problems = error.problems
    else:
        problems = ()
        assert damper.forward_filter.is_stable()
    assert all("\n" not in str(problem) for problem in problems)
