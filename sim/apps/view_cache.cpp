#include "sim/apps/view_cache.h"

#include <cmath>

#include "core/parallel.h"
#include "core/priority.h"
#include "core/units.h"

namespace scanrig::sim {

std::pair<int, long long> LooksAlike::key(const Place& place) {
  constexpr long long kTurn = 360'000'000'000;  // in units of 1e-9 deg
  return {place.placement, (std::llround(1e9 * place.angle_deg) % kTurn + kTurn) % kTurn};
}

ViewCache::ViewCache(Scene& scene, const std::vector<Place>& expected)
    : scene_(scene),
      expected_(expected.begin(), expected.end()),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void ViewCache::end() {
  {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
  }
  thread_.request_stop();
  changed_.notify_all();
}

std::shared_ptr<const View> ViewCache::get(const Place& place) {
  std::unique_lock lock(mutex_);
  if (!views_.contains(place)) requested_.push_back(place);
  changed_.notify_all();
  changed_.wait(lock, [&] { return ended_ || views_.contains(place); });
  return ended_ ? nullptr : views_.at(place);
}

bool ViewCache::wait_until_ready(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  return changed_.wait(lock, stop, [&] { return expected_.empty() && requested_.empty(); });
}

void ViewCache::run(const std::stop_token& stop) {
  lower_priority();  // a real rig does not compute its images
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !requested_.empty() || !expected_.empty(); })) {
    const bool surprise = !requested_.empty();
    auto& queue = surprise ? requested_ : expected_;
    const Place place = queue.front();
    if (!views_.contains(place)) {
      lock.unlock();
      std::shared_ptr<const View> view;
      const auto look = [&] { return scene_.look(place.placement, to_radians(place.angle_deg)); };
      with_threads(0, [&] { view = std::make_shared<const View>(look()); });
      lock.lock();
      views_[place] = std::move(view);
      if (surprise) unexpected_.push_back(place);
      keep_few();
    }
    queue.pop_front();
    changed_.notify_all();
  }
}

/// Call with `mutex_` held: a view in full size has 20 MB.
void ViewCache::keep_few() {
  constexpr std::size_t kFew = 8;
  for (; unexpected_.size() > kFew; unexpected_.pop_front()) views_.erase(unexpected_.front());
}

}  // namespace scanrig::sim
