"""A door hands out the names of its folder, each imported when it is first used."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture
def rooms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A package of two modules whose door names one thing of each."""
    package = tmp_path / "rooms_of_a_test"
    package.mkdir()
    (package / "cellar.py").write_text("WINE = 'red'\n")
    (package / "attic.py").write_text("def dust():\n    return 'grey'\n")
    (package / "__init__.py").write_text(
        "from typing import TYPE_CHECKING\n"
        "from harness.core.door import lazy_names\n"
        "if TYPE_CHECKING:\n"
        "    from rooms_of_a_test.attic import dust\n"
        "    from rooms_of_a_test.cellar import WINE as DRINK\n"
        "else:\n"
        "    __getattr__, __dir__ = lazy_names(__name__)\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    yield "rooms_of_a_test"
    for name in [name for name in sys.modules if name.startswith("rooms_of_a_test")]:
        del sys.modules[name]


def test_a_name_is_imported_when_it_is_used(rooms: str) -> None:
    package = __import__(rooms)
    assert {"dust", "DRINK"} <= set(dir(package))
    assert f"{rooms}.cellar" not in sys.modules
    assert package.DRINK == "red"
    assert {f"{rooms}.cellar", f"{rooms}.attic"} & set(sys.modules) == {f"{rooms}.cellar"}
    assert package.dust() == "grey"


@pytest.mark.parametrize("name", ["WINE", "cellar", "__wrapped__"])
def test_only_names_of_the_door_pass(rooms: str, name: str) -> None:
    with pytest.raises(AttributeError, match=f"module '{rooms}' has no attribute '{name}'"):
        getattr(__import__(rooms), name)


def test_a_door_of_the_harness_imports_nothing_by_itself() -> None:
    code = (
        "import sys, harness.simulate; print([m for m in sys.modules if m.startswith(('numpy', 'harness.simulate.'))])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
