"""The frame of a report: one HTML page, dark or light as the reader likes it, and good on paper."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from html import escape
from typing import Final

STYLE: Final = """
:root{color-scheme:light dark;--page:#f5f4f0;--card:#fff;--line:#dcd9d0;--ink:#1b1f24;--quiet:#555b63;--accent:#a83806;
--second:#5b6b80;--good:#12613a;--road:#3a3f47;--border:#1b1f24}
@media(prefers-color-scheme:dark){:root{--page:#101418;--card:#181d23;--line:#2a313a;--ink:#edf0f3;--quiet:#9aa4b0;
--accent:#ff8a3d;--second:#8fa3ba;--good:#57cf92;--road:#3b444f;--border:#d8dde3}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);
font:16px/1.5 ui-sans-serif,system-ui,"Segoe UI",Roboto,sans-serif}
main{max-width:1020px;margin:0 auto;padding:48px clamp(16px,4vw,40px) 80px}
h1{font-size:2.4rem;line-height:1.1;letter-spacing:-.025em;margin:0 0 4px;overflow-wrap:anywhere}
h2{font-size:1.2rem;margin:0 0 12px;letter-spacing:-.01em}
p{margin:0 0 12px;color:var(--quiet)}
.brand{color:var(--accent);font-weight:700;letter-spacing:-.01em;margin:0 0 18px}
section{background:var(--card);border:1px solid var(--line);border-radius:14px;padding:24px;margin-top:24px;
break-inside:avoid-page}
section.long{break-inside:auto}
dl{display:flex;flex-wrap:wrap;gap:16px 36px;margin:24px 0 0}
dl div{display:grid}dt{color:var(--quiet);font-size:.84rem}
dd{margin:0;font-size:1.45rem;font-weight:680;font-variant-numeric:tabular-nums;letter-spacing:-.015em}
dd small{display:block;font-size:.78rem;font-weight:400;color:var(--quiet);letter-spacing:0}
figure{margin:0 0 14px}figcaption{font-weight:600;font-size:.92rem;display:flex;gap:14px;flex-wrap:wrap}
.keys{font-weight:400;color:var(--quiet);display:flex;gap:14px;flex-wrap:wrap}
.key::before{content:"";display:inline-block;width:16px;height:3px;margin-right:6px;vertical-align:4px;
background:var(--accent)}
.key.second::before{background:var(--second)}
.key.dots::before{background:var(--good);width:8px;height:8px;border-radius:50%;vertical-align:0}
svg{width:100%;display:block}svg text{font-size:12px;fill:var(--quiet)}svg.track{max-height:620px}
svg text.corner{fill:var(--quiet);font-weight:650}
.grid{stroke:var(--line)}.mark{stroke:var(--good);stroke-dasharray:4 4}
.curve{fill:none;stroke:var(--accent);stroke-width:2;stroke-linejoin:round}.curve.second{stroke:var(--second)}
circle.dots{fill:var(--good)}.fan circle.dots{fill:var(--accent)}.arrow{stroke:var(--accent);stroke-width:1.6}
.band0{fill:transparent}.band1{fill:var(--second);opacity:.14}
.car{fill:var(--ink)}.road{fill:var(--road);stroke:var(--border)}.start{stroke:#fff}
.line path{stroke-linecap:round;fill:none}.exits{stroke:#ff5a4d;fill:none}
.bar{flex-wrap:nowrap;justify-content:center;color:var(--quiet);font-weight:400;align-items:center;margin-top:8px}
.bar span{display:inline-flex;border-radius:4px;overflow:hidden}.bar i{width:min(8px,1.5vw);height:10px}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;font-size:.92rem}
th{text-align:left;color:var(--quiet);font-weight:560;font-size:.84rem}
th,td{padding:6px 14px 6px 0;border-bottom:1px solid var(--line);overflow-wrap:anywhere}
tr:last-child td{border-bottom:0}.scroll{overflow-x:auto}
.heat th,.heat td{white-space:nowrap}.heat td:nth-child(2){white-space:normal;min-width:6em}
.settings{columns:2;column-gap:36px;font-size:.9rem}
.settings p{display:flex;justify-content:space-between;gap:16px;margin:0;
padding:4px 0;border-bottom:1px solid var(--line);
break-inside:avoid}.settings b{font-weight:600;color:var(--ink);text-align:right;overflow-wrap:anywhere}
.two{display:grid;grid-template-columns:minmax(0,1fr) minmax(0,1.2fr);gap:28px;align-items:start}
pre{margin:0;white-space:pre-wrap;overflow-wrap:anywhere;
font:13.5px/1.55 ui-monospace,"SF Mono",Menlo,Consolas,monospace;tab-size:4}
.stage{width:100%;aspect-ratio:16/9;display:block;border-radius:12px;background:#dfe6ea}
.controls{display:flex;gap:12px;align-items:center;margin-top:12px;flex-wrap:wrap}
.controls input{flex:1;min-width:120px;accent-color:var(--accent)}
.controls span{font-variant-numeric:tabular-nums;font-size:.9rem}
button,.button{font:inherit;font-weight:600;color:var(--ink);background:var(--page);border:1px solid var(--line);
border-radius:10px;padding:8px 16px;min-height:42px;cursor:pointer;text-decoration:none;display:inline-block}
button[aria-pressed=true]{border-color:var(--accent)}
footer{color:var(--quiet);font-size:.84rem;margin-top:28px}
@media(max-width:640px){.settings{columns:1}.two{grid-template-columns:minmax(0,1fr)}section{padding:16px}h1{font-size:1.8rem}}
@media print{:root{--page:#fff;--card:#fff;--line:#ddd;--ink:#000;--quiet:#444;--accent:#a83806;--second:#5b6b80;
--good:#12613a;--road:#555;--border:#000}body{font-size:11pt}main{max-width:none;padding:0}
section{border:0;padding:0;margin-top:28px}svg.track{max-height:150mm}
*{-webkit-print-color-adjust:exact;print-color-adjust:exact}@page{margin:16mm}}
"""

POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'"
"""What the page may load: nothing; its style is inside it, and so is the one script that it may have."""


def page(
    name: str,
    lead: str,
    figures: Sequence[tuple[str, str, str]],
    hero: str,
    sections: Sequence[str],
    *,
    versions: Mapping[str, str],
    script: str = "",
    language: str = "en",
) -> str:
    """The whole document.

    Args:
        name: The run's, plain text.
        lead: Below it, HTML.
        figures: What, how much, and a remark; plain text.
        hero: The large picture, HTML.
        sections: As `section` makes them; empty ones are left out.
        versions: Of what made the run; plain text.
        script: Runs at the end of the page, which allows none but this one.
        language: Of its words.
    """
    listed = "".join(
        f"<div><dt>{escape(what)}</dt><dd>{escape(value)}{f'<small>{escape(note)}</small>' if note else ''}</dd></div>"
        for what, value, note in figures
    )
    made = " · ".join(f"{escape(what)} {escape(str(version))}" for what, version in versions.items())
    policy, last = POLICY, ""
    if script:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        policy, last = f"{POLICY}; script-src 'sha256-{digest}'", f"<script>{script}</script>"
    return (
        f'<!doctype html>\n<html lang="{language}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>{escape(name)} · Racecraft</title><style>{STYLE}</style></head><body><main>"
        f'<p class="brand">Racecraft</p><h1>{escape(name)}</h1><p>{lead}</p><dl>{listed}</dl>'
        f"{f'<section>{hero}</section>' if hero else ''}{''.join(sections)}"
        f"<footer>{made}</footer></main>{last}</body></html>\n"
    )


def section(title: str, content: str) -> str:
    """A part of the page with a heading; empty where it has no content."""
    if not content:
        return ""
    kind = ' class="long"' if len(content) > 40_000 or "<pre" in content or content.count("<tr>") > 24 else ""
    return f"<section{kind}><h2>{escape(title)}</h2>{content}</section>"


def pairs(rows: Sequence[tuple[str, str]]) -> str:
    """Names and values in two columns; plain text."""
    listed = "".join(f"<p>{escape(name)} <b>{escape(value)}</b></p>" for name, value in rows)
    return f'<div class="settings">{listed}</div>'


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; cells are plain text."""
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
