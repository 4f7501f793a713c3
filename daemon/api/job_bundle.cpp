#include "daemon/api/job_bundle.h"

#include <unistd.h>

#include <atomic>

#include "daemon/api/folder_files.h"

namespace scanrig {
namespace {

constexpr std::string_view kPrefix = ".bundle-", kEnding = ".tar.gz";

void send_packed(const std::filesystem::path& packed, const Send& send) {
  const auto file = open_below(packed.parent_path(), packed.filename().string());
  ::unlink(packed.c_str());
  if (!file) return send(error_response(file.error()));
  send({.body = *file, .type = media_type(kEnding)});
}

}  // namespace

void send_bundle(const ApiStation& station, const Values& values, Send send) {
  static std::atomic<unsigned> number = 0;
  if (!find_job(station, values)) return send(no_such_job());
  const auto packed = station.storage / fmt::format("{}{}{}", kPrefix, ++number, kEnding);
  const event::JobRequested asked{.what = event::JobRequested::What::bundle, .job = *values.text("id"), .path = packed};
  // The reply comes on the control loop's thread, which must not touch the disk.
  station.loop.ask(asked,
                   [send = std::move(send), packed, on_worker = station.on_worker](const Result<std::string>& done) {
                     if (!done) return send(error_response(done.error()));
                     on_worker([send, packed] { send_packed(packed, send); });
                   });
}

void remove_old_bundles(const std::filesystem::path& storage) {
  std::error_code error;
  for (std::filesystem::directory_iterator next(storage, error), end; !error && next != end; next.increment(error)) {
    std::error_code ignored;
    if (!next->path().filename().string().starts_with(kPrefix)) continue;
    std::filesystem::remove_all(next->path(), ignored);  // half packed ones too
  }
}

}  // namespace scanrig
