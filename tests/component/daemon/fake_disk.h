#pragma once

#include <functional>
#include <mutex>
#include <string>

namespace scanrig::fakes {

/// The disk of a test program that is linked with fake_disk.cpp: every fsync of the program passes here.
struct FakeDisk {
  /// Called with the path to be synced, from the requesting thread; may wait. Returns the number of
  /// the error with which the sync fails, or 0: then the real one is done. Empty: as 0.
  using Sync = std::function<int(const std::string& path)>;

  void at_sync(Sync what) {
    const std::lock_guard guard(mutex_);
    at_sync_ = std::move(what);
  }
  int sync(const std::string& path) {
    Sync what;
    {
      const std::lock_guard guard(mutex_);
      what = at_sync_;
    }
    return what ? what(path) : 0;
  }

 private:
  std::mutex mutex_;
  Sync at_sync_;
};

FakeDisk& disk();

}  // namespace scanrig::fakes
