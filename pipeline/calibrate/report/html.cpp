#include "pipeline/calibrate/report/html.h"

#include <fmt/format.h>

#include <cmath>

namespace scanrig::report {

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

std::string row_of(const std::string& figures) { return fmt::format("<div class=\"row\">\n{}</div>\n", figures); }

}  // namespace scanrig::report
