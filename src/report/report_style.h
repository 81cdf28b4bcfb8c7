// The report's style sheet.
#pragma once

#include <string_view>

namespace trammel::report {

inline constexpr std::string_view kReportStyle = R"css(
:root{color-scheme:light dark;--page:#f4f6f8;--card:#fff;--ink:#1d2430;--muted:#5a6472;--edge:#d8dee5;
--good:#0a5fa5;--warn:#8a4b00;--bad:#a32014;--code:#eef1f5}
@media(prefers-color-scheme:dark){:root{--page:#14181e;--card:#1d232b;--ink:#e8ecf1;--muted:#a3adba;
--edge:#333c47;--good:#7cc0f2;--warn:#f2b25c;--bad:#ff9a8c;--code:#2a323c}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:16px/1.5 system-ui,"DejaVu Sans",sans-serif}
main{max-width:860px;margin:0 auto;padding:20px 16px 48px}
h1{font-size:1.25rem;margin:0}h2{font-size:1.1rem;margin:0 0 10px}p{margin:.5em 0}
.facts{color:var(--muted);font-size:.9rem;margin:2px 0 16px;overflow-wrap:anywhere}
.card{background:var(--card);border:1px solid var(--edge);border-radius:10px;padding:16px 20px;margin:0 0 16px}
.head{border-left:6px solid var(--good)}.head.cannot_tell{border-left-color:var(--warn)}
.head.refused{border-left-color:var(--bad)}
.value{font-size:2.1rem;font-weight:700;line-height:1.2;margin:0}
.value small{font-size:1.2rem;font-weight:600;color:var(--muted)}
.verdict{display:inline-block;font-weight:700;border:1.5px solid currentColor;border-radius:99px;
padding:1px 12px;font-size:.9rem;color:var(--good)}
.cannot_tell .verdict{color:var(--warn)}.refused .verdict{color:var(--bad)}
.reason{font-size:1.05rem;overflow-wrap:anywhere}.quiet{color:var(--muted);font-size:.92rem}
pre{background:var(--code);border-radius:6px;padding:10px 12px;margin:6px 0 12px;overflow-x:auto;
font:14px/1.45 "DejaVu Sans Mono",monospace}
code{font:.92em "DejaVu Sans Mono",monospace}
.wide{overflow-x:auto}table{border-collapse:collapse;width:100%;font-size:.92rem}
th,td{padding:5px 10px;text-align:right;border-bottom:1px solid var(--edge);white-space:nowrap}
th{color:var(--muted);font-weight:600}th:first-child,td:first-child{text-align:left;padding-left:0}
td.text{text-align:left;white-space:normal;min-width:13em;overflow-wrap:anywhere}tr.unused{color:var(--muted)}
figure{margin:0}figure img{display:block;width:100%;min-width:560px;height:auto;background:#fff;border-radius:6px}
figcaption{font-size:.92rem;color:var(--muted);margin-top:10px}
li{margin:.3em 0;overflow-wrap:anywhere}ul{margin:0;padding-left:1.2em}
footer{color:var(--muted);font-size:.85rem}
@media print{:root{color-scheme:light;--page:#fff;--card:#fff;--ink:#000;--muted:#444;--edge:#bbb;
--good:#0a5fa5;--warn:#8a4b00;--bad:#a32014;--code:#f2f2f2}
main{max-width:none;padding:0}.card{break-inside:avoid;padding:10px 12px}figure img{min-width:0}
.wide{overflow:visible}body{font-size:11pt}}
)css";

}  // namespace trammel::report
