"""Pieces of a web page that needs nothing beside itself; every text that goes in is escaped."""

import html
import re
from collections.abc import Iterable, Sequence
from typing import Final

# What HTML does not allow in a text, not even escaped: controls, halves of pairs, noncharacters.
_FORBIDDEN = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef"
    + "".join(f"{chr(plane + 0xFFFE)}-{chr(plane + 0xFFFF)}" for plane in range(0, 0x110000, 0x10000))
    + "]"
)

_STYLE: Final = """\
:root { color-scheme: light dark; --ink: #1d2327; --paper: #fff; --faint: #5a656c; --line: #d5dbdf;
  --box: #f3f6f7; --alarm: #fff3d6; --accent: #00796b; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e3e8ea; --paper: #14191c; --faint: #9aa7ae; --line: #364148;
    --box: #1d2529; --alarm: #43360f; --accent: #4fc3b0; }
}
body { margin: 0 auto; padding: 1rem; max-width: 60rem; color: var(--ink); background: var(--paper);
  font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.2; margin: 0; }
h2 { font-size: 1.15rem; margin: 2rem 0 0.5rem; color: var(--accent); }
p.faint, figcaption, caption { color: var(--faint); margin: 0.25rem 0; text-align: left; }
figure { margin: 1rem 0; }
img { display: block; max-width: 100%; max-height: 90vh; background: #fff; border: 1px solid var(--line); }
img.cells { width: 100%; object-fit: contain; background: none; border: 0; image-rendering: pixelated; }
table { border-collapse: collapse; width: 100%; }
th, td { padding: 0.25rem 0.75rem 0.25rem 0; border-bottom: 1px solid var(--line);
  text-align: left; vertical-align: top; }
th[scope=row] { font-weight: 600; width: 30%; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.scroll { overflow-x: auto; }
.alarm { background: var(--alarm); padding: 0.5rem 1rem; border-radius: 0.4rem; margin: 1rem 0; }
pre { background: var(--box); padding: 0.75rem; border-radius: 0.4rem;
  overflow-x: auto; overflow-wrap: normal; }
summary { cursor: pointer; }
"""

_PAGE: Final = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>
{style}</style>
</head>
<body>
{body}
</body>
</html>
"""


def escaped(text: object) -> str:
    """A text as it may stand between tags and in quoted attributes.

    Parameters
    ----------
    text : object
        Anything; its `str` is shown. Characters that no page may hold become U+FFFD.

    Examples
    --------
    >>> from glassslam.outputs.html_page import escaped
    >>> escaped('<b> & "c"')
    '&lt;b&gt; &amp; &quot;c&quot;'
    """
    return html.escape(_FORBIDDEN.sub("\ufffd", str(text)), quote=True)


def page(title: str, sections: Iterable[str]) -> str:
    """A whole page.

    Parameters
    ----------
    title : str
        Plain text.
    sections : iterable of str
        HTML; empty ones are left out.
    """
    return _PAGE.format(title=escaped(title), style=_STYLE, body="\n".join(filter(None, sections)))


def section(heading: str, content: str) -> str:
    """A part of a page with a heading (plain text) and content (HTML); empty without content."""
    return f"<section>\n<h2>{escaped(heading)}</h2>\n{content}\n</section>" if content else ""


def paragraph(text: str, style: str = "") -> str:
    """A paragraph of plain text."""
    return f'<p class="{style}">{escaped(text)}</p>' if style else f"<p>{escaped(text)}</p>"


def preformatted(text: str) -> str:
    """Plain text with its line breaks, to copy from."""
    return f"<pre>{escaped(text)}</pre>"


def bullets(items: Iterable[str]) -> str:
    """A list of plain texts."""
    return "<ul>\n" + "\n".join(f"<li>{escaped(item)}</li>" for item in items) + "\n</ul>"


def facts(rows: Iterable[tuple[str, str]]) -> str:
    """A table of names and values, both plain text; a name that repeats the one before is not shown again."""
    lines, before = [], ""
    for name, value in rows:
        shown = "" if name == before else escaped(name)
        lines.append(f'<tr><th scope="row">{shown}</th><td>{escaped(value)}</td></tr>')
        before = name
    return "<table>\n<tbody>\n" + "\n".join(lines) + "\n</tbody>\n</table>" if lines else ""


def figures(caption: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of numbers that scrolls sideways where the screen is narrow; all cells are plain text."""
    head = "".join(f'<th scope="col" class="number">{escaped(column)}</th>' for column in columns)
    body = "\n".join(
        "<tr>" + "".join(f'<td class="number">{escaped(cell)}</td>' for cell in row) + "</tr>" for row in rows
    )
    return (
        f'<div class="scroll">\n<table>\n<caption>{escaped(caption)}</caption>\n'
        f"<thead>\n<tr>{head}</tr>\n</thead>\n<tbody>\n{body}\n</tbody>\n</table>\n</div>"
    )
