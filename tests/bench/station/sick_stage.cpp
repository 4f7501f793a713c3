// Preloaded into a daemon or a reconstruction: a stage that fails as the file $SICK_STAGE states.
//   segv    a segmentation fault
//   throw   an unexpected exception
//   eat     allocates all memory, until there is no more
// A stage is any code that allocates a large piece of memory in the program scanrig or, in a daemon, in a nice thread.
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

constexpr std::size_t kLarge = 256u << 10;  ///< libraries take less when they are loaded
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
  thread_local bool asking = false;  // reading the file allocates memory too
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
