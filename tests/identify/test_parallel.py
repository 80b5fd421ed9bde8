"""Work side by side: results in order, errors told, processors that are idle taken along."""

import threading
import time

import pytest

from mrctl.identify import parallel
from mrctl.identify.parallel import in_parallel


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    crew = parallel._Crew(2)
    monkeypatch.setattr(parallel, "_here", crew)
    return crew


def test_results_come_in_the_order_of_what_was_asked():
    assert in_parallel(lambda k: (time.sleep(0.002 * (5 - k)), k * k)[1], range(6)) == [0, 1, 4, 9, 16, 25]


def test_one_processor_works_one_by_one(monkeypatch):
    monkeypatch.setattr(parallel, "_here", parallel._Crew(1))
    assert set(in_parallel(lambda _: threading.get_ident(), range(4))) == {threading.get_ident()}


@pytest.mark.parametrize("bad", [0, 3])
def test_an_error_reaches_who_asked_and_nobody_stays_busy(two_processors, bad):
    def fails(k):
        time.sleep(0.005)
        if k == bad:
            raise ValueError(f"no {k}")
        return k

    with pytest.raises(ValueError, match=f"no {bad}"):
        in_parallel(fails, range(4))
    time.sleep(0.05)
    assert two_processors._idle == 1
    assert in_parallel(lambda k: -k, range(3)) == [0, -1, -2]


def test_a_processor_that_is_done_helps_the_other_with_its_parts(two_processors):
    begun = threading.Event()

    def part(_):
        time.sleep(0.01)
        return threading.get_ident()

    def whole(k):
        if k == 0:
            begun.wait(2.0)
            return set()
        begun.set()
        time.sleep(0.05)  # the other one is done
        return set(in_parallel(part, range(8)))

    helped = in_parallel(whole, range(2))[1]
    assert len(helped) == 2
    assert two_processors._idle == 1


def test_no_more_work_at_a_time_than_there_are_processors(two_processors):
    busy, most, lock = 0, 0, threading.Lock()

    def leaf(_):
        nonlocal busy, most
        with lock:
            busy += 1
            most = max(most, busy)
        time.sleep(0.003)
        with lock:
            busy -= 1

    in_parallel(lambda _: in_parallel(lambda _: in_parallel(leaf, range(3)), range(3)), range(5))
    assert most <= 2
    assert two_processors._idle == 1
