#include <arv.h>

#include <memory>

#include "drivers/camera/camera_list.h"

namespace scanrig {
namespace {

std::string text(const char* words) { return words ? words : ""; }

}  // namespace

std::vector<FoundCamera> find_aravis_cameras() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    found.push_back({text(arv_get_device_protocol(i)),
                     text(arv_get_device_vendor(i)) + " " + text(arv_get_device_model(i)),
                     text(arv_get_device_serial_nbr(i)), text(arv_get_device_address(i))});
  }
  return found;
}

Result<CameraCapabilities> aravis_capabilities(const std::string& serial) {
  arv_update_device_list();
  const char* id = nullptr;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    if (text(arv_get_device_serial_nbr(i)) == serial) id = arv_get_device_id(i);
  }
  if (!id)
    return fail(ErrorCode::not_found, "no camera {} on the network or USB; check power, cable and network", serial);
  GError* problem = nullptr;
  const std::unique_ptr<ArvCamera, decltype(&g_object_unref)> camera(arv_camera_new(id, &problem), &g_object_unref);
  CameraCapabilities capabilities;
  const auto list = [&](auto read, std::vector<std::string>& names) {
    guint count = 0;
    const char** const all = problem ? nullptr : read(camera.get(), &count, &problem);
    for (guint i = 0; all && i < count; ++i) names.emplace_back(all[i]);
    g_free(all);
  };
  list(arv_camera_dup_available_pixel_formats_as_strings, capabilities.pixel_formats);
  list(arv_camera_dup_available_trigger_sources, capabilities.trigger_sources);
  if (!problem) return capabilities;
  const std::string why = text(problem->message);
  g_clear_error(&problem);
  return fail(ErrorCode::io, "camera {} cannot be read: {}; stop the program that uses it", serial, why);
}

}  // namespace scanrig
