"""What MkDocs does beyond its settings: formulas, colours of code, and pages that lie outside docs/."""

import html
import posixpath
import re
from collections.abc import Iterable
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from mkdocs.structure.toc import AnchorLink
from pygments.formatters import HtmlFormatter

ROOT = Path(__file__).parents[2]
PAGES_OUTSIDE = {"readme.md": "README.md", "contributing.md": "CONTRIBUTING.md", "all_results.md": "results/README.md"}
"""Page of the site -> file of the repository."""
CODE_STYLES = {"css/code_light.css": "xcode", "css/code_dark.css": "github-dark"}
"""Style sheet of the site -> its style of Pygments."""
LINK = re.compile(r'(!?)\[([^\[\]]*)\]\(([^)\s]+)\)|src="([^"]+)"')
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\(\(|\[)(.*?)\\[)\]]</\1>', re.DOTALL)
"""What the extension `pymdownx.arithmatex` makes of $...$ and of $$...$$."""
DIGIT_ANCHOR = re.compile(r'(\bid="|\bhref="[^":]*#)(\d)')
"""Anchors of numbered headings: the script of the theme stops at one that begins with a digit."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    for uri, source in PAGES_OUTSIDE.items():
        files.append(File.generated(config, uri, content=(ROOT / source).read_text(encoding="utf-8")))
    for uri, style in CODE_STYLES.items():
        files.append(File.generated(config, uri, content=HtmlFormatter(style=style).get_style_defs(".highlight")))
    return files


def on_page_markdown(markdown: str, page: Page, files: Files, **_: object) -> str:
    """Links hold in the repository; here they become links between pages.

    A link to a file of the repository that is no page becomes its text.
    """
    here = page.file.src_uri
    source = PAGES_OUTSIDE.get(here, f"docs/{here}")
    uris = {path: uri for uri, path in PAGES_OUTSIDE.items()}

    def move(found: re.Match[str]) -> str:
        picture, text, *targets = found.groups()
        path, mark, anchor = (targets[0] or targets[1]).partition("#")
        whole = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if not path or not (ROOT / whole).exists():
            return found[0]
        inside = files.get_file_from_path(whole.removeprefix("docs/")) if whole.startswith("docs/") else None
        uri = inside.src_uri if inside and not inside.inclusion.is_excluded() else uris.get(whole)
        if uri is None:
            return text
        target = posixpath.relpath(uri, posixpath.dirname(here) or ".") + mark + anchor
        return f'src="{target}"' if targets[1] else f"{picture}[{text}]({target})"

    return LINK.sub(move, markdown)


def on_page_content(html_text: str, page: Page, **_: object) -> str:
    text = DIGIT_ANCHOR.sub(r"\1section-\2", FORMULA.sub(_mathml, html_text))
    if stray := re.search(r".{0,60}(\$\s*<math|</math>\s*\$).{0,60}", text):
        raise PluginError(f"A formula between $$ needs an empty line before and after it: {stray[0]}")
    _rename_anchors(page.toc)
    return text


def _rename_anchors(links: Iterable[AnchorLink]) -> None:
    for link in links:
        link.id = re.sub(r"^(?=\d)", "section-", link.id)
        _rename_anchors(link.children)


def _mathml(found: re.Match[str]) -> str:
    """The formula as MathML, which browsers draw without a script."""
    latex = " ".join(html.unescape(found[3]).split())
    mathml = convert(re.sub(r"\\tag\{(.*?)\}", r"\\qquad(\1)", latex), display="block" if found[2] == "[" else "inline")
    if "\\" in mathml:
        raise PluginError(f"A formula has a command that latex2mathml does not know: {latex}")
    return mathml
