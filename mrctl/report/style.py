"""The style sheet of a report page: dense, themed, readable on a phone and on paper."""

from __future__ import annotations

from mrctl.report.theme import FONT, MONO, figure_css, variables_css

_PAGE = """
*{box-sizing:border-box}
html{color-scheme:light dark;-webkit-text-size-adjust:100%}
body{margin:0;background:var(--bg);color:var(--ink);font:14px/1.45 FONT;overflow-wrap:break-word}
main,body>header,body>footer,body>nav{max-width:872px;margin:0 auto;padding:0 16px}
body>header{padding-top:20px;border-top:3px solid var(--link)}
h1{font-size:22px;line-height:1.2;margin:0}
.subtitle{color:var(--soft);margin:4px 0 0}
nav{font-size:13px}
nav ol{list-style:none;display:flex;flex-wrap:wrap;gap:2px 18px;margin:12px 0 0;padding:6px 0;
border:solid var(--rule);border-width:1px 0}
a{color:var(--link);text-decoration-thickness:1px;text-underline-offset:2px}
nav a{text-decoration:none}
a:hover{text-decoration:underline}
a:focus-visible,summary:focus-visible,.scroll:focus-visible{outline:2px solid var(--link);outline-offset:2px}
section{margin-top:26px}
h2{font-size:16px;line-height:1.25;margin:0 0 6px;padding-bottom:3px;border-bottom:1px solid var(--rule)}
p{margin:0 0 10px;max-width:46em}
code,pre{font-family:MONO;font-size:.92em}
pre{margin:6px 0;padding:6px 8px;background:var(--sunk);overflow-x:auto;white-space:pre-wrap}
figure{margin:14px 0 18px;break-inside:avoid}
figcaption,caption{color:var(--soft);font-size:12.5px;text-align:left}
figcaption{margin-top:4px;max-width:60em}
.narrow{display:none}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:0 24px}
.pair>figure{min-width:0}
.scroll{overflow-x:auto;margin:12px 0 16px}
table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums}
caption{padding-bottom:4px}
caption>span{display:block;position:sticky;left:0;width:fit-content;
max-width:min(100%,calc(100vw - 24px))}
th,td{padding:3px 14px 3px 0;text-align:left;vertical-align:baseline}
th:last-child,td:last-child{padding-right:4px}
thead th{font-weight:600;border-bottom:1px solid var(--ink);vertical-align:bottom}
tbody th{font-weight:400}
tbody tr{border-bottom:1px solid var(--grid)}
tbody tr:last-child{border-bottom:1px solid var(--rule)}
.r{text-align:right;white-space:nowrap}
.c{text-align:center}
.best{font-weight:700}
.best::after{content:"\\2009\\25C2";color:var(--good);margin-right:-.8em}
.tone{font-weight:600;color:var(--c)}
.key{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:1px;margin:12px 0 16px;
background:var(--rule);border:1px solid var(--rule)}
.key>div{background:var(--bg);padding:7px 10px}
.key dt{color:var(--soft);font-size:12.5px}
.key dd{margin:0}
.key .value{font-size:19px;line-height:1.3;font-variant-numeric:tabular-nums}
.key .note{color:var(--soft);font-size:12.5px}
.cards{display:grid;align-items:start;grid-template-columns:repeat(auto-fit,minmax(min(100%,255px),1fr));
gap:12px;margin:12px 0 16px}
.card{border:1px solid var(--rule);border-left:3px solid var(--c,var(--rule));padding:9px 12px;
min-width:0;break-inside:avoid}
.card h3{display:flex;flex-wrap:wrap;gap:2px 8px;align-items:baseline;justify-content:space-between;
font-size:14px;margin:0 0 4px;overflow-wrap:anywhere}
.badge{font-size:12px;font-weight:600;color:var(--c,var(--soft));white-space:nowrap}
.card dl{display:grid;grid-template-columns:auto 1fr;gap:1px 12px;margin:6px 0 0;font-size:13px}
.card dt{color:var(--soft)}
.card dd{margin:0;text-align:right;font-variant-numeric:tabular-nums;min-width:0;overflow-wrap:anywhere}
.card p{font-size:13px;margin:6px 0 0}
details{margin:10px 0 14px}
summary{cursor:pointer;color:var(--link)}
details>.inside{padding-left:12px;border-left:2px solid var(--rule);margin-top:8px}
body>footer{margin-top:34px;padding-top:8px;padding-bottom:24px;color:var(--soft);font-size:12.5px}
footer>div{border-top:1px solid var(--rule);padding-top:8px}
footer p{margin:0 0 4px;max-width:none}
footer code{overflow-wrap:anywhere}
@media (max-width:640px){
.wide{display:none}.narrow{display:block;max-width:460px}.pair{grid-template-columns:minmax(0,1fr)}
h1{font-size:19px}main,body>header,body>footer,body>nav{padding-left:12px;padding-right:12px}
tbody th:first-child{position:sticky;left:0;background:var(--bg);min-width:8.5em;max-width:48vw}
.key{grid-template-columns:1fr 1fr}.key .value{font-size:17px}
}
@media print{
body{font-size:10pt}nav{display:none}.wide{display:block}.narrow{display:none}
.pair{grid-template-columns:1fr 1fr}
.scroll{overflow:visible}a{color:inherit}tr{break-inside:avoid}h2{break-after:avoid}
svg,.card,.key{print-color-adjust:exact;-webkit-print-color-adjust:exact}
details::details-content{content-visibility:visible;display:block;block-size:auto}
@page{margin:15mm}
}
"""


def style_sheet() -> str:
    """All rules of a page, with the variables of both themes."""
    return (
        variables_css() + _PAGE.replace("FONT", FONT).replace("MONO", MONO).replace("\n", "") + figure_css()
    )
