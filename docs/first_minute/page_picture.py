"""Draw parts of a report page as one small picture: python docs/first_minute/page_picture.py PAGE OUT.png SELECTOR...

The parts are found by CSS selectors and stand below each other. Charts that scroll sideways are cut at the width of the
view. Needs playwright and chromium.
"""

import argparse
import io
import os
import shutil
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

WIDTH_PX = 840
"""Three times the width at which README shows the picture."""
MARGIN_PX = 20
PAPER = "#ffffff"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page")
    parser.add_argument("out")
    parser.add_argument("selector", nargs="+")
    parser.add_argument("--view", type=int, default=460, metavar="PX", help="width of the view (default 460)")
    args = parser.parse_args()
    chromium = os.environ.get("HARNESS_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(
            viewport={"width": args.view, "height": 1000}, device_scale_factor=2, color_scheme="light"
        )
        page.set_default_timeout(240_000)
        page.goto(Path(args.page).resolve().as_uri(), timeout=240_000)
        page.add_style_tag(content=".scroll-hint { visibility: hidden; }")
        parts = [Image.open(io.BytesIO(page.locator(each).first.screenshot())) for each in args.selector]
        browser.close()
    stack(parts).save(args.out, optimize=True)


def stack(parts: list[Image.Image]) -> Image.Image:
    """The parts below each other, `WIDTH_PX` wide, in a palette of 256 colours."""
    width = max(part.width for part in parts)
    size = (width + 2 * MARGIN_PX, sum(part.height for part in parts) + 2 * MARGIN_PX)
    picture = Image.new("RGB", size, PAPER)
    top = MARGIN_PX
    for part in parts:
        picture.paste(part.convert("RGB"), (MARGIN_PX, top))
        top += part.height
    small = picture.resize((WIDTH_PX, round(WIDTH_PX * picture.height / picture.width)))
    return small.quantize(256, dither=Image.Dither.NONE)


if __name__ == "__main__":
    main()
