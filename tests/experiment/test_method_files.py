"""Files of a user's method: an edit leads to new cells, and a file that the key does not cover fails the cell."""

import os
import py_compile
import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest

from harness.body import build_body
from harness.core.seeds import generator
from harness.errors import BadInput, UnknownName
from harness.experiment import engine
from harness.experiment.methods import remote_method
from harness.experiment.methods.isolation import Isolation
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.remote_method import NamedMethod, RemoteMethod, close_methods, resolve_method
from harness.results import read_cells, read_summary
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
    monkeypatch.setattr(engine, "close_methods", end_methods)
    monkeypatch.syspath_prepend(tmp_path / "methods")
    yield tmp_path / "methods"
    end_methods()


def end_methods() -> None:
    """End the processes of methods, but not the server that forks them."""
    while remote_method._remote_methods:
        remote_method._remote_methods.popitem()[1].process.close()


def fit(name: str = "mine:Mine", isolation: Isolation | None = None) -> RemoteMethod:
    """The method, once it was trained."""
    method = resolve_method(name, isolation or Isolation())
    assert isinstance(method, RemoteMethod)
    method.fit(build_body(), [], generator(1, "fit"))
    return method


READS_WEIGHTS = "angle = json.loads((HERE / 'weights.json').read_text())", "files = ['weights.json']"


def test_an_edit_never_meets_cells_of_before(folder: Path, tmp_path: Path) -> None:
    """The edits of a helper and of a declared file are measured, and the cells of before stay as they were."""
    from dataclasses import replace

    errors, training = [], f"from tools import gains; {READS_WEIGHTS[0]} + gains.ANGLE"
    for helper, weight in ((0.1, 0.0), (0.5, 0.0), (0.5, 0.25)):
        files = {"tools/gains.py": f"ANGLE = {helper}", "weights.json": str(weight)}
        write_method(folder, training, READS_WEIGHTS[1], files)
        engine.run(replace(ONE_CLIP, methods=("mine:Mine",)), tmp_path / "run")
        poses = {cell.key: float(cell.estimate_qpos[0, 10]) for cell in read_cells(tmp_path / "run")}
        (row,) = read_summary(tmp_path / "run")["cells"]
        errors.append((row["joint_angle_mean_deg"], poses[row["key"]]))
    assert len({error for error, _ in errors}) == 3
    assert [pose - errors[0][1] for _, pose in errors] == pytest.approx([0.0, 0.4, 0.65])


@pytest.mark.parametrize(
    ("training", "file"),
    [
        ("angle = json.loads((HERE / 'weights.json').read_text())", "weights.json"),
        ("angle = json.load(open('weights.json', 'rb+'))", "weights.json"),
        ("angle = float(np.load(HERE / 'inner' / 'weights.npy'))", "inner/weights.npy"),
        ("angle = import_module(''.join(['hid', 'den'])).ANGLE", "hidden.py"),
        ("angle = len(__import__('sqlite3').connect(HERE / 'a.db').execute('select 1').fetchall())", "a.db"),
        ("angle = __import__('sqlite3').connect(f'file:{HERE}/a%2edb?mode=ro', uri=True)", "a.db"),
        ("angle = __import__('sqlite3').connect('file:a.db?mode=ro', uri=True)", "a.db"),
        (
            "import os; angle = os.open('a.bin', os.O_RDONLY, dir_fd=os.open(HERE / 'inner', os.O_RDONLY))",
            "inner/a.bin",
        ),
        ("import os; angle = os.open('methods/a.bin', os.O_RDONLY, dir_fd=os.open(HERE.parent, 0))", "a.bin"),
        ("import os; os.chdir('/'); angle = open(HERE / 'a.bin', 'rb').read()", "a.bin"),
        ("angle = (HERE / '__pycache__' / 'a.bin').read_bytes()", "__pycache__/a.bin"),
        ("angle = (HERE / 'own.dist-info' / 'a.json').read_bytes()", "own.dist-info/a.json"),
        ("import ctypes; angle = ctypes.CDLL(HERE / 'a.so')", "a.so"),
        ("import pkgutil; angle = pkgutil.get_data('upright', 'a.bin')", "a.bin"),
        ("import sys; sys.path.append(str(HERE / 'a.zip')); import hid_den", "a.zip"),
        ("angle = np.fromfile(HERE / 'a.bin')", "a.bin"),
        ("angle = np.memmap(HERE / 'a.bin', mode='r')", "a.bin"),
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
        "import os, tempfile; os.environ['GAIN'] = '1'; Path.home(); tempfile.gettempdir(); angle = 0.0",
        "import os; angle = 0.0; os.close(os.open('.', os.O_RDONLY))",
    ],
)
def test_what_does_not_bear_on_results_is_allowed(folder: Path, training: str) -> None:
    write_method(folder, training)
    fit()


def test_a_declared_file_that_changes_during_a_run_fails_the_cell(folder: Path) -> None:
    write_method(folder, *READS_WEIGHTS, {"weights.json": "0.1"})
    method = fit()
    (folder / "weights.json").write_text("0.25")
    with pytest.raises(MethodFailure, match="changed since the run began"):
        method.fit(build_body(), [], generator(1, "fit"))


def test_source_that_changes_during_a_run_is_noticed_by_a_new_process(folder: Path) -> None:
    write_method(folder, "angle = 0.0")
    method = fit()
    before = NamedMethod("", method).source_hash
    write_method(folder, "angle = 0.5")
    method.process.close()
    with pytest.raises(MethodFailure, match="changed since the run began"):
        method.fit(build_body(), [], generator(1, "fit"))
    end_methods()
    assert NamedMethod("", fit()).source_hash != before


def test_errors_of_names_are_those_of_the_registry(folder: Path) -> None:
    write_method(folder, "angle = 0.0")
    with pytest.raises(UnknownName, match="Did you mean 'Mine'"):
        resolve_method("mine:Mne", Isolation())
    with pytest.raises(UnknownName, match=r"no module in .* called 'nowhere'"):
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
    for _ in range(2):
        write_plain(folder, 0.1)
        engine.run(replace(ONE_CLIP, methods=("plain:Plain",)), tmp_path / "run")
        keys.append({path.name for path in (tmp_path / "run" / "cells").iterdir()})
    assert len(keys[0]) == 1
    assert keys[0] == keys[1]


def test_options_are_those_of_another_process(folder: Path) -> None:
    texts = []
    for angle in (0.1, 0.1, 0.2):
        write_plain(folder, angle)
        method = resolve_method("plain:Plain", Isolation())
        assert isinstance(method, RemoteMethod)
        texts.append(method.options)
        end_methods()
    assert texts[0] == texts[1] != texts[2]
    assert texts[0].startswith("plain.Plain(angle=0.1, gain=plain.Plain.__init__.<locals>.<lambda>(")


@pytest.mark.long
def test_hashes_of_texts_and_the_temporary_folder_are_those_of_another_server(folder: Path) -> None:
    parts = "(hash('left'), list({*'abcdefgh'}), tempfile.gettempdir() + '/tables')"
    write_plain(folder, 0.1, f"import tempfile; self.parts = {parts}")
    texts = set[str]()
    for _ in range(2):
        texts.add(NamedMethod("", resolve_method("plain:Plain", Isolation())).options)
        close_methods()
    assert len(texts) == 1


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


def write_unnoticed(path: Path, text: str) -> None:
    """Write a file whose size and times tell of no edit; compiled code of it, if there is any, is that of before."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    os.utime(path, (1e9, 1e9))


STATES_ANGLE = "files = {files}; __init__ = lambda self: super(Mine, self).__init__(summary=str(gains.ANGLE))"
GAINS = "ANGLE = {}\n"
IMPORTS = {
    "by name": "import gains",
    "by a computed name": "gains = import_module('gai' + 'ns')",
    "by the function of the statement": "gains = __import__('gai' + 'ns')",
    "by a text": "exec('im' + 'port gains')",
    "by its path": (
        "import importlib.util as u; spec = u.spec_from_file_location('g', HERE / 'gains.py'); "
        "gains = u.module_from_spec(spec); spec.loader.exec_module(gains)"
    ),
}


@pytest.mark.parametrize("statement", IMPORTS.values(), ids=IMPORTS)
def test_an_edit_that_leaves_size_and_time_is_another_method(folder: Path, statement: str) -> None:
    """Python would run the compiled code of before: it believes size and time of the source."""
    found: list[tuple[str, str]] = []
    for angle in (0.1, 0.5):
        declared = ["gains.py"] if statement == IMPORTS["by its path"] else []  # Python does not list it
        write_method(folder, "angle = 0.0", STATES_ANGLE.format(files=declared))
        (folder / "mine.py").write_text((folder / "mine.py").read_text().replace("class", f"{statement}\nclass", 1))
        write_unnoticed(folder / "gains.py", GAINS.format(angle))
        for file in ("gains.py", "mine.py"):
            if not found:
                py_compile.compile(str(folder / file), doraise=True)
        method = fit()
        found.append((method.summary, method.source_hash))
        end_methods()
    assert [summary for summary, _ in found] == ["0.1", "0.5"]
    assert found[0][1] != found[1][1]


@pytest.mark.parametrize("name", ["package.mine:Mine", "mine:Mine"])
def test_byte_code_of_an_installed_method_is_not_that_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Installers compile what they install, and an edit within a second may keep size and time of the source."""
    site, found = tmp_path / "site-packages", list[tuple[str, str]]()
    module = site / f"{name.partition(':')[0].replace('.', '/')}.py"
    monkeypatch.syspath_prepend(site)
    for angle in (0.1, 0.5):
        write_unnoticed(module, UPRIGHT.read_text().replace("the T-pose, whatever is seen", f"angle {angle}"))
        if not found:
            (module.parent / "__init__.py").touch()
            for file in module.parent.iterdir():
                py_compile.compile(str(file), doraise=True)
        method = resolve_method(name.replace("Mine", "Upright"), Isolation())
        found.append((method.summary, NamedMethod("", method).source_hash))
        end_methods()
    assert [summary for summary, _ in found] == ["angle 0.1", "angle 0.5"]
    assert found[0][1] != found[1][1]


def write_byte_code(folder: Path, angle: float) -> None:
    write_unnoticed(folder / "source" / "gains.py", GAINS.format(angle))
    py_compile.compile(str(folder / "source" / "gains.py"), str(folder / "methods" / "gains.pyc"), doraise=True)


def write_archive(folder: Path, angle: float) -> None:
    with zipfile.ZipFile(folder / "methods" / "code.zip", "w") as archive:
        archive.writestr(zipfile.ZipInfo("gains.py"), GAINS.format(angle))


def write_elsewhere(folder: Path, angle: float) -> None:
    write_unnoticed(folder / "elsewhere" / "gains.py", GAINS.format(angle))


PLACES: dict[str, tuple[Callable[[Path, float], None], str]] = {
    "byte code without source": (write_byte_code, ""),
    "an archive": (write_archive, "methods/code.zip"),
    "another folder of the import path": (write_elsewhere, "elsewhere"),
}


@pytest.mark.parametrize("statement", ["import gains", "gains = import_module('gai' + 'ns')"])
@pytest.mark.parametrize(("write", "entry"), PLACES.values(), ids=PLACES)
def test_code_counts_wherever_it_lies(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    write: Callable[[Path, float], None],
    entry: str,
    statement: str,
) -> None:
    write_method(folder, "angle = 0.0", STATES_ANGLE.format(files=[]))
    (folder / "mine.py").write_text((folder / "mine.py").read_text().replace("class", f"{statement}\nclass", 1))
    monkeypatch.syspath_prepend(folder.parent / entry)
    found = []
    for angle in (0.1, 0.5):
        write(folder.parent, angle)
        method = fit()
        found.append((method.summary, method.source_hash))
        end_methods()
    assert [summary for summary, _ in found] == ["0.1", "0.5"]
    assert found[0][1] != found[1][1]


def test_the_code_that_makes_a_method_of_the_package_counts(folder: Path) -> None:
    found = []
    for scale in (0.5, 0.25):
        (folder / "maker.py").write_text(
            "from harness.reconstruct.methods.ik import Ik\n\n\ndef make():\n    return Ik()\n\n\nSCALE = {scale}\n"
        )
        write_unnoticed(folder / "maker.py", (folder / "maker.py").read_text().format(scale=scale))
        method = resolve_method("maker:make", Isolation())
        assert isinstance(method, RemoteMethod)
        found.append(NamedMethod("", method).source_hash)
        end_methods()
    assert found[0] != found[1]


COMPILED = """
import numba
import gains
from upright import Upright


@numba.njit(cache=True)
def angle():
    return gains.ANGLE


class Mine(Upright):
    def __init__(self):
        super().__init__(summary=str(angle()))
"""


@pytest.mark.long
def test_machine_code_that_numba_keeps_is_not_that_of_before(folder: Path) -> None:
    """A constant of another module is compiled in, and numba looks at the time of its own source alone."""
    shutil.copy(UPRIGHT, folder)
    write_unnoticed(folder / "mine.py", COMPILED)
    found = []
    for angle in (0.1, 0.5):
        write_unnoticed(folder / "gains.py", GAINS.format(angle))
        found.append(fit().summary)
        end_methods()
    assert found == ["0.1", "0.5"]


def test_data_that_is_rewritten_with_its_size_and_time_fails_the_cell(folder: Path) -> None:
    write_method(folder, *READS_WEIGHTS)
    write_unnoticed(folder / "weights.json", "0.1")
    method = fit()
    write_unnoticed(folder / "weights.json", "0.5")
    with pytest.raises(MethodFailure, match="changed since the run began"):
        method.fit(build_body(), [], generator(1, "fit"))


VARIABLE = "HARNESS_TEST_GAIN"


READS = [f"os.environ['{VARIABLE}']", f"os.getenv('{VARIABLE}', '0')", f"os.environ.get('{VARIABLE}', '0')"]


def test_a_declared_variable_is_part_of_the_key_and_may_be_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_method(
        folder, f"import os; angle = {' + '.join(map('float({})'.format, READS))}", f"environment = ['{VARIABLE}']"
    )
    hashes = []
    for value in ("0.1", "0.5"):
        close_methods()  # the server too: it has the environment of its start, as a run has
        monkeypatch.setenv(VARIABLE, value)
        hashes.append(NamedMethod("", fit()).source_hash)
    assert hashes[0] != hashes[1]


@pytest.mark.parametrize(
    "read",
    [
        f"os.environ.get('{VARIABLE}')",
        f"os.getenv('{VARIABLE}')",
        f"'{VARIABLE}' in os.environ",
        f"os.environ.setdefault('{VARIABLE}', '1')",
        f"os.environb.get(b'{VARIABLE}')",
        f"os.environ.pop('{VARIABLE}')",
        "os.environ.copy()",
        "list(os.environ.values())",
        "dict(os.environ)",
        f"os.path.expandvars('$HOME/${VARIABLE}')",
        f"from collections import ChainMap; ChainMap(os.environ, {{}})['{VARIABLE}']",
        f"from string import Template; Template('${VARIABLE}').substitute(os.environ)",
    ],
)
def test_an_undeclared_variable_fails_the_cell(folder: Path, monkeypatch: pytest.MonkeyPatch, read: str) -> None:
    monkeypatch.setenv(VARIABLE, "1")
    write_method(folder, f"import os; {read}; angle = 0.0")
    with pytest.raises(MethodFailure, match=r"the environment variable \w+, which is not declared"):
        fit()


def test_numbers_of_threads_need_no_declaration(folder: Path) -> None:
    """The harness sets them, and much code gives them a default before it imports numpy."""
    write_method(folder, "import os; os.environ.setdefault('OMP_NUM_THREADS', '1'); angle = 0.0")
    fit()


def test_a_variable_that_is_read_while_the_module_is_imported_counts(folder: Path) -> None:
    write_method(folder, "angle = 0.0", f"import os; gain = os.environ.get('{VARIABLE}')")
    with pytest.raises(MethodFailure, match=f"the environment variable {VARIABLE}, which is not declared"):
        resolve_method("mine:Mine", Isolation())


def test_a_declaration_of_variables_is_a_list_of_names(folder: Path) -> None:
    write_method(folder, "angle = 0.0", f"environment = '{VARIABLE}'")
    with pytest.raises(BadInput, match="Write a list of names"):
        resolve_method("mine:Mine", Isolation())
