#include "daemon/jobs/bundle.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>
#include <vector>

#include "core/files.h"
#include "daemon/jobs/child_process.h"
#include "daemon/jobs/job_files.h"

namespace scanrig {
namespace {

constexpr std::string_view kRemoved = "(removed)";
constexpr std::string_view kTokenCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// Replaces the text after each `prefix`, up to the first character that `end` finds.
template <class End>
std::string masked(std::string_view text, std::string_view prefix, const End& end) {
  std::string out;
  std::size_t at = 0;
  for (auto found = text.find(prefix); found != std::string_view::npos; found = text.find(prefix, at)) {
    const auto secret = found + prefix.size();
    out.append(text.substr(at, secret - at)).append(kRemoved);
    at = std::min(end(secret), text.size());
  }
  return out.append(text.substr(at));
}

namespace fs = std::filesystem;

constexpr const char* kTar = "/bin/tar";
constexpr auto kPackingLimit = std::chrono::minutes(30);
constexpr std::size_t kMaxCrashFiles = 20;
constexpr std::uintmax_t kMaxTextBytes = 1u << 20;
constexpr std::uintmax_t kHeaderBytes = 4096;  ///< per file, of tar; poorly compressed files grow by less

Result<void> sync(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  if (synced) return {};
  return fail(ErrorCode::io, "cannot write {}", file.string());
}

/// Removes a half packed bundle, whatever ended the packing.
class Remains {
 public:
  explicit Remains(fs::path path) : path_(std::move(path)) {}
  ~Remains() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Remains(const Remains&) = delete;
  Remains& operator=(const Remains&) = delete;

 private:
  fs::path path_;
};

/// Sorted, newest first.
std::vector<fs::path> crash_files(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, fs::path>> found;
  std::error_code error;
  for (fs::directory_iterator next(folder, error), end; !error && next != end; next.increment(error)) {
    std::error_code unreadable;
    const auto written = next->last_write_time(unreadable);
    const bool is_file = fs::is_regular_file(next->symlink_status(unreadable));
    if (is_file && !unreadable && next->path().extension() == ".txt") found.emplace_back(written, next->path());
  }
  std::ranges::sort(found, std::greater());
  if (found.size() > kMaxCrashFiles) found.resize(kMaxCrashFiles);
  std::vector<fs::path> files;
  for (auto& [written, path] : found) files.push_back(std::move(path));
  return files;
}

/// Unreadable files are left out: support then needs the rest even more.
std::map<std::string, std::string> texts_of(const BundleOptions& options) {
  std::map<std::string, std::string> texts;
  const auto add_file = [&](const std::string& name, const fs::path& file) {
    std::error_code error;
    if (fs::file_size(file, error) > kMaxTextBytes || error) return;
    if (const auto text = read_file(file)) texts[name] = without_secrets(*text);
  };
  for (const auto& [name, text] : options.rig_texts) texts["rig/" + name] = without_secrets(text);
  if (!options.calibration_file.empty()) add_file("rig/calibration.json", options.calibration_file);
  for (const auto& file : crash_files(options.crash_folder)) add_file("crash/" + file.filename().string(), file);
  return texts;
}

Result<void> check_space(const fs::path& job_folder, const std::map<std::string, std::string>& texts,
                         const fs::path& target, std::uintmax_t reserve) {
  const auto contents = measure_folder(job_folder);
  auto needed = contents.bytes + kHeaderBytes * (contents.files + texts.size() + 4);
  for (const auto& [name, text] : texts) needed += text.size();
  std::error_code error;
  const auto space = fs::space(target.parent_path(), error);
  if (error) {
    return fail(ErrorCode::io, "cannot read the free space of {}: {}", target.parent_path().string(), error.message());
  }
  if (space.available >= needed + reserve) return {};
  constexpr double kGib = 1u << 30;
  return fail(ErrorCode::io, "{:.2f} GiB needed, {:.2f} of {:.2f} kept free; delete or export jobs",
              static_cast<double>(needed) / kGib, static_cast<double>(reserve) / kGib,
              static_cast<double>(space.available) / kGib);
}

Result<void> write_texts(const std::map<std::string, std::string>& texts, const fs::path& folder) {
  for (const auto& [name, text] : texts) {
    const auto file = folder / name;
    if (auto made = create_directories_synced(file.parent_path()); !made) return made;
    const FileContent content{file.filename().string(), std::as_bytes(std::span(text))};
    if (auto written = write_files_synced(file.parent_path(), std::span(&content, 1)); !written) return written;
  }
  return {};
}

Result<void> pack(const fs::path& job_folder, const fs::path& beside, const fs::path& packed,
                  const std::stop_token& stop) {
  const auto job = job_folder.filename().string();
  ChildCommand command{.words = {kTar, "--create", "--gzip", "--file", packed.string(), "--directory",
                                 job_folder.parent_path().string(), job},
                       .limit = kPackingLimit};
  std::error_code ignored;
  if (fs::exists(beside / job, ignored)) {
    for (const auto& word : {std::string("--directory"), beside.string(), job}) command.words.push_back(word);
  }
  const auto ended = run_child(command, stop);
  if (!ended) return pass_on(ended);
  if (ended->code != 0) return fail(ErrorCode::io, "cannot write {}: {}", packed.string(), ended->last_words);
  return sync(packed);
}

}  // namespace

std::string without_secrets(std::string_view text) {
  const auto tokens =
      masked(text, "scanrig_", [&](std::size_t from) { return text.find_first_not_of(kTokenCharacters, from); });
  const std::string_view rest = tokens;
  return masked(rest, "://", [&](std::size_t from) { return rest.find_first_of(" \t\r\n\"'`<>,", from); });
}

Result<void> bundle(const fs::path& job_folder, const fs::path& target, const BundleOptions& options,
                    const Context& context) {
  std::error_code ignored;
  if (!target.is_absolute()) {
    return fail(ErrorCode::invalid_input, "bundle: \"{}\" is not an absolute path", target.string());
  }
  if (fs::exists(target, ignored)) return fail(ErrorCode::exists, "bundle: {} is already there", target.string());
  const auto texts = texts_of(options);
  if (auto fits = check_space(job_folder, texts, target, options.reserve_bytes); !fits) return pass_on(fits, "bundle");
  const fs::path prepared = target.string() + ".part", beside = target.string() + ".beside";
  const Remains remains(prepared), texts_remain(beside);
  if (auto written = write_texts(texts, beside / job_folder.filename()); !written) return pass_on(written, "bundle");
  if (auto packed = pack(job_folder, beside, prepared, context.stop); !packed) return pass_on(packed, "bundle");
  return replace_folder(prepared, target);
}

}  // namespace scanrig
