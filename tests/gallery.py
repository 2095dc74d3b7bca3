"""Makes the studies of docs/gallery.md: `python -m tests.gallery [STUDY...]`, or `make gallery` for all of them.

The commands are those of the page. They run in build/gallery, and `make docs` publishes the pages that lie there. The
command also writes the picture and the result of each study into docs/gallery. It needs playwright and chromium.
"""

import io
import os
import re
import resource
import shutil
import sys
from pathlib import Path
from typing import Any

from tests.page_commands import ShellBlock, page_sections, run_block
from tests.test_prose import ROOT

PAGE = ROOT / "docs" / "gallery.md"
FOLDER = ROOT / "build" / "gallery"
VIEW_PX = (1000, 640)
PICTURE_PX = (600, 384)
_MARKERS = re.compile(r"<!-- result (\S+) -->\n(.*?)<!-- end of result -->", re.DOTALL)


def result_pages(text: str) -> dict[str, str]:
    """Heading of a study -> its page in build/gallery."""
    sections = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    return {section.splitlines()[0]: found[1] for section in sections if (found := _MARKERS.search(section))}


def main() -> None:
    from playwright.sync_api import sync_playwright

    text = PAGE.read_text(encoding="utf-8")
    sections, pages = page_sections(text), result_pages(text)
    chosen = sys.argv[1:] or list(pages)
    if unknown := set(chosen) - set(pages):
        raise SystemExit(f"No study {', '.join(sorted(unknown))}. Known: {', '.join(pages)}.")
    chromium = os.environ.get("HARNESS_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for title in chosen:
            minutes = make_study(sections[title])
            picture = PAGE.with_suffix("") / f"{Path(pages[title]).parts[0].removesuffix('.html')}.png"
            result = draw(browser, FOLDER / pages[title], picture)
            write_result(pages[title], title, picture, result, minutes)
            print(f"{title}: {minutes:.1f} min of CPU time. {result}")
        browser.close()


def make_study(blocks: list[ShellBlock]) -> float:
    """Run the commands of a study anew; returns the CPU time [min]."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in re.findall(r"--(?:out|html) (\S+)|\b(\w+\.rec)\b", "".join(block.commands for block in blocks)):
        path = FOLDER / "".join(name)
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for block in blocks:
        run_block(block, FOLDER)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime) / 60.0


def draw(browser: Any, page: Path, picture: Path) -> str:
    """Draw the first screen of a page as a small picture; returns its headline without brackets."""
    from PIL import Image

    view = browser.new_page(viewport={"width": VIEW_PX[0], "height": VIEW_PX[1]}, color_scheme="light")
    view.goto(page.as_uri())
    view.wait_for_timeout(1000)
    screen = Image.open(io.BytesIO(view.screenshot())).convert("RGB").resize(PICTURE_PX)
    picture.parent.mkdir(exist_ok=True)
    screen.quantize(128, dither=Image.Dither.NONE).save(picture, optimize=True)
    lines = view.inner_text("h1").splitlines()
    view.close()
    return re.sub(r" \([^()]*\)", "", ": ".join(line.strip() for line in lines if line.strip()))


def write_result(page: str, title: str, picture: Path, result: str, minutes: float) -> None:
    """Write the picture, the headline and the time of a study between its markers."""
    time = f"{minutes:.0f} minutes" if minutes >= 1.5 else f"{60.0 * minutes:.0f} seconds"
    lines = [
        f"![{title}: the page of the study]({picture.relative_to(PAGE.parent).as_posix()})",
        "",
        f"> {result}",
        "",
        f"About {time} of CPU time.",
    ]
    block = f"<!-- result {page} -->\n" + "\n".join(_wrapped(lines)) + "\n<!-- end of result -->"
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(_MARKERS.sub(lambda m: block if m[1] == page else m[0], text), encoding="utf-8")


def _wrapped(lines: list[str]) -> list[str]:
    """Quotations of at most 118 characters a line."""
    import textwrap

    return [
        part
        for line in lines
        for part in (textwrap.wrap(line, 116, subsequent_indent="> ") if line.startswith("> ") else [line])
    ]


if __name__ == "__main__":
    main()
