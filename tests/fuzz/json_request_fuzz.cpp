#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/api/request.h"
#include "daemon/api/route.h"

namespace {

using namespace scanrig;

void check(const RequestField& field, const Values& values) {
  const auto number = values.number(field.name);
  const auto integer = values.integer(field.name);
  const auto text = values.text(field.name);
  const auto within = [&](double value) { return std::isfinite(value) && value >= field.min && value <= field.max; };
  if (number && !within(*number)) std::abort();
  if (integer && !within(static_cast<double>(*integer))) std::abort();
  if (text && field.words.empty() && !within(static_cast<double>(text->size()))) std::abort();
  if (field.required && !values.has(field.name)) std::abort();
}

}  // namespace

// A body of any bytes: every field has the type of the route's schema, or nothing is taken. Tried with the body of
// every route and with one that has fields of all types.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using Type = RequestField::Type;
  static const std::vector<RequestField> all_types{
      {.name = "t", .description = "", .required = true, .min = 1, .max = 8},
      {.name = "w", .description = "", .words = {"a", "b"}},
      {.name = "n", .type = Type::number, .description = "", .min = -1, .max = 1},
      {.name = "i", .type = Type::integer, .description = "", .min = -5, .max = 5},
      {.name = "f", .type = Type::flag, .description = ""}};
  static const Router router;
  const std::string_view body(reinterpret_cast<const char*>(data), size);
  const auto attempt = [&](const std::vector<RequestField>& fields) {
    Values values;
    const auto read = read_body(body, fields, values);
    if (!read && (read.error().code != ErrorCode::invalid_input || read.error().message.empty())) std::abort();
    if (!read) return;
    for (const auto& field : fields) check(field, values);
  };
  attempt(all_types);
  for (const auto& route : router.routes()) attempt(route.in_body);
  return 0;
}
