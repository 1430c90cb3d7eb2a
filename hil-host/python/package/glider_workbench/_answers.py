"""Answers as tidy frames, which a notebook shows with a forest plot."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from html import escape
from typing import Any

import pandas as pd

from ._flight import unit

#: Rows of a forest plot, and of a table in a notebook, at most.
_ROWS = 16


class Answer(pd.DataFrame):
    """A frame with ``attrs`` (``units``, ``document`` and what its function says) that a notebook shows with its headline and forest plot."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        # What is computed from an answer is a plain frame.
        return pd.DataFrame

    def _repr_html_(self) -> str:
        headline = escape(str(self.attrs.get("headline", "")))
        shown = pd.DataFrame(self).drop(columns=["evidence", "about"], errors="ignore").head(_ROWS)
        more = f"<p>… {len(self) - _ROWS} rows more</p>" if len(self) > _ROWS else ""
        return f"<div><p><b>{headline}</b></p>{forest(self)}{shown.to_html(float_format='{:.4g}'.format, na_rep='', border=0)}{more}</div>"


def answer(rows: Iterable[Mapping[str, Any]], document: Mapping[str, Any], units: Mapping[str, str], headline: str, **about: Any) -> Answer:
    """Rows of a document as a frame."""
    out = Answer(list(rows))
    units = {k: unit(u) for k, u in units.items() if k in out.columns}
    out.attrs.update(headline=headline, units=units, document=dict(document), **about)
    return out


def _finite(*values: Any) -> bool:
    return all(isinstance(v, (int, float)) and math.isfinite(v) for v in values)


def _labels(row: Mapping[Hashable, Any], names: Sequence[str]) -> str:
    return " · ".join(str(row[n]) for n in names if isinstance(row.get(n), (str, int)) and str(row[n]))


def forest(frame: pd.DataFrame) -> str:
    """Values with their 90 % intervals as SVG, each row in its own unit; empty where there is none. The line is no effect, no change."""
    if not {"value", "low", "high"} <= set(frame.columns):
        return ""
    names = [n for n in ("hypothesis", "kind", "parameter", "number", "name") if n in frame.columns]
    names = names[:2] if names[:1] == ["hypothesis"] else names[:1]
    rows = [r for r in frame.to_dict("records") if _finite(r["value"], r["low"], r["high"])][:_ROWS]
    if not rows:
        return ""
    left, width, right, pitch = 300, 260, 240, 22
    middle, height = left + width / 2, pitch * len(rows) + 30
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + width + right}" height="{height}" role="img" font-family="sans-serif" font-size="12">',
        f'<title>Values with 90 % intervals</title><line x1="{middle}" x2="{middle}" y1="4" y2="{height - 24}" stroke="#999" stroke-dasharray="3 3"/>',
    ]
    for k, row in enumerate(rows):
        reach = max(abs(row[c]) for c in ("value", "low", "high")) or 1.0
        value, low, high = (middle + 0.48 * width * row[c] / reach for c in ("value", "low", "high"))
        y = pitch * k + 16
        label = escape(_labels(row, names))
        said = f"{row['value']:.3g} ({row['low']:.3g} to {row['high']:.3g}) {row.get('unit') or ''}".removesuffix(" 1").rstrip()
        out.append(
            f'<text x="{left - 8}" y="{y + 4}" text-anchor="end">{label}</text>'
            f'<line x1="{low:.1f}" x2="{high:.1f}" y1="{y}" y2="{y}" stroke="#1f77b4" stroke-width="2"/>'
            f'<circle cx="{value:.1f}" cy="{y}" r="4" fill="#1f77b4"/><text x="{left + width + 8}" y="{y + 4}">{escape(said)}</text>'
        )
    out.append(f'<text x="{middle}" y="{height - 8}" text-anchor="middle" fill="#666">each row in its own unit; the line is 0</text></svg>')
    return "".join(out)
