#include <unistd.h>

#include "drivers/projector/gpio_projector.h"
#include "sim/wire/gpio_socket.h"
#include "tests/component/projector/projector_compliance.h"

namespace scanrig {
namespace {

class GpioProjectorBench final : public ProjectorBench {
 public:
  GpioProjectorBench() {
    plug(true);
    lines_ = gpio::socket_lines(socket_, clock_);
    auto opened = GpioProjector::open({{"DOTS", false}, gpio::LineSpec{"PLAIN", false}, kPulse}, *lines_, clock_);
    EXPECT_TRUE(opened) << opened.error().message;
    projector_ = std::move(*opened);
  }

  Projector& projector() override { return *projector_; }
  Clock& clock() override { return clock_; }
  std::vector<Flash> seen() override {
    std::vector<Flash> seen;
    for (const auto& edge : far_end_->edges()) {
      if (edge.high) seen.push_back({edge.line == "DOTS" ? Light::pattern : Light::plain, edge.at});
    }
    return seen;
  }
  bool seen_lit() override { return far_end_->level("DOTS") || far_end_->level("PLAIN"); }
  void when_lit(std::function<void()> act) override {
    far_end_->on_edge([this, act = std::move(act)](const auto& edge) {
      if (edge.high && !onlooker_.joinable()) onlooker_ = std::jthread(act);
    });
  }
  Clock::Duration exposure() const override { return kPulse - std::chrono::milliseconds(1); }
  void plug(bool in) override {
    far_end_.reset();
    if (in) far_end_ = sim::wire::GpioSocket::start(socket_, {{"DOTS", false}, {"PLAIN", false}}, clock_).value();
  }

 private:
  static constexpr std::chrono::milliseconds kPulse{20};

  RealClock clock_;
  const std::string socket_ = testing::TempDir() + "light" + std::to_string(::getpid()) + "-" +
                              std::to_string(reinterpret_cast<std::uintptr_t>(this));
  std::unique_ptr<sim::wire::GpioSocket> far_end_;
  std::unique_ptr<gpio::Lines> lines_;
  std::unique_ptr<GpioProjector> projector_;
  std::jthread onlooker_;
};

std::unique_ptr<ProjectorBench> make_bench() { return std::make_unique<GpioProjectorBench>(); }

INSTANTIATE_TEST_SUITE_P(Gpio, ProjectorCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
