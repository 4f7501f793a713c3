#include "daemon/journal/journal.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace scanrig {

/// Outlives the Journal where a sink stalls. It waits on the real clock: the log takes no part in the rig's time.
struct Journal::Shared {
  Shared(Sink to, std::size_t most) : sink(std::move(to)), max_waiting(most) {}

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return ending || !waiting.empty() || dropped > 0; });
      if (waiting.empty() && dropped == 0) break;
      const auto lines = std::exchange(waiting, {});
      const auto lost = std::exchange(dropped, 0);
      lock.unlock();
      for (const auto& line : lines) sink(line);
      if (lost > 0) sink({Priority::warning, fmt::format("{} lines of the log were dropped: it was stalled.", lost)});
      lock.lock();
    }
    ended = true;
    changed.notify_all();
  }

  const Sink sink;
  const std::size_t max_waiting;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<JournalEntry> waiting;
  std::size_t dropped = 0;
  bool ending = false, ended = false;
};

Journal::Journal(Sink sink, std::size_t max_waiting) : shared_(std::make_shared<Shared>(std::move(sink), max_waiting)) {
  std::thread([shared = shared_] { shared->run(); }).detach();
}

Journal::~Journal() {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->changed.notify_all();
  shared_->changed.wait_for(lock, kLastWords, [this] { return shared_->ended; });
}

/// Text from files and devices may hold any bytes; a line of the log stays one line.
void Journal::write(JournalEntry entry) {
  for (auto* text : {&entry.message, &entry.job, &entry.device}) {
    std::ranges::replace_if(
        *text, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  }
  {
    const std::lock_guard guard(shared_->mutex);
    if (shared_->waiting.size() >= shared_->max_waiting) {
      ++shared_->dropped;
      return;
    }
    shared_->waiting.push_back(std::move(entry));
  }
  shared_->changed.notify_all();
}

}  // namespace scanrig
