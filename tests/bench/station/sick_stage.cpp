// Preloaded into a daemon or a reconstruction: a stage that goes wrong as the file $SICK_STAGE says.
//   segv    a segmentation fault
//   throw   an exception that nobody foresaw
//   eat     takes all the memory it is given, until there is no more
// A stage is whatever asks for a large piece of memory in the program scanrig or, in a daemon, in a nice thread.
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

namespace {

constexpr std::size_t kLarge = 64u << 10;
constexpr std::size_t kBite = 16u << 20;

struct Bite {
  Bite* before;
};

[[noreturn]] void eat() {
  Bite* last = nullptr;
  while (void* more = std::malloc(kBite)) {
    std::memset(more, 1, kBite);
    last = new (more) Bite{last};
  }
  while (last) {
    Bite* const before = last->before;
    std::free(last);
    last = before;
  }
  throw std::bad_alloc();
}

/// The daemon's main thread is not nice.
bool in_a_stage() {
  if (std::string_view(::program_invocation_short_name) == "scanrig") return true;
  return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())) >
         ::getpriority(PRIO_PROCESS, static_cast<id_t>(::getpid()));
}

void be_sick() {
  thread_local bool asking = false;  // to look into the file takes memory too
  const char* const file = std::getenv("SICK_STAGE");
  if (!file || asking || !in_a_stage()) return;
  asking = true;
  std::string how;
  std::ifstream(file) >> how;
  asking = false;
  if (how == "segv") std::raise(SIGSEGV);
  if (how == "throw") throw std::runtime_error("a stage that throws");
  if (how == "eat") eat();
}

}  // namespace

void* operator new(std::size_t size) {
  if (size >= kLarge) be_sick();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
