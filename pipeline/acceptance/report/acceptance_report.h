#pragma once

#include <string>
#include <vector>

#include "pipeline/acceptance/acceptance.h"

namespace scanrig::acceptance {

/// One model that was measured.
struct Measurement {
  std::string model;  ///< its file, as named
  Acceptance found;
};

struct AcceptanceReport {
  Artefact artefact;
  std::string date;  ///< ISO 8601
  std::vector<Measurement> measurements;

  [[nodiscard]] std::vector<AcceptanceResult> worst() const;
  [[nodiscard]] bool passes() const;
};

/// acceptance.html: results against their limits, and where on the artefact the errors are; one page without scripts or
/// other files. Same input, same bytes.
std::string acceptance_html(const AcceptanceReport& report);

/// The same results for programs, docs/reference/acceptance.md.
std::string acceptance_json(const AcceptanceReport& report);

/// The artefact as its certificate states it: "sphere of 25.000 mm, U = 0.0010 mm".
std::string describe(const Artefact& artefact);

/// "pass", "fail", with ", within U of the limit"; empty without a limit.
std::string verdict_words(const AcceptanceResult& result);

}  // namespace scanrig::acceptance
