"""The commands, code and links of the README and of the documents work."""

import ast
import json
import re
import shlex
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import harness
from harness.cli import build_parser, main
from harness.commands.catalogue import build_catalogue
from harness.core.options import expand_alternatives
from harness.errors import Outcome
from harness.experiment import run as run_scenario
from harness.experiment.scenarios import load_scenario
from harness.reconstruct import list_methods, make_method
from harness.report.run.text import run_table
from harness.results import read_summary
from harness.study.trust.plan import load_plan
from harness.testing.contract_case import make_case
from tests.short_demo import short_demo
from tests.test_doors import DOORS

ROOT = Path(harness.__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
OWN_METHOD = (ROOT / "docs" / "own_method.md").read_text(encoding="utf-8")
RESULTS = (ROOT / "results" / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
DEMO = load_scenario("demo")
EIGHT_WALKS = """schema = 1
methods = ["ridge"]
stations = "liu2011"
[motion]
source = "builtin"
body = "common"
database = "behaviour"
longest_s = 1.5
behaviours = ["walking"]
test = ["walking_p[1-8]_01"]
examples = ["walking_p[1-8]_02"]
"""


def test_the_documented_method_runs_beside_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the very command; `demo` is a shorter one here, a file of that name."""
    short_demo(tmp_path / "demo")
    code = re.findall(r"```python\n(.*?)```", OWN_METHOD, re.DOTALL)[0]
    assert len(code.splitlines()) <= 40
    assert 'harness_gate("upright:Upright"' in OWN_METHOD  # tests/testing/test_regression_gate.py runs one
    (tmp_path / "upright.py").write_text(code)
    command = next(c for c in commands(OWN_METHOD) if c.startswith("run demo --methods"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main([*shlex.split(command), "--no-report"]) == 0
    methods = {row["method"]: row for row in read_summary(tmp_path / "results" / "mine")["methods"]}
    assert set(methods) == {"ik", "upright:Upright", "upright:Upright+ik"}
    errors = {name: row["metrics"]["mpjpe_mm"]["mean"] for name, row in methods.items()}
    assert errors["upright:Upright+ik"] < 0.2 * errors["upright:Upright"]


@pytest.mark.long
def test_the_documented_method_passes_the_contract(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the very command."""
    (tmp_path / "upright.py").write_text(re.findall(r"```python\n(.*?)```", OWN_METHOD, re.DOTALL)[0])
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(shlex.split(next(c for c in commands(OWN_METHOD) if c.startswith("check ")))) == 0


def test_the_first_exercise_of_the_readme_is_that_of_the_page_on_own_methods() -> None:
    """The next test but one runs the commands of that page: the copy passes, and the named change breaks it."""
    exercise, section = (
        README.split("## Did I break it?")[1].split("\n## ")[0],
        OWN_METHOD.split("## A whole method")[0],
    )
    assert len(commands(exercise)) == 4
    assert commands(exercise) == commands(section)
    copy = r"^    cp \S+ \S+"
    assert re.findall(copy, exercise, re.MULTILINE) == re.findall(copy, section, re.MULTILINE)
    ((option, bad),) = re.findall(r"`(\w+)` the default ([\d.]+) in place", section)
    assert f"default of `{option}` in `mine.py` to {bad}," in " ".join(exercise.split())


def test_the_moving_picture_of_the_readme_lasts_eight_seconds() -> None:
    image_module = pytest.importorskip("PIL.Image")
    (path,) = re.findall(r"\]\((\S+\.webp)\)", README)
    assert (ROOT / path).stat().st_size < 1.5e6
    with image_module.open(ROOT / path) as picture:
        durations_ms = []
        for frame in range(picture.n_frames):
            picture.seek(frame)
            picture.load()
            durations_ms.append(picture.info["duration"])
    assert sum(durations_ms) == pytest.approx(8000, abs=100)


def test_every_block_of_the_page_on_own_methods_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after another in one namespace. The module that wraps `ridge` is tried as a method."""
    namespace: dict[str, object] = {"__name__": "page"}
    blocks = re.findall(r"```python\n(.*?)```", OWN_METHOD, re.DOTALL)
    for block in blocks:
        exec(compile(block, "docs/own_method.md", "exec"), namespace)  # noqa: S102  # a reader does this
    (wrapper,) = (block for block in blocks if block.startswith("# steady.py\n"))
    (tmp_path / "steady.py").write_text(wrapper)
    monkeypatch.syspath_prepend(str(tmp_path))
    hinges = [
        np.array([estimate.qpos[7:] for estimate in case.run(case.frames)])
        for case in (make_case(make_method(name)) for name in ("ridge", "steady:Steady"))
    ]
    np.testing.assert_array_equal(hinges[1][0], hinges[0][0])
    np.testing.assert_allclose(hinges[1][1], 0.5 * (hinges[0][0] + hinges[0][1]), atol=1e-12)


@pytest.mark.long
def test_the_copied_method_beats_a_control_and_the_named_change_breaks_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the very commands; `gate` is eight short walks here."""
    section = OWN_METHOD.split("## A whole method")[0]
    ((source, copy),) = re.findall(r"^    cp (\S+) (\S+)", section, re.MULTILINE)
    ((option, bad, good),) = re.findall(r"`(\w+)` the default ([\d.]+) in place of\s([\d.]+)\.\s", section)
    code = (ROOT / source).read_text(encoding="utf-8")
    (line,) = re.findall(rf"^    {option}: .* = {good}$", code, re.MULTILINE)
    (tmp_path / "gate").write_text(EIGHT_WALKS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    run, compare, run_again, compare_again = (c for c in commands(section) if c.startswith(("run ", "compare ")))
    (tmp_path / copy).write_text(code)
    assert main([*shlex.split(run), "--no-report"]) == 0
    assert main([*shlex.split(compare)]) == Outcome.PASS.exit_code
    (tmp_path / copy).write_text(code.replace(line, line.replace(good, bad)))
    assert main([*shlex.split(run_again), "--no-report"]) == 0
    assert main([*shlex.split(compare_again)]) == Outcome.REGRESSED.exit_code


def test_the_documented_entry_point_gives_the_method_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As an installer writes it: the package's folder beside its dist-info."""
    (tmp_path / "upright.py").write_text(re.findall(r"```python\n(.*?)```", OWN_METHOD, re.DOTALL)[0])
    (project,) = re.findall(r"```toml\n(.*?)```", OWN_METHOD, re.DOTALL)
    points = tomllib.loads(project)["project"]["entry-points"]
    info = tmp_path / "upright-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: upright\nVersion: 1.0\n")
    lines = [f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in names.items()) for group, names in points.items()]
    (info / "entry_points.txt").write_text("\n".join(lines))
    assert "upright" not in list_methods()
    monkeypatch.syspath_prepend(str(tmp_path))
    assert make_method("upright+ik").name == "upright+ik"
    assert "upright" in build_catalogue()["methods"]
    monkeypatch.chdir(short_demo(tmp_path / "demo").parent)
    out = tmp_path / "run"
    assert main(["run", "demo", "--methods", "upright", "--no-report", "--out", str(out)]) == 0
    assert {row["method"] for row in read_summary(out)["methods"]} == {"upright"}


def test_documented_options_are_those_of_the_method() -> None:
    (named,) = re.findall(r"`--methods '([^']*)'`", OWN_METHOD)
    assert make_method(named).name == named
    for text in re.findall(r"\(`(\w+\[[^`]*\|[^`]*\])`\)", OWN_METHOD):
        assert [make_method(name).name for name in expand_alternatives(text)] == expand_alternatives(text)


@pytest.mark.parametrize(
    "behaviour",
    [
        pytest.param(behaviour, marks=[] if behaviour == "jumping" else [pytest.mark.slow])
        for behaviour in dict.fromkeys(DEMO.motion.behaviours)
    ],
)
def test_the_table_of_the_readme_is_the_demo_s(tmp_path: Path, behaviour: str) -> None:
    """Every figure but times, to 5 %: another machine's arithmetic may differ in the last bits."""
    shown = RESULTS.split("<!-- demo table -->")[1].split("<!-- end of demo table -->")[0]
    clips = tuple(clip for clip in DEMO.motion.test if clip.startswith(behaviour))
    alone = replace(DEMO, motion=replace(DEMO.motion, test=clips, behaviours=(behaviour,)))
    assert run_scenario(alone, tmp_path / "demo") is Outcome.PASS
    made = run_table(read_summary(tmp_path / "demo"))
    rows, again = ([line.split() for line in text.splitlines() if "/" in line] for text in (shown, made))
    assert len(rows) == 1 + len(DEMO.methods) * len(set(DEMO.motion.behaviours))  # the title first
    of_it = [row for row in rows[1:] if row[0] == behaviour]
    assert len(of_it) == len(DEMO.methods)
    for row, other in zip(of_it, again[1:], strict=True):
        assert row[:5] == other[:5]
        figures = [[float(x) for x in each[5:] if x != "±"][:-2] for each in (row, other)]  # the last ones are times
        np.testing.assert_allclose(figures[0], figures[1], rtol=0.05, atol=0.02)


def commands(text: str) -> list[str]:
    """What follows `harness` in every line of code, without its comment and what is done where it fails."""
    return re.findall(r"^(?: {4})?harness (.*?)(?:  +#.*| \|\| .*)?$", text, re.MULTILINE)


def blocks(text: str, language: str) -> list[str]:
    """The fenced blocks of code of a language, as in the file."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_code_can_be_copied_from_the_file_of_a_page(page: Path) -> None:
    """Fenced code parses as it is. Indented Python, or the end of an indented here-document, would not."""
    text = page.read_text(encoding="utf-8")
    for block in blocks(text, "python"):
        ast.parse(block)
    for block in blocks(text, "toml"):
        tomllib.loads(block)
    for block in blocks(text, "sh"):
        checked = subprocess.run(["/bin/bash", "-n"], input=block, capture_output=True, text=True, check=False)
        assert (checked.returncode, checked.stderr) == (0, "")
    assert re.findall(r"^ +(?:from \S+ import .*|import \w+|with .*:|.*<<.*)$", prose(text), re.MULTILINE) == []


def prose(text: str) -> str:
    """The text without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)


def test_the_files_of_the_laboratory_are_those_of_the_raw_page(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "hil.md").read_text(encoding="utf-8")
    script = "".join(block for block in blocks(page, "sh") if "<<" in block)
    subprocess.run(["/bin/bash", "-e"], input=script, cwd=tmp_path, text=True, check=True)
    assert {path.name for path in tmp_path.iterdir()} == {"hidden.toml", "motion.toml", "plan.toml"}
    assert load_scenario(tmp_path / "hidden.toml").motion.test[0] == "rig_p1_04"
    plan = load_plan(tmp_path / "plan.toml")
    assert len(load_scenario(tmp_path / plan.scenario).motion.test) == 12


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_command_of_a_page_parses(page: Path) -> None:
    found = commands(page.read_text(encoding="utf-8"))
    assert len(found) >= 4 or page.name != "README.md" or page.parent != ROOT
    for command in found:
        build_parser().parse_args(shlex.split(command.replace("\\", "/")))


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub and MkDocs make them, and those that it writes itself."""
    text = page.read_text(encoding="utf-8")
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    named = {re.sub(r"[^\w -]", "", title.replace("`", "").lower()).strip().replace(" ", "-") for title in titles}
    return named | set(re.findall(r'<a id="([\w-]+)"></a>', text))


@pytest.mark.parametrize("page", [*PAGES, ROOT / "results" / "README.md"], ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r'src="([^"]+)"', text):
        if link.startswith(("http://", "https://")):
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_the_results_format_names_every_column(tmp_path: Path) -> None:
    text = "".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in ("results-format.md", "metrics.md"))
    out = tmp_path / "run"
    scenario = str(short_demo(tmp_path / "demo"))
    assert main(["run", scenario, "--methods", "mean_pose", "--no-report", "--out", str(out)]) == 0
    header = (out / "summary.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    (cell, *_) = (out / "cells").iterdir()
    with np.load(cell / "frames.npz") as arrays:
        names = [name for name in arrays.files if not name.startswith("error.")]
    keys = [*json.loads((cell / "cell.json").read_text(encoding="utf-8")), *read_summary(out)]
    assert [name for name in (*header, *names, *keys) if f"`{name}`" not in text] == []


def test_the_api_reference_has_every_door() -> None:
    """mkdocstrings lists the names of a door, and every public name of `core` and `testing`."""
    folder = ROOT / "docs" / "api"
    pages = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.md")}
    text, config = "".join(pages.values()), (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for door in DOORS:
        assert f"::: {door}\n    options:\n      show_submodules: false\n" in text, door
    core = [path.stem for path in (ROOT / "harness" / "core").glob("[!_]*.py")]
    assert [name for name in core if f"::: harness.core.{name}\n" not in text] == []
    assert "::: harness.testing\n" in pages["testing"]
    assert "show_submodules: true" in config
    assert "show_if_no_docstring: true" in config
    assert all(f"api/{page}.md" in config for page in pages)
