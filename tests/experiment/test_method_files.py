"""Files of a user's method: an edit leads to new cells, and a file that the key does not cover fails the cell."""

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest

from harness.body.humanoid import build_body
from harness.core.seeds import generator
from harness.errors import BadInput, UnknownName
from harness.experiment import engine
from harness.experiment.isolation import Isolation
from harness.experiment.method_process import MethodFailure
from harness.experiment.remote_method import RemoteMethod, close_methods, hash_method, resolve_method
from harness.results.storage import read_cells, read_summary
from tests.experiment.test_isolation import ONE_CLIP

UPRIGHT = Path(__file__).parents[1] / "testing" / "upright.py"
MINE = """
import json
from importlib import import_module
from pathlib import Path

import numpy as np
from upright import Trained, Upright

HERE = Path(__file__).parent


class Mine(Upright):
    {attributes}

    def fit(self, body, examples, rng):
        {training}
        pose = super().fit(body, examples, rng).pose.copy()
        pose[10] += angle
        return Trained(pose)
"""


def write_method(folder: Path, training: str, attributes: str = "", files: Mapping[str, str] | None = None) -> None:
    shutil.copy(UPRIGHT, folder)
    files = {"mine.py": MINE.format(training=training, attributes=attributes), **(files or {})}
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    (tmp_path / "methods").mkdir()
    monkeypatch.syspath_prepend(tmp_path / "methods")
    yield tmp_path / "methods"
    close_methods()


def fit(name: str = "mine:Mine", isolation: Isolation | None = None) -> RemoteMethod:
    """The method, once it was trained."""
    method = resolve_method(name, isolation or Isolation())
    assert isinstance(method, RemoteMethod)
    method.fit(build_body(), [], generator(1, "fit"))
    return method


EDITS = {
    "a helper of a folder": ("from tools import gains; angle = gains.ANGLE", "", "tools/gains.py", "ANGLE = {}"),
    "a declared file": (
        "angle = json.loads((HERE / 'weights.json').read_text())",
        "files = ['weights.json']",
        "weights.json",
        "{}",
    ),
}


@pytest.mark.parametrize(("training", "attributes", "file", "text"), EDITS.values(), ids=EDITS)
def test_an_edit_never_meets_cells_of_before(
    folder: Path, tmp_path: Path, training: str, attributes: str, file: str, text: str
) -> None:
    """The first angle is measured, the edit is measured too, and the first one is found again."""
    from dataclasses import replace

    errors = []
    for angle in (0.1, 0.5, 0.1):
        write_method(folder, training, attributes, {file: text.format(angle)})
        engine.run(replace(ONE_CLIP, methods=("mine:Mine",)), tmp_path / "run")
        poses = {cell.key: float(cell.estimate_qpos[0, 10]) for cell in read_cells(tmp_path / "run")}
        (row,) = read_summary(tmp_path / "run")["cells"]
        errors.append((row["joint_angle_mean_deg"], poses[row["key"]]))
    assert errors[0] == errors[2]
    assert errors[1][0] != errors[0][0]
    assert errors[1][1] - errors[0][1] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("training", "file"),
    [
        ("angle = json.loads((HERE / 'weights.json').read_text())", "weights.json"),
        ("angle = json.load(open('weights.json', 'rb+'))", "weights.json"),
        ("angle = float(np.load(HERE / 'inner' / 'weights.npy'))", "inner/weights.npy"),
        ("angle = import_module(''.join(['hid', 'den'])).ANGLE", "hidden.py"),
        ("angle = len(__import__('sqlite3').connect(HERE / 'a.db').execute('select 1').fetchall())", "a.db"),
    ],
)
def test_an_undeclared_file_below_its_folder_fails_the_cell(
    folder: Path, monkeypatch: pytest.MonkeyPatch, training: str, file: str
) -> None:
    write_method(folder, f"try:\n            {training}\n        except Exception:\n            angle = 0.0")
    (folder / file).parent.mkdir(exist_ok=True)
    np.save(folder / file, 0.5) if file.endswith(".npy") else (folder / file).write_text("0.5")
    monkeypatch.chdir(folder)
    with pytest.raises(MethodFailure, match=rf"{folder / file}, which is not declared"):
        fit()


def test_a_file_that_is_read_while_the_module_is_imported_counts(folder: Path) -> None:
    write_method(folder, "angle = 0.0", "weight = float((HERE / 'weights.json').read_text())", {"weights.json": "1"})
    with pytest.raises(MethodFailure, match=r"weights\.json, which is not declared"):
        resolve_method("mine:Mine", Isolation())


@pytest.mark.parametrize(
    "training",
    [
        "open('/dev/null').close(); angle = 0.0",
        "angle = 0.0; open(HERE / 'log.txt', 'a').write('x')",
        "angle = 0.0 if not (HERE / 'absent.json').exists() else 1.0",
        "import decimal, numpy.polynomial, upright; angle = 0.0",
    ],
)
def test_what_does_not_bear_on_results_is_allowed(folder: Path, training: str) -> None:
    write_method(folder, training)
    fit()


def test_a_declared_file_that_changes_during_a_run_fails_the_cell(folder: Path) -> None:
    write_method(folder, *EDITS["a declared file"][:2], {"weights.json": "0.1"})
    method = fit()
    (folder / "weights.json").write_text("0.25")
    with pytest.raises(MethodFailure, match="changed since the run began"):
        method.fit(build_body(), [], generator(1, "fit"))


def test_source_that_changes_during_a_run_is_noticed_by_a_new_process(folder: Path) -> None:
    write_method(folder, "angle = 0.0")
    method = fit()
    before = hash_method(method)
    write_method(folder, "angle = 0.5")
    method.process.close()
    with pytest.raises(MethodFailure, match="changed since the run began"):
        method.fit(build_body(), [], generator(1, "fit"))
    close_methods()
    assert hash_method(fit()) != before


def test_errors_of_names_are_those_of_the_registry(folder: Path) -> None:
    write_method(folder, "angle = 0.0")
    with pytest.raises(UnknownName, match="Did you mean 'Mine'"):
        resolve_method("mine:Mne", Isolation())
    with pytest.raises(UnknownName, match="no method called 'nowhere:Mine'"):
        resolve_method("nowhere:Mine", Isolation())
    write_method(folder, "return (")
    with pytest.raises(BadInput, match="SyntaxError"):
        resolve_method("mine:Mine[name=3]", Isolation())


PLAIN = """
import random
import threading
import numpy as np
from upright import Trained, Upright as Other


class Plain:
    name, summary, needs_examples = "plain", "a class without repr", False

    def __init__(self):
        self.angle, self.names, self.gain = {angle}, {{"a", "b", "c"}}, lambda x: {angle} * x
        self.table = np.arange(2000.0)
        {more}

    def fit(self, body, examples, rng):
        return Other().fit(body, examples, rng)
"""


def write_plain(folder: Path, angle: float, more: str = "pass") -> None:
    shutil.copy(UPRIGHT, folder)
    (folder / "plain.py").write_text(PLAIN.format(angle=angle, more=more))


@pytest.mark.long
def test_a_class_without_repr_is_found_again(folder: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    keys = []
    for angle in (0.1, 0.1, 0.2):
        write_plain(folder, angle)
        engine.run(replace(ONE_CLIP, methods=("plain:Plain",)), tmp_path / "run")
        keys.append({path.name for path in (tmp_path / "run" / "cells").iterdir()})
    assert len(keys[0]) == 1
    assert keys[0] == keys[1] < keys[2]


def test_options_are_those_of_another_process(folder: Path) -> None:
    write_plain(folder, 0.1)
    texts = []
    for _ in range(2):
        texts.append(fit("plain:Plain").options)
        close_methods()
    assert texts[0] == texts[1]
    assert texts[0].startswith("plain.Plain(angle=0.1, gain=plain.Plain.__init__.<locals>.<lambda>(")


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("self.lock = threading.Lock()", r"plain:Plain\.lock is a _thread\.lock"),
        ("self.seed = random.random()", r"another state each time that it is made: .*seed="),
        ("self.rng = np.random.default_rng()", r"another state each time that it is made"),
    ],
)
def test_a_method_whose_cells_could_not_be_found_again_is_refused(folder: Path, more: str, message: str) -> None:
    write_plain(folder, 0.1, more)
    with pytest.raises(BadInput, match=message):
        resolve_method("plain:Plain", Isolation())
