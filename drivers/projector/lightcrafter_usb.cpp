#include <libusb.h>

#include <algorithm>

#include "drivers/projector/lightcrafter_transport.h"

namespace scanrig::dlpc350 {
namespace {

constexpr std::uint16_t kVendor = 0x0451, kProduct = 0x6401;
constexpr int kInterface = 0;
constexpr std::uint8_t kOut = 0x01, kIn = 0x81;

struct Context {
  Context() { libusb_init(&context); }
  ~Context() {
    if (context) libusb_exit(context);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  libusb_context* context = nullptr;
};

tl::unexpected<Error> failed(const char* what, int code) {
  auto kind = ErrorCode::io;
  if (code == LIBUSB_ERROR_TIMEOUT) kind = ErrorCode::timeout;
  if (code == LIBUSB_ERROR_NOT_FOUND) kind = ErrorCode::not_found;
  return fail(kind, "LightCrafter: {}: {}", what, libusb_strerror(code));
}

class Usb final : public Transport {
 public:
  Usb(std::unique_ptr<Context> context, libusb_device_handle* handle, Clock& clock)
      : context_(std::move(context)), handle_(handle), clock_(clock) {}
  ~Usb() override {
    libusb_release_interface(handle_, kInterface);
    libusb_close(handle_);
  }

  Result<void> send(const Report& report, Deadline deadline) override {
    Report bytes = report;
    return transfer(kOut, bytes, deadline, "send");
  }
  Result<Report> receive(Deadline deadline) override {
    Report bytes{};
    if (auto received = transfer(kIn, bytes, deadline, "receive"); !received) return pass_on(received);
    return bytes;
  }

 private:
  Result<void> transfer(std::uint8_t endpoint, Report& bytes, Deadline deadline, const char* what) {
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(deadline.left(clock_)).count();
    int moved = 0;
    // 0 would mean no limit.
    const auto limit = static_cast<unsigned>(std::clamp<long>(wait, 1, 60'000));
    const int code =
        libusb_interrupt_transfer(handle_, endpoint, bytes.data(), static_cast<int>(bytes.size()), &moved, limit);
    if (code != 0) return failed(what, code);
    if (moved != static_cast<int>(bytes.size())) {
      return fail(ErrorCode::protocol, "LightCrafter: {}: {} bytes instead of {}", what, moved, bytes.size());
    }
    return {};
  }

  std::unique_ptr<Context> context_;
  libusb_device_handle* handle_;
  Clock& clock_;
};

std::string serial_of(libusb_device_handle* handle, const libusb_device_descriptor& descriptor) {
  std::array<unsigned char, 64> text{};
  const int length = libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber, text.data(), text.size());
  return length > 0 ? std::string(text.begin(), text.begin() + length) : std::string();
}

Result<std::unique_ptr<Transport>> open_usb(const std::string& serial, Clock& clock) {
  auto context = std::make_unique<Context>();
  if (!context->context) return fail(ErrorCode::io, "LightCrafter: USB cannot be used on this machine");
  libusb_device** devices = nullptr;
  const auto count = libusb_get_device_list(context->context, &devices);
  libusb_device_handle* handle = nullptr;
  int reason = LIBUSB_ERROR_NOT_FOUND, matches = 0;
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(devices[i], &descriptor) != 0) continue;
    if (descriptor.idVendor != kVendor || descriptor.idProduct != kProduct) continue;
    libusb_device_handle* candidate = nullptr;
    const int opened = libusb_open(devices[i], &candidate);
    if (opened != 0) {
      reason = opened;
      continue;
    }
    const bool wanted = serial.empty() || serial_of(candidate, descriptor) == serial;
    matches += wanted;
    if (wanted && !handle) {
      handle = candidate;
    } else {
      libusb_close(candidate);
    }
  }
  if (count >= 0) libusb_free_device_list(devices, 1);
  if (!handle) {
    return failed(serial.empty() ? "no LightCrafter 4500 on USB" : "no LightCrafter 4500 with this serial number",
                  reason);
  }
  if (matches > 1) {
    libusb_close(handle);
    return fail(ErrorCode::not_found, "LightCrafter: {} of them on USB; say which by its serial number", matches);
  }
  libusb_set_auto_detach_kernel_driver(handle, 1);  // the kernel takes it for a HID
  if (const int claimed = libusb_claim_interface(handle, kInterface); claimed != 0) {
    libusb_close(handle);
    return failed("use its interface", claimed);
  }
  return std::make_unique<Usb>(std::move(context), handle, clock);
}

}  // namespace

OpenTransport usb_transport(std::string serial, Clock& clock) {
  return [serial = std::move(serial), &clock] { return open_usb(serial, clock); };
}

}  // namespace scanrig::dlpc350
