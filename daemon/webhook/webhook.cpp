#include "daemon/webhook/webhook.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/runtime/actor_thread.h"

namespace scanrig {
namespace {

constexpr int kTries = 3;
constexpr auto kLimit = std::chrono::seconds(5);
constexpr auto kPause = std::chrono::seconds(2);

bool is_bad(const JobInfo& job) {
  return job.state == JobState::failed || job.state == JobState::interrupted ||
         (job.state == JobState::done && job.passed == false);
}

std::string news_of(const JobInfo& job) {
  const nlohmann::ordered_json json = {{"event", "job"},
                                       {"job", job.id},
                                       {"part", job.part},
                                       {"state", to_string(job.state)},
                                       {"code", job.error ? to_string(job.error->code) : ""},
                                       {"message", job.error ? job.error->message : ""}};
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::vector<std::string> alerts(const Snapshot& before, const Snapshot& now) {
  std::vector<std::string> log_entries;
  for (const auto& [id, job] : now.jobs) {
    const auto was = before.jobs.find(id);
    const bool known = was != before.jobs.end() && (was->second == job || is_bad(*was->second));
    if (is_bad(*job) && !known) log_entries.push_back(news_of(*job));
  }
  if (now.machine == MachineState::error && before.machine != MachineState::error) {
    const nlohmann::ordered_json json = {
        {"event", "machine"}, {"state", to_string(now.machine)}, {"message", now.cause}};
    log_entries.push_back(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  return log_entries;
}

Webhook::Webhook(Clock& clock, HttpAddress address)
    : clock_(clock), address_(std::move(address)), inbox_(clock), thread_(start_actor(clock, [this] { run(); })) {}

Webhook::~Webhook() {
  {
    const std::lock_guard guard(mutex_);
    stop_.request_stop();
  }
  clock_.notify_all(stopped_);
  inbox_.close();
  thread_.join();
}

/// Problems from before the daemon's start are not reported.
void Webhook::look(std::shared_ptr<const Snapshot> now) {
  if (before_) {
    for (auto& message : alerts(*before_, *now)) inbox_.post(std::move(message));
  }
  before_ = std::move(now);
}

void Webhook::run() {
  while (const auto message = inbox_.take()) {
    for (int i = 0; i < kTries && !stop_.stop_requested(); ++i) {
      if (http_post(address_, *message, kLimit, stop_.get_token())) break;
      if (i + 1 < kTries) pause();
    }
  }
}

void Webhook::pause() {
  std::unique_lock lock(mutex_);
  clock_.wait_until(lock, stopped_, clock_.now() + kPause, [this] { return stop_.stop_requested(); });
}

}  // namespace scanrig
