"""Words of the documentation site: `python -m tests.site_words` prints them for each page, and the sum.

Pages are those that MkDocs publishes but for the API reference, which docstrings make. A word is what stands between
blanks in the published text: of prose, tables, code and formulas, without addresses of links and texts of pictures.
"""

import re
from pathlib import Path

from tests.test_prose import ROOT

MOST_WORDS = 60_000


def published_pages(root: Path = ROOT) -> list[Path]:
    """Pages below docs/ that MkDocs publishes, without the API reference."""
    (text,) = re.findall(r"^exclude_docs: \|\n((?:  .*\n)+)", (root / "mkdocs.yml").read_text(encoding="utf-8"), re.M)
    folder, excluded = root / "docs", tuple(text.split())
    pages = [path for path in sorted(folder.rglob("*.md")) if path.relative_to(folder).parts[0] != "api"]
    return [page for page in pages if not f"/{page.relative_to(folder).as_posix()}".startswith(excluded)]


def count_words(page: str) -> int:
    """Number of words of a page in Markdown, as a browser shows it."""
    page = re.sub(r"<!--.*?-->|^```[^\n]*$|!\[[^\]]*\]\([^)]*\)|</?\w[^>\n]*>", " ", page, flags=re.M | re.S)
    page = re.sub(r"\]\([^)\s]*\)", "] ", page)
    page = re.sub(r"^\s*\|[-:| ]+\|\s*$|(?<!\\)\||^\s*(#+|[-*]|\d+\.) ", " ", page, flags=re.M)
    return len(page.split())


def main() -> None:
    counts = {page: count_words(page.read_text(encoding="utf-8")) for page in published_pages()}
    for page, count in sorted(counts.items(), key=lambda entry: entry[1]):
        print(f"{count:8,}  {page.relative_to(ROOT)}")
    print(f"{sum(counts.values()):8,}  words of at most {MOST_WORDS:,}")


if __name__ == "__main__":
    main()
