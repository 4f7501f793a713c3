#include "daemon/api/event_hub.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"

namespace scanrig {
namespace {

/// The revision changes with every event of the control loop, most of which no client can see.
std::string visible(const Snapshot& snapshot) {
  auto status = to_json(snapshot);
  status.erase("revision");
  return to_line(status);
}

}  // namespace

void EventHub::see(std::shared_ptr<const Snapshot> snapshot) {
  std::vector<std::function<void()>> wake;
  {
    const std::lock_guard guard(mutex_);
    const auto before = last_;
    if (auto now = visible(*snapshot); now != status_) {
      status_ = std::move(now);
      add("status", to_line(to_json(*snapshot)));
    }
    static const JobTable kNone;
    const auto& known = seen_ ? seen_->jobs : kNone;
    for (const auto& [id, job] : snapshot->jobs) {
      const auto old = known.find(id);
      // All jobs are old in the first snapshot: a client lists them.
      if (seen_ && (old == known.end() || old->second != job)) add("job", to_line(to_detailed_json(*job)));
    }
    for (const auto& [id, job] : known) {
      if (!snapshot->jobs.contains(id)) add("job_deleted", to_line({{"id", id}}));
    }
    seen_ = std::move(snapshot);
    if (last_ == before) return;
    for (const auto& [number, call] : subscribers_) wake.push_back(call);
  }
  for (const auto& call : wake) call();
}

void EventHub::add(std::string_view name, const std::string& data) {
  ++last_;
  events_.push_back(std::make_shared<const std::string>(text_of(last_, name, data)));
  if (events_.size() > kept_) events_.pop_front();
}

std::string EventHub::text_of(std::uint64_t number, std::string_view name, const std::string& data) const {
  return fmt::format("id: {}-{}\nevent: {}\ndata: {}\n\n", life_, number, name, data);
}

EventHub::Present EventHub::present() const {
  const std::lock_guard guard(mutex_);
  return {life_, last_, seen_};
}

EventHub::Text EventHub::beat(const std::string& time) const {
  const std::lock_guard guard(mutex_);
  return std::make_shared<const std::string>(
      fmt::format("event: beat\ndata: {}\n\n", to_line({{"time", time}, {"seq", last_}})));
}

EventHub::Batch EventHub::present_status(bool lost) const {
  Batch batch{.last = last_};
  const auto add_text = [&](std::string_view name, const std::string& data) {
    batch.texts.push_back(std::make_shared<const std::string>(text_of(last_, name, data)));
  };
  if (lost) add_text("lost", R"({"sentence":"Events lost: fetch the jobs again."})");
  if (seen_) add_text("status", to_line(to_json(*seen_)));
  return batch;
}

EventHub::Batch EventHub::since(std::uint64_t last) const {
  if (last > last_ || last_ - last > events_.size()) return present_status(true);
  const auto missed = static_cast<std::ptrdiff_t>(last_ - last);
  return {.last = last_, .texts = {events_.end() - missed, events_.end()}};
}

EventHub::Batch EventHub::join(std::string_view last_event_id) const {
  const std::lock_guard guard(mutex_);
  if (last_event_id.empty()) return present_status(false);
  const auto dash = last_event_id.rfind('-');
  std::uint64_t number = 0;
  if (dash == std::string_view::npos || last_event_id.substr(0, dash) != life_) return present_status(true);
  const auto* end = last_event_id.data() + last_event_id.size();
  const auto read = std::from_chars(last_event_id.data() + dash + 1, end, number);
  if (read.ec != std::errc() || read.ptr != end) return present_status(true);
  return since(number);
}

EventHub::Batch EventHub::after(std::uint64_t last) const {
  const std::lock_guard guard(mutex_);
  return since(last);
}

std::uint64_t EventHub::subscribe(std::function<void()> wake) {
  const std::lock_guard guard(mutex_);
  subscribers_.emplace(next_subscriber_, std::move(wake));
  return next_subscriber_++;
}

void EventHub::unsubscribe(std::uint64_t number) {
  const std::lock_guard guard(mutex_);
  subscribers_.erase(number);
}

std::size_t EventHub::subscribers() const {
  const std::lock_guard guard(mutex_);
  return subscribers_.size();
}

}  // namespace scanrig
