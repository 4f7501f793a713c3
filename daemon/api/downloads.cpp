#include "daemon/api/downloads.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kTypes{{{".gz", "application/gzip"},
                                                                                {".glb", "model/gltf-binary"},
                                                                                {".ply", "application/octet-stream"},
                                                                                {".obj", "model/obj"},
                                                                                {".stl", "model/stl"},
                                                                                {".png", "image/png"},
                                                                                {".jpg", "image/jpeg"},
                                                                                {".json", "application/json"},
                                                                                {".html", "text/html; charset=utf-8"},
                                                                                {".mtl", "text/plain; charset=utf-8"}}};

Result<int> open_component(int folder, const std::string& name, bool last) {
  // O_NONBLOCK: whatever kind of file is there, opening it does not wait.
  const int flags = O_RDONLY | O_CLOEXEC | O_NOFOLLOW | (last ? O_NONBLOCK : O_DIRECTORY);
  const int fd = ::openat(folder, name.c_str(), flags);
  if (fd >= 0) return fd;
  if (errno == EMFILE || errno == ENFILE || errno == EIO || errno == EACCES) {
    return fail(ErrorCode::io, "{}: cannot be opened: {}", name, std::strerror(errno));
  }
  return fail(ErrorCode::not_found, "the job has no such file");
}

constexpr std::string_view kPrefix = ".bundle-", kEnding = ".tar.gz";

void send_packed(const std::filesystem::path& packed, const Send& send) {
  const auto file = open_below(packed.parent_path(), packed.filename().string());
  ::unlink(packed.c_str());
  if (!file) return send(error_response(file.error()));
  send({.body = *file, .type = media_type(kEnding)});
}

}  // namespace

Result<std::vector<FolderFile>> list_files(const fs::path& folder) {
  std::vector<FolderFile> files;
  std::error_code error;
  for (fs::recursive_directory_iterator next(folder, error), end; !error && next != end; next.increment(error)) {
    std::error_code gone;
    if (!fs::is_regular_file(next->symlink_status(gone))) continue;
    const auto bytes = next->file_size(gone);
    if (!gone) files.push_back({next->path().lexically_relative(folder).string(), bytes});
  }
  if (error) return fail(ErrorCode::io, "cannot list {}: {}", folder.string(), error.message());
  std::ranges::sort(files, {}, &FolderFile::path);
  return files;
}

Result<std::shared_ptr<OpenFile>> open_below(const fs::path& folder, std::string_view path) {
  int at = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (at < 0) return fail(ErrorCode::not_found, "the job's folder does not exist any more");
  for (bool last = false; !last;) {
    const auto slash = path.find('/');
    last = slash == std::string_view::npos;
    const std::string name(path.substr(0, slash));
    if (!last) path.remove_prefix(slash + 1);
    const auto next = name.empty() || name == "." || name == ".."
                          ? Result<int>(fail(ErrorCode::not_found, "the job has no such file"))
                          : open_component(at, name, last);
    ::close(at);
    if (!next) return pass_on(next);
    at = *next;
  }
  struct stat status {};
  if (::fstat(at, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(at);
    return fail(ErrorCode::not_found, "the job has no such file");
  }
  const auto& written = status.st_mtim;
  auto tag = fmt::format("\"{:x}-{:x}-{:x}.{:x}\"", status.st_ino, status.st_size, written.tv_sec, written.tv_nsec);
  return std::make_shared<OpenFile>(at, static_cast<std::uint64_t>(status.st_size), std::move(tag));
}

std::optional<FilePart> part_of_file(std::string_view range, std::uint64_t size) {
  const FilePart whole{0, size};
  constexpr std::string_view kUnit = "bytes=";
  if (!range.starts_with(kUnit)) return whole;
  range.remove_prefix(kUnit.size());
  const auto dash = range.find('-');
  if (dash == std::string_view::npos) return whole;
  const auto number = [](std::string_view text) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
  };
  const auto from = number(range.substr(0, dash)), to = number(range.substr(dash + 1));
  if (!from && dash > 0) return whole;
  if (!to && dash + 1 < range.size()) return whole;
  if (!from) {
    if (!to) return whole;
    return *to == 0 ? std::nullopt : std::optional(FilePart{size - std::min(*to, size), size});
  }
  if (to && *to < *from) return whole;
  if (*from >= size) return std::nullopt;
  return FilePart{*from, to && *to < size ? *to + 1 : size};
}

std::string_view media_type(std::string_view path) {
  const auto found = std::ranges::find_if(kTypes, [&](const auto& type) { return path.ends_with(type.first); });
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

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
