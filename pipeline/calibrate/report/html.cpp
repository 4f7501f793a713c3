#include "pipeline/calibrate/report/html.h"

#include <fmt/format.h>

#include <cmath>

namespace scanrig::report {
namespace {

constexpr std::string_view kStyle = R"css(
body{font:15px/1.45 system-ui,sans-serif;color:#1b1f24;background:#fff;max-width:1120px;margin:24px auto;padding:0 20px}
h1{font-size:26px;margin:0 0 4px}
h2{font-size:20px;margin:36px 0 8px;border-bottom:1px solid #ccd1d6;padding-bottom:4px}
h3{font-size:16px;margin:18px 0 4px}
p,li{max-width:820px}
.grade{display:inline-block;padding:2px 14px;border-radius:6px;color:#fff;background:#1a7f37}
.grade.B{background:#3d7a00}.grade.C{background:#9a6700}.grade.refused{background:#b3261e}
.muted{color:#57606a}
table{border-collapse:collapse;margin:8px 0 14px}
th,td{padding:3px 10px;border-bottom:1px solid #e3e6e9;text-align:left;font-variant-numeric:tabular-nums}
th{color:#57606a;font-weight:600}
.row{display:flex;flex-wrap:wrap;gap:14px;align-items:flex-start}
figure{margin:6px 0}
figcaption{font-size:13px;color:#57606a;max-width:520px}
figure.tile{margin:0}
figure.tile figcaption{font-size:11px;line-height:1.25;width:150px}
svg{display:block;font:11px system-ui,sans-serif}
svg .line{fill:none;stroke:#8a939b;stroke-width:1}
svg .faint{stroke:#d5d9dd}
svg .frame{fill:none;stroke:#8a939b}
svg .lost{fill:#fdf0ef;stroke:#b3261e}
svg .cell{stroke:#fff;stroke-width:1}
svg .disc{stroke:#57606a;stroke-width:.5}
svg .dots{fill:none;stroke:#555;stroke-width:2.2;stroke-linecap:round}
svg .arrows{fill:none;stroke:#0b4f9c;stroke-width:1;stroke-linejoin:round}
svg .arrows.lost{fill:none;stroke:#b3261e}
svg .strong{stroke-width:1.6}
svg .big{stroke-width:5}
svg text{fill:#1b1f24}
svg .middle{text-anchor:middle}svg .start{text-anchor:start}svg .end{text-anchor:end}
svg text.light{fill:#fff}
svg .c0{stroke:#555}svg .c1{stroke:#0072b2}svg .c2{stroke:#e69f00}svg .c3{stroke:#009e73}
svg .c4{stroke:#cc79a7}svg .c5{stroke:#56b4e9}svg .c6{stroke:#d55e00}svg .c7{stroke:#8c6d31}
@media print{section{break-inside:auto}figure{break-inside:avoid}}
)css";

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      default:
        // XML has no control characters.
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
    }
  }
  return out;
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  std::string text = fmt::format("{:.{}f}", value, digits);
  const bool is_zero = text.find_first_not_of("-0.") == std::string::npos;
  return is_zero && text.front() == '-' ? text.substr(1) : text;
}

std::string heading(std::string_view text) { return fmt::format("<h3>{}</h3>\n", escaped(text)); }

std::string paragraph(std::string_view text) { return fmt::format("<p>{}</p>\n", escaped(text)); }

std::string section(std::string_view title, const std::string& content) {
  return fmt::format("<section>\n<h2>{}</h2>\n{}</section>\n", escaped(title), content);
}

std::string table(const Row& head, const std::vector<Row>& rows) {
  std::string out = "<table>\n<tr>";
  for (const std::string& cell : head) out += fmt::format("<th>{}</th>", escaped(cell));
  out += "</tr>\n";
  for (const Row& row : rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += fmt::format("<td>{}</td>", escaped(cell));
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string figure(const std::string& drawing, std::string_view caption, std::string_view style) {
  const std::string named = style.empty() ? "" : fmt::format(" class=\"{}\"", escaped(style));
  return fmt::format("<figure{}>\n{}<figcaption>{}</figcaption>\n</figure>\n", named, drawing, escaped(caption));
}

std::string page(std::string_view title, const std::string& content) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width\"/>\n";
  out += fmt::format("<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n", escaped(title), kStyle);
  return out + content + "</body>\n</html>\n";
}

std::string row_of(const std::string& figures) { return fmt::format("<div class=\"row\">\n{}</div>\n", figures); }

}  // namespace scanrig::report
