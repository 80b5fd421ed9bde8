from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motions import HEADER, csv_text, rows
from zoo import ZOO, Animal

from mrctl.errors import InputError
from mrctl.measurements import load_campaign, require_sound


@pytest.mark.parametrize("animal", ZOO, ids=lambda animal: animal.name)
def test_each_broken_campaign_gets_one_clear_line_or_a_stated_correct_reading(tmp_path, animal: Animal):
    animal.make(tmp_path)
    if animal.refused is not None:
        with pytest.raises(InputError) as caught:
            require_sound(load_campaign(tmp_path))
        lines = str(caught.value).splitlines()
        assert len(lines) == 1, lines
        assert animal.refused in lines[0]
        assert "; " in lines[0], "there is a mend"
        return
    campaign = load_campaign(tmp_path)
    warnings = [str(problem) for problem in require_sound(campaign)]
    if animal.warned is not None:
        assert any(animal.warned in line for line in warnings), warnings
        return
    run = campaign.runs[0]
    assert not warnings
    assert np.array_equal(run.force_n[:1800], run.force_n[:1800])
    if len(run) < 10_000:
        assert np.max(np.abs(run.force_n - rows()[:, 4])) < 60  # a lost sample is interpolated
        assert np.median(np.abs(run.force_n - rows()[:, 4])) < 1e-3
    assert any(str(animal.read) in note for note in run.notes)


def test_the_whole_zoo_in_one_folder_is_one_list_of_complaints(tmp_path):
    animals = [animal for animal in ZOO if animal.name not in {"a million rows", "symlink loop"}]
    for number, animal in enumerate(animals):
        folder = tmp_path / f"{number:02d}"
        folder.mkdir()
        animal.make(folder)
    start = time.process_time()
    with pytest.raises(InputError) as caught:
        load_campaign(tmp_path)
    assert time.process_time() - start < 10
    lines = str(caught.value).splitlines()
    assert len(lines) >= 22
    assert all(str(tmp_path) in line for line in lines)


def test_a_path_that_is_not_there_is_said(tmp_path):
    with pytest.raises(InputError, match="there is no such file or folder; check the path"):
        load_campaign(tmp_path / "nowhere")
    (tmp_path / "dangling").symlink_to("nowhere")
    with pytest.raises(InputError, match="is a link to nothing"):
        load_campaign(tmp_path / "dangling")
    (tmp_path / "gone.csv").symlink_to("nowhere")
    with pytest.raises(InputError, match=r"gone\.csv: is a link to nothing; mend the link, or remove it"):
        load_campaign(tmp_path)


def only_input_errors(path, data: bytes) -> None:
    path.write_bytes(data)
    try:
        campaign = load_campaign(path)
        require_sound(campaign)
    except InputError as error:
        for line in str(error).splitlines():
            assert str(path) in line


pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
fuzz = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@fuzz
@given(st.binary(max_size=400))
def test_random_bytes_raise_nothing_but_input_errors(tmp_path, data):
    only_input_errors(tmp_path / "fuzz.csv", data)


@fuzz
@given(
    st.lists(
        st.sampled_from(
            [*"0123456789.,;-+eE\t \n\r\"'#", "nan", "inf", "velocity_m_s", "time_s", "\x00", "é"]
        ),
        max_size=300,
    ).map("".join)
)
def test_random_tables_raise_nothing_but_input_errors(tmp_path, text):
    only_input_errors(tmp_path / "fuzz.csv", (HEADER + "\n" + text).encode())


TEXT = csv_text(rows()[:120]).encode()


@fuzz
@given(
    st.lists(
        st.tuples(st.integers(0, len(TEXT) - 1), st.binary(min_size=1, max_size=3)), min_size=1, max_size=6
    )
)
def test_damaged_files_raise_nothing_but_input_errors(tmp_path, damage):
    data = bytearray(TEXT)
    for place, patch in damage:
        data[place : place + len(patch)] = patch
    only_input_errors(tmp_path / "fuzz.csv", bytes(data))


NUMBERS = st.floats(allow_nan=True, allow_infinity=True, width=64)


@fuzz
@given(
    st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS, NUMBERS), min_size=1, max_size=80), st.booleans()
)
def test_random_numbers_raise_nothing_but_input_errors(tmp_path, table, even):
    lines = [
        ",".join(map(repr, (0.01 * index if even else row[0], *row[1:]))) for index, row in enumerate(table)
    ]
    only_input_errors(tmp_path / "fuzz.csv", "\n".join([HEADER, *lines]).encode())
