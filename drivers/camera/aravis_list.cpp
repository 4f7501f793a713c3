#include <arv.h>

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

}  // namespace scanrig
