"""What a calibration hands over to be printed, drawn and written, the same for every sub-command."""

from __future__ import annotations

import base64
import datetime
import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.figure import Figure

import libloc
from libloc import Verdict

_PLAIN = {
    Verdict.OK: "ok: use it",
    Verdict.FAIR: "fair: use it; a better recording would help",
    Verdict.WARN: "warn: read the reasons before you use it",
    Verdict.REFUSED: "refused: not to be used",
}
_COLOUR = {
    Verdict.OK: "#1b7837",
    Verdict.FAIR: "#4d7ea8",
    Verdict.WARN: "#b35806",
    Verdict.REFUSED: "#a50026",
}


@dataclass
class Table:
    title: str
    heading: list[str]  # of the columns, the first is that of the rows' names
    rows: list[list[str]]


@dataclass
class Picture:
    name: str  # of the PNG file, without its ending
    caption: str
    draw: Callable[[], Figure]  # called only when pictures are wanted


@dataclass
class Outcome:
    """One calibrated block of the rig."""

    block: str  # "magnetometer", "imu.accelerometer", ...
    summary: str  # one line: what was calibrated from what
    verdict: Verdict
    reasons: list[str]  # of the verdict, plain sentences
    apply: Callable[[libloc.Rig], None] | None  # puts the result into a rig; None: there is no result
    facts: list[tuple[str, str]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # what the user should know beside the verdict
    counts: dict[str, int] = field(default_factory=dict)  # of reading


def verdict_text(verdict: Verdict) -> str:
    return _PLAIN[verdict]


def with_sigma(value: float, sigma: float | None, scale: float = 1.0) -> str:
    """ "12.345 ± 0.012": as many digits as the deviation has meaning for."""
    value *= scale
    # Not known, or nothing but rounding: a parameter that the method does not estimate.
    if sigma is None or not 1e-12 * abs(value) < sigma * scale < float("inf"):
        return f"{value:.6g}"
    sigma *= scale
    digits = max(0, 1 - int(f"{sigma:e}".split("e")[1]))
    if digits > 12:
        return f"{value:.6g} ± {sigma:.2g}"
    return f"{value:.{digits}f} ± {sigma:.{digits}f}"


def _text_table(table: Table) -> list[str]:
    rows = [table.heading, *table.rows]
    width = [max(len(row[i]) for row in rows) for i in range(len(table.heading))]
    return [
        "  "
        + row[0].ljust(width[0])
        + "".join("  " + cell.rjust(w) for cell, w in zip(row[1:], width[1:], strict=True))
        for row in rows
    ]


def text_of(outcome: Outcome) -> str:
    """For the terminal."""
    lines = [outcome.summary]
    width = max((len(name) for name, _ in outcome.facts), default=0)
    lines += [f"  {name.ljust(width)}  {text}" for name, text in outcome.facts]
    for table in outcome.tables:
        lines += [f"{table.title}:", *_text_table(table)]
    lines += [f"  {name}: {value}" for name, value in outcome.counts.items()]
    lines.append(f"verdict {verdict_text(outcome.verdict)}")
    lines += [f"  - {reason}" for reason in outcome.reasons]
    lines += [f"note: {note}" for note in outcome.notes]
    return "\n".join(lines)


def _escape(text: str) -> str:
    return html.escape(text, quote=True)


def _html_table(table: Table) -> str:
    head = "".join(f"<th>{_escape(cell)}</th>" for cell in table.heading)
    body = "".join(
        "<tr>"
        + f"<th>{_escape(row[0])}</th>"
        + "".join(f"<td>{_escape(cell)}</td>" for cell in row[1:])
        + "</tr>"
        for row in table.rows
    )
    return f"<h2>{_escape(table.title)}</h2><table><tr>{head}</tr>{body}</table>"


_STYLE = """
body { font: 15px/1.45 sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 1.8rem; }
.verdict { color: white; padding: .6rem 1rem; border-radius: 4px; font-weight: bold; }
table { border-collapse: collapse; } th, td { padding: .25rem .8rem; border-bottom: 1px solid #ddd; }
th { text-align: left; font-weight: 600; } td { text-align: right; font-family: monospace; }
td.text { text-align: left; font-family: inherit; } img { max-width: 100%; } figure { margin: 1.5rem 0; }
figcaption { color: #555; } footer { margin-top: 2rem; color: #777; font-size: .85rem; }
"""


def write_report(folder: Path, outcome: Outcome, command: Sequence[str], written: str) -> Path:
    """The pictures as PNG files and all in one report.html, which needs no other file.

    written: what became of the result. Returns the path of report.html.
    """
    folder.mkdir(parents=True, exist_ok=True)
    figures = []
    for picture in outcome.pictures:
        path = folder / f"{picture.name}.png"
        picture.draw().savefig(path, dpi=110)
        data = base64.b64encode(path.read_bytes()).decode()
        figures.append(
            f'<figure><img alt="{_escape(picture.caption)}" src="data:image/png;base64,{data}">'
            f"<figcaption>{_escape(picture.caption)}</figcaption></figure>"
        )
    facts = "".join(
        f'<tr><th>{_escape(name)}</th><td class="text">{_escape(text)}</td></tr>'
        for name, text in outcome.facts
    )
    counts = "".join(
        f"<tr><th>{_escape(name)}</th><td>{value}</td></tr>" for name, value in outcome.counts.items()
    )
    reasons = "".join(f"<li>{_escape(reason)}</li>" for reason in outcome.reasons)
    notes = "".join(f"<li>{_escape(note)}</li>" for note in outcome.notes)
    now = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC")
    parts = [
        f"<h1>Calibration: {_escape(outcome.block)}</h1><p>{_escape(outcome.summary)}</p>",
        '<p class="verdict" style="background: '
        f'{_COLOUR[outcome.verdict]}">{_escape(verdict_text(outcome.verdict))}</p>',
        f"<ul>{reasons}</ul>" if reasons else "",
        f"<p>{_escape(written)}</p>",
        f"<ul>{notes}</ul>" if notes else "",
        f"<table>{facts}</table>",
        *(_html_table(table) for table in outcome.tables),
        "<h2>Pictures</h2>" if figures else "",
        *figures,
        f"<h2>What was read</h2><table>{counts}</table>" if counts else "",
        f"<footer><code>{_escape(' '.join(command))}</code><br>libloc {libloc.__version__}, {now}</footer>",
    ]
    path = folder / "report.html"
    path.write_text(
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f"<title>Calibration: {_escape(outcome.block)}</title><style>{_STYLE}</style></head><body>"
        + "\n".join(part for part in parts if part)
        + "</body></html>\n",
        encoding="utf-8",
    )
    return path
