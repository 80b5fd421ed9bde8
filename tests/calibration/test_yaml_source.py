"""Reading YAML: line marks, and the traps of YAML 1.1 named instead of fallen into."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.errors import InputError
from mrctl.yaml_source import Findings, parse_document, read_document


def slips(text):
    """What reading says of a text: lines `LINE: what; mend`."""
    raw = text if isinstance(text, bytes) else text.encode()
    try:
        findings = Findings(parse_document(raw, "x.yaml"))
        findings.raise_if_any()
    except InputError as error:
        return [str(problem).removeprefix("x.yaml:") for problem in error.problems]
    return []


def only(text):
    found = slips(text)
    assert len(found) == 1, found
    return found[0]


def test_plain_data_comes_with_the_line_of_every_value():
    document = parse_document(b"a: 1\nb:\n  c: [1.5,\n    x]\n  d: null\n", "x.yaml")
    assert document.data == {"a": 1, "b": {"c": [1.5, "x"], "d": None}}
    assert [document.line(p) for p in (("a",), ("b", "c"), ("b", "c", 0), ("b", "c", 1), ("b", "d"))] == [
        1, 3, 3, 4, 5,
    ]  # fmt: skip
    assert document.line(("b", "gone", "deeper")) == 2


def test_a_duplicate_key_names_both_lines():
    assert only("a: 1\nb: 2\na: 3\n") == "3: `a` stands twice, here and in line 1; keep one of the two"


def test_all_slips_come_at_once_in_the_order_of_lines():
    found = slips("a: 1e-3\nb: 12:30\na: 1\nc: 010\n")
    assert [line.split(":")[0] for line in found] == ["1", "2", "3", "4"]


@pytest.mark.parametrize(
    ("written", "mended"),
    [
        ("1e-3", "1.0e-3"), ("-2E5", "-2.0e+5"), ("1.5e3", "1.5e+3"), ("+1e+2", "+1.0e+2"), (".5e3", ".5e+3"),
    ],
)  # fmt: skip
def test_an_exponent_that_yaml_takes_for_text_is_mended(written, mended):
    assert only(f"a: {written}") == (
        f"1: YAML reads {written} as text, not as a number; write {mended} (or quote it if text is meant)"
    )
    document = parse_document(f"a: {mended}".encode(), "x.yaml")
    assert document.data["a"] == pytest.approx(float(written))
    assert document.slips == ()


def test_a_quoted_exponent_is_text():
    assert parse_document(b"a: '1e-3'", "x").data == {"a": "1e-3"}


@pytest.mark.parametrize("written", ["12:30", "1:30:00", "-1:05.5", "190:20:30"])
def test_a_number_to_base_sixty_is_refused(written):
    assert only(f"a: {written}").startswith(
        f"1: YAML reads {written} as a number to base 60; write the plain"
    )


@pytest.mark.parametrize("written", ["010", "-017", "0_7"])
def test_an_octal_number_is_refused(written):
    assert only(f"a: {written}").startswith(f"1: YAML reads {written} as an octal number")


def test_keys_are_text_whatever_yaml_takes_them_for():
    document = parse_document(b"on: 1\noff: 2\nyes: 3\n12: 4\n1.5: 5\nnull: 6\n", "x")
    assert list(document.data) == ["on", "off", "yes", "12", "1.5", "null"]
    assert document.slips == ()


def test_truth_values_keep_the_word_they_were_written_with():
    document = parse_document(b"a: on\nb: No\nc: true\n", "x")
    assert document.data == {"a": True, "b": False, "c": True}
    assert document.words["b",] == "No"


def test_a_date_is_text():
    assert parse_document(b"a: 2025-01-31\n", "x").data == {"a": "2025-01-31"}


def test_anchors_aliases_and_merge_keys_work():
    document = parse_document(b"a: &x {p: 1, q: 2}\nb: *x\nc:\n  <<: *x\n  q: 3\n", "x")
    assert document.data == {"a": {"p": 1, "q": 2}, "b": {"p": 1, "q": 2}, "c": {"q": 3, "p": 1}}
    assert document.line(("c", "p")) == 1
    assert document.line(("c", "q")) == 5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "1: the file is empty; begin it with"),
        (b"# only a comment\n", "1: the file is empty"),
        (b"- a\n- b\n", "1: the file is not a mapping; write `key: value` lines"),
        (b"just words\n", "1: the file is not a mapping"),
        (b"a: 1\n---\nb: 2\n", "2: a second document begins here; keep one"),
        (b"a:\n\tb: 1\n", "2: not valid YAML: found character '\\t' that cannot start any token; indent"),
        (b"a: 1\nb: caf\xe9\n", "2: byte 0xe9 is not UTF-8; save the file as UTF-8"),
        (b"a: 1\nb: x\x00y\n", "2: the control character U+0000 is not allowed in YAML; remove it"),
        (b"a: [1, 2\nb: 3\n", "2: not valid YAML: expected ',' or ']'"),
        (b"a: b: c\n", "1: not valid YAML: mapping values are not allowed here; check the indentation"),
        (b"a: 1\n b: 2\n", "2: not valid YAML"),
        (b"a: 1\nb\nc: 2\n", "not valid YAML: could not find expected ':'; write `key: value`"),
        (b"a: *nowhere\n", "1: not valid YAML: found undefined alias 'nowhere'; define it"),
        (b"a: 'open\n", "not valid YAML: found unexpected end of stream; close the quotation mark"),
        (b"a: !custom 1\n", "1: the tag !custom is not understood; remove it"),
        (b"a: !!python/object/apply:os.system ['ls']\n", "1: the tag tag:yaml.org,2002:python/"),
        (b"a: !!binary aGk=\n", "is not understood"),
        (b"a: !!int abc\n", "1: abc is not a number"),
        (b"a: !!bool perhaps\n", "1: perhaps is neither true nor false"),
        (b"? [a, b]\n: 1\n", "1: a key is a list or a mapping; write a plain word"),
        (b"a: {<<: 3}\n", "1: only a mapping can be merged with <<"),
        (b"a: " + b"9" * 5000 + b"\n", "1: a number of 5000 characters"),
        (b'a: "\\UFFFFFFFF"\n', "not valid YAML"),
        (b"a: " + b"[" * 500 + b"]" * 500, "1: nested too deeply"),
        (b"a: " + b"{b: " * 100 + b"1" + b"}" * 100, "1: nested too deeply"),
        (b"a: &x [*x]\n", "1: nested too deeply, or aliases multiply too far"),
        (b"a: &x {<<: *x}\n", "aliases multiply too far"),
        (b"%YAML 2.0\n---\na: 1\n", "not valid YAML: found incompatible YAML document"),
    ],
)  # fmt: skip
def test_what_is_not_one_plain_mapping_is_refused_with_its_mend(text, said):
    assert said in only(text)


def test_a_billion_laughs_is_refused_quickly():
    text = "a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n"
    for k in range(1, 12):
        text += f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n"
    assert "aliases multiply too far" in only(text)


def test_laughing_merge_keys_are_refused_too():
    text = "a0: &a0 {k: [1, 2, 3, 4, 5, 6, 7, 8, 9]}\n"
    for k in range(1, 12):
        text += f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 9)}], x{k}: 1}}\n"
    assert "aliases multiply too far" in only(text)


def test_a_bom_is_no_problem():
    assert parse_document(b"\xef\xbb\xbfa: 1\n", "x").data == {"a": 1}


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda p: p / "gone.yaml", "there is no such file; check the path"),
        (lambda p: p, "this is a folder; name a file in it"),
        (lambda _: "nul\0byte.yaml", "cannot be read"),
        (lambda _: "x" * 5000, "cannot be read"),
    ],
)
def test_a_file_that_cannot_be_read_is_an_input_error(tmp_path, make, said):
    with pytest.raises(InputError) as error:
        read_document(make(tmp_path))
    assert said in str(error.value)


def test_a_huge_file_is_refused(tmp_path):
    (tmp_path / "big.yaml").write_bytes(b"# " + b"x" * 5_000_000)
    with pytest.raises(InputError, match="larger than 4 MB"):
        read_document(tmp_path / "big.yaml")


@settings(max_examples=200, deadline=None)
@given(
    st.one_of(
        st.binary(max_size=200),
        st.text(max_size=200).map(str.encode),
        st.text(alphabet="ab01:.-_eE [],{}&*!|>'\"\n\t#?%<~yno", max_size=120).map(str.encode),
    )
)
def test_nothing_but_an_input_error_leaves_the_reader(raw):
    slips(raw)
