#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/setup/dialogue.h"
#include "core/result.h"

namespace scanrig::config::setup {

/// Where setup from the page is.
enum class Phase {
  none,      ///< the service has its devices
  lending,   ///< claimed; the service closes its devices
  working,   ///< a program uses the devices
  found,     ///< a draft of rig.toml is to be looked at
  written,   ///< rig.toml is replaced; the doctor may examine the rig
  examined,  ///< the doctor has
  failed     ///< `problem` says why
};
std::string_view to_string(Phase phase);  ///< "none"

/// What a person at the page is shown.
struct SessionState {
  Phase phase = Phase::none;
  std::string who{};                   ///< who began it
  bool is_owner = false;               ///< the one who requested this may reply
  std::vector<std::string> told{};     ///< the newest lines
  std::optional<Question> question{};  ///< waits for a reply
  std::uint64_t number = 0;            ///< of the question; another one each time
  std::string draft{};                 ///< text of the rig.toml that was found
  std::string problem{};
};

struct SessionOptions {
  std::vector<std::string> setup;  ///< the program that asks and writes `draft`, and its arguments
  std::vector<std::string> doctor;
  std::filesystem::path file;   ///< rig.toml
  std::filesystem::path draft;  ///< beside it: relative paths mean the same
  /// Of a rig.toml, before it replaces the present one.
  std::function<Result<void>(const std::filesystem::path&)> check;
  std::chrono::milliseconds silence = std::chrono::minutes(5);  ///< without a sign of the owner's browser it is over
  std::chrono::milliseconds grace = std::chrono::seconds(2);    ///< for a program to let go of the devices
};

/// `scanrig setup` for a person at the page: runs the program while the service has lent it the devices, hands its
/// questions on and its replies back, replaces rig.toml when the person accepts. One browser has it: who holds the key
/// that claim() gives. Another one reads along, and may end it.
/// Threads: any; a thread of its own watches the program.
class Session {
 public:
  explicit Session(SessionOptions options);
  /// As end().
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Called by the session's thread when the owner's browser was silent for too long. Must not wait.
  void on_silence(std::function<void()> over);

  /// A key. Fails with `busy`, and with `io` where rig.toml could not be written.
  Result<std::string> claim(const std::string& who);
  /// The devices are free: the program starts. Fails with `refused` unless claimed.
  Result<void> begin();
  /// A line for question `number`. Fails with `refused` (another browser's, no such question now), `invalid_input`.
  Result<void> reply(const std::string& key, std::uint64_t number, const std::string& text);
  /// rig.toml becomes the draft, the old one is kept as rig.toml.old. Fails with `refused`, `io`, `invalid_input`.
  Result<void> accept(const std::string& key);
  /// Starts the doctor. Fails with `refused`.
  Result<void> examine(const std::string& key);
  /// Starts setup again. Fails with `refused`.
  Result<void> repeat(const std::string& key);
  /// Whether it was more than a claim. Returns once no program has a device any more.
  bool end();

  /// A request with the owner's key is a sign of its browser.
  [[nodiscard]] SessionState state(const std::string& key);
  /// An image of the present question. Fails with `not_found`, `io`.
  [[nodiscard]] Result<std::string> image(std::size_t option) const;
  [[nodiscard]] std::filesystem::path kept() const;  ///< rig.toml.old

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace scanrig::config::setup
