"""The gallery and the exercises of docs/: their commands are valid, and print the answers that the pages give."""

import re
import shlex
from pathlib import Path

import pytest

from harness.cli import build_parser
from tests.gallery import PAGE, PICTURE_PX, result_pages
from tests.page_commands import ShellBlock, has_answer, page_sections, run_block
from tests.test_prose import ROOT

GALLERY = PAGE.read_text(encoding="utf-8")
EXERCISES = page_sections((ROOT / "docs" / "exercises.md").read_text(encoding="utf-8"))
STUDIES = page_sections(GALLERY)


@pytest.mark.parametrize("title", [*STUDIES, *EXERCISES])
def test_the_commands_of_a_study_and_of_an_exercise_parse(title: str) -> None:
    found = [command for block in {**STUDIES, **EXERCISES}[title] for command in block.harness_commands()]
    assert found
    for command in found:
        build_parser().parse_args(shlex.split(command))


def test_the_gallery_has_a_picture_and_a_result_of_each_study() -> None:
    image_module = pytest.importorskip("PIL.Image")
    pages = result_pages(GALLERY)
    assert list(pages) == list(STUDIES)
    assert len(pages) == 6
    for title, section in zip(pages, re.split(r"^## ", GALLERY, flags=re.MULTILINE)[1:], strict=True):
        (picture,) = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", section)
        with image_module.open(PAGE.parent / picture) as image:
            assert image.size == PICTURE_PX, title
        assert re.search(r"^> \w.{20,}", section, re.MULTILINE), title
        assert re.search(r"^About \d+ (seconds|minutes) of CPU time\.$", section, re.MULTILINE), title
        first = Path(pages[title]).parts[0].removesuffix(".html")
        assert any(re.search(rf"\b{first}\b", block.commands) for block in STUDIES[title]), title


def test_each_kind_of_user_has_an_exercise_with_an_answer() -> None:
    assert len(EXERCISES) == 3
    for title, blocks in EXERCISES.items():
        assert sum(len(block.answer) for block in blocks) >= 2, title


@pytest.mark.slow
@pytest.mark.parametrize("title", EXERCISES)
def test_an_exercise_has_its_answer(title: str, tmp_path: Path) -> None:
    """Words as they stand, numbers to 5 %, since another machine's arithmetic differs in the last bits."""
    for block in EXERCISES[title]:
        output = run_block(block, tmp_path)
        assert [line for line in block.answer if not has_answer(output, line)] == []


def test_blocks_run_in_their_folder_and_a_command_that_fails_is_told(tmp_path: Path) -> None:
    assert "methods:" in run_block(ShellBlock("cd .\nharness list methods > list.txt\ncat list.txt\n"), tmp_path)
    assert (tmp_path / "list.txt").exists()
    with pytest.raises(RuntimeError, match="exit code 2"):
        run_block(ShellBlock("harness run no_such_scenario\necho more\n"), tmp_path)


def test_an_answer_is_its_words_in_order_and_its_numbers_nearly() -> None:
    printed = "- Share of echoes: 5.88 % (5.68 to 6.08), expected\n3 %, 2.0 times as much.\npass\n"
    assert has_answer(printed, "Share of echoes: 5.9 % (5.7 to 6.1), expected 3 %")
    assert not has_answer(printed, "Share of echoes: 5.5 %")
    assert not has_answer(printed, "Share of gaps: 5.9 %")
    assert not has_answer(printed, "expected 3 %, 2.0 times as much. regressed")
