"""Tests of the recovery table."""

from harness.report.run.recovery import section, text

ROW = {
    "method": "ik",
    "inputs": "pos+ori",
    "split": "none",
    "clip": "a",
    "evaluated_frames": 40,
    "disturbed_deg": 3.0,
    "undisturbed_deg": 2.0,
    "ratio": 1.5,
    "during": 4.0,
    "back_after_s": 0.5,
    "status_right": 0.995,
}


def test_ratios_that_are_too_large_or_unknown_are_marked() -> None:
    rows = [
        ROW | {"disturbance": "one_lost"},
        ROW | {"disturbance": "all_lost", "disturbed_deg": 3.1, "ratio": 1.55},
        ROW | {"disturbance": "one_off", "disturbed_deg": None, "ratio": None, "back_after_s": None},
    ]
    rows.append(ROW | {"disturbance": "start_off", "evaluated_frames": 0, "ratio": None, "status_right": None})
    found = text({"recovery": rows})
    head, line = found[3], found[4]
    for word in ("method", "split", "clips", "undisturbed [deg]", "one_lost", "all_lost", "one_off", "status right"):
        assert word in head
    assert "4.00, then 1.50 (1.50)  4.00, then 1.55 (1.55) FAIL  4.00, then nan (nan) FAIL  not measured" in line
    assert line.endswith("99.50 %")
    page = section({"recovery": rows})
    assert "1.55 (1.55) FAIL" in page
    assert '<th scope="col">all_lost</th>' in page


def test_a_run_without_disturbances_says_nothing() -> None:
    assert text({"recovery": []}) == []
    assert text({}) == []
    assert section({}) == ""
