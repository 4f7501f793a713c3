#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "sim/scene/scene.h"

namespace scanrig::sim {

/// How the object lies and where the table stands.
struct Place {
  int placement = 0;
  double angle_deg = 0.0;  ///< turns counted
};

/// Whole turns and what rounding leaves of them are no difference.
struct LooksAlike {
  bool operator()(const Place& a, const Place& b) const { return key(a) < key(b); }
  static std::pair<int, long long> key(const Place& place);
};

/// Views of a scene, each rendered once, by a thread of its own: what somebody waits for, then what is expected.
/// Threads: every function may be called from any thread. Nobody else may call look() of the scene.
class ViewCache {
 public:
  /// `expected`: kept for good, rendered in this order.
  ViewCache(Scene& scene, const std::vector<Place>& expected);
  ~ViewCache() { end(); }

  /// Nobody waits any more; what is being rendered is finished.
  void end();
  /// Waits until it is rendered; null when the cache has ended.
  std::shared_ptr<const View> get(const Place& place);
  /// Waits until all that is expected is rendered; false when `stop` came first.
  bool wait_until_ready(const std::stop_token& stop);

 private:
  void run(const std::stop_token& stop);
  void keep_few();

  Scene& scene_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<Place, std::shared_ptr<const View>, LooksAlike> views_;
  std::deque<Place> wanted_, expected_;  // not yet rendered
  std::deque<Place> surprises_;          // rendered although not expected, oldest first
  bool ended_ = false;
  std::jthread thread_;
};

}  // namespace scanrig::sim
