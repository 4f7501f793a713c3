#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace scanrig {

/// Wall seconds and the process's peak memory after each stage; a stage that runs several times is summed.
class StageLog {
 public:
  /// Times one stage until it goes out of scope.
  class Timer {
   public:
    Timer(StageLog& log, std::string stage);
    ~Timer();
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   private:
    StageLog& log_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_;
  };

  [[nodiscard]] nlohmann::json to_json() const;

 private:
  struct Entry {
    std::string stage;
    double seconds = 0.0;
    double peak_memory_mib = 0.0;
    int runs = 0;
  };
  void add(const std::string& stage, double seconds);
  std::vector<Entry> entries_;
};

}  // namespace scanrig
