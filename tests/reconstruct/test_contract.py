"""The cache makes a value once per calibration, and never returns that of another."""

import threading
from dataclasses import replace

from harness.reconstruct.contract import CalibrationCache
from tests.reconstruct.conftest import Scene


def test_it_is_made_once_for_each_way_of_wearing(walk: Scene) -> None:
    kept, made, calibration = CalibrationCache[str](), list[str](), walk.calibration

    def make() -> str:
        made.append(f"number {len(made)}")
        return made[-1]

    other = replace(calibration, mount_m=calibration.mount_m + 0.01)
    assert [kept.get(worn, make) for worn in (calibration, calibration, other, other, calibration)] == [
        *("number 0", "number 0", "number 1", "number 1", "number 2")
    ]


def test_threads_that_wear_them_otherwise_get_their_own(walk: Scene) -> None:
    kept, together, calibration = CalibrationCache[float](), threading.Barrier(2), walk.calibration
    wrong: list[float] = []

    def follow(shift_m: float) -> None:
        worn = replace(calibration, mount_m=calibration.mount_m + shift_m)
        for _ in range(200):
            together.wait()
            got = kept.get(worn, lambda: float(worn.mount_m[0, 0]))
            if got != worn.mount_m[0, 0]:
                wrong.append(got)

    threads = [threading.Thread(target=follow, args=(shift_m,)) for shift_m in (0.0, 0.5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
