#pragma once

#include <string>
#include <string_view>
#include <vector>

/// The parts of a report's page. Texts are escaped here; content is HTML already. The page is well-formed XML.
namespace scanrig::report {

std::string escaped(std::string_view text);

/// A number with `digits` decimals, never "-0"; a dash when it is not finite.
std::string number(double value, int digits);

std::string heading(std::string_view text);  ///< within a section
std::string paragraph(std::string_view text);
std::string section(std::string_view title, const std::string& content);

using Row = std::vector<std::string>;
std::string table(const Row& head, const std::vector<Row>& rows);

/// A drawing over its caption.
std::string figure(const std::string& drawing, std::string_view caption, std::string_view style = "");
/// The whole page, with the style of all reports.
std::string page(std::string_view title, const std::string& content);
/// Figures side by side.
std::string row_of(const std::string& figures);

}  // namespace scanrig::report
