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

/// Placement of the object and angle of the table.
struct Place {
  int placement = 0;
  double angle_deg = 0.0;  ///< whole turns included
};

/// Equal up to whole turns and rounding.
struct LooksAlike {
  bool operator()(const Place& a, const Place& b) const { return key(a) < key(b); }
  static std::pair<int, long long> key(const Place& place);
};

/// Views of a scene, each rendered once, by an own thread: requested views first, then expected ones.
/// Threads: every function may be called from any thread. Only this class may call look() of the scene.
class ViewCache {
 public:
  /// `expected`: kept permanently, rendered in this order.
  ViewCache(Scene& scene, const std::vector<Place>& expected);
  ~ViewCache() { end(); }

  /// Ends all waiting; the current rendering is finished.
  void end();
  /// Waits until it is rendered; null when the cache has ended.
  std::shared_ptr<const View> get(const Place& place);
  /// Waits until all expected views are rendered; false when `stop` came first.
  bool wait_until_ready(const std::stop_token& stop);

 private:
  void run(const std::stop_token& stop);
  void keep_few();

  Scene& scene_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<Place, std::shared_ptr<const View>, LooksAlike> views_;
  std::deque<Place> requested_, expected_;  // not yet rendered
  std::deque<Place> unexpected_;            // rendered although not expected, oldest first
  bool ended_ = false;
  std::jthread thread_;
};

}  // namespace scanrig::sim
