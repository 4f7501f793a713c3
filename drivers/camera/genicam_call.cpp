#include "drivers/camera/genicam_call.h"

#include <algorithm>
#include <cmath>

namespace scanrig {
namespace {

/// Reads with `read`; where the value is not `value` by `is_same`, writes it with `write` and reads it again.
template <class Value, class Read, class Write, class IsSame>
Result<void> make_have(const char* feature, const Value& value, const GenicamCall& attempt, Read read, Write write,
                       IsSame is_same) {
  Value got{};
  const auto read_now = [&] {
    return attempt(fmt::format("read {}", feature), [&](GError** error) { got = read(error); });
  };
  if (auto done = read_now(); !done || is_same(got)) return done;
  auto written = attempt(fmt::format("set {} to {}", feature, value), [&](GError** error) { write(error); });
  if (!written) return written;
  if (auto done = read_now(); !done || is_same(got)) return done;
  return fail(ErrorCode::invalid_input, "{}: {} stays {} although it was set to {}; set it with the maker's program",
              attempt.who(), feature, got, value);
}

}  // namespace

Result<void> GenicamCall::refused(const std::string& what, GError* error) const {
  auto code = ErrorCode::io;
  if (g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT)) code = ErrorCode::timeout;
  if (g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND)) code = ErrorCode::not_found;
  if (g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_FEATURE_NOT_FOUND) ||
      g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_INVALID_PARAMETER) || error->domain == ARV_GC_ERROR) {
    code = ErrorCode::invalid_input;
  }
  const std::string reason = error->message;
  g_error_free(error);
  return fail(code, "{}: {}: {}", who_, what, reason);
}

bool has_feature(ArvCamera* camera, const char* feature) {
  GError* error = nullptr;
  const bool there = arv_camera_is_feature_available(camera, feature, &error);
  const bool known = !error;
  g_clear_error(&error);
  return there && known;
}

bool has_entry(ArvCamera* camera, const char* feature, const std::string& entry) {
  GError* error = nullptr;
  const bool there = arv_camera_is_enumeration_entry_available(camera, feature, entry.c_str(), &error);
  g_clear_error(&error);
  return there;
}

std::vector<std::string> entries_of(ArvCamera* camera, const char* feature) {
  GError* error = nullptr;
  guint count = 0;
  const char** names = arv_camera_dup_available_enumerations_as_strings(camera, feature, &count, &error);
  std::vector<std::string> entries;
  for (guint i = 0; names && i < count; ++i) entries.emplace_back(names[i]);
  g_free(names);
  g_clear_error(&error);
  return entries;
}

Result<std::string> read_text(ArvCamera* camera, const char* feature, const GenicamCall& attempt) {
  std::string text;
  auto read = attempt(fmt::format("read {}", feature), [&](GError** error) {
    if (const char* found = arv_camera_get_string(camera, feature, error)) text = found;
  });
  if (!read) return pass_on(read);
  return text;
}

Result<void> set_text(ArvCamera* camera, const char* feature, const std::string& value, const GenicamCall& attempt) {
  const auto read = [&](GError** error) {
    const char* found = arv_camera_get_string(camera, feature, error);
    return std::string(found ? found : "");
  };
  const auto write = [&](GError** error) { arv_camera_set_string(camera, feature, value.c_str(), error); };
  return make_have(feature, value, attempt, read, write, [&](const std::string& got) { return got == value; });
}

Result<void> set_whole(ArvCamera* camera, const char* feature, std::int64_t value, const GenicamCall& attempt) {
  const auto read = [&](GError** error) -> std::int64_t { return arv_camera_get_integer(camera, feature, error); };
  const auto write = [&](GError** error) { arv_camera_set_integer(camera, feature, value, error); };
  return make_have(feature, value, attempt, read, write, [&](std::int64_t got) { return got == value; });
}

Result<void> set_entry_if_present(ArvCamera* camera, const char* feature, const std::string& entry,
                                  const GenicamCall& attempt) {
  if (!has_feature(camera, feature) || !has_entry(camera, feature, entry)) return {};
  return set_text(camera, feature, entry, attempt);
}

Result<void> set_flag_if_present(ArvCamera* camera, const char* feature, bool value, const GenicamCall& attempt) {
  if (!has_feature(camera, feature)) return {};
  const auto read = [&](GError** error) { return arv_camera_get_boolean(camera, feature, error) != FALSE; };
  const auto write = [&](GError** error) { arv_camera_set_boolean(camera, feature, value ? TRUE : FALSE, error); };
  return make_have(feature, value, attempt, read, write, [&](bool got) { return got == value; });
}

Result<void> set_whole_if_present(ArvCamera* camera, const char* feature, std::int64_t value,
                                  const GenicamCall& attempt) {
  if (!has_feature(camera, feature)) return {};
  return set_whole(camera, feature, value, attempt);
}

Result<void> set_number_if_present(ArvCamera* camera, const char* feature, double value, double tolerance,
                                   const GenicamCall& attempt) {
  if (!has_feature(camera, feature)) return {};
  double low = value, high = value;
  auto bounds = attempt(fmt::format("read the limits of {}", feature),
                        [&](GError** error) { arv_camera_get_float_bounds(camera, feature, &low, &high, error); });
  if (!bounds) return bounds;
  const double nearest = low <= high ? std::clamp(value, low, high) : value;
  const auto read = [&](GError** error) { return arv_camera_get_float(camera, feature, error); };
  const auto write = [&](GError** error) { arv_camera_set_float(camera, feature, nearest, error); };
  return make_have(feature, nearest, attempt, read, write,
                   [&](double got) { return std::abs(got - nearest) <= tolerance; });
}

Result<void> execute(ArvCamera* camera, const char* command, const GenicamCall& attempt) {
  return attempt(fmt::format("execute {}", command),
                 [&](GError** error) { arv_camera_execute_command(camera, command, error); });
}

}  // namespace scanrig
