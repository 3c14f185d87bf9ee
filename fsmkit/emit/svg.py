"""Colours of SVG pictures for readers who prefer a dark page."""

from __future__ import annotations

DARK = {
    "white": "#1c232a", "#ffffff": "#1c232a", "#f5f7fa": "#252e37",
    "#1f2933": "#e6eaee", "#52606d": "#b4bfc9", "#8490a0": "#8b98a6", "black": "#e6eaee",
    "#9aa5b1": "#6b7884", "#dbe2ea": "#3a454f", "#b45309": "#ffb066",
    "#ffd66b": "#6b5200", "#b7791f": "#ffd25e", "#fff8e1": "#3d3416",
    "#b91c1c": "#ff8a80", "#fef2f2": "#3b2022", "#15803d": "#7ed491", "#f0fdf4": "#1c3324",
}  # fmt: skip
"""The dark colour for each light colour of drawings of charts, systems and sequences."""


def _rules() -> str:
    return "".join(
        f'[{attribute}="{light}"]{{{attribute}:{dark}}}'
        for light, dark in DARK.items()
        for attribute in ("fill", "stroke")
    )


STYLE = f"<style>@media (prefers-color-scheme: dark){{{_rules()}}}</style>"
"""Style rules take precedence over the attributes of shapes (SVG 1.1, 6.4)."""


def with_dark_colours(svg: str) -> str:
    """Return an SVG document whose colours follow the reader's preference for dark or light."""
    start = svg.index(">", svg.index("<svg")) + 1
    return f"{svg[:start]}\n{STYLE}{svg[start:]}"
