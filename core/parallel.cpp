#include "core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include "core/priority.h"

namespace scanrig {
namespace {

/// Worker threads that help a thread of lower priority take its priority.
class NoMoreUrgent : public tbb::task_scheduler_observer {
 public:
  explicit NoMoreUrgent(tbb::task_arena& arena) : task_scheduler_observer(arena), niceness_(niceness()) {
    observe(true);
  }
  NoMoreUrgent(const NoMoreUrgent&) = delete;
  NoMoreUrgent& operator=(const NoMoreUrgent&) = delete;
  ~NoMoreUrgent() override { observe(false); }
  void on_scheduler_entry(bool) override { lower_priority_to(niceness_); }

 private:
  const int niceness_;
};

}  // namespace

void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
      },
      tbb::simple_partitioner{});
}

void with_threads(int threads, const std::function<void()>& work) {
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  const NoMoreUrgent helpers(arena);
  arena.execute([&] { work(); });
}

}  // namespace scanrig
