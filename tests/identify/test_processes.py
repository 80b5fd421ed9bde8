"""Large pieces of work in copies of this process: results in order, and what was there before stays one."""

import multiprocessing
import os
import signal
import threading
import time

import pytest

from mrctl.identify import parallel
from mrctl.identify.processes import in_processes


@pytest.fixture(autouse=True)
def three_processors(monkeypatch):
    monkeypatch.setattr(parallel, "_here", parallel._Crew(3))
    yield
    assert not multiprocessing.active_children()


def slowly(k):
    """Long enough that no process does all of it."""
    time.sleep(0.03)
    return k, os.getpid()


def test_results_come_in_the_order_of_what_was_asked_from_several_processes():
    found = in_processes(slowly, range(9))
    assert [k for k, _ in found] == list(range(9))
    assert len({pid for _, pid in found}) == 3


def test_what_was_there_before_comes_back_as_itself_whether_it_can_be_pickled_or_not():
    had, own = [lambda: 1, [2.0]], [3.0]

    def refers(k):
        return slowly(k)[1], had[k % 2], own

    found = in_processes(refers, range(6), had)
    assert all(one is had[k % 2] for k, (_, one, _) in enumerate(found))
    elsewhere = [copied for pid, _, copied in found if pid != os.getpid()]
    assert elsewhere
    assert all(copied == own and copied is not own for copied in elsewhere)


@pytest.mark.parametrize("bad", range(3))
def test_an_error_reaches_who_asked(bad):
    def fails(k):
        slowly(k)
        if k == bad:
            raise ValueError(f"no {k}")
        return k

    with pytest.raises(ValueError, match=f"no {bad}"):
        in_processes(fails, range(3))
    assert parallel.workers() == 3


def test_what_a_copy_cannot_send_is_done_here():
    found = in_processes(lambda k: (*slowly(k), lambda: k), range(4))
    assert [one() for *_, one in found] == [0, 1, 2, 3]
    assert {pid for _, pid, _ in found} == {os.getpid()}


def test_a_copy_that_is_ended_leaves_its_work_to_who_asked():
    mine = os.getpid()

    def killed(k):
        if os.getpid() != mine:
            os.kill(os.getpid(), signal.SIGKILL)
        return slowly(k)

    assert in_processes(killed, range(4)) == [(k, mine) for k in range(4)]


def test_an_interrupt_ends_the_copies_and_is_not_lost(capfd):
    mine = os.getpid()

    def interrupted(k):
        if os.getpid() == mine:
            raise KeyboardInterrupt
        time.sleep(30.0)
        return k

    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        in_processes(interrupted, range(3))
    assert time.monotonic() - began < 5.0
    assert capfd.readouterr() == ("", "")


def test_the_processors_are_shared_and_work_within_a_copy_gets_along_without_its_parents_threads(monkeypatch):
    monkeypatch.setattr(parallel, "_here", parallel._Crew(4))
    parallel.in_parallel(slowly, range(8))  # so that there are threads that a copy has not

    def shares(k):
        return parallel.workers(), [n for n, _ in parallel.in_parallel(slowly, range(k, k + 3))]

    assert in_processes(shares, range(2)) == [(2, [0, 1, 2]), (2, [1, 2, 3])]
    assert parallel.workers() == 4


def test_who_has_nothing_left_to_do_leaves_its_processors_to_those_that_have():
    """Two do nothing; the third one's work within, in threads or processes, then goes on with all three."""

    def within(k):
        if k < 2:
            return k
        time.sleep(0.2)  # by now the others are done
        threads = parallel.in_parallel(lambda n: slowly(n) and threading.get_ident(), range(9))
        return len(set(threads)), parallel.workers(), {pid for _, pid in in_processes(slowly, range(9))}

    *_, (threads, workers, pids) = in_processes(within, range(3))
    assert (threads, workers, len(pids)) == (3, 3, 3)
    assert parallel.workers() == 3


def test_nobody_takes_processors_along_that_are_busy():
    def within(k):
        time.sleep(0.05 if k else 0.3)
        return parallel.workers(most=9), len(set(parallel.in_parallel(lambda _: slowly(k)[1], range(4))))

    first, *rest = in_processes(within, range(3))
    assert first == (3, 1)  # by then the others were done
    assert all(workers < 3 for workers, _ in rest)


@pytest.mark.parametrize("why", ["one processor", "one thing to do", "another thread", "another system"])
def test_without_copies_it_is_done_here(monkeypatch, why):
    things, found = range(1 if why == "one thing to do" else 4), []
    if why == "one processor":
        monkeypatch.setattr(parallel, "_here", parallel._Crew(1))
    if why == "another system":
        monkeypatch.setattr("sys.platform", "darwin")

    def ask():
        found.extend(in_processes(slowly, things))

    if why == "another thread":
        thread = threading.Thread(target=ask)
        thread.start()
        thread.join()
    else:
        ask()
    assert found == [(k, os.getpid()) for k in things]
