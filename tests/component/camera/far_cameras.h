#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <string>
#include <vector>

namespace scanrig {

/// The program scanrig-gige-camera, as a child: commands to its input, replies from its output. It ends with its owner.
class FarCameras {
 public:
  FarCameras(const std::string& program, const std::vector<std::string>& arguments) {
    std::array<int, 2> to{}, from{};
    if (::pipe(to.data()) != 0 || ::pipe(from.data()) != 0) return;
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(to[0], STDIN_FILENO);
      ::dup2(from[1], STDOUT_FILENO);
      for (const int end : {to[0], to[1], from[0], from[1]}) ::close(end);
      std::vector<char*> words{const_cast<char*>(program.c_str())};
      for (const auto& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
      words.push_back(nullptr);
      ::execv(program.c_str(), words.data());
      ::_exit(127);
    }
    ::close(to[0]);
    ::close(from[1]);
    in_ = ::fdopen(to[1], "w");
    out_ = ::fdopen(from[0], "r");
  }
  FarCameras(const FarCameras&) = delete;
  FarCameras& operator=(const FarCameras&) = delete;
  ~FarCameras() {
    if (child_ > 0) freeze(false);
    if (in_) std::fclose(in_);
    if (child_ > 0) ::waitpid(child_, nullptr, 0);
    if (out_) std::fclose(out_);
  }

  /// Next line of its output; empty if it has ended.
  std::string hear() {
    std::array<char, 256> line{};
    if (!out_ || !std::fgets(line.data(), static_cast<int>(line.size()), out_)) return {};
    std::string text(line.data());
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
  }
  /// Stops the process, so that no camera replies; lets it run on.
  void freeze(bool frozen) {
    ::kill(child_, frozen ? SIGSTOP : SIGCONT);
    if (frozen) ::waitpid(child_, nullptr, WUNTRACED);
  }

  std::string tell(const std::string& words) {
    std::fprintf(in_, "%s\n", words.c_str());
    std::fflush(in_);
    return hear();
  }

 private:
  pid_t child_ = -1;
  std::FILE* in_ = nullptr;
  std::FILE* out_ = nullptr;
};

}  // namespace scanrig
