#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <algorithm>
#include <filesystem>
#include "pipeline/closure/patch_shift.h"
#include "pipeline/closure/compare_views.h"
int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  for (auto& e : fs::directory_iterator(argv[1])) files.push_back(e.path().filename());
  std::sort(files.begin(), files.end());
  for (auto& f : files) {
    if (f.find("before") != std::string::npos) continue;
    auto p = f.find('_', 2);
    auto stem = f.substr(0, p);
    auto b = cv::imread(std::string(argv[1]) + "/" + stem + "_before.png"), a = cv::imread(std::string(argv[1]) + "/" + f);
    auto s = scanrig::patch_shifts(b, a);
    auto c = scanrig::compare_views(b, a);
    std::vector<double> d, m;
    for (auto& x : s) { d.push_back(x.shift_px); m.push_back(x.misfit_px); }
    std::sort(d.rbegin(), d.rend()); std::sort(m.rbegin(), m.rend());
    if (d.empty()) { fmt::print("{:32} none\n", f); continue; }
    auto at = [](auto& v, double q) { return v[std::min(v.size() - 1, (size_t)(q * v.size()))]; };
    fmt::print("{:32} n={:4} shift max {:.3f} 5th {:.3f} 2% {:.3f} 5% {:.3f} 10% {:.3f} 50% {:.3f} | misfit max {:.3f} 5th {:.3f} 2% {:.3f} 10% {:.3f} | old {:.3f} {:.3f} {}\n", f, d.size(), d[0], d[std::min<size_t>(4, d.size()-1)], at(d, .02), at(d, .05), at(d, .1), at(d,.5), m[0], m[std::min<size_t>(4, m.size()-1)], at(m, .02), at(m, .1), c->shift_px, c->changed, c->features);
  }
}
