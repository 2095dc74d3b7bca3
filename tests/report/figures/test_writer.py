"""Figures and tables as files: kinds and folders that fit, formats, what is refused, nothing written over."""

import shutil
from pathlib import Path

import pytest

from harness.errors import BadFile, BadInput, HarnessError, UnknownName
from harness.report.figures.print_figure import FigureSelection
from harness.report.figures.writer import KINDS, write_figure, write_results_table
from harness.results import CellIndex


def test_a_figure_lies_below_its_run_in_pdf_unless_told_otherwise(ranked: Path, tmp_path: Path) -> None:
    figure = write_figure(ranked, force=True)
    assert figure.path == ranked / "figures" / "ranking.pdf"
    assert (figure.kind, figure.width_mm) == ("ranking", 85.0)
    assert figure.path.read_bytes().startswith(b"%PDF")
    for name, begins in (("a.svg", b"<?xml"), ("b.PNG", b"\x89PNG"), ("c", b"%PDF"), ("d.pdf", b"%PDF")):
        assert write_figure(ranked, out=tmp_path / "new" / name).path.read_bytes().startswith(begins)
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["a.svg", "b.PNG", "c", "d.pdf"]


@pytest.mark.parametrize("kind", [name for name, each in KINDS.items() if each.of_run])
def test_every_kind_of_a_run_is_drawn_the_same_twice(kind: str, framed: Path, tmp_path: Path) -> None:
    first, second = (write_figure(framed, kind, out=tmp_path / f"{n}.pdf") for n in (1, 2))
    assert first.path.read_bytes() == second.path.read_bytes()
    assert first.width_mm == KINDS[kind].width_mm
    assert first.caption.endswith(".")
    assert first.kind == kind


def test_a_placement_study_is_drawn_by_default(placement_study: Path, tmp_path: Path) -> None:
    study = tmp_path / "study"
    study.mkdir()
    (study / "findings.json").write_bytes((placement_study / "findings.json").read_bytes())
    figure = write_figure(study)
    assert (figure.path, figure.kind, figure.width_mm) == (study / "figures" / "placement.pdf", "placement", 170.0)


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        ("rankin", {}, "no kind of figure called 'rankin'. Did you mean 'ranking'"),
        ("placement", {}, "a run. It is for a placement study. Choose ranking, time, joints, cdf."),
        ("ranking", {"clip": "x"}, "--clip with --kind ranking"),
        ("cdf", {"control": "ik"}, "--control with --kind cdf"),
        ("joints", {"metric": "mpjpe_mm"}, "--metric with --kind joints"),
        ("ranking", {"metric": "mpjpe_m"}, "Did you mean 'mpjpe_mm'"),
        ("ranking", {"methods": ("ikk",)}, "Did you mean 'ik'"),
        ("time", {"clip": "walk_99"}, "no clip of the run called 'walk_99'"),
    ],
)
def test_choices_that_do_not_fit_are_refused(
    kind: str, options: dict[str, object], said: str, ranked: Path, tmp_path: Path
) -> None:
    with pytest.raises(HarnessError) as refused:
        write_figure(ranked, kind, FigureSelection(**options), out=tmp_path / "x.pdf")  # type: ignore[arg-type]
    assert said in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_kinds_of_a_run_are_refused_for_a_study(placement_study: Path) -> None:
    with pytest.raises(BadInput, match=r"a placement study\. It is for a run\. Choose placement\."):
        write_figure(placement_study, "time")


def test_formats_that_do_not_exist_are_refused(ranked: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="no format of figures called 'jpg'"):
        write_figure(ranked, out=tmp_path / "x.jpg")
    assert write_figure(ranked, out=tmp_path / "x.SVG").path.read_bytes().startswith(b"<?xml")


def test_nothing_is_written_over(ranked: Path, tmp_path: Path) -> None:
    for path, write in (
        (tmp_path / "x.pdf", lambda **options: write_figure(ranked, out=tmp_path / "x.pdf", **options)),
        (tmp_path / "x.tex", lambda **options: write_results_table(ranked, "latex", out=tmp_path / "x.tex", **options)),
    ):
        path.write_text("mine")
        with pytest.raises(BadFile, match="it exists"):
            write()
        assert path.read_text() == "mine"
        write(force=True)
        assert path.read_bytes() != b"mine"
        with pytest.raises(BadFile, match="it is not a file"):
            write_figure(ranked, out=tmp_path)
    with pytest.raises(BadFile, match=r"x.pdf is a file, not a folder"):
        write_figure(ranked, out=tmp_path / "x.pdf" / "below.pdf")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.pdf", "x.tex"]


def test_folders_without_a_run_are_refused_by_what_they_are(ranked: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "findings.json").write_text("{}")
    (tmp_path / "baseline").mkdir()
    (tmp_path / "baseline" / "cells.json").write_text("{}")
    with CellIndex(shutil.copytree(ranked, tmp_path / "sweep")) as index:
        index.note(kind="sweep")
    for name, kind, said in (
        ("nowhere", BadFile, "no such folder"),
        ("empty", BadFile, "no results"),
        ("paper", BadFile, "the study of a paper"),
        ("baseline", BadFile, "a baseline"),
        ("sweep", BadFile, "a sweep"),
    ):
        with pytest.raises(kind, match=said):
            write_figure(tmp_path / name)
        with pytest.raises(kind, match=said):
            write_results_table(tmp_path / name, "csv")


def test_a_table_is_the_text_that_is_written(ranked: Path, tmp_path: Path) -> None:
    written = write_results_table(ranked, "csv", metrics=["mpjpe_mm"], out=tmp_path / "new" / "t.csv")
    assert (tmp_path / "new" / "t.csv").read_text(encoding="utf-8") == written.text
    assert written.text.startswith("method,mpjpe_mm,")
