#include "config/setup/session.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "config/setup/asking_program.h"
#include "core/files.h"
#include "core/secrets.h"

namespace scanrig::config::setup {
namespace {

using SteadyClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kLookEvery{100};
constexpr std::size_t kLinesKept = 100;
constexpr std::size_t kKeyBytes = 16;

/// "scanrig: ..." of the program's standard error, without that.
std::string problem_in(const std::string& words) {
  constexpr std::string_view kProgram = "scanrig: ";
  if (words.empty()) return "setup: its program ended without a word; see the log";
  return words.starts_with(kProgram) ? words.substr(kProgram.size()) : words;
}

Error not_yours() {
  return {ErrorCode::refused, "setup: another browser replies; end it there, or with its button End here"};
}

}  // namespace

std::string_view to_string(Phase phase) {
  switch (phase) {
    case Phase::none: return "none";
    case Phase::lending: return "lending";
    case Phase::working: return "working";
    case Phase::found: return "found";
    case Phase::written: return "written";
    case Phase::examined: return "examined";
    case Phase::failed: break;
  }
  return "failed";
}

struct Session::Impl {
  explicit Impl(SessionOptions given) : options(std::move(given)) {}

  void run(const std::stop_token& stop);
  void run_program(const std::stop_token& stop, const std::vector<std::string>& words);
  void take(const std::string& line);
  void ended(const Result<AskingProgram>& program, bool is_doctor);
  bool is_silent();
  Result<void> start(const std::string& key, std::initializer_list<Phase> from, const std::vector<std::string>& words);

  const SessionOptions options;
  std::mutex ending;  ///< one end at a time; taken before `mutex`
  std::jthread thread;
  std::mutex mutex;
  std::condition_variable_any changed;
  // Guarded by `mutex`.
  std::function<void()> over = [] {};
  SessionState state;
  std::string key;
  std::vector<std::string> to_start;  ///< empty: nothing
  std::string reply;                  ///< lines for the program
  SteadyClock::time_point heard;
};

/// Watches the owner's browser, and runs a program when one is wanted. Where this thread ends, what it started dies.
void Session::Impl::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::vector<std::string> words;
    {
      std::unique_lock lock(mutex);
      changed.wait_for(lock, stop, kLookEvery, [&] { return !to_start.empty(); });
      words = std::exchange(to_start, {});
    }
    if (!words.empty()) run_program(stop, words);
    if (is_silent()) over();
  }
}

bool Session::Impl::is_silent() {
  const std::lock_guard lock(mutex);
  if (SteadyClock::now() - heard < options.silence) return false;
  heard = SteadyClock::time_point::max();  // once
  return true;
}

void Session::Impl::run_program(const std::stop_token& stop, const std::vector<std::string>& words) {
  const bool is_doctor = words == options.doctor;
  auto program = AskingProgram::start(words);
  if (program) {
    while (program->read([this](const auto& line) { take(line); })) {
      if (stop.stop_requested()) return program->end(options.grace);
      if (is_silent()) over();
      const std::lock_guard lock(mutex);
      if (!reply.empty()) program->write(std::exchange(reply, {}));
    }
  }
  ended(program, is_doctor);
}

void Session::Impl::take(const std::string& line) {
  auto message = read_line(line);
  const std::lock_guard lock(mutex);
  if (message && message->question) {
    state.question = std::move(message->question);
    ++state.number;
    return;
  }
  if (message) state.told.push_back(std::move(message->told));
  if (state.told.size() > kLinesKept) state.told.erase(state.told.begin());
}

void Session::Impl::ended(const Result<AskingProgram>& program, bool is_doctor) {
  const int code = program ? program->code() : -1;
  // With findings the doctor ends with `device`.
  const bool is_done =
      code == static_cast<int>(ExitCode::ok) || (is_doctor && code == static_cast<int>(ExitCode::device));
  const auto text = is_doctor ? Result<std::string>("") : read_file(options.draft);
  const std::lock_guard lock(mutex);
  state.question.reset();
  if (!is_done || !text) {
    state.phase = Phase::failed;
    state.problem = !program  ? program.error().message
                    : is_done ? text.error().message
                              : problem_in(program->last_words());
    return;
  }
  state.phase = is_doctor ? Phase::examined : Phase::found;
  if (!is_doctor) state.draft = *text;
}

Result<void> Session::Impl::start(const std::string& by, std::initializer_list<Phase> from,
                                  const std::vector<std::string>& words) {
  const std::lock_guard lock(mutex);
  if (by != key || key.empty()) return tl::unexpected(not_yours());
  if (std::ranges::find(from, state.phase) == from.end()) {
    const bool is_working = state.phase == Phase::working;
    return fail(ErrorCode::refused, "setup: not now; {}",
                is_working ? "wait until it has finished, or end it" : "reload the page for the next step");
  }
  state.phase = Phase::working;
  state.told.clear();
  state.problem.clear();
  to_start = words;
  changed.notify_all();
  return {};
}

Session::Session(SessionOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Session::~Session() { end(); }

void Session::on_silence(std::function<void()> over) {
  const std::lock_guard lock(impl_->mutex);
  impl_->over = std::move(over);
}

Result<std::string> Session::claim(const std::string& who) {
  const auto& folder = impl_->options.file.parent_path();
  if (::access(folder.c_str(), W_OK) != 0) {
    return fail(ErrorCode::io, "setup: the service may not write into {} ({}); run sudo scanrig setup at a terminal",
                folder.string(), std::strerror(errno));
  }
  const std::lock_guard one_end(impl_->ending);
  const std::lock_guard lock(impl_->mutex);
  auto& state = impl_->state;
  if (state.phase != Phase::none) {
    return fail(ErrorCode::busy, "setup: {} has begun it already; end that one first", state.who);
  }
  auto key = random_hexadecimal(kKeyBytes);
  if (!key) return key;
  impl_->key = *std::move(key);
  state = {.phase = Phase::lending, .who = who};
  impl_->heard = SteadyClock::now();
  impl_->thread = std::jthread([impl = impl_.get()](const std::stop_token& stop) { impl->run(stop); });
  return impl_->key;
}

Result<void> Session::begin() {
  std::string key;
  {
    const std::lock_guard lock(impl_->mutex);
    key = impl_->key;
  }
  return impl_->start(key, {Phase::lending}, impl_->options.setup);
}

Result<void> Session::reply(const std::string& key, std::uint64_t number, const std::string& text) {
  const std::lock_guard lock(impl_->mutex);
  auto& state = impl_->state;
  if (key != impl_->key || key.empty()) return tl::unexpected(not_yours());
  if (!state.question || state.number != number) {
    return fail(ErrorCode::refused, "setup: that question is no longer asked; look at the present one");
  }
  if (text.find('\n') != std::string::npos || !state.question->is_answered_by(text)) {
    return fail(ErrorCode::invalid_input, "setup: that is not a reply to: {}", state.question->printed());
  }
  state.question.reset();
  impl_->heard = SteadyClock::now();
  impl_->reply += text + "\n";
  return {};
}

Result<void> Session::accept(const std::string& key) {
  const std::lock_guard lock(impl_->mutex);
  auto& state = impl_->state;
  const auto& options = impl_->options;
  if (key != impl_->key || key.empty()) return tl::unexpected(not_yours());
  if (state.phase != Phase::found) return fail(ErrorCode::refused, "setup: there is no file to accept now");
  // What was shown is what is checked and written, whatever became of the draft.
  if (auto written = write_file_atomically(options.draft, state.draft); !written) return written;
  if (auto checked = options.check(options.draft); !checked) return checked;
  std::error_code error;
  const auto mode = std::filesystem::status(options.file, error).permissions();
  const bool has_old = !error;
  if (has_old) {
    const auto old = read_file(options.file);
    if (!old) return pass_on(old, "setup");
    if (auto written = write_file_atomically(kept(), *old); !written) return written;
  }
  if (auto written = write_file_atomically(options.file, state.draft); !written) return written;
  if (has_old) {  // both are readable for those who could read the old one
    for (const auto& file : {options.file, kept()}) std::filesystem::permissions(file, mode, error);
  }
  state.phase = Phase::written;
  return {};
}

Result<void> Session::examine(const std::string& key) {
  return impl_->start(key, {Phase::written, Phase::examined}, impl_->options.doctor);
}

Result<void> Session::repeat(const std::string& key) {
  return impl_->start(key, {Phase::found, Phase::failed}, impl_->options.setup);
}

bool Session::end() {
  const std::lock_guard one_end(impl_->ending);
  if (impl_->thread.joinable()) {
    impl_->thread.request_stop();
    impl_->thread.join();
  }
  const std::lock_guard lock(impl_->mutex);
  const bool was_active = impl_->state.phase > Phase::lending;
  if (impl_->state.phase != Phase::none) {
    std::error_code ignored;
    std::filesystem::remove(impl_->options.draft, ignored);
  }
  impl_->state = {};
  impl_->key.clear();
  impl_->to_start.clear();
  impl_->reply.clear();
  return was_active;
}

SessionState Session::state(const std::string& key) {
  const std::lock_guard lock(impl_->mutex);
  auto state = impl_->state;
  state.is_owner = !key.empty() && key == impl_->key;
  if (state.is_owner) impl_->heard = SteadyClock::now();
  return state;
}

Result<std::string> Session::image(std::size_t option) const {
  std::string file;
  {
    const std::lock_guard lock(impl_->mutex);
    const auto& question = impl_->state.question;
    if (question && option < question->images.size()) file = question->images[option];
  }
  if (file.empty()) return fail(ErrorCode::not_found, "setup: there is no image of that choice");
  return read_file(file);
}

std::filesystem::path Session::kept() const {
  auto file = impl_->options.file;
  file += ".old";
  return file;
}

}  // namespace scanrig::config::setup
