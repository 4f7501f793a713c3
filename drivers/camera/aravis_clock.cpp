#include "drivers/camera/aravis_setup.h"

#include <array>
#include <cstdlib>

namespace scanrig {
namespace {

/// Names of the features in SFNC 2.7, 26, and in older cameras.
struct PtpNames {
  const char *enable, *status, *latch, *offset;
};
constexpr std::array kPtp{
    PtpNames{"PtpEnable", "PtpStatus", "PtpDataSetLatch", "PtpOffsetFromMaster"},
    PtpNames{"GevIEEE1588", "GevIEEE1588Status", "GevIEEE1588DataSetLatch", "GevIEEE1588OffsetFromMaster"}};

const PtpNames* ptp_names(ArvCamera* camera) {
  for (const PtpNames& names : kPtp) {
    if (has_feature(camera, names.enable)) return &names;
  }
  return nullptr;
}

/// True once the clock follows another or is the one that others follow.
bool is_settled(const std::string& status) { return status == "Slave" || status == "Master"; }

Result<std::int64_t> offset_ns(ArvCamera* camera, const PtpNames& names, const GenicamCall& attempt) {
  if (!has_feature(camera, names.offset)) return 0;
  if (has_feature(camera, names.latch)) {
    if (auto latched = execute(camera, names.latch, attempt); !latched) return pass_on(latched);
  }
  std::int64_t offset = 0;
  auto read = attempt(fmt::format("read {}", names.offset),
                      [&](GError** error) { offset = arv_camera_get_integer(camera, names.offset, error); });
  if (!read) return pass_on(read);
  return offset;
}

Result<void> wait_for_ptp(ArvCamera* camera, const PtpNames& names, Clock& clock, Deadline deadline,
                          const GenicamCall& attempt) {
  constexpr auto kPoll = std::chrono::milliseconds(20);
  constexpr std::int64_t kCloseNs = 100'000;  // a tenth of what left and right may differ by
  for (;;) {
    const auto status = read_text(camera, names.status, attempt);
    if (!status) return pass_on(status);
    const auto offset = offset_ns(camera, names, attempt);
    if (!offset) return pass_on(offset);
    if (is_settled(*status) && std::abs(*offset) <= kCloseNs) return {};
    if (deadline.left(clock) <= kPoll) {
      return fail(ErrorCode::timeout,
                  "{}: its clock does not follow PTP in time ({}, {} us beside it); check the clock and the switch",
                  attempt.who(), *status, *offset / 1000);
    }
    clock.sleep_for(kPoll);
  }
}

}  // namespace

bool has_ptp_on(ArvCamera* camera) {
  const PtpNames* names = ptp_names(camera);
  return names && arv_camera_get_boolean(camera, names->enable, nullptr) != FALSE;
}

Result<void> set_up_clock(ArvCamera* camera, const AravisOptions& options, Clock& clock, Deadline deadline,
                          const GenicamCall& attempt) {
  if (options.frame_clock != TriggeringOptions::FrameClock::ptp) return {};
  const PtpNames* names = ptp_names(camera);
  if (!names) {
    return fail(ErrorCode::unsupported, "{}: the camera has no PTP; use clock = \"interval\"", attempt.who());
  }
  if (auto on = set_flag_if_present(camera, names->enable, true, attempt); !on) return on;
  return wait_for_ptp(camera, *names, clock, deadline, attempt);
}

}  // namespace scanrig
