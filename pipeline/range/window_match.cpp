#include "pipeline/range/window_match.h"

#include <atomic>

#include "pipeline/range/window.h"

namespace scanrig {
namespace {

template <int R>
SCANRIG_LANES DisparityPatch match_inline(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u,
                                          int v, DisparityPatch patch, const WindowOptions& options) {
  patch.valid = false;
  if (!Window<R>::fits(here, u, v)) return patch;
  Window<R> window(here, mask, u, v, patch, options);
  return window.usable(options) ? window.match(there, patch, options) : patch;
}

using Match = DisparityPatch(const MatchImage&, const MatchImage&, const MatchMask&, int, int, DisparityPatch,
                             const WindowOptions&);

template <int R>
DisparityPatch match_baseline(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                              DisparityPatch patch, const WindowOptions& options) {
  return match_inline<R>(here, there, mask, u, v, patch, options);
}

#ifdef __x86_64__
template <int R>
[[gnu::target("avx2")]] DisparityPatch match_avx2(const MatchImage& here, const MatchImage& there,
                                                  const MatchMask& mask, int u, int v, DisparityPatch patch,
                                                  const WindowOptions& options) {
  return match_inline<R>(here, there, mask, u, v, patch, options);
}
#endif

/// By radius: 5, 7, 10, 15.
struct Matchers {
  Match *of5, *of7, *of10, *of15;
};

Matchers matchers(Instructions instructions) {
#ifdef __x86_64__
  if (instructions == Instructions::avx2) return {match_avx2<5>, match_avx2<7>, match_avx2<10>, match_avx2<15>};
#endif
  static_cast<void>(instructions);
  return {match_baseline<5>, match_baseline<7>, match_baseline<10>, match_baseline<15>};
}

std::atomic<Instructions>& used_instructions() {
  static std::atomic<Instructions> used = available_instructions().back();
  return used;
}

template <int R>
WindowResidual residual_with(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                             const DisparityPatch& patch, const WindowOptions& options) {
  if (!Window<R>::fits(here, u, v)) return {};
  const Window<R> window(here, mask, u, v, patch, options);
  return window.usable(options) ? window.residual(there, patch) : WindowResidual{};
}

}  // namespace

MatchImage::MatchImage(const cv::Mat1f& image) : value(image), cubic(image), slope(image.size()) {
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) slope(y, x) = cubic.row(y)[std::ptrdiff_t{4} * x + 1];
  }
}

std::vector<Instructions> available_instructions() {
  std::vector<Instructions> available = {Instructions::baseline};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2") != 0) available.push_back(Instructions::avx2);
#endif
  return available;
}

void use_instructions(Instructions instructions) { used_instructions() = instructions; }

DisparityPatch match_window(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                            const DisparityPatch& patch, const WindowOptions& options) {
  const Matchers use = matchers(used_instructions().load(std::memory_order_relaxed));
  Match* const match = patch.radius == 5    ? use.of5
                       : patch.radius == 7  ? use.of7
                       : patch.radius == 10 ? use.of10
                                            : use.of15;
  return match(here, there, mask, u, v, patch, options);
}

WindowResidual window_residual(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                               const DisparityPatch& patch, const WindowOptions& options) {
  switch (patch.radius) {
    case 5: return residual_with<5>(here, there, mask, u, v, patch, options);
    case 7: return residual_with<7>(here, there, mask, u, v, patch, options);
    case 10: return residual_with<10>(here, there, mask, u, v, patch, options);
    default: return residual_with<15>(here, there, mask, u, v, patch, options);
  }
}

}  // namespace scanrig
