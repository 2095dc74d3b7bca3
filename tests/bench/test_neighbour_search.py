"""The bench of indexes: exact search is exact, the chosen index finds enough, and every figure is named once."""

from harness.bench.neighbour_search import bench_index


def test_recall_of_every_index_on_a_small_set() -> None:
    rows = {row.text: row for row in bench_index(sizes=(800,))}
    recall = {name: row.value or 0.0 for name, row in rows.items() if "recall@" in name}
    ratios = [row for name, row in rows.items() if "exact search" in name]
    assert len(rows) - len(ratios) == 2 * len(recall) == 2 * (4 + 4 + 4 + 4)
    for name, share in recall.items():
        if name.startswith(("flat", "kd_tree")):
            assert share == 1.0
        else:
            assert 0.5 < share <= 1.0
    assert all((row.value or 0.0) > 0.0 for row in rows.values())
    held = {name: row.target for name, row in rows.items() if row.target}
    assert len(held) == 4 + len(ratios)
