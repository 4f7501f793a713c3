#include "drivers/camera/genicam_call.h"

namespace scanrig {

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

Result<void> set_text(ArvCamera* camera, const char* feature, const std::string& value, const GenicamCall& attempt) {
  return attempt(fmt::format("set {} to {}", feature, value),
                 [&](GError** error) { arv_camera_set_string(camera, feature, value.c_str(), error); });
}

}  // namespace scanrig
