"""The queue between the threads: bounded, drops the oldest items, and never blocks the producer."""

import threading

from harness.live.capture import DroppingQueue


def test_the_oldest_gives_way_and_is_counted() -> None:
    queue: DroppingQueue[int] = DroppingQueue(3)
    for number in range(10):
        queue.put(number)
    queue.end()
    assert [queue.take() for _ in range(4)] == [7, 8, 9, None]
    assert queue.dropped == 7
    assert queue.take() is None  # for ever


def test_what_waits_can_be_let_go() -> None:
    queue: DroppingQueue[int] = DroppingQueue(3)
    queue.put(1)
    queue.put(2)
    queue.drop_all()
    assert queue.dropped == 2
    queue.put(3)
    assert queue.take() == 3
    queue.put(4)
    queue.end()
    queue.drop_all()
    assert (queue.dropped, queue.take()) == (3, None)


def test_between_threads_nothing_is_lost_but_what_is_counted() -> None:
    queue: DroppingQueue[int] = DroppingQueue(5)
    taken: list[int] = []

    def take() -> None:
        while (item := queue.take()) is not None:
            taken.append(item)

    thread = threading.Thread(target=take)
    thread.start()
    for number in range(20_000):
        queue.put(number)
        assert len(queue) <= 5
    queue.end()
    thread.join()
    assert taken == sorted(set(taken))
    assert taken[-1] == 19_999
    assert len(taken) + queue.dropped == 20_000
