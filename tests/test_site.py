"""The documentation site as a browser shows it: heights, widths, formulas, types, the dark mode, and no network."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.report.conftest import browser as browser
from tests.site_pages import MOST_HEIGHT_PX, VIEWS, look_at_pages, served
from tests.test_prose import ROOT


def build(root: Path, out: Path) -> subprocess.CompletedProcess[str]:
    """As `make docs` does, of another folder; --quiet would hide the warnings that --strict counts."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(out)]
    return subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=900, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="mkdocs is not installed")
    out = tmp_path_factory.mktemp("site") / "site"
    done = build(ROOT, out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.long
def test_every_page_is_whole_and_none_is_a_scroll(site: Path, browser: Any) -> None:
    """No page needs the network; dark where the system is; no formula is left as LaTeX or has no room."""
    for width_px, scheme in VIEWS:
        pages = look_at_pages(browser, site, width_px, scheme)
        assert len(pages) > 50
        assert [(page.name, page.wrong) for page in pages if page.wrong] == []
        assert [(page.name, page.width) for page in pages if page.width > width_px] == []
        assert [(page.name, page.latex) for page in pages if page.latex] == []
        assert sum(len(page.formulas) for page in pages) > 200
        assert all(width > 3 for page in pages for width in page.formulas)
        if scheme == "dark":
            assert max(int(re.findall(r"\d+", page.ground)[0]) for page in pages) < 64
        else:
            assert [(page.name, page.height) for page in pages if page.height > MOST_HEIGHT_PX] == []
            assert {page.ground for page in pages} == {"rgb(255, 255, 255)"}


@pytest.mark.long
def test_a_reader_chooses_light_and_finds_the_type_of_a_signature(site: Path, browser: Any) -> None:
    with served(site) as address:
        view = browser.new_page(viewport={"width": 1400, "height": 900}, color_scheme="dark")
        view.set_default_timeout(240_000)
        view.goto(f"{address}/index.html")
        assert "invert" in view.evaluate("getComputedStyle(document.querySelector('.col-md-9 img')).filter")
        view.click("#theme-menu")
        view.click("[data-bs-theme-value=light]")
        assert view.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert view.evaluate("getComputedStyle(document.querySelector('.col-md-9 img')).filter") == "none"
        view.goto(f"{address}/api/reconstruct.html")
        view.click("[id='harness.reconstruct.make_method'] ~ * a:has-text('Method')")
        assert view.url.endswith("api/reconstruct.html#harness.reconstruct.Method")
        view.close()


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (r"An error of $\nosuchcommand{x}$.", "nosuchcommand"),
        ("One line and\n$$x^2$$ the rest.", "empty line"),
        ("[Somewhere](nowhere.md)", "nowhere.md"),
    ],
)
def test_a_formula_or_a_link_that_is_wrong_stops_the_build(tmp_path: Path, text: str, reason: str) -> None:
    """In a site of one page with the settings of the real one."""
    pytest.importorskip("mkdocs", reason="mkdocs is not installed")
    settings = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[0]
    shutil.copytree(ROOT / "docs" / "site", tmp_path / "docs" / "site")
    for name in ("README.md", "CONTRIBUTING.md", "results/README.md", "docs/gallery.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("# A page\n", encoding="utf-8")
    (tmp_path / "mkdocs.yml").write_text(settings + "\n", encoding="utf-8")
    page = tmp_path / "docs" / "index.md"
    page.write_text("# Title\n\nA formula $x^2$.\n", encoding="utf-8")
    assert build(tmp_path, tmp_path / "out").returncode == 0
    assert "<math" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    page.write_text(f"# Title\n\n{text}\n", encoding="utf-8")
    done = build(tmp_path, tmp_path / "out")
    assert done.returncode != 0
    assert reason in done.stdout + done.stderr
