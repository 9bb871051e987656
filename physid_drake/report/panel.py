"""A panel of words over Meshcat's static page, which opens without a network."""

from __future__ import annotations

_STYLE = """
<style>
  #physid { position: fixed; top: 0; left: 0; max-width: 33em; margin: 10px; padding: 10px 14px; max-height: 94vh;
    overflow: auto; font: 13px/1.45 system-ui, sans-serif; background: rgba(255, 255, 255, .92); color: #222;
    border-radius: 6px; box-shadow: 0 1px 6px rgba(0, 0, 0, .3); z-index: 10; }
  #physid h1 { font-size: 16px; margin: 0 0 4px; } #physid h2 { font-size: 13px; margin: 10px 0 2px; }
  #physid table { border-collapse: collapse; } #physid td, #physid th { padding: 1px 8px 1px 0; text-align: right;
    font-weight: normal; } #physid th { color: #666; }
  #physid td:first-child, #physid th:first-child { text-align: left; }
  #physid .dot { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin: 0 4px 0 10px; }
  #physid svg { display: block; width: 100%; height: auto; margin: 6px 0; }
  #physid summary { cursor: pointer; } #physid select { max-width: 100%; }
</style>
"""


def with_panel(html: str, panel: str) -> str:
    """Meshcat's static page with a panel, an element of id "physid", at its left."""
    body_end = html.rindex("</body>")
    return html[:body_end] + _STYLE + panel + html[body_end:]
